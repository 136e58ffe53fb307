//! Outcomes of detections: wakes or false alarms, in the right direction or reversed.

use rayon::prelude::*;
use wake_dataset::{Pair, Source};
use wake_detector::score::{Judged, Rule, verdicts};
use wake_detector::{Detection, Detector, GreyImage};
use wake_physics::Scene;
use wake_physics::measure::angle_between;

use super::simulated::known;
use crate::detector::Sample;
use crate::error::Result;

/// A detection and its outcome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionOutcome {
    /// Number of the image.
    pub image: usize,
    /// The detection.
    pub detection: Detection,
    /// Whether it is a wake by the ray rule, in either direction; a second detection of the same wake is not.
    pub wake: bool,
    /// Whether its direction is right; `None` for false alarms and for wakes whose direction is unknown.
    pub direction: Option<bool>,
}

/// Images with known wakes, and their detections.
#[derive(Debug, Clone, Default)]
pub struct KnownImages {
    /// The wakes of each image.
    pub judged: Vec<Judged>,
    /// The detections in each image.
    pub found: Vec<Vec<Detection>>,
    /// The scene of each image.
    pub scenes: Vec<Scene>,
}

/// Images searched at a time.
const AT_ONCE: u64 = 16;

/// Pixel spacing given to the detector \[m\]; `None`: unknown.
pub type Spacing<'a> = dyn Fn(&Scene) -> Option<f32> + Sync + 'a;

impl KnownImages {
    /// Searches the first `count` images of a source, all of them square, once for each spacing.
    ///
    /// - `done`: called with the number of images after each batch
    ///
    /// # Errors
    ///
    /// As [`Source::items`]; a spacing that the detector refuses.
    pub fn search(
        source: &dyn Source,
        count: u64,
        detector: &Detector,
        spacings: &[&Spacing<'_>],
        mut done: impl FnMut(u64),
    ) -> Result<Vec<Self>> {
        let mut all = vec![Self::default(); spacings.len()];
        for first in (0..count).step_by(AT_ONCE as usize) {
            let pairs = source.items(first..count.min(first + AT_ONCE))?;
            let find = |pair: &Pair| -> Result<Vec<Vec<Detection>>> {
                let image = Sample::of_pair(pair).image();
                let spacings = spacings.iter().map(|spacing| spacing(&pair.scene));
                spacings
                    .map(|metres| found(detector, &image, metres))
                    .collect()
            };
            let found: Vec<_> = pairs.par_iter().map(find).collect::<Result<_>>()?;
            done(found.len() as u64);
            for (pair, found) in pairs.iter().zip(found) {
                let judged = judged(&Sample::of_pair(pair));
                for (images, found) in all.iter_mut().zip(found) {
                    images.judged.push(judged.clone());
                    images.found.push(found);
                    images.scenes.push(pair.scene.clone());
                }
            }
        }
        Ok(all)
    }

    /// Outcomes of the detections of all images; those that fit an ignored label best are left out.
    #[must_use]
    pub fn outcomes(&self) -> Vec<DetectionOutcome> {
        outcomes(&self.judged, &self.found)
    }

    /// The images with the detections in them, for curves.
    #[must_use]
    pub fn with_found(&self) -> Vec<Judged> {
        let images = self.judged.iter().zip(&self.found);
        images
            .map(|(image, found)| image.with_found(found))
            .collect()
    }
}

fn found(detector: &Detector, image: &GreyImage, spacing: Option<f32>) -> Result<Vec<Detection>> {
    Ok(match spacing {
        Some(metres) => detector.clone().with_spacing(metres)?.find(image),
        None => detector.find(image),
    })
}

fn judged(sample: &Sample) -> Judged {
    let size = sample.size;
    Judged {
        columns: size as f64,
        rows: size as f64,
        labels: sample.wakes.iter().map(|wake| known(wake, size)).collect(),
        found: Vec::new(),
    }
}

/// Outcomes of the detections of some images; those that fit an ignored label best are left out.
#[must_use]
pub fn outcomes(images: &[Judged], found: &[Vec<Detection>]) -> Vec<DetectionOutcome> {
    let either_way = |(image, found): (&Judged, &Vec<Detection>)| {
        let mut image = image.with_found(found);
        image
            .labels
            .iter_mut()
            .for_each(|label| label.ambiguous = true);
        image
    };
    let judged: Vec<Judged> = images.iter().zip(found).map(either_way).collect();
    let verdicts = verdicts(&judged, Rule::Ray).into_iter();
    let outcome = verdicts.map(|verdict| {
        let detection = found[verdict.image][verdict.detection];
        let label = verdict
            .label
            .map(|label| &images[verdict.image].labels[label]);
        let turn = label
            .filter(|label| !label.ambiguous)
            .map(|label| angle_between(f64::from(detection.wake.axis_deg), label.ray.axis_deg));
        DetectionOutcome {
            image: verdict.image,
            detection,
            wake: label.is_some(),
            direction: turn.map(|turn| turn.abs() < 90.0),
        }
    });
    outcome.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_detector::Wake;

    fn wake(tip: [f32; 2], axis_deg: f32) -> Wake {
        Wake {
            tip,
            axis_deg,
            half_angle_deg: 3.0,
            length: 100.0,
            snr: f32::INFINITY,
            contrast_db: None,
        }
    }

    /// A wake found, a wake found in reverse, a second detection of the first wake, and a false alarm.
    #[test]
    fn reversed_wakes_are_wakes_of_the_wrong_direction() {
        let labels = [wake([100.0, 100.0], 90.0), wake([300.0, 300.0], 0.0)];
        let image = Judged {
            columns: 512.0,
            rows: 512.0,
            labels: labels.iter().map(|wake| known(wake, 512)).collect(),
            found: Vec::new(),
        };
        let found = vec![
            Detection::new(0.9, wake([104.0, 99.0], 91.0)),
            Detection::new(0.8, wake([300.0, 200.0], 180.0)),
            Detection::new(0.7, wake([110.0, 100.0], 88.0)),
            Detection::new(0.6, wake([400.0, 50.0], 45.0)),
        ];
        let outcomes = outcomes(&[image], &[found]);
        let told: Vec<_> = outcomes
            .iter()
            .map(|one| (one.wake, one.direction))
            .collect();
        let expected = [
            (true, Some(true)),
            (true, Some(false)),
            (false, None),
            (false, None),
        ];
        assert_eq!(told, expected);
    }
}
