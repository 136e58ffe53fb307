//! Estimated cost of a simulation.

use super::work::{Advice, Work};
use std::fmt;

/// Core time \[s\] above which the user should be warned: chosen.
const HIGH: f64 = 1.0;

/// Estimated cost of a simulation by the fast methods; its text gives advice on what to change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Rows and columns computed, margins included.
    pub computed: [usize; 2],
    /// Computed pixels per pixel of the image.
    pub for_each: f64,
    /// Core time \[s\], within a factor of three above a tenth of a second.
    pub core_seconds: f64,
    /// Upper bound on memory \[bytes\]; at least a third of it is used above 64 MiB.
    pub bytes: u64,
    /// Advice for the costliest part.
    pub(super) advice: Advice,
}

impl Cost {
    /// Cost for an image inside a larger raster of computed pixels.
    pub(super) fn new(computed: [usize; 2], image_pixels: usize, work: &Work) -> Self {
        let pixels = computed[0] as f64 * computed[1] as f64;
        let (core_seconds, advice) = work.seconds();
        Self {
            computed,
            for_each: pixels / image_pixels.max(1) as f64,
            core_seconds,
            bytes: work.bytes().0,
            advice,
        }
    }

    /// Whether the user should be warned before the simulation begins.
    #[must_use]
    pub fn is_high(&self) -> bool {
        self.core_seconds > HIGH
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [rows, columns] = self.computed;
        write!(
            f,
            "{rows} x {columns} pixels are computed, {:.1} per pixel of the image: about {:.0} core-seconds and up to {:.1} GiB; {}",
            self.for_each,
            self.core_seconds,
            self.bytes as f64 / (1u64 << 30) as f64,
            self.advice.text()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use crate::plan::Plan;

    fn cost(assignments: &[&str]) -> Cost {
        let scene = Scene::default().with_assignments(assignments).unwrap();
        Plan::new(&scene).unwrap().cost()
    }

    /// A line of 97 pixels of 0.1 m, displaced by up to kilometres, is computed on all pixels that may reach it.
    #[test]
    fn a_thin_image_that_needs_a_wide_sea_says_so() {
        let thin = ["grid.rows=1", "grid.columns=97", "grid.spacing=0.1"];
        let of = |range_to_velocity: &str| cost(&[&thin[..], &[range_to_velocity]].concat());
        let [near, far] = ["radar.range_to_velocity=10", "radar.range_to_velocity=200"].map(of);
        assert!(!near.is_high() && far.is_high(), "{near:?} {far:?}");
        let [rows, columns] = far.computed;
        assert!((far.for_each - (rows * columns) as f64 / 97.0).abs() < 1e-6);
        let text = far.to_string();
        for word in ["radar.range_to_velocity", "core-seconds", &rows.to_string()] {
            assert!(text.contains(word), "{text}");
        }
        assert!(!cost(&[]).is_high());
    }

    /// Pixels finer than the image's are counted.
    #[test]
    fn oversampling_costs_its_square() {
        let sensor = "radar.sensor=\"sentinel-1-iw\"";
        let [two, four] =
            ["grid.oversampling=2", "grid.oversampling=4"].map(|over| cost(&[sensor, over]));
        // The margins are rounded up to whole pixels, a hundredth of the rows.
        let ratio = four.for_each / two.for_each;
        assert!((3.9..4.1).contains(&ratio), "{ratio}");
    }
}
