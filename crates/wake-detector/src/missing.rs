//! Windows with missing pixels: land, and areas beyond the swath.

use crate::wake::Wake;

/// Windows with a smaller share of valid pixels are not searched.
const LEAST: f32 = 0.02;
/// Share of missing pixels on a wake's line from which it is dropped.
const MOST_OF_LINE: f32 = 0.5;
/// Distance from the tip to each side within which no pixel may be missing, because edges of missing areas resemble wakes.
const AROUND: i64 = 12;

/// Mask of a window's missing pixels; empty if there are none.
#[derive(Debug)]
pub(crate) struct Missing {
    columns: usize,
    missing: Vec<bool>,
}

/// Replaces missing pixels by the median of the others, an area without contrast.
///
/// `None` for a window with almost no valid pixels.
pub(crate) fn filled(pixels: &mut [f32], columns: usize) -> Option<Missing> {
    if !pixels.is_empty() && pixels.iter().all(|x| x.is_finite()) {
        return Some(Missing {
            columns,
            missing: Vec::new(),
        });
    }
    let missing: Vec<bool> = pixels.iter().map(|x| !x.is_finite()).collect();
    let mut there: Vec<f32> = pixels.iter().copied().filter(|x| x.is_finite()).collect();
    if there.is_empty() || (there.len() as f32) < LEAST * pixels.len() as f32 {
        return None;
    }
    let middle = there.len() / 2;
    let median = *there.select_nth_unstable_by(middle, f32::total_cmp).1;
    for (pixel, missing) in pixels.iter_mut().zip(&missing) {
        if *missing {
            *pixel = median;
        }
    }
    Some(Missing { columns, missing })
}

impl Missing {
    /// Whether pixels are valid around the tip of a wake and along most of its line.
    ///
    /// - `wake`: in pixels of the window
    pub(crate) fn leaves(&self, wake: &Wake) -> bool {
        if self.missing.is_empty() {
            return true;
        }
        let rows = (self.missing.len() / self.columns) as i64;
        let is_missing = |x: i64, y: i64| {
            let inside = (0..rows).contains(&y) && (0..self.columns as i64).contains(&x);
            !inside || self.missing[y as usize * self.columns + x as usize]
        };
        let [x, y] = wake.tip.map(|x| x.round() as i64);
        let mut around =
            (-AROUND..=AROUND).flat_map(|dy| (-AROUND..=AROUND).map(move |dx| (dx, dy)));
        if around.any(|(dx, dy)| is_missing(x + dx, y + dy)) {
            return false;
        }
        let steps = wake.length.max(1.0) as i32;
        let gone = (0..steps).filter(|&step| {
            let [x, y] = wake.at(step as f32).map(|x| x.round() as i64);
            is_missing(x, y)
        });
        (gone.count() as f32) < MOST_OF_LINE * steps as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_has_no_contrast_and_no_wakes() {
        let (rows, columns) = (60, 80);
        let value = |i: usize| {
            if i % columns < 30 {
                f32::NAN
            } else {
                (i % 7) as f32
            }
        };
        let mut pixels: Vec<f32> = (0..rows * columns).map(value).collect();
        let missing = filled(&mut pixels, columns).expect("most is there");
        assert!(pixels.iter().all(|x| x.is_finite()));
        assert!((pixels[5] - 3.0).abs() < 1e-6, "{}", pixels[5]);
        let wake = |x: f32, axis_deg: f32| Wake {
            tip: [x, 30.0],
            axis_deg,
            half_angle_deg: 0.0,
            length: 25.0,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        assert!(missing.leaves(&wake(50.0, 0.0)));
        assert!(!missing.leaves(&wake(35.0, 0.0)), "at the coast");
        assert!(!missing.leaves(&wake(10.0, 90.0)), "on land");
        let mut nothing = vec![f32::NAN; 100];
        nothing[3] = 1.0;
        assert!(filled(&mut nothing, 10).is_none());
        let mut all = vec![1.0; 100];
        assert!(
            filled(&mut all, 10)
                .expect("all is there")
                .leaves(&wake(3.0, 0.0))
        );
    }
}
