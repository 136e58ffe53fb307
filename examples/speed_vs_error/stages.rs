//! The stages: each with its fast method, its oracle and what their difference is measured against.

use crate::row::{Errors, Row, median_seconds, seconds};
use crate::satellite;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use wake_physics::hull::Hull;
use wake_physics::kelvin::KelvinWake;
use wake_physics::sar::direct::DirectImage;
use wake_physics::sar::{AzimuthResolution, Imaging, Sources};
use wake_physics::scattering::{
    Backscatter, BackscatterTable, FacetFields, SlopeCovariance, Specular, TwoScale,
};
use wake_physics::spectrum::elfouhaily::Elfouhaily;
use wake_physics::surface::Surface;
use wake_physics::waves::{PlaneWaves, Quantity, Transfer, harmonic_sum, matrix_product};
use wake_physics::wind_sea::{DirectionalSpectrum, WindSea};
use wake_physics::{
    DirectPixels, Field, Raster, Scene, Track, direct_intensity, nufft, permittivity, simulate,
};

/// Stages in the order of the data flow.
pub(crate) const STAGES: [&str; 9] = [
    "sea",
    "swell",
    "kelvin",
    "edge",
    "unresolved",
    "backscatter",
    "bunching",
    "response",
    "scene",
];

/// Whether the method of a stage has a tolerance; the others are measured once a size.
pub(crate) fn has_tolerance(stage: &str) -> bool {
    !["edge", "response"].contains(&stage)
}

/// Waves of sea and wake: the paper's scale.
const WAVES: usize = 10_000;
/// Pixels of the oracle where the whole raster takes too long.
const SAMPLE: usize = 4_096;
/// Pixels of the quadrature of σ⁰, which takes a millisecond each.
pub(crate) const QUADRATURES: usize = 1_024;
/// Largest raster, as pixels along a side, on which the oracles run whole.
const WHOLE: usize = 128;
/// Runs of a fast method, and of a short matrix product.
pub(crate) const RUNS: usize = 5;
/// Rows of a matrix product on a large raster, scaled up.
const PRODUCT_ROWS: usize = 48;
/// Incidence of the default scene [rad].
const INCIDENCE: f64 = 32.0 * std::f64::consts::PI / 180.0;

/// The six fields of surface and velocity.
pub(crate) const QUANTITIES: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

pub(crate) const TRANSFER: Transfer = Transfer {
    depth: f64::INFINITY,
    incidence: INCIDENCE,
    relaxation_rate: 1.7,
    steepness: 4.5,
};

/// Measures one stage.
pub(crate) fn measure(
    stage: &'static str,
    size: usize,
    tolerance: f64,
    memo: &mut Memo,
) -> wake_physics::Result<Row> {
    let raster = Raster::image(size, size, 2.5);
    Ok(match stage {
        "sea" => sea(&raster, tolerance),
        "kelvin" => kelvin(&raster, tolerance),
        "backscatter" => backscatter(&raster, tolerance, memo),
        "bunching" => bunching(&raster, tolerance),
        "swell" => satellite::swell(&raster, tolerance),
        "edge" => satellite::edge(size),
        "unresolved" => satellite::unresolved(&raster, tolerance, memo),
        "response" => satellite::response(size),
        _ => return scene(size, tolerance, memo),
    })
}

fn spectrum() -> DirectionalSpectrum {
    let sea = Scene::default().sea;
    DirectionalSpectrum::new(&WindSea {
        wind_speed: sea.wind_speed,
        wind_toward: sea.wind_toward.to_radians(),
        fetch: sea.fetch,
        depth: sea.depth,
        spectrum: sea.spectrum,
        spreading: sea.spreading,
    })
}

pub(crate) fn wake() -> KelvinWake {
    KelvinWake {
        hull: Hull::wigley(195.0, 26.0, 10.0),
        speed: 10.0,
        track: Track::new([0.0, 0.0], 45.0, 0.0),
        depth: f64::INFINITY,
        filter_depth: 0.0,
    }
}

/// FFT of the sea with its strongest waves.
fn sea(raster: &Raster, tolerance: f64) -> Row {
    let surface = Surface::new(&spectrum(), 7, 0.0, raster).strongest(WAVES);
    let fast = || surface.fields(&TRANSFER, &QUANTITIES, tolerance);
    sum("sea", raster, tolerance, &surface.modes(), fast)
}

/// Non-uniform FFT of the wake, nodes and their amplitudes included.
fn kelvin(raster: &Raster, tolerance: f64) -> Row {
    let wake = wake();
    let waves = wake.waves(&wake.plan(raster, tolerance)).strongest(WAVES);
    let fast = || {
        let waves = wake.waves(&wake.plan(raster, tolerance)).strongest(WAVES);
        nufft::synthesize(&waves, &TRANSFER, &QUANTITIES, raster, tolerance)
    };
    sum("kelvin", raster, tolerance, &waves, fast)
}

/// A sum of plane waves against the harmonic sum and the matrix product.
pub(crate) fn sum(
    stage: &'static str,
    raster: &Raster,
    tolerance: f64,
    waves: &PlaneWaves,
    fast: impl Fn() -> Vec<Field>,
) -> Row {
    let (fast_seconds, fields) = median_seconds(RUNS, fast);
    let (pixels, scale) = pixels(raster);
    let (oracle, exact) = seconds(|| harmonic_sum(waves, &TRANSFER, &QUANTITIES, raster, &pixels));
    let errors = fields
        .iter()
        .zip(&exact)
        .fold(Errors::default(), |worst, (field, exact)| {
            let values = pixels.iter().map(|&[i, j]| f64::from(field.at(i, j)));
            worst.worst(Errors::of(values, exact, field.rms()))
        });
    let (matrix_product_seconds, _) = product(raster, waves);
    Row {
        matrix_product_seconds: Some(matrix_product_seconds),
        ..row(
            stage,
            raster,
            Some(tolerance),
            fast_seconds,
            (oracle * scale, pixels.len()),
            errors,
        )
    }
}

/// Seconds of the matrix product, on some rows of a large raster, and its fields.
fn product(raster: &Raster, waves: &PlaneWaves) -> (f64, Vec<Field>) {
    let whole = raster.rows <= WHOLE;
    let rows = if whole { raster.rows } else { PRODUCT_ROWS };
    let part = Raster { rows, ..*raster };
    let (seconds, fields) =
        median_seconds(1, || matrix_product(waves, &TRANSFER, &QUANTITIES, &part));
    (seconds * raster.rows as f64 / rows as f64, fields)
}

/// The pixels of the oracle, and how many times more there are.
fn pixels(raster: &Raster) -> (Vec<[usize; 2]>, f64) {
    if raster.rows <= WHOLE {
        let all = (0..raster.len()).map(|n| [n / raster.columns, n % raster.columns]);
        return (all.collect(), 1.0);
    }
    (sample(raster, SAMPLE), raster.len() as f64 / SAMPLE as f64)
}

/// Random pixels of a raster.
pub(crate) fn sample(raster: &Raster, count: usize) -> Vec<[usize; 2]> {
    let mut random = StdRng::seed_from_u64(1);
    let mut one = || [raster.rows, raster.columns].map(|n| random.random_range(0..n));
    (0..count).map(|_| one()).collect()
}

/// Surface and wake together: slopes, and what the imaging needs.
pub(crate) fn fields(raster: &Raster, quantities: &[Quantity]) -> Vec<Field> {
    let mut fields = Surface::new(&spectrum(), 7, 0.0, raster).fields(&TRANSFER, quantities, 1e-4);
    let wake = wake();
    let waves = wake.waves(&wake.plan(raster, 1e-4));
    let more = nufft::synthesize(&waves, &TRANSFER, quantities, raster, 1e-4);
    let fade = wake_physics::kelvin::fade_field(&wake.track, 195.0, raster);
    for (field, more) in fields.iter_mut().zip(&more) {
        for ((f, m), a) in field.values.iter_mut().zip(&more.values).zip(&fade.values) {
            *f += m * a;
        }
    }
    fields
}

pub(crate) fn backscatter_model(spacing: f64) -> Backscatter {
    let scene = Scene::default();
    let wavenumber = std::f64::consts::TAU * scene.radar.frequency / 299_792_458.0;
    let epsilon = permittivity::sea_water(scene.radar.frequency, 20.0, 35.0);
    let short = Elfouhaily::new(scene.sea.wind_speed, scene.sea.fetch);
    let two_scale = TwoScale::new(
        INCIDENCE,
        wavenumber,
        scene.radar.polarization,
        epsilon,
        short,
        [1.0, 0.0],
    );
    let tilt: SlopeCovariance = two_scale.slopes_from(std::f64::consts::PI / spacing);
    let lobe = Specular::mirror_lobe(wavenumber, spacing);
    Backscatter {
        specular: Specular::new(epsilon, INCIDENCE, &tilt, lobe),
        two_scale,
        tilt,
    }
}

/// Table over slopes, built anew each time, against quadrature at each pixel.
fn backscatter(raster: &Raster, tolerance: f64, memo: &mut Memo) -> Row {
    let slopes = fields(raster, &[Quantity::SlopeX, Quantity::SlopeY]);
    let facets = FacetFields::of_slopes(&slopes[0], &slopes[1]);
    let model = backscatter_model(raster.spacing);
    let mean: f64 = model.parts([0.0, 0.0]).iter().sum();
    let (fast_seconds, sigma0) = median_seconds(RUNS, || {
        let table = BackscatterTable::covering(model.clone(), &facets, tolerance * mean);
        table.sigma0_field(&facets)
    });
    // A sample on every raster, and the same for every tolerance.
    let pixels = sample(raster, QUADRATURES);
    let scale = raster.len() as f64 / pixels.len() as f64;
    let oracle = memo.at_size("backscatter", raster.rows, || {
        let (seconds, exact) = seconds(|| model.sigma0_pixels(&facets, &pixels));
        (seconds, exact.into_iter().map(f64::from).collect())
    });
    let values = pixels.iter().map(|&[i, j]| f64::from(sigma0.at(i, j)));
    let errors = Errors::of(values, &oracle.1, sigma0.mean());
    row(
        "backscatter",
        raster,
        Some(tolerance),
        fast_seconds,
        (oracle.0 * scale, pixels.len()),
        errors,
    )
}

/// Scattered kernels against the dense bunching integral.
fn bunching(raster: &Raster, tolerance: f64) -> Row {
    let source_raster = raster.with_margin(64, 4);
    let quantities = [
        Quantity::VelocityX,
        Quantity::VelocityZ,
        Quantity::RadialAcceleration,
        Quantity::Elevation,
        Quantity::SlopeX,
    ];
    let f = fields(&source_raster, &quantities);
    let (sin, cos) = (INCIDENCE.sin() as f32, INCIDENCE.cos() as f32);
    let mut velocity = f[1].clone();
    for (v, x) in velocity.values.iter_mut().zip(&f[0].values) {
        *v = *v * cos - x * sin;
    }
    let mut sigma0 = f[4].clone();
    for s in &mut sigma0.values {
        *s = 0.03 * (5.0 * *s).exp();
    }
    let sources = Sources {
        raster: source_raster,
        sigma0: &sigma0,
        radial_velocity: Some(&velocity),
        radial_acceleration: Some(&f[2]),
        elevation: Some(&f[3]),
    };
    let imaging = Imaging {
        range_to_velocity: 78.0,
        incidence: INCIDENCE,
        resolution: AzimuthResolution::of_moving_sea(0.0312, 78.0, (3.0, 1), 0.2),
    };
    let (fast_seconds, image) = median_seconds(RUNS, || imaging.image(&sources, raster, tolerance));
    let (pixels, scale) = pixels(raster);
    let direct = DirectImage::new(&imaging, &sources, raster);
    let (oracle, exact) = seconds(|| {
        pixels
            .par_iter()
            .map(|&[i, j]| direct.at(i, j))
            .collect::<Vec<f64>>()
    });
    let values = pixels.iter().map(|&[i, j]| f64::from(image.at(i, j)));
    let errors = Errors::of(values, &exact, image.mean());
    row(
        "bunching",
        raster,
        Some(tolerance),
        fast_seconds,
        (oracle * scale, pixels.len()),
        errors,
    )
}

/// The whole simulation against the oracles of all stages at random pixels of the same image, with all terms and at the
/// strictest tolerance. Sums of waves and σ⁰ are scaled from the source pixels that reach them to all source pixels,
/// imaging from the pixels to all pixels.
fn scene(size: usize, tolerance: f64, memo: &mut Memo) -> wake_physics::Result<Row> {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns) = (size, size);
    scene.model.tolerance = tolerance;
    let (fast_seconds, fast) = median_seconds(RUNS, || simulate(&scene));
    let fast = fast?;
    scene.model.tolerance = STRICTEST;
    let raster = fast.raster;
    let pixels = sample(&raster, scene_pixels(size));
    let direct = memo.scene_at(size, || direct_intensity(&scene, &pixels))?;

    let values = pixels.iter().map(|&[i, j]| fast.intensity.at(i, j).into());
    let errors = Errors::of(values, &direct.intensity, fast.intensity.mean());
    let [rows, columns] = fast.plan.sizes.computed;
    let per_source = direct.seconds.sea + direct.seconds.kelvin + direct.seconds.backscatter;
    let oracle = per_source * (rows * columns) as f64 / direct.sources as f64
        + direct.seconds.imaging * raster.len() as f64 / pixels.len() as f64;
    let oracle = (oracle, pixels.len());
    Ok(row(
        "scene",
        &raster,
        Some(tolerance),
        fast_seconds,
        oracle,
        errors,
    ))
}

/// Pixels of the oracle of the scene: fewer of a large image, whose sea has more waves.
fn scene_pixels(size: usize) -> usize {
    ((1 << 23) / (size * size).max(1 << 18)).max(4)
}

/// Seconds of an oracle, and its values.
type Exact = (f64, Vec<f64>);

/// What several rows share, because it is slow.
#[derive(Default)]
pub(crate) struct Memo {
    /// Seconds and exact σ⁰ of the sample, by stage and size.
    backscatter: Vec<(&'static str, usize, Exact)>,
    /// Pixels of the scene by the oracles, by size.
    scene: Vec<(usize, DirectPixels)>,
}

impl Memo {
    pub(crate) fn at_size(
        &mut self,
        stage: &'static str,
        size: usize,
        compute: impl FnOnce() -> Exact,
    ) -> &Exact {
        let mut known = self.backscatter.iter();
        let known = known.position(|known| (known.0, known.1) == (stage, size));
        let index = known.unwrap_or_else(|| {
            self.backscatter.push((stage, size, compute()));
            self.backscatter.len() - 1
        });
        &self.backscatter[index].2
    }

    fn scene_at(
        &mut self,
        size: usize,
        compute: impl FnOnce() -> wake_physics::Result<DirectPixels>,
    ) -> wake_physics::Result<&DirectPixels> {
        let known = self.scene.iter().position(|(s, _)| *s == size);
        let index = match known {
            Some(index) => index,
            None => {
                self.scene.push((size, compute()?));
                self.scene.len() - 1
            }
        };
        Ok(&self.scene[index].1)
    }
}

/// Tolerance of the direct simulation: its nodes of the wake stand for all others, and it leaves out no term.
const STRICTEST: f64 = 1e-6;

pub(crate) fn row(
    stage: &'static str,
    raster: &Raster,
    tolerance: Option<f64>,
    fast_seconds: f64,
    (oracle_seconds, pixels): (f64, usize),
    errors: Errors,
) -> Row {
    Row {
        stage,
        size: raster.rows,
        tolerance,
        fast_seconds,
        oracle_seconds,
        pixels,
        matrix_product_seconds: None,
        ratio: oracle_seconds / fast_seconds,
        max_error: errors.max,
        rms_error: errors.rms,
    }
}
