//! How much those terms change the image that no wave carries: the turbulent wake, its edges, waves that no pixel carries.

use crate::kelvin::SubpixelWake;
use crate::models::Models;
use crate::raster::Raster;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::turbulent::current::WakeEdge;
use crate::wakes::Wake;
use std::f64::consts::{PI, SQRT_2};

/// Step of the differences that give the slope of ln σ⁰ \[1\].
pub(super) const SLOPE_STEP: f64 = 0.05;

/// Points along each side of the image where the turbulent wake is looked at.
const DAMPING_POINTS: usize = 48;

/// Rays on each side of a ship's track, and places on each.
const RAY_POINTS: usize = 40;

/// Root of the mean square of the damping by all turbulent wakes over the image.
pub(super) fn damping(models: &Models) -> f64 {
    if models.wakes.iter().all(|wake| wake.turbulent.speed == 0.0) {
        return 0.0;
    }
    rms_over(&models.computed, |place| {
        let of = |wake: &Wake| {
            let seen = wake.turbulent.track.seen_from_ship(place);
            wake.turbulent.damping(seen)
        };
        // What is left is the product: 1 − (1 − a)(1 − b) = a + b (1 − a).
        models
            .wakes
            .iter()
            .map(of)
            .fold(0.0, |all, one| all + one * (1.0 - all))
    })
}

/// What the current of the wake changes over the image, see [`Survey::edge`].
pub(super) fn edge(models: &Models) -> [f64; 2] {
    let of = |edge: &WakeEdge| {
        let to_port = |seen: [f64; 2]| edge.track.at(seen[0]).port().map(f64::abs);
        let change = |place| {
            let seen = edge.track.seen_from_ship(place);
            let [port_x, port_y] = to_port(seen);
            let along_sight = port_x * models.incidence.sin();
            // Velocity bunching gathers by R/V times the slope of the velocity along azimuth.
            let gathered = models.range_to_velocity * along_sight * port_y;
            (edge.factor(seen) - 1.0).abs() + gathered * edge.divergence(seen).abs()
        };
        let velocity = |place| {
            let seen = edge.track.seen_from_ship(place);
            to_port(seen)[0] * models.incidence.sin() * edge.velocity(seen)
        };
        [
            rms_over(&models.computed, change),
            rms_over(&models.computed, velocity),
        ]
    };
    let edges = models.wakes.iter().filter_map(|wake| wake.edge.as_ref());
    // Where wakes cross their changes add, at most.
    edges
        .map(of)
        .fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
}

/// What the waves of the ship that pixels do not carry change over the image, see [`Survey::subpixel_wake`].
pub(super) fn subpixel_wake(models: &Models, backscatter: &Backscatter) -> [f64; 2] {
    if models.subpixel_wakes.is_empty() {
        return [0.0; 2];
    }
    let curvature = curvature_of_sigma(backscatter);
    let change = |place| {
        let rough = models.roughness(place).unwrap_or_default();
        let terms = rough.slopes.iter().zip(curvature);
        terms
            .map(|(variance, curvature)| variance * curvature)
            .sum()
    };
    let narrow = models.resolution().at(0.0) / (SQRT_2 * PI);
    let width = models.computed.spacing.hypot(narrow);
    let wider = |place| {
        let rough = models.roughness(place).unwrap_or_default();
        let smear = models.range_to_velocity.powi(2) * rough.radial(models.incidence);
        smear / (smear + width * width)
    };
    [
        rms_over(&models.computed, change),
        rms_over(&models.computed, wider),
    ]
}

/// Root of the mean square of the specular return over the image and its resolved slopes, where the waves of a ship that pixels
/// do not carry roughen the sea \[1\]; 0 where there are none.
///
/// Few places make it, near the track: it is summed over rays from the ship, the denser the nearer to the track. Behind several
/// ships each counts alone.
pub(super) fn rough_specular(
    models: &Models,
    backscatter: &Backscatter,
    resolved: &SlopeCovariance,
) -> f64 {
    let image = &models.image;
    let [rows, columns] = [image.rows as f64, image.columns as f64];
    let specular = |waves: &SubpixelWake, place: [f64; 2]| {
        let [column, row] = image.pixel(place[0], place[1]);
        let inside = (-0.5..rows - 0.5).contains(&row) && (-0.5..columns - 0.5).contains(&column);
        let rough = waves.at(place).filter(|_| inside);
        rough.map_or(0.0, |rough| {
            let [xx, xy, yy] = rough.slopes;
            let over = backscatter.specular.over(&SlopeCovariance { xx, xy, yy });
            over.rms_over(resolved).powi(2)
        })
    };
    let mut sum = 0.0;
    for waves in &models.subpixel_wakes {
        let track = waves.track();
        let step = track.farthest_astern(image) / RAY_POINTS as f64;
        for n in 0..RAY_POINTS * RAY_POINTS {
            let astern = step * ((n / RAY_POINTS) as f64 + 0.5);
            // Tangents 0 to 1 of the angle to the track, evenly in their roots.
            let root = ((n % RAY_POINTS) as f64 + 0.5) / RAY_POINTS as f64;
            let aside = astern * root * root;
            let area = step * astern * 2.0 * root / RAY_POINTS as f64;
            let there = track.at(-astern);
            for port in [-aside, aside] {
                sum += area * specular(waves, there.on_sea([0.0, port]));
            }
        }
    }
    (sum / (rows * columns * image.spacing * image.spacing)).sqrt()
}

/// ½∂²σ⁰/∂s² over σ⁰ for variances xx, xy and yy of the slopes, on the calm facet.
pub(super) fn curvature_of_sigma(backscatter: &Backscatter) -> [f64; 3] {
    let sigma = |x: f64, y: f64| {
        let [bragg, specular] = backscatter.coarse_parts([x * SLOPE_STEP, y * SLOPE_STEP]);
        bragg + specular
    };
    let calm = sigma(0.0, 0.0);
    if calm <= 0.0 {
        return [0.0; 3];
    }
    let square = SLOPE_STEP * SLOPE_STEP * calm;
    let mixed = sigma(1.0, 1.0) + sigma(-1.0, -1.0) - sigma(1.0, -1.0) - sigma(-1.0, 1.0);
    [
        0.5 * (sigma(1.0, 0.0) + sigma(-1.0, 0.0) - 2.0 * calm) / square,
        0.25 * mixed / square,
        0.5 * (sigma(0.0, 1.0) + sigma(0.0, -1.0) - 2.0 * calm) / square,
    ]
}

/// Root of the mean square of a function of the place (x, y) over the image, looked at on a coarse raster.
pub(super) fn rms_over(image: &Raster, of: impl Fn([f64; 2]) -> f64) -> f64 {
    let (rows, columns) = (
        image.rows.min(DAMPING_POINTS),
        image.columns.min(DAMPING_POINTS),
    );
    let mut sum = 0.0;
    for i in 0..rows {
        for j in 0..columns {
            let (x, y) = (
                image.x(j * image.columns / columns),
                image.y(i * image.rows / rows),
            );
            sum += of([x, y]).powi(2);
        }
    }
    (sum / (rows * columns) as f64).sqrt()
}
