//! Seconds per image of the simulator's fast methods, its harmonic sum, the wake model, and a text-to-image model.

use crate::exit::Outcome;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use std::time::Instant;
use wake_ldm::WakeSampler;
use wake_physics::hull::Hull;
use wake_physics::kelvin::KelvinWake;
use wake_physics::scene::{SpectrumModel, SpreadingModel};
use wake_physics::surface::Surface;
use wake_physics::waves::{Quantity, Transfer, harmonic_sum};
use wake_physics::wind_sea::{DirectionalSpectrum, WindSea};
use wake_physics::{Raster, Scene, Track, simulate};
use wake_train::evaluation::{HeldOut, ImageSource, TextToImage, Told};

/// Pixels along a side.
const SIZES: [usize; 3] = [128, 256, 512];
/// Number of waves of sea and of wake: chosen; the paper does not state its own.
const WAVES: usize = 10_000;
/// Pixels of the harmonic sum, whose time is scaled to the image.
const SAMPLE: usize = 512;
/// Largest size at which a text-to-image model is timed, relative to its own image size.
const LARGER: usize = 4;
/// Timed runs, of which the median is reported.
const RUNS: usize = 3;
/// Fields of the surface that an image needs.
const QUANTITIES: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

/// Seconds per image at one size.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct TimingRow {
    /// Pixels along a side.
    pub(crate) size: usize,
    pub(crate) simulator_fast: f64,
    /// Harmonic sums of 10⁴ waves of the sea and 10⁴ of the wake only, without backscatter and imaging; scaled up from
    /// a sample of pixels.
    pub(crate) simulator_harmonic_sum: f64,
    /// The wake model; `None` if it does not support this size.
    pub(crate) model: Option<f64>,
    /// The text-to-image model; `None` without one, or if it does not support this size.
    pub(crate) text_to_image: Option<f64>,
}

/// Times all methods.
pub(crate) fn timings(
    model: Option<&WakeSampler>,
    text_to_image: Option<&TextToImage<'_>>,
) -> Outcome<Vec<TimingRow>> {
    SIZES
        .into_iter()
        .map(|size| {
            let mut scene = HeldOut::default().scene(0);
            (scene.grid.rows, scene.grid.columns) = (size, size);
            let fast = median(|| {
                simulate(&scene)?;
                Ok(())
            })?;
            let drawn = |source: Option<&dyn ImageSource>| {
                let draw = |source: &dyn ImageSource| {
                    median(|| {
                        source.draw(std::slice::from_ref(&scene), Told::Both)?;
                        Ok(())
                    })
                };
                source.map(draw).transpose()
            };
            let model = model.filter(|model| model.check_scene(&scene).is_ok());
            // Attention over far more pixels than a model was made for takes minutes.
            let text_to_image =
                text_to_image.filter(|model| size <= LARGER * model.pipeline.image_size()[0]);
            Ok(TimingRow {
                size,
                simulator_fast: fast,
                simulator_harmonic_sum: harmonic_seconds(&scene),
                model: drawn(model.map(|model| model as _))?,
                text_to_image: drawn(text_to_image.map(|model| model as _))?,
            })
        })
        .collect()
}

/// Median seconds of some runs after a warm-up run.
fn median(mut run: impl FnMut() -> Outcome<()>) -> Outcome<f64> {
    run()?;
    let mut seconds = Vec::new();
    for _ in 0..RUNS {
        let start = Instant::now();
        run()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[RUNS / 2])
}

/// Seconds of the harmonic sums of sea and wake over all pixels.
fn harmonic_seconds(scene: &Scene) -> f64 {
    let size = scene.grid.rows;
    let raster = Raster::image(size, size, scene.grid.spacing);
    let transfer = Transfer {
        depth: scene.sea.depth,
        incidence: scene.radar.incidence.to_radians(),
        relaxation_rate: 1.0,
        action_slope: 4.5,
    };
    let spectrum = DirectionalSpectrum::new(&WindSea {
        wind_speed: scene.sea.wind_speed,
        wind_toward: scene.sea.wind_toward.to_radians(),
        fetch: scene.sea.fetch,
        depth: scene.sea.depth,
        spectrum: SpectrumModel::Elfouhaily,
        spreading: SpreadingModel::Hasselmann,
    });
    let sea = Surface::new(&spectrum, scene.seed, 0.0, &raster)
        .strongest(WAVES)
        .modes();
    // Every held-out scene has a ship.
    let ship = scene.ships.first().cloned().unwrap_or_default();
    let wake = KelvinWake {
        hull: Hull::wigley(ship.length, ship.beam, ship.draft),
        speed: ship.speed,
        track: Track::new(ship.position, ship.heading, 0.0),
        depth: scene.sea.depth,
        filter_depth: 0.0,
        steepness: None,
    };
    let wake = wake.waves(&wake.plan(&raster, 1e-6)).strongest(WAVES);
    let mut random = StdRng::seed_from_u64(1);
    let pixels: Vec<[usize; 2]> = (0..SAMPLE)
        .map(|_| [random.random_range(0..size), random.random_range(0..size)])
        .collect();
    let mut seconds = 0.0;
    for waves in [&sea, &wake] {
        let start = Instant::now();
        std::hint::black_box(harmonic_sum(
            waves,
            &transfer,
            &QUANTITIES,
            &raster,
            &pixels,
        ));
        // A wake with fewer than 10⁴ nodes is scaled to 10⁴.
        let waves = WAVES as f64 / waves.len().max(1) as f64;
        seconds += start.elapsed().as_secs_f64() * waves;
    }
    seconds * (size * size) as f64 / SAMPLE as f64
}
