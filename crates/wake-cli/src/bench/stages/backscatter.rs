//! Stage σ⁰ of facets: a table against quadrature.

use super::memo::Memo;
use super::oracle::{QUADRATURES, RUNS, at_pixels, sample};
use super::surface::{INCIDENCE, fields, wake};
use crate::bench::row::{Row, median_seconds, seconds};
use wake_physics::scattering::{
    Backscatter, BackscatterTable, FacetFields, SlopeCovariance, Specular, TwoScale,
};
use wake_physics::spectrum::elfouhaily::Elfouhaily;
use wake_physics::waves::Quantity;
use wake_physics::{Field, Raster, Scene, permittivity};

/// Mean square slope of waves below the pixel size, times the distance astern \[m\], and its largest value \[1\]:
/// typical of a ship of 195 m on pixels of 2.5 m.
const ROUGHNESS: f64 = 2.0;
const ROUGHEST: f64 = 0.02;

fn backscatter_model(spacing: f64) -> Backscatter {
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

/// Table over slopes, rebuilt in every run, against quadrature at each pixel.
pub(crate) fn backscatter(raster: &Raster, tolerance: f64, memo: &mut Memo) -> Row {
    let slopes = fields(raster, &[Quantity::SlopeX, Quantity::SlopeY]);
    let facets = FacetFields::of_slopes(&slopes[0], &slopes[1]);
    // A sample for every raster size, the same for every tolerance.
    let pixels = sample(raster, QUADRATURES);
    by_quadrature("backscatter", (raster, tolerance), &facets, &pixels, memo)
}

/// σ⁰ where waves of a ship roughen the sea below the pixel size: means over nodes of the table against quadrature over
/// all slopes, at pixels with such waves.
pub(crate) fn unresolved(raster: &Raster, tolerance: f64, memo: &mut Memo) -> Row {
    let slopes = fields(raster, &[Quantity::SlopeX, Quantity::SlopeY]);
    let track = wake().track;
    // Divergent waves, which propagate away from the track.
    let of_pixel = |i: usize, j: usize| {
        let [ahead, port] = track.seen_from_ship([raster.x(j), raster.y(i)]);
        let variance = if port.abs() < -0.2 * ahead {
            (ROUGHNESS / -ahead).min(ROUGHEST)
        } else {
            0.0
        };
        let [x, y] = track.turned([0.3, 0.91f64.sqrt().copysign(port)]);
        [x * x, x * y, y * y].map(|product| (variance * product) as f32)
    };
    let variances = [0, 1, 2].map(|n| Field::from_fn(raster, |i, j| of_pixel(i, j)[n]));
    let facets = FacetFields {
        subpixel_variances: Some(&variances),
        ..FacetFields::of_slopes(&slopes[0], &slopes[1])
    };
    let rough = |&[i, j]: &[usize; 2]| variances[0].at(i, j) + variances[2].at(i, j) > 0.0;
    let all = sample(raster, 16 * QUADRATURES);
    let pixels: Vec<_> = all.into_iter().filter(rough).take(QUADRATURES).collect();
    by_quadrature("unresolved", (raster, tolerance), &facets, &pixels, memo)
}

/// The table for some facets against quadrature at some pixels.
fn by_quadrature(
    stage: &'static str,
    (raster, tolerance): (&Raster, f64),
    facets: &FacetFields<'_>,
    pixels: &[[usize; 2]],
    memo: &mut Memo,
) -> Row {
    let model = backscatter_model(raster.spacing);
    let mean: f64 = model.parts([0.0, 0.0]).iter().sum();
    let (fast_seconds, sigma0) = median_seconds(RUNS, || {
        BackscatterTable::covering(model.clone(), facets, tolerance * mean).sigma0_field(facets)
    });
    let known = memo.backscatter.entry((stage, raster.rows));
    let (oracle, exact) = known.or_insert_with(|| {
        let (seconds, exact) = seconds(|| model.sigma0_pixels(facets, pixels));
        (seconds, exact.into_iter().map(f64::from).collect())
    });
    let fast = (fast_seconds, &sigma0);
    at_pixels(
        stage,
        (raster, Some(tolerance)),
        fast,
        (*oracle, exact),
        pixels,
    )
}
