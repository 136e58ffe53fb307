//! Film of twenty seconds of a wake: the water beside its radar image.

use super::levels::signed;
use crate::exit::Outcome;
use crate::sheet::Picture;
use gif::{Encoder, EncodingError, Frame, Repeat};
use wake_physics::{Field, Result, Scene, Simulator};

/// Number of frames, half a second apart.
const FRAMES: u32 = 40;
/// Time between frames \[s\].
const STEP: f64 = 0.5;
/// Rows and columns of each half \[pixels\].
const SIDE: usize = 176;
/// Grey levels that share one level of the film: fewer levels make a smaller file.
const LEVELS: u8 = 8;

/// The film as a GIF.
pub(crate) fn film() -> Outcome<Vec<u8>> {
    let mut simulator = Simulator::default();
    let frames: Result<Vec<Picture>> = (0..FRAMES)
        .map(|n| frame(&mut simulator, f64::from(n) * STEP))
        .collect();
    Ok(encoded(&frames?)?)
}

/// Water and image at a time \[s\].
fn frame(simulator: &mut Simulator, time: f64) -> Result<Picture> {
    let simulation = simulator.simulate(&scene(time)?)?;
    let water = Picture::from_levels(&signed(&simulation.elevation), SIDE);
    let image = Picture::from_levels(&contrast(&simulation.intensity), SIDE);
    simulator.reclaim(simulation);
    Ok(Picture::sheet(
        &[
            water.captioned(&format!("Water, {time:.0} s")),
            image.captioned("Radar, no speckle"),
        ],
        2,
    ))
}

fn scene(time: f64) -> Result<Scene> {
    Scene::default().with_assignments(&[
        &format!("grid.rows={SIDE}"),
        &format!("grid.columns={SIDE}"),
        "grid.spacing=3.5",
        "sea.wind_speed=4",
        "sea.wind_toward=130",
        "ship.length=100",
        "ship.beam=15",
        "ship.draft=6",
        "ship.speed=8",
        "ship.heading=60",
        "ship.position=[20, 20]",
        "model.terms=all",
        &format!("sea.time={time}"),
    ])
}

/// Levels on a scale shared by all frames of a sea: black is zero, white is two and a half times the mean.
fn contrast(field: &Field) -> Vec<u8> {
    let scale = 255.0 / (2.5 * field.mean().max(1e-12));
    let level = |&value: &f32| (f64::from(value) * scale).clamp(0.0, 255.0) as u8;
    field.values.iter().map(level).collect()
}

/// Encodes grey pictures as an endless GIF.
fn encoded(pictures: &[Picture]) -> std::result::Result<Vec<u8>, EncodingError> {
    let [rows, columns] = pictures[0].size();
    let palette: Vec<u8> = (0..=u8::MAX / LEVELS)
        .flat_map(|grey| [grey * LEVELS + LEVELS / 2; 3])
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, columns as u16, rows as u16, &palette)?;
    encoder.set_repeat(Repeat::Infinite)?;
    for picture in pictures {
        let pixels = (0..rows).flat_map(|i| (0..columns).map(move |j| picture.at(i, j)));
        let indices: Vec<u8> = pixels.map(|colour| colour[0] / LEVELS).collect();
        let mut frame = Frame::from_indexed_pixels(columns as u16, rows as u16, indices, None);
        // In hundredths of a second.
        frame.delay = (100.0 * STEP) as u16;
        encoder.write_frame(&frame)?;
    }
    drop(encoder);
    Ok(bytes)
}
