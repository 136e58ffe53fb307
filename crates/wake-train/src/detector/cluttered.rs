//! Simulated images under painted clutter that the simulator does not model: land, islets, piers, streaks, ships at rest,
//! fronts, filaments, borders.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use wake_dataset::{Grey, Pair, Source};
use wake_physics::labels::WakeLabel;
use wake_physics::measure::median;

use super::draw::Draw;
use super::hidden::{HIDES, free_share};
use super::sea::{Echoes, border, clutter, filaments, front};

/// Share of images with a front.
const FRONTS: f32 = 0.12;
/// Share of images with filaments.
const FILAMENTS: f32 = 0.15;
/// Separates the random numbers of the clutter from other draws of the same seed.
const STREAM: u64 = 0xC1_77E5;

/// Simulated images under painted clutter, which is another at every position, also where an image repeats.
#[derive(Debug)]
pub(crate) struct Cluttered {
    simulated: Arc<dyn Source>,
    seed: u64,
}

impl Cluttered {
    pub(crate) fn new(simulated: Arc<dyn Source>, seed: u64) -> Self {
        Self { simulated, seed }
    }

    /// Paints the clutter of a position over an image.
    fn painted_over(&self, mut pair: Pair, position: u64) -> Pair {
        let draw = &mut Draw::new(self.seed ^ STREAM, position);
        let size = pair.image.rows;
        let mut mean = vec![1.0; size * size];
        if draw.chance(FRONTS) {
            front(&mut mean, size, draw);
        }
        if draw.chance(FILAMENTS) {
            filaments(&mut mean, size, draw);
        }
        border(&mut mean, size, draw);
        let mut bright = vec![0.0; size * size];
        clutter(&mut bright, size, &Echoes::draw(draw), draw);
        let level = median(&pair.image.pixels);
        let levels: Vec<u8> = (pair.image.pixels.iter().zip(&mean).zip(&bright))
            .map(|((grey, factor), bright)| match *factor {
                0.0 => 0,
                factor => (255.0 * (grey * factor + level * bright)).round() as u8,
            })
            .collect();
        pair.image = Grey::of_levels(&levels, size, size);
        let hidden = |i: usize| mean[i] == 0.0 || bright[i] > HIDES;
        for ship in &mut pair.labels.ships {
            hide(&mut ship.wake, size, hidden);
        }
        pair
    }
}

/// Lowers a wake's signal-to-noise ratio by the hidden part of its line, as of a matched filter on the rest.
fn hide(wake: &mut WakeLabel, size: usize, hidden: impl Fn(usize) -> bool) {
    let (Some(visibility), Some([a, b, c, d])) = (&mut wake.visibility, wake.oriented_box_px)
    else {
        return;
    };
    let [from, to] = [[a, b], [c, d]].map(|[p, q]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
    visibility.snr *= free_share([from, to], size, hidden).sqrt();
}

impl Source for Cluttered {
    fn size(&self) -> [usize; 2] {
        self.simulated.size()
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let pairs = self.simulated.items(positions.clone())?;
        let places: Vec<(Pair, u64)> = pairs.into_iter().zip(positions).collect();
        let over = |(pair, position)| self.painted_over(pair, position);
        Ok(places.into_par_iter().map(over).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Repeated;
    use crate::detector::clear::Clear;
    use wake_dataset::{Recipe, Simulated};
    use wake_physics::labels::Visibility;

    fn source() -> Cluttered {
        let changes = ["scene.grid.rows = 96", "scene.grid.columns = 96"];
        let recipe = Recipe::detector().and_then(|recipe| recipe.with_assignments(&changes));
        let simulated = Simulated::new(recipe.expect("a recipe"), 5).expect("a source");
        Cluttered::new(Arc::new(Clear::new(simulated)), 5)
    }

    /// Images depend on their positions alone; where nothing is painted the simulated grey stays.
    #[test]
    fn clutter_lies_over_simulated_images() {
        let source = source();
        let pairs = source.items(0..6).expect("pairs");
        assert_eq!(source.items(4..6).expect("pairs"), pairs[4..]);
        let mut kept = 0;
        let simulated = source.simulated.items(0..6).expect("pairs");
        for (pair, below) in pairs.iter().zip(&simulated) {
            let same = |(a, b): (&f32, &f32)| (a - b).abs() < 0.5 / 255.0;
            let pixels = pair.image.pixels.iter().zip(&below.image.pixels);
            kept += pixels.filter(|&pixel| same(pixel)).count();
        }
        let all = 6 * 96 * 96;
        assert!(kept > all / 4 && kept < all, "{kept} of {all}");
    }

    /// An image that repeats lies under other clutter, with the same wakes.
    #[test]
    fn repeated_images_have_new_clutter() {
        let repeated = Repeated::new(source().simulated, 2);
        let pairs = Cluttered::new(Arc::new(repeated), 5)
            .items(0..4)
            .expect("pairs");
        for (first, again) in pairs[..2].iter().zip(&pairs[2..]) {
            assert_eq!(first.scene, again.scene);
            assert!(first.image != again.image);
        }
    }

    /// A wake with three quarters of its line under land keeps half its signal-to-noise ratio, a free wake all of it.
    #[test]
    fn hidden_wakes_are_weaker() {
        let label = || WakeLabel {
            visibility: Some(Visibility {
                contrast_db: 1.0,
                snr: 2.0,
            }),
            oriented_box_px: Some([[0.0, 10.0], [0.0, 20.0], [80.0, 20.0], [80.0, 10.0]]),
            ..WakeLabel::default()
        };
        for (from, expected) in [(20, 1.0), (200, 2.0), (0, 0.0)] {
            let mut wake = label();
            hide(&mut wake, 96, |i| i % 96 >= from);
            let snr = wake.visibility.expect("it stays").snr;
            // One of 64 places more or less.
            assert!((snr - expected).abs() < 0.04, "{snr} {expected}");
        }
    }
}
