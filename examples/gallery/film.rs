//! Twenty seconds of a wake: the water beside its radar image.

use crate::stages::signed;
use gif::{Encoder, Frame, Repeat};
use std::error::Error;
use wake_physics::picture::Picture;
use wake_physics::{Field, Scene, Simulator};

/// Frames, half a second of the sea each.
const FRAMES: u32 = 40;
/// Between frames \[s\].
const STEP: f64 = 0.5;
/// Sides of each half \[pixels\].
const SIDE: usize = 176;
/// Greys of the film: fewer make it smaller.
const GREYS: u8 = 32;

/// The film as a GIF.
pub(crate) fn film() -> Result<Vec<u8>, Box<dyn Error>> {
    let mut simulator = Simulator::default();
    let mut bytes = Vec::new();
    let mut encoder: Option<Encoder<&mut Vec<u8>>> = None;
    let mut target = Some(&mut bytes);
    for n in 0..FRAMES {
        let time = f64::from(n) * STEP;
        let simulation = simulator.simulate(&scene(time)?)?;
        let picture = Picture::sheet(
            &[
                Picture::from_levels(&signed(&simulation.elevation), SIDE)
                    .captioned(&format!("Water, {time:.0} s")),
                Picture::from_levels(&contrast(&simulation.intensity), SIDE)
                    .captioned("Radar, no speckle"),
            ],
            2,
        );
        let [rows, columns] = picture.size();
        let pixels = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        let indices: Vec<u8> = pixels
            .map(|(i, j)| picture.at(i, j)[0] / (256 / u16::from(GREYS)) as u8)
            .collect();
        let (width, height) = (columns as u16, rows as u16);
        if let Some(target) = target.take() {
            let palette: Vec<u8> = (0..GREYS)
                .flat_map(|g| [(255 * u16::from(g) / u16::from(GREYS - 1)) as u8; 3])
                .collect();
            let mut begun = Encoder::new(target, width, height, &palette)?;
            begun.set_repeat(Repeat::Infinite)?;
            encoder = Some(begun);
        }
        let mut frame = Frame::from_indexed_pixels(width, height, indices, None);
        // In hundredths of a second.
        frame.delay = (100.0 * STEP) as u16;
        encoder
            .as_mut()
            .expect("begun with the first frame")
            .write_frame(&frame)?;
        simulator.reclaim(simulation);
    }
    drop(encoder);
    Ok(bytes)
}

fn scene(time: f64) -> wake_physics::Result<Scene> {
    Scene::default().with_assignments(&[
        format!("grid.rows={SIDE}"),
        format!("grid.columns={SIDE}"),
        "grid.spacing=3.5".to_owned(),
        "sea.wind_speed=4".to_owned(),
        "sea.wind_toward=130".to_owned(),
        "ship.length=100".to_owned(),
        "ship.beam=15".to_owned(),
        "ship.draft=6".to_owned(),
        "ship.speed=8".to_owned(),
        "ship.heading=60".to_owned(),
        "ship.position=[20, 20]".to_owned(),
        "model.terms=all".to_owned(),
        format!("sea.time={time}"),
    ])
}

/// Levels about the mean, the same for every frame of a sea: black is nothing, white two and a half times the mean.
fn contrast(field: &Field) -> Vec<u8> {
    let scale = 255.0 / (2.5 * field.mean().max(1e-12));
    let level = |&value: &f32| (f64::from(value) * scale).clamp(0.0, 255.0) as u8;
    field.values.iter().map(level).collect()
}
