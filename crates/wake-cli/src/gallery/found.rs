//! Panel of detections among several ships and look-alikes.

use wake_detector::{Detector, GreyImage};
use wake_nn::device_named;
use wake_physics::{Scene, simulate};

use super::panel::{FOUND, SIDE, marked, set_in};
use crate::exit::Outcome;
use crate::sheet::Picture;

/// Scene of three ships under way, one at rest, and slicks.
const SCENE: &str = "assets/scenes/four_ships.toml";
/// Pixels of the scene's image per pixel of the panel, along each side.
const REDUCED: usize = 2;
/// Distance of a probability from the tip \[pixels of the image\].
const AHEAD: f32 = 48.0;

/// The image with the axes and probabilities of sure detections, and a small copy without them.
pub(crate) fn panel() -> Outcome<Picture> {
    let scene = Scene::read(SCENE.as_ref())?;
    let simulation = simulate(&scene)?;
    let side = SIDE * REDUCED;
    let levels = simulation.levels(&simulation.quick_look());
    let image = GreyImage::eight_bits(side, side, levels.clone())?;
    let spacing = scene.grid.spacing;
    let detector = Detector::pretrained(&device_named("flex")?)?.with_spacing(spacing as f32)?;
    let mut picture = marked(&means(&levels, side), spacing * REDUCED as f64);
    for one in detector.find(&image).iter().filter(|one| one.sure) {
        let place = |along: f32| one.wake.at(along).map(|v| f64::from(v) / REDUCED as f64);
        picture.draw_line([place(0.0), place(one.wake.length)], FOUND);
        if let Some(probability) = one.probability {
            // Ahead of the ship, within the picture.
            let [x, y] = place(-AHEAD);
            let [left, top] = [x - 16.0, y - 8.0];
            let within = |v: f64, room: usize| v.clamp(0.0, (SIDE - room) as f64) as usize;
            let text = format!("{probability:.2}");
            picture.write_text(&text, within(top, 16), within(left, 32));
        }
    }
    set_in(&mut picture, &Picture::reduced(&levels, side, SIDE / 3));
    Ok(picture)
}

/// Means of the levels over squares.
fn means(levels: &[u8], side: usize) -> Vec<u8> {
    let square = |n: usize| {
        let first = n / SIDE * REDUCED * side + n % SIDE * REDUCED;
        let lines = (0..REDUCED).flat_map(|line| &levels[first + line * side..][..REDUCED]);
        let sum: usize = lines.map(|&level| usize::from(level)).sum();
        (sum / (REDUCED * REDUCED)) as u8
    };
    (0..SIDE * SIDE).map(square).collect()
}
