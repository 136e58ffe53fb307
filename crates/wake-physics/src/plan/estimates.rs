//! Estimated change of the image if a term is left out, by the modulation transfer functions.

use super::terms::Weighed;
use crate::effects::Weight;
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::prepared::Prepared;
use crate::scattering::SlopeCovariance;
use crate::scene::{Scene, Term};

/// Factor on the linear root mean square: one random sea may be rougher than the mean, bunching concentrates changes, and
/// waves of finite height are not quite linear. It is an estimate, not a proven bound.
const SAFETY: f64 = 3.0;

/// Change by the rounding of `f32` fields, whatever is left out: a few times 6e-8 of each of several fields.
const ROUNDING: f64 = 1e-6;

/// Every term with its estimated change, in the order of the data flow.
pub(super) fn weighed(prepared: &Prepared<'_>, amplitudes: &Amplitudes<'_>) -> Vec<Weighed> {
    let (scene, models) = (prepared.scene, &prepared.models);
    let linear = |weight: Weight| Weight {
        estimate: SAFETY * weight.estimate + ROUNDING,
        ..weight
    };
    let one = |&term: &Term| {
        let effect = prepared.effects.each().find(|effect| effect.term() == term);
        let weight = match (effect, term) {
            (Some(effect), _) => linear(effect.weigh(models, amplitudes)),
            (None, Term::ImpulseResponse) => response(scene, models, amplitudes.contrast),
            (None, Term::Speckle) => speckle(scene),
            (None, term) => linear(Weight {
                absent: absent(term, models, amplitudes),
                estimate: match term {
                    Term::Specular => {
                        let wake = &prepared.effects.subpixel_wake;
                        let rough = wake.specular(models, amplitudes);
                        estimate(term, amplitudes).max(rough)
                    }
                    _ => estimate(term, amplitudes),
                },
            }),
        };
        Weighed { term, weight }
    };
    Term::ALL.iter().map(one).collect()
}

/// Relative root mean square change of the image without one of the terms that every scene has.
fn estimate(term: Term, a: &Amplitudes<'_>) -> f64 {
    match term {
        Term::Sea => a.waves(&a.sea),
        Term::Kelvin => a.waves(&a.wake),
        Term::TiltAverage => a.backscatter[0],
        Term::Specular => a.backscatter[1],
        Term::RangeBunching => {
            a.part(|m| m.range_bunching) + a.both(|w| a.range_shift(w)) * a.contrast
        }
        Term::Hydrodynamic => a.part(|m| m.hydrodynamic),
        Term::VelocityBunching => {
            a.part(|m| m.bunching) + a.both(|w| a.azimuth_shift(w)) * a.contrast
        }
        Term::AzimuthSmear => a.azimuth_smear(),
        _ => 0.0,
    }
}

/// Reason why such a term is absent from a scene.
fn absent(term: Term, models: &Models, amplitudes: &Amplitudes<'_>) -> Option<&'static str> {
    let first = amplitudes.first;
    let flat = first.is_flat().then_some("there are no resolved waves");
    let still = (models.range_to_velocity == 0.0).then_some("R/V is 0");
    let no_bragg = models.short_waves_vanish();
    let bragg = no_bragg.then_some("there are no short waves to scatter");
    match term {
        Term::Sea => {
            let none = first.open.no_wind_waves();
            none.then_some("pixels resolve no wind waves")
        }
        Term::Kelvin => {
            let unseen = first.wake.is_empty();
            let unseen = unseen.then_some("no resolved wave reaches the image");
            models.no_wake().or(unseen)
        }
        Term::TiltAverage => {
            let none = models.subpixel_slopes() == SlopeCovariance::NONE;
            bragg.or(none.then_some("no waves between pixel spacing and Bragg waves"))
        }
        Term::RangeBunching => flat,
        Term::Hydrodynamic => flat.or(bragg),
        Term::VelocityBunching | Term::AzimuthSmear => still.or(flat),
        _ => None,
    }
}

/// The impulse response smears away at most the whole contrast, and adds correlation of the speckle between neighbours.
fn response(scene: &Scene, models: &Models, contrast: f64) -> Weight {
    let spacing = models.pixels.image.spacing;
    let correlation = models
        .response
        .map_or(0.0, |response| response.pixel_correlation(spacing));
    Weight {
        absent: match (&models.response, scene.radar.range_resolution) {
            (Some(_), _) => None,
            (None, None) => Some("not requested"),
            (None, Some(_)) => Some("not in model.terms"),
        },
        estimate: contrast.max(correlation),
    }
}

/// Speckle is multiplicative: its share of the speckled image is √(1 + cv²)/√looks, with cv below √3.
fn speckle(scene: &Scene) -> Weight {
    Weight {
        absent: None,
        estimate: 2.0 / f64::from(scene.radar.looks).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{bright_edge, subpixel_wake, turbulent};
    use crate::linear::WaveSample;
    use crate::linear::{FirstOrder, OpenSea};
    use crate::sar::AzimuthResolution;
    use crate::scattering::modulation::ModulationTransfer;
    use crate::waves::Transfer;
    use std::f64::consts::PI;

    const BACKSCATTER: [f64; 2] = [0.21, 0.3];

    fn wave(k: [f64; 2], variance: f64) -> WaveSample {
        WaveSample {
            k,
            omega: 1.0,
            variance,
        }
    }

    fn open() -> OpenSea {
        let mut open = OpenSea::new(&Models::new(&Scene::default()));
        open.waves = vec![wave([0.1, 0.0], 0.04)];
        open.swell = vec![wave([0.1, 0.0], 0.01)];
        open.curvature = [3.0, 7.0];
        open
    }

    /// One wave of the sea along range and one of the wake along azimuth, both with ω = 1/s, tan θ = 3/4, and distinct
    /// values for everything else.
    fn first(open: &OpenSea) -> FirstOrder<'_> {
        let modulation = ModulationTransfer {
            transfer: Transfer {
                depth: f64::INFINITY,
                incidence: 0.75f64.atan(),
                relaxation_rate: 1.0,
                action_slope: 4.0,
            },
            tilt: [5.0, 0.0],
            bragg_share: 0.5,
            range_to_velocity: 50.0,
        };
        FirstOrder {
            open,
            wake: vec![wave([0.0, 0.2], 1e-4)],
            modulation,
            resolution: AzimuthResolution {
                nominal: 10.0 * PI,
                coherence: 0.0,
                defocus: 50.0 * PI,
            },
            mean: [1.0, 1.0],
            resolved: SlopeCovariance::NONE,
            modulation_variance: 0.0,
            spacing: 4.0,
        }
    }

    /// Estimate without its safety factor and rounding.
    fn of_effect(scene: &[&str], term: Term, amplitudes: &Amplitudes<'_>) -> f64 {
        let scene = Scene::default().with_assignments(scene).unwrap();
        let Prepared {
            models, effects, ..
        } = Prepared::new(&scene);
        let effect = effects.each().find(|effect| effect.term() == term);
        let weight = effect.unwrap().weigh(&models, amplitudes);
        assert_eq!(weight.absent, None, "{term:?}");
        weight.estimate
    }

    /// Worked out by hand. Modulation of the sea's wave: tilt 0.5 i, range bunching 0.4/3 i, hydrodynamic
    /// 0.5 · (−0.4 i)/(1 − i) = 0.1 − 0.1 i; of the wake's: bunching −0.2 i · 50 · (−0.8 i) = −8, smeared to 1/e.
    /// Heights 0.2 and 0.01 m.
    #[test]
    fn estimates_are_those_worked_out_by_hand() {
        let one_over_e = (-1f64).exp();
        let sea = 0.2 * (0.01 + (0.5 + 0.4 / 3.0 - 0.1f64).powi(2)).sqrt();
        let wake = 0.01 * 8.0 * one_over_e;
        // Contrast of the image: both waves and the change by the specular return.
        let c = (sea * sea + wake * wake + 0.09).sqrt();
        let product = (1.0 + c * c).sqrt();
        // Width of a point: 4 m of the pixel and 10/√2 of the resolution.
        let width = 66f64.sqrt();
        // The rms acceleration toward the radar is √0.040064: the squared resolution grows by 2500 π² times its square.
        let acceleration: f64 = 0.04 + 0.64e-4;
        let moving = 1.0 + 25.0 * acceleration;
        let wider = 16.0 + 50.0 * moving;
        let shifts = |height: f64, velocity: f64| [50.0 * velocity / width, height / 3.0];
        let [sea_shift, wake_shift] = [shifts(0.2, 0.2), shifts(0.01, 0.008)];
        let both = |axis: usize| sea_shift[axis].hypot(wake_shift[axis]) * c;
        let of_sea = (sea + 3.0 * 0.04 * 0.01) * product + sea_shift[0].hypot(sea_shift[1]) * c;
        let of_wake = (wake + 7.0 * 1e-4 * 0.04) * product + wake_shift[0].hypot(wake_shift[1]) * c;
        // Half the height: a quarter of the second order.
        let of_swell =
            (0.5 * sea + 3.0 * 0.01 * 0.01) * product + 0.5 * sea_shift[0].hypot(sea_shift[1]) * c;
        let open = open();
        let first = first(&open);
        let a = &Amplitudes::with(&first, BACKSCATTER);
        // Noise of 10 log 0.36 dB over a mean of 2.
        let noise = format!("radar.nesz={}", 10.0 * 0.36f64.log10());
        let gusts = 0.16 / crate::gusts::wind_exponent(9.6e9);
        let gusts = format!("sea.gust_strength={gusts}");
        let optional = |keys: &[&str], term| of_effect(keys, term, a);
        for (term, found, expected) in [
            (Term::Sea, estimate(Term::Sea, a), of_sea),
            (
                Term::Swell,
                optional(&["sea.swell_height=1"], Term::Swell),
                of_swell,
            ),
            (Term::Kelvin, estimate(Term::Kelvin, a), of_wake),
            (
                Term::BrightEdge,
                bright_edge::estimate([0.12, 0.5], a),
                0.12 + 50.0 * 0.5 / width * c,
            ),
            (
                Term::Slicks,
                optional(&["sea.slick_damping=0.15"], Term::Slicks),
                0.15 * 0.5,
            ),
            (
                Term::Gusts,
                optional(&[&gusts], Term::Gusts),
                0.16 * product,
            ),
            (Term::Noise, optional(&[&noise], Term::Noise), 0.18),
            (
                Term::SubpixelWake,
                subpixel_wake::estimate([0.13, 0.14], a),
                0.13 * product + 0.14 * c,
            ),
            (Term::Turbulent, turbulent::estimate(0.11, a), 0.11 * 0.5),
            (Term::TiltAverage, estimate(Term::TiltAverage, a), 0.21),
            (Term::Specular, estimate(Term::Specular, a), 0.3),
            (
                Term::RangeBunching,
                estimate(Term::RangeBunching, a),
                0.2 * 0.4 / 3.0 * (1.0 + c) + both(1),
            ),
            (
                Term::Hydrodynamic,
                estimate(Term::Hydrodynamic, a),
                0.2 * 0.02f64.sqrt() * (1.0 + c),
            ),
            (
                Term::VelocityBunching,
                estimate(Term::VelocityBunching, a),
                0.01 * 8.0 * (one_over_e + c) + both(0),
            ),
            (Term::AzimuthSmear, estimate(Term::AzimuthSmear, a), {
                let lost = 0.01 * 8.0 * (one_over_e - (-moving).exp());
                lost * product + 0.5 * (1.0 - 66.0 / wider) * 0.3
            }),
        ] {
            assert!(
                (found / expected - 1.0).abs() < 1e-12,
                "{term:?}: {found} {expected}"
            );
        }
        let breaking = ["sea.breaking=true", "sea.wind_speed=10"];
        let scene = Scene::default().with_assignments(&breaking).unwrap();
        let prepared = Prepared::new(&scene);
        let found = optional(&breaking, Term::Breaking);
        assert!((found / (prepared.effects.breaking.sigma0 / 2.0) - 1.0).abs() < 1e-12);
        // All estimates have the safety factor of three and rounding, except response and speckle.
        for Weighed { term, weight } in weighed(&prepared, a) {
            let expected = match term {
                Term::Sea => 3.0 * of_sea + 1e-6,
                Term::Specular => 3.0 * 0.3 + 1e-6,
                Term::Breaking => 3.0 * found + 1e-6,
                Term::ImpulseResponse => c,
                // Four looks.
                Term::Speckle => 1.0,
                _ => continue,
            };
            assert!(
                (weight.estimate / expected - 1.0).abs() < 1e-12,
                "{term:?}: {weight:?} {expected}"
            );
        }
    }

    /// Correlated speckle may exceed the contrast.
    #[test]
    fn a_response_changes_the_contrast_or_the_speckle() {
        let keys = ["radar.range_resolution=40", "radar.azimuth_resolution=40"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let models = Models::new(&scene);
        let correlation = models.response.unwrap().pixel_correlation(2.5);
        assert!((0.5..1.0).contains(&correlation));
        for (contrast, expected) in [(0.1, correlation), (2.0, 2.0)] {
            let weight = response(&scene, &models, contrast);
            assert!((weight.estimate - expected).abs() < 1e-15 && weight.absent.is_none());
        }
    }

    /// Where a ship's waves roughen the sea, its specular return exceeds the sea's alone.
    #[test]
    fn rough_places_count_where_they_return_more() {
        let keys = [
            "radar.sensor=sentinel-1-iw",
            "radar.incidence=31",
            "sea.wind_speed=3",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let prepared = Prepared::new(&scene);
        let first = FirstOrder::new(&prepared.models, &prepared.open);
        let wakes = &prepared.effects.subpixel_wake;
        let rough = wakes.specular(&prepared.models, &Amplitudes::new(&first));
        assert!(rough > 0.0);
        for sea in [0.0, 0.5 * rough, 2.0 * rough] {
            let amplitudes = Amplitudes::with(&first, [0.0, sea]);
            let all = weighed(&prepared, &amplitudes);
            let specular = all.iter().find(|one| one.term == Term::Specular).unwrap();
            let expected = SAFETY * sea.max(rough) + ROUNDING;
            assert!((specular.weight.estimate - expected).abs() < 1e-15 * expected.max(1.0));
        }
    }

    /// Every term appears once, and the reason for an absent term concerns that term.
    #[test]
    fn what_is_absent_is_told_of_its_own_term() {
        let scene = Scene::default();
        let prepared = Prepared::new(&scene);
        let first = FirstOrder::new(&prepared.models, &prepared.open);
        let all = weighed(&prepared, &Amplitudes::new(&first));
        let terms: Vec<Term> = all.iter().map(|one| one.term).collect();
        assert_eq!(terms, Term::ALL);
        for Weighed { term, weight } in all {
            let optional = [
                Term::Swell,
                Term::SubpixelWake,
                Term::BrightEdge,
                Term::Slicks,
                Term::Breaking,
                Term::Gusts,
                Term::Noise,
                Term::ImpulseResponse,
            ];
            let reason = optional.contains(&term).then_some("not requested");
            assert_eq!(weight.absent, reason, "{term:?}");
        }
    }
}
