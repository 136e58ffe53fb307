//! Sets of images for the evaluation of estimates.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use wake_dataset::{Recipe, Simulated};
use wake_detector::score::Label;
use wake_detector::{Detector, GreyImage, Wake};
use wake_ldm::WakeSampler;
use wake_nn::device_named;
use wake_physics::estimate::{ExpectedImage, Likelihood, Parameter, Priors, Sighting};
use wake_physics::grey::GreyScale;
use wake_physics::scene::{Sea, Ship};
use wake_physics::{Field, Scene, simulate};
use wake_train::detector::judging::Tile;
use wake_train::evaluation::{HeldOut, ImageSource, ToEstimate, Told, View};

use super::super::detector::real;
use super::options::Options;
use crate::exit::Outcome;

/// Seed of the scenes of the recipe detector, which no training has.
const SEED: u64 = 900_301;
/// Rows and columns of its images.
const SIDE: usize = 256;
/// Assumptions about real tiles, whose radar is unknown: pixel \[m\], incidence \[deg\] and looks.
const ASSUMED: (f64, f64, u32) = (10.0, 35.0, 4);

/// A set of images.
pub(super) struct Set {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) count: u64,
    kind: Kind,
}

enum Kind {
    Paper,
    Detector(Box<Simulated>),
    Detected(Box<Detector>),
    Drawn(Box<WakeSampler>),
    Wrong(fn(&mut Scene)),
    FromTruth,
    OpenSeaNoise,
    OwnLaw,
    Empty,
    Real(Vec<(GreyImage, Label)>),
}

impl Set {
    /// All requested sets.
    pub(super) fn all(options: &Options) -> Outcome<Vec<Self>> {
        let device = device_named(&options.device)?;
        let mut recipe = Recipe::detector()?;
        (recipe.scene.grid.rows, recipe.scene.grid.columns) = (SIDE, SIDE);
        let others = u64::from(options.others);
        let mut sets = vec![Self {
            name: "paper",
            about: "scenes of the paper's ranges, 256 × 256 pixels of 4 m",
            count: options.count.into(),
            kind: Kind::Paper,
        }];
        let mut add = |name, about, count, kind| {
            sets.push(Self {
                name,
                about,
                count,
                kind,
            });
        };
        if options.satellites > 0 {
            add(
                "detector",
                "scenes of the recipe detector with one ship: seven sensors, shallow water, and gusts, swell and slicks unknown to the estimator",
                options.satellites.into(),
                Kind::Detector(Box::new(Simulated::new(recipe, SEED)?)),
            );
        }
        if others > 0 {
            let detector = Detector::pretrained(&device)?;
            let spacing = HeldOut::default().base.grid.spacing as f32;
            add(
                "detected",
                "paper's scenes, sighted by the detector: its wake with the highest score",
                others,
                Kind::Detected(Box::new(detector.with_spacing(spacing)?)),
            );
            add(
                "wake model",
                "paper's scenes, drawn by the wake model, with speckle",
                others,
                Kind::Drawn(Box::new(WakeSampler::pretrained(&device)?)),
            );
            let wrong: [(_, _, fn(&mut Scene)); 3] = [
                (
                    "wrong incidence",
                    "paper's scenes, incidence assumed 3 degrees too large",
                    |known| known.radar.incidence += 3.0,
                ),
                (
                    "wrong looks",
                    "paper's scenes, twice the looks assumed",
                    |known| known.radar.looks *= 2,
                ),
                (
                    "wrong hull",
                    "paper's scenes, half the draft and 1.5 times the beam assumed",
                    |known| {
                        for ship in &mut known.ships {
                            ship.draft *= 0.5;
                            ship.beam *= 1.5;
                        }
                    },
                ),
            ];
            for (name, about, change) in wrong {
                add(name, about, others, Kind::Wrong(change));
            }
            // Errors that remain without the search, then also without errors of the mean image, then also without
            // errors of the noise model.
            add(
                "from the truth",
                "paper's scenes, from the true scene instead of a search",
                others,
                Kind::FromTruth,
            );
            add(
                "right mean",
                "the model's mean image of the paper's scenes under a simulated sea, from the true scene",
                others,
                Kind::OpenSeaNoise,
            );
            add(
                "right model",
                "images of the model itself, from the true scene",
                others,
                Kind::OwnLaw,
            );
            add(
                "no ship",
                "paper's scenes without the ship",
                others,
                Kind::Empty,
            );
        }
        if let Some(folder) = &options.real {
            let labels: Vec<_> = real::tiles(folder)?
                .into_iter()
                .flat_map(labelled)
                .collect();
            add(
                "real tiles",
                "clear wakes of real tiles: pixels of 10 m, incidence of 35 degrees, 4 looks assumed, brightness unknown",
                labels.len() as u64,
                Kind::Real(labels),
            );
        }
        Ok(sets)
    }

    /// True for real tiles, whose speeds are unknown.
    pub(super) fn is_real(&self) -> bool {
        matches!(self.kind, Kind::Real(_))
    }

    /// True for the set of sea without ships.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self.kind, Kind::Empty)
    }

    /// An image of the set; `None` if a scene does not have exactly one ship, or if the detector finds nothing.
    pub(super) fn image(&self, index: u64) -> Outcome<Option<ToEstimate>> {
        let truth = match &self.kind {
            Kind::Detector(recipe) => recipe.scene(index)?,
            Kind::Real(labels) => {
                return Ok(labels.get(index as usize).map(|l| real_image(index, l)));
            }
            _ => HeldOut::default().scene(index),
        };
        let [ship] = &truth.ships[..] else {
            return Ok(None);
        };
        let sighting = sighted(ship, &truth, index);
        let image = match &self.kind {
            Kind::Empty => {
                let mut open = truth.clone();
                open.ships.clear();
                simulate(&open)?.speckled
            }
            Kind::Drawn(model) => {
                let view = View {
                    speckle: true,
                    ..View::default()
                };
                let source: &dyn ImageSource = &**model;
                view.draw(source, std::slice::from_ref(&truth), Told::Both)?
                    .swap_remove(0)
            }
            Kind::OpenSeaNoise => over_open_sea(&truth)?,
            Kind::OwnLaw => Likelihood::new(&truth, &Parameter::OF_WAKE)?.draw(index)?,
            _ => simulate(&truth)?.speckled,
        };
        let mut known = known(&truth);
        let sighting = match &self.kind {
            Kind::Detected(detector) => match detected(detector, &image, &truth)? {
                Some(found) => found,
                None => return Ok(None),
            },
            Kind::Wrong(change) => {
                change(&mut known);
                sighting
            }
            _ => sighting,
        };
        Ok(Some(ToEstimate {
            index,
            truth,
            image,
            known,
            sighting,
            priors: Priors::default(),
            from_truth: matches!(
                self.kind,
                Kind::FromTruth | Kind::OpenSeaNoise | Kind::OwnLaw
            ),
        }))
    }
}

/// The estimator's mean image of a scene, times the relative intensity of a simulated sea without the ship.
fn over_open_sea(truth: &Scene) -> Outcome<Field> {
    let mean = |scene: &Scene| ExpectedImage::new(scene, &[])?.intensity(scene);
    let mut open = truth.clone();
    open.ships.clear();
    let mut image = mean(truth)?;
    let (sea, of_sea) = (simulate(&open)?.speckled, mean(&open)?);
    let relative = sea.values.iter().zip(&of_sea.values).map(|(i, m)| i / m);
    for (value, relative) in image.values.iter_mut().zip(relative) {
        *value *= relative;
    }
    Ok(image)
}

/// Input of the estimator: radar, grid, hull and water of a scene, with default wind, and without swell, gusts and
/// slicks.
fn known(truth: &Scene) -> Scene {
    let mut known = truth.clone();
    let Sea {
        fetch,
        depth,
        time,
        temperature,
        salinity,
        spectrum,
        spreading,
        ..
    } = truth.sea;
    known.sea = Sea {
        fetch,
        depth,
        time,
        temperature,
        salinity,
        spectrum,
        spreading,
        ..Sea::default()
    };
    for ship in &mut known.ships {
        ship.turn_rate = 0.0;
    }
    known
}

/// Position and heading of a ship with Gaussian errors.
fn sighted(ship: &Ship, truth: &Scene, index: u64) -> Sighting {
    let right = Sighting::of_ship(truth);
    mistaken(
        right.unwrap_or(Sighting::new(ship.position, ship.heading)),
        index,
    )
}

/// Adds Gaussian errors to a sighting with its own standard deviations, clipped at two of them.
fn mistaken(right: Sighting, index: u64) -> Sighting {
    let mut random = StdRng::seed_from_u64(SEED ^ (index << 20));
    let mut gaussian = || {
        // The sum of twelve uniform numbers has variance 1.
        let sum: f64 = (0..12).map(|_| random.random_range(0.0..1.0)).sum();
        (sum - 6.0).clamp(-2.0, 2.0)
    };
    Sighting {
        place: right.place.map(|at| at + right.place_sd * gaussian()),
        heading: right.heading + right.heading_sd * gaussian(),
        ..right
    }
}

/// The detection with the highest score.
fn detected(detector: &Detector, image: &Field, scene: &Scene) -> Outcome<Option<Sighting>> {
    let grey = GreyScale::filling(image);
    let levels = image.values.iter().map(|&v| grey.level(f64::from(v)));
    let picture = GreyImage::eight_bits(image.rows, image.columns, levels.collect())?;
    let found = detector.find(&picture).into_iter();
    let best = found.max_by(|a, b| a.score.total_cmp(&b.score));
    Ok(best.map(|one| of_wake(&one.wake, scene)))
}

/// Position and heading of the ship of a wake, in the scene of its image.
fn of_wake(wake: &Wake, scene: &Scene) -> Sighting {
    let grid = &scene.grid;
    let [column, row] = wake.tip.map(f64::from);
    let x = (column - (grid.columns / 2) as f64) * grid.spacing;
    let y = ((grid.rows / 2) as f64 - row) * grid.spacing;
    Sighting::new([x, y], f64::from(wake.axis_deg) + 180.0)
}

/// The clear labels of a tile that count.
fn labelled(tile: Tile) -> Vec<(GreyImage, Label)> {
    let labels = tile.clear.labels.iter().filter(|label| label.counts);
    labels
        .map(|label| (tile.image.clone(), label.clone()))
        .collect()
}

/// The part of a tile around a label.
fn real_image(index: u64, (image, label): &(GreyImage, Label)) -> ToEstimate {
    let (spacing, incidence, looks) = ASSUMED;
    let (column, row) = (label.ray.tip[0], label.ray.tip[1]);
    let side = SIDE.min(image.rows()).min(image.columns());
    // The wake lies astern of the tip.
    let (sin, cos) = label.ray.axis_deg.to_radians().sin_cos();
    let first = |middle: f64, count: usize| {
        let start = (middle - 0.5 * side as f64).round().max(0.0);
        (start as usize).min(count - side)
    };
    let top = first(row - 0.25 * side as f64 * cos, image.rows());
    let left = first(column + 0.25 * side as f64 * sin, image.columns());
    let amplitudes = image.window(top, left, side, side);
    let mut truth = Scene::default();
    (truth.grid.rows, truth.grid.columns, truth.grid.spacing) = (side, side, spacing);
    truth.radar.incidence = incidence;
    truth.radar.looks = looks;
    let wake = Wake {
        tip: [column - left as f64, row - top as f64].map(|v| v as f32),
        axis_deg: label.ray.axis_deg as f32,
        half_angle_deg: 0.0,
        length: 0.0,
        snr: 0.0,
        contrast_db: None,
    };
    let sighting = of_wake(&wake, &truth);
    if let Some(ship) = truth.ships.first_mut() {
        (ship.position, ship.heading) = (sighting.place, sighting.heading);
    }
    ToEstimate {
        index,
        known: truth.clone(),
        truth,
        image: Field {
            rows: side,
            columns: side,
            values: amplitudes.iter().map(|a| a * a).collect(),
        },
        sighting: mistaken(sighting, index),
        priors: Priors {
            gain: f64::INFINITY,
            ..Priors::default()
        },
        from_truth: false,
    }
}
