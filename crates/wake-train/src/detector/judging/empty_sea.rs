//! False alarms on sea without ships.

use serde::Serialize;
use wake_detector::Detection;
use wake_physics::Scene;

/// Searched sea without ships.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct EmptySea {
    /// Number of images.
    pub images: usize,
    /// Their area \[km²\].
    pub area: f64,
    /// Detections in them.
    pub false_alarms: usize,
}

impl EmptySea {
    /// Counts the detections of at least `least_score` in the images for which `counts` is true.
    #[must_use]
    pub fn count(
        scenes: &[Scene],
        found: &[Vec<Detection>],
        least_score: f32,
        counts: impl Fn(&Scene) -> bool,
    ) -> Self {
        let mut sea = Self::default();
        for (scene, found) in scenes.iter().zip(found).filter(|(scene, _)| counts(scene)) {
            sea.images += 1;
            sea.area += area(scene);
            sea.false_alarms += found.iter().filter(|one| one.score >= least_score).count();
        }
        sea
    }

    /// False alarms per 1,000 km².
    #[must_use]
    pub fn rate(&self) -> f64 {
        1e3 * self.false_alarms as f64 / self.area
    }

    /// Upper end of the one-sided 95 % interval of the rate, for independent false alarms.
    ///
    /// ```text
    /// Σ_{k ≤ n} e^{−μ} μᵏ/k! = 0.05,    rate = 1000 μ/area
    /// ```
    #[must_use]
    pub fn most(&self) -> f64 {
        let (mut low, mut high) = (0.0, 10.0 + 3.0 * self.false_alarms as f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match poisson_below(self.false_alarms, middle) > 0.05 {
                true => low = middle,
                false => high = middle,
            }
        }
        1e3 * high / self.area
    }
}

/// Probability of no more than `count` events where `mean` are expected.
fn poisson_below(count: usize, mean: f64) -> f64 {
    let mut term = (-mean).exp();
    let mut sum = term;
    for k in 1..=count {
        term *= mean / k as f64;
        sum += term;
    }
    sum
}

/// Area of the image of a scene \[km²\].
fn area(scene: &Scene) -> f64 {
    let grid = &scene.grid;
    (grid.rows * grid.columns) as f64 * grid.spacing * grid.spacing * 1e-6
}

/// Smallest threshold, at least `least`, at which sea without ships has no more than `rate` false alarms per 1,000 km².
#[must_use]
pub fn score_for(scenes: &[Scene], found: &[Vec<Detection>], rate: f64, least: f32) -> f32 {
    let area: f64 = scenes.iter().map(area).sum();
    let allowed = (rate * area * 1e-3).floor() as usize;
    let mut scores: Vec<f32> = found.iter().flatten().map(|one| one.score).collect();
    scores.sort_by(|a, b| b.total_cmp(a));
    // Just above the first score that is one too many.
    scores
        .get(allowed)
        .map_or(least, |score| score.next_up())
        .max(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_detector::Wake;

    fn sea(scores: &[&[f32]]) -> (Vec<Scene>, Vec<Vec<Detection>>) {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (1000, 1000, 10.0);
        let wake = Wake {
            tip: [0.0; 2],
            axis_deg: 0.0,
            half_angle_deg: 0.0,
            length: 9.0,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        let found = |scores: &&[f32]| scores.iter().map(|&s| Detection::new(s, wake)).collect();
        (
            vec![scene; scores.len()],
            scores.iter().map(found).collect(),
        )
    }

    /// Images of 100 km²: four detections on 400 km² are ten per 1,000 km².
    #[test]
    fn rates_are_per_thousand_square_kilometres() {
        let (scenes, found) = sea(&[&[0.4, 0.1], &[], &[0.2], &[0.3]]);
        let all = EmptySea::count(&scenes, &found, 0.0, |_| true);
        assert!((all.rate() - 10.0).abs() < 1e-9 && (all.area - 400.0).abs() < 1e-9);
        assert_eq!(
            EmptySea::count(&scenes, &found, 0.25, |_| true).false_alarms,
            2
        );
        // 5 per 1,000 km² are two on 400: the threshold lies above the third score.
        let sure = score_for(&scenes, &found, 5.0, 0.0);
        assert!(sure > 0.2 && sure < 0.21, "{sure}");
        assert!((score_for(&scenes, &found, 5.0, 0.35) - 0.35).abs() < 1e-9);
        assert!(score_for(&scenes, &found, 100.0, 0.0).abs() < 1e-9);
    }

    /// Published bounds of a Poisson mean (Garwood 1936), one-sided 95 %: 3.00 for no event, 4.74 for one, 16.96 for ten.
    #[test]
    fn bounds_of_rates_are_those_of_the_tables() {
        for (count, bound) in [(0, 2.996), (1, 4.744), (10, 16.962)] {
            let sea = EmptySea {
                images: 1,
                area: 1000.0,
                false_alarms: count,
            };
            assert!((sea.most() - bound).abs() < 1e-3, "{count}: {}", sea.most());
        }
    }
}
