//! Simulated images, searched by several finders.

use std::time::Instant;

use rayon::prelude::*;
use wake_dataset::Source;
use wake_physics::Scene;

use crate::detector::{FOUND, Sample};
use crate::error::Result;
use wake_detector::Finder;
use wake_detector::GreyImage;
use wake_detector::score::{Judged, Label, Ray};
use wake_detector::{Detection, Wake};

/// Images searched at a time.
const AT_ONCE: u64 = 16;

/// Label of a wake in a square image of `size` pixels a side.
///
/// It counts if the wake is strong enough ([`FOUND`]) and begins inside; the direction of a wake that begins outside is
/// ambiguous.
#[must_use]
pub fn known(wake: &Wake, size: usize) -> Label {
    let inside = wake
        .tip
        .iter()
        .all(|x| (-0.5..size as f32 - 0.5).contains(x));
    Label {
        ray: Ray::from(wake),
        length: f64::from(wake.length),
        counts: wake.snr >= FOUND && inside,
        ambiguous: !inside,
    }
}

/// Searched images with their detections.
#[derive(Debug, Clone, Default)]
pub struct Searched {
    /// For each finder the images with its detections, all in the same order.
    pub judged: Vec<Vec<Judged>>,
    /// The wakes of each image, as many as it has labels.
    pub wakes: Vec<Vec<Wake>>,
    /// The scene of each image.
    pub scenes: Vec<Scene>,
    /// Seconds per image of the first finder alone.
    pub seconds: f64,
}

impl Searched {
    /// Searches the first `count` images of a source, all of them square.
    ///
    /// - `done`: called with each image, its wakes and the detections of each finder, in order
    ///
    /// # Errors
    ///
    /// As [`Source::items`].
    pub fn of(
        source: &dyn Source,
        count: u64,
        finders: &[&dyn Finder],
        mut done: impl FnMut(&GreyImage, &[Wake], &[Vec<Detection>]),
    ) -> Result<Self> {
        let mut searched = Self {
            judged: vec![Vec::new(); finders.len()],
            ..Self::default()
        };
        for first in (0..count).step_by(AT_ONCE as usize) {
            let pairs = source.items(first..count.min(first + AT_ONCE))?;
            let samples: Vec<Sample> = pairs.iter().map(Sample::of_pair).collect();
            let images: Vec<GreyImage> = samples.iter().map(Sample::image).collect();
            if first == 0 {
                searched.seconds = seconds(finders, &images);
            }
            let find = |image: &GreyImage| -> Vec<Vec<Detection>> {
                let all = finders.par_iter().map(|finder| finder.find(image));
                all.collect()
            };
            let found: Vec<Vec<Vec<Detection>>> = images.par_iter().map(find).collect();
            for ((image, sample), found) in images.iter().zip(samples).zip(found) {
                done(image, &sample.wakes, &found);
                searched.push(sample, &found);
            }
            let scenes = pairs.into_iter().map(|pair| pair.scene);
            searched.scenes.extend(scenes);
        }
        Ok(searched)
    }

    fn push(&mut self, sample: Sample, found: &[Vec<Detection>]) {
        let image = Judged {
            columns: sample.size as f64,
            rows: sample.size as f64,
            labels: sample.wakes.iter().map(|w| known(w, sample.size)).collect(),
            found: Vec::new(),
        };
        for (found, judged) in found.iter().zip(&mut self.judged) {
            judged.push(image.with_found(found));
        }
        self.wakes.push(sample.wakes);
    }

    /// The images of one finder with all but the clear wakes ignored.
    ///
    /// - `contrast_db`: contrast above which a wake is clear \[dB\]
    ///
    /// # Panics
    ///
    /// When there is no such finder.
    #[must_use]
    pub fn clear(&self, finder: usize, contrast_db: f64) -> Vec<Judged> {
        let mut images = self.judged[finder].clone();
        for (image, wakes) in images.iter_mut().zip(&self.wakes) {
            for (label, wake) in image.labels.iter_mut().zip(wakes) {
                label.counts &= wake
                    .contrast_db
                    .is_some_and(|db| f64::from(db) > contrast_db);
            }
        }
        images
    }
}

/// Time of the first finder per image \[s\].
fn seconds(finders: &[&dyn Finder], images: &[GreyImage]) -> f64 {
    let begin = Instant::now();
    for image in images {
        finders.first().map(|finder| finder.find(image));
    }
    begin.elapsed().as_secs_f64() / images.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wake(tip: f32, snr: f32, contrast_db: Option<f32>) -> Wake {
        Wake {
            tip: [tip, 10.0],
            axis_deg: 90.0,
            half_angle_deg: 5.0,
            length: 100.0,
            snr,
            contrast_db,
        }
    }

    /// The centre of the last pixel is half a pixel from the border.
    #[test]
    fn wakes_count_that_are_seen_and_begin_inside() {
        let told = |tip, snr| {
            let label = known(&wake(tip, snr, None), 64);
            (label.counts, label.ambiguous)
        };
        assert_eq!(told(63.4, FOUND), (true, false));
        assert_eq!(told(63.6, FOUND), (false, true));
        assert_eq!(told(-0.4, 0.9 * FOUND), (false, false));
    }

    #[test]
    fn faint_wakes_and_those_of_unknown_contrast_are_ignored() {
        let wakes = [Some(1.5), Some(0.5), None].map(|db| wake(10.0, FOUND, db));
        let image = Judged {
            labels: wakes.iter().map(|w| known(w, 64)).collect(),
            ..Judged::default()
        };
        let searched = Searched {
            judged: vec![vec![image]],
            wakes: vec![wakes.to_vec()],
            ..Searched::default()
        };
        let counts = |label: &Label| label.counts;
        assert!(searched.judged[0][0].labels.iter().all(counts));
        let clear = &searched.clear(0, 1.0)[0];
        let clear: Vec<bool> = clear.labels.iter().map(counts).collect();
        assert_eq!(clear, [true, false, false]);
    }
}
