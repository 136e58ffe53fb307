//! Ship waves too short for the computed pixels, as variances of slopes and velocities by position.

use super::effect::{Effect, NOT_ASKED_FOR, OUTSIDE, Site, Weight};
use crate::fields::Fields;
use crate::kelvin::{Roughness, SubpixelWake};
use crate::linear::Amplitudes;
use crate::linear::amplitudes::rms_over;
use crate::models::Models;
use crate::raster::Field;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::{Scene, Term};
use crate::workspace::Workspace;
use rayon::prelude::*;
use std::f64::consts::{PI, SQRT_2};

/// Rays on each side of a ship's track, and points on each ray.
const RAY_POINTS: usize = 40;

/// Step of the finite differences for the curvature of σ⁰ \[1\].
const SLOPE_STEP: f64 = 0.05;

#[derive(Debug)]
pub(crate) struct SubpixelWakes {
    /// Whether these waves count: only if the scene asks for an impulse response and allows the term, even on finer
    /// computed pixels. Otherwise they are left out, as in the original model.
    pub(crate) counted: bool,
    /// The waves of each ship that makes such waves.
    pub(crate) waves: Vec<Option<SubpixelWake>>,
}

impl SubpixelWakes {
    pub(super) fn new(scene: &Scene, models: &Models) -> Self {
        let counted =
            scene.radar.range_resolution.is_some() && scene.model.terms.allow(Term::SubpixelWake);
        let band = models.subpixel_band();
        let of_ship = |wake: &crate::kelvin::KelvinWake| match counted {
            true => wake.subpixel(band),
            false => None,
        };
        Self {
            counted,
            waves: models.wakes.iter().map(of_ship).collect(),
        }
    }

    /// The variances at a point (x, y) \[m\], or `None` where no wave reaches.
    fn at(&self, place: [f64; 2]) -> Option<Roughness> {
        let each = self.waves.iter().flatten();
        let each = each.filter_map(|waves| waves.at(place));
        each.reduce(|a, b| a.plus(&b))
    }

    /// Root mean squares over the image: the relative change of σ⁰, and the share of a point's width that the velocities
    /// add, 0 to 1.
    fn strength(&self, models: &Models, backscatter: &Backscatter) -> [f64; 2] {
        if self.waves.iter().all(Option::is_none) {
            return [0.0; 2];
        }
        let curvature = curvature_of_sigma(backscatter);
        let change = |place| {
            let rough = self.at(place).unwrap_or_default();
            let terms = rough.slopes.iter().zip(curvature);
            terms
                .map(|(variance, curvature)| variance * curvature)
                .sum()
        };
        let narrow = models.resolution().at(0.0) / (SQRT_2 * PI);
        let width = models.pixels.computed.spacing.hypot(narrow);
        let wider = |place| {
            let rough = self.at(place).unwrap_or_default();
            let smear = models.range_to_velocity.powi(2) * rough.radial(models.incidence);
            smear / (smear + width * width)
        };
        [
            rms_over(&models.pixels.computed, change),
            rms_over(&models.pixels.computed, wider),
        ]
    }

    /// Specular return where the waves roughen the sea: root mean square over the mean σ⁰ \[1\]; 0 without such waves.
    ///
    /// Only a few points near the track contribute, so the sum runs over rays from the ship, denser toward the track.
    /// Several ships count separately.
    pub(crate) fn specular(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> f64 {
        let first = amplitudes.first;
        if first.mean_sigma0() <= 0.0 {
            return 0.0;
        }
        let image = &models.pixels.image;
        let [rows, columns] = [image.rows as f64, image.columns as f64];
        let specular = |waves: &SubpixelWake, place: [f64; 2]| {
            let [column, row] = image.pixel(place[0], place[1]);
            let inside =
                (-0.5..rows - 0.5).contains(&row) && (-0.5..columns - 0.5).contains(&column);
            let rough = waves.at(place).filter(|_| inside);
            rough.map_or(0.0, |rough| {
                let [xx, xy, yy] = rough.slopes;
                let specular = &first.open.backscatter.specular;
                let over = specular.over(&SlopeCovariance { xx, xy, yy });
                over.rms_over(&first.resolved).powi(2)
            })
        };
        let mut sum = 0.0;
        for waves in self.waves.iter().flatten() {
            let track = waves.track();
            let step = track.farthest_astern(image) / RAY_POINTS as f64;
            for n in 0..RAY_POINTS * RAY_POINTS {
                let astern = step * ((n / RAY_POINTS) as f64 + 0.5);
                // Tangents of the angle to the track from 0 to 1, evenly spaced in their square roots.
                let root = ((n % RAY_POINTS) as f64 + 0.5) / RAY_POINTS as f64;
                let aside = astern * root * root;
                let area = step * astern * 2.0 * root / RAY_POINTS as f64;
                let there = track.at(-astern);
                for port in [-aside, aside] {
                    sum += area * specular(waves, there.on_sea([0.0, port]));
                }
            }
        }
        (sum / (rows * columns * image.spacing * image.spacing)).sqrt() / first.mean_sigma0()
    }

    /// Variances xx, xy and yy of the slopes. Velocities smear the image like an acceleration with the same defocus, which
    /// is added in quadrature to the acceleration in `fields`.
    ///
    /// - `smears`: whether velocities smear the image
    pub(crate) fn variances(
        &self,
        site: &Site<'_>,
        memory: &mut Workspace,
        fields: &mut Fields,
        smears: bool,
    ) -> [Field; 3] {
        let (models, raster) = (site.models, &site.raster);
        let mut variances = [(); 3].map(|()| memory.flat_field(raster));
        let per_velocity = if smears {
            models.defocus_of_velocity()
        } else {
            0.0
        };
        let columns = raster.columns.max(1);
        let mut unused = Vec::new();
        let acceleration = &mut fields.radial_acceleration.values;
        let acceleration = if per_velocity > 0.0 {
            acceleration
        } else {
            unused.resize(raster.len(), 0.0);
            &mut unused
        };
        let [xx, xy, yy] = variances
            .each_mut()
            .map(|f| f.values.par_chunks_mut(columns));
        let rows = xx.zip(xy).zip(yy).zip(acceleration.par_chunks_mut(columns));
        rows.enumerate()
            .for_each(|(i, (((xx, xy), yy), acceleration))| {
                for (j, acceleration) in acceleration.iter_mut().enumerate() {
                    if let Some(rough) = self.at([raster.x(j), raster.y(i)]) {
                        [xx[j], xy[j], yy[j]] = rough.slopes.map(|v| v as f32);
                        let square = rough.radial(models.incidence) * per_velocity * per_velocity;
                        *acceleration = acceleration.hypot(square.sqrt() as f32);
                    }
                }
            });
        variances
    }
}

/// Estimated change of the intensity, relative.
///
/// - `change` of σ⁰, relative, and the share of a point's width that velocities add
pub(crate) fn estimate([change, wider]: [f64; 2], amplitudes: &Amplitudes<'_>) -> f64 {
    change * amplitudes.with_contrast() + wider * amplitudes.contrast
}

impl Effect for SubpixelWakes {
    fn term(&self) -> Term {
        Term::SubpixelWake
    }

    fn weigh(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        let strength = self.strength(models, &amplitudes.first.open.backscatter);
        Weight {
            absent: match strength {
                _ if !self.counted => Some(NOT_ASKED_FOR),
                _ if self.waves.iter().all(Option::is_none) => Some("no ship has subpixel waves"),
                [0.0, _] => Some(OUTSIDE),
                _ => None,
            },
            estimate: estimate(strength, amplitudes),
        }
    }
}

/// ½∂²σ⁰/∂s² with respect to the slopes xx, xy and yy, over σ⁰, on the calm facet.
fn curvature_of_sigma(backscatter: &Backscatter) -> [f64; 3] {
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
