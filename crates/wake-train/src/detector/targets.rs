//! Target maps of the network, and its loss.

use burn::tensor::activation::{log_sigmoid, sigmoid};
use burn::tensor::{Device, Tensor, TensorData};

use super::sample::Sample;
use wake_detector::Wake;
use wake_detector::network::{ANGLE_UNIT, INPUTS, LENGTH_UNIT, Map, STRIDE};
use wake_detector::normalize;

/// Least signal-to-noise ratio of wakes that count; weaker ones are ignored, whether detected or missed.
pub const FOUND: f32 = 5.5;
/// Wakes up to this signal-to-noise ratio are invisible and count as sea.
const UNSEEN: f32 = 2.0;
/// Standard deviation of the hill around a tip \[cells\].
const HILL: f32 = 2.0;
/// Half the width of a line \[cells\].
const LINE: f32 = 1.3;
/// Distance from a weak wake within which nothing is learnt \[cells\].
const AROUND: f32 = 4.0;

/// Channels of the targets.
const HEAT: usize = 0;
const PEAK: usize = 1;
const ON_LINE: usize = 2;
/// Four directions, length and half-angle, as the network gives them.
const VALUES: usize = 3;
/// Weights of these values on lines and at tips.
const LINE_WEIGHT: usize = 9;
const TIP_WEIGHT: usize = 10;
/// Masks of the cells whose tips, and lines, enter the loss.
const TIP_JUDGED: usize = 11;
const LINE_JUDGED: usize = 12;
const CHANNELS: usize = 13;

/// The targets of one image, `[CHANNELS, cells, cells]`.
fn targets(sample: &Sample) -> Vec<f32> {
    let cells = sample.size / STRIDE;
    let area = cells * cells;
    let mut maps = vec![0.0; CHANNELS * area];
    maps[TIP_JUDGED * area..].fill(1.0);
    // Stronger wakes are drawn over weaker ones.
    let mut wakes: Vec<&Wake> = sample.wakes.iter().filter(|w| w.snr > UNSEEN).collect();
    wakes.sort_by(|a, b| a.snr.total_cmp(&b.snr));
    for wake in wakes {
        draw(&mut maps, cells, wake);
    }
    maps
}

fn draw(maps: &mut [f32], cells: usize, wake: &Wake) {
    let area = cells * cells;
    // Centres of cells lie 1½ pixels from their first pixel.
    let centre = 0.5 * (STRIDE as f32 - 1.0);
    let tip = wake.tip.map(|x| (x - centre) / STRIDE as f32);
    let length = wake.length / STRIDE as f32;
    let [right, down] = wake.direction();
    let inside = |x: f32| (0.0..cells as f32 - 0.5).contains(&x.round());
    let (found, tip_inside) = (wake.snr >= FOUND, tip.iter().all(|&x| inside(x)));
    let values = [
        [right, down, right, down],
        [
            (wake.length / LENGTH_UNIT).ln(),
            wake.half_angle_deg / ANGLE_UNIT,
            0.0,
            0.0,
        ],
    ];
    for (i, (row, column)) in (0..cells)
        .flat_map(|r| (0..cells).map(move |c| (r, c)))
        .enumerate()
    {
        let (x, y) = (column as f32 - tip[0], row as f32 - tip[1]);
        let along = x * right + y * down;
        let beyond = along - along.clamp(0.0, length);
        let from_line = (y * right - x * down).hypot(beyond);
        let from_tip = x.hypot(y);
        let mut put = |channel: usize, value: f32| maps[channel * area + i] = value;
        if !found {
            if from_line < AROUND {
                put(LINE_JUDGED, 0.0);
            }
            if from_line < 2.0 * AROUND {
                put(TIP_JUDGED, 0.0);
            }
            continue;
        }
        if from_line < LINE {
            put(ON_LINE, 1.0);
            put(LINE_JUDGED, 1.0);
        }
        if from_line < 2.0 * LINE {
            put(LINE_WEIGHT, 1.0);
            put(VALUES, values[0][0]);
            put(VALUES + 1, values[0][1]);
        }
        if !tip_inside {
            // The point where the line enters the image may or may not count as its tip.
            if from_line < 2.0 * AROUND {
                put(TIP_JUDGED, 0.0);
            }
            continue;
        }
        let heat = (-0.5 * (from_tip / HILL).powi(2)).exp();
        if heat > 0.3 {
            put(TIP_WEIGHT, heat);
            put(TIP_JUDGED, 1.0);
            put(VALUES + 2, values[0][2]);
            put(VALUES + 3, values[0][3]);
            put(VALUES + 4, values[1][0]);
            put(VALUES + 5, values[1][1]);
        }
        let before = maps[HEAT * area + i];
        maps[HEAT * area + i] = before.max(heat);
    }
    if found && tip_inside {
        let at = tip[1].round() as usize * cells + tip[0].round() as usize;
        maps[PEAK * area + at] = 1.0;
        maps[TIP_JUDGED * area + at] = 1.0;
    }
}

/// A batch of network inputs and their target maps.
pub(crate) struct Batch {
    /// `[batch, INPUTS, size, size]`
    pub(crate) images: Tensor<4>,
    /// `[batch, CHANNELS, cells, cells]`
    targets: Tensor<4>,
}

impl Batch {
    /// Joins prepared images and their targets; all have one size.
    pub(crate) fn new(samples: &[Prepared], device: &Device) -> Self {
        let (count, size) = (samples.len(), samples.first().map_or(0, |s| s.size));
        let cells = size / STRIDE;
        let tensor = |numbers: Vec<f32>, shape: [usize; 4]| {
            Tensor::from_data(TensorData::new(numbers, shape), device)
        };
        let joined =
            |part: fn(&Prepared) -> &[f32]| samples.iter().flat_map(part).copied().collect();
        Self {
            images: tensor(joined(|s| &s.inputs), [count, INPUTS, size, size]),
            targets: tensor(joined(|s| &s.targets), [count, CHANNELS, cells, cells]),
        }
    }

    /// The loss of some maps, and its parts: tips, lines, directions, extents.
    ///
    /// ```text
    /// tips    −Σ [peak (1 − p)² ln p + (1 − heat)⁴ p² ln(1 − p)] / wakes
    /// lines   cross-entropy, the mean off lines plus a fifth of the mean on them, + 1 − 2 Σ p t / Σ (p² + t²)
    /// others  mean squared difference where there is a wake
    /// ```
    ///
    /// # References
    ///
    /// Law & Deng (2018), `CornerNet`, Eq. 1 (tips); Milletari, Navab & Ahmadi (2016), `V-Net` (lines).
    pub(crate) fn loss(&self, maps: Tensor<4>) -> (Tensor<1>, [Tensor<1>; 4]) {
        let target = |channel: usize, count: usize| self.targets.clone().narrow(1, channel, count);
        let map = |map: Map, count: usize| maps.clone().narrow(1, map as usize, count);
        let rest = |x: Tensor<4>| -x + 1.0;
        let tips = {
            let (x, heat, peak) = (map(Map::Tip, 1), target(HEAT, 1), target(PEAK, 1));
            let p = sigmoid(x.clone());
            let hit = peak.clone() * rest(p.clone()).square() * log_sigmoid(x.clone());
            let far = rest(heat).square().square() * rest(peak.clone()) * target(TIP_JUDGED, 1);
            let miss = far * p.square() * log_sigmoid(-x);
            -(hit + miss).sum() / (peak.sum() + 1.0)
        };
        let lines = {
            let (x, line, judged) = (
                map(Map::Line, 1),
                target(ON_LINE, 1),
                target(LINE_JUDGED, 1),
            );
            let p = sigmoid(x.clone()) * judged.clone();
            let (on, off) = (line.clone(), rest(line) * judged);
            let cross = (on.clone() * log_sigmoid(x.clone())).sum() / (on.clone().sum() + 64.0)
                * 0.2
                + (off.clone() * log_sigmoid(-x)).sum() / (off.sum() + 64.0);
            let common = (p.clone() * on.clone()).sum() * 2.0 + 16.0;
            -cross + 1.0 - common / (p.square().sum() + on.sum() + 16.0)
        };
        let squared = |map: Tensor<4>, target: Tensor<4>, weight: Tensor<4>| {
            let sum = weight.clone().sum() + 1.0;
            ((map - target).square() * weight).sum() / sum
        };
        let directions = squared(
            map(Map::LineRight, 2),
            target(VALUES, 2),
            target(LINE_WEIGHT, 1),
        ) + squared(
            map(Map::TipRight, 2),
            target(VALUES + 2, 2),
            target(TIP_WEIGHT, 1),
        );
        let extents = squared(
            map(Map::Length, 2),
            target(VALUES + 4, 2),
            target(TIP_WEIGHT, 1),
        );
        let total = tips.clone() + lines.clone() * 2.0 + directions.clone() + extents.clone() * 0.2;
        (total, [tips, lines, directions, extents])
    }
}

/// A normalised image and its targets.
#[derive(Debug)]
pub(crate) struct Prepared {
    size: usize,
    inputs: Vec<f32>,
    targets: Vec<f32>,
}

impl Prepared {
    pub(crate) fn new(sample: &Sample) -> Self {
        let contrast = normalize::contrast(&sample.pixels, sample.size, sample.size);
        let seen: Vec<[f32; INPUTS]> = contrast.into_iter().map(normalize::inputs).collect();
        let inputs = (0..INPUTS)
            .flat_map(|k| seen.iter().map(move |x| x[k]))
            .collect();
        Self {
            size: sample.size,
            inputs,
            targets: targets(sample),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_detector::network::OUTPUTS;

    fn sample(wakes: Vec<Wake>) -> Sample {
        let size = 128;
        Sample {
            size,
            pixels: vec![0.0; size * size],
            wakes,
        }
    }

    fn wake(snr: f32) -> Wake {
        Wake {
            tip: [41.5, 65.5],
            axis_deg: 90.0,
            half_angle_deg: 5.0,
            length: 60.0,
            snr,
            contrast_db: None,
        }
    }

    /// Maps equal to the targets, with logits of ±12.
    fn perfect(batch: &Batch) -> Tensor<4> {
        let target = |channel: usize, count: usize| batch.targets.clone().narrow(1, channel, count);
        let logit = |x: Tensor<4>| x * 24.0 - 12.0;
        Tensor::cat(
            vec![
                logit(target(PEAK, 1)),
                logit(target(ON_LINE, 1)),
                target(VALUES, 6),
            ],
            1,
        )
    }

    #[test]
    fn the_tip_lies_in_its_cell_and_the_line_runs_along_the_ray() {
        let maps = targets(&sample(vec![wake(20.0)]));
        let at =
            |channel: usize, row: usize, column: usize| maps[(channel * 32 + row) * 32 + column];
        // (41.5 − 1.5)/4 = 10, (65.5 − 1.5)/4 = 16.
        assert!(at(PEAK, 16, 10) > 0.5 && at(HEAT, 16, 10) > 0.999);
        assert!(
            at(ON_LINE, 16, 24) > 0.5 && at(ON_LINE, 16, 28) < 0.5 && at(ON_LINE, 19, 15) < 0.5
        );
        assert!((at(VALUES, 16, 15) - 1.0).abs() < 1e-6 && at(VALUES + 1, 16, 15).abs() < 1e-6);
        // Around a weak wake nothing is learnt.
        let weak = targets(&sample(vec![wake(4.0)]));
        let at =
            |channel: usize, row: usize, column: usize| weak[(channel * 32 + row) * 32 + column];
        assert!(
            at(PEAK, 16, 10) < 0.5 && at(TIP_JUDGED, 16, 10) < 0.5 && at(LINE_JUDGED, 16, 20) < 0.5
        );
        assert!(at(TIP_JUDGED, 2, 2) > 0.5);
    }

    /// Perfect maps have next to no loss; a wrong direction, a missed tip and a false tip each cost.
    #[test]
    fn the_loss_is_least_for_the_targets() {
        let device = Device::flex();
        let batch = Batch::new(&[Prepared::new(&sample(vec![wake(20.0)]))], &device);
        let loss = |maps: Tensor<4>| batch.loss(maps).0.into_scalar::<f32>();
        let perfect = perfect(&batch);
        let least = loss(perfect.clone());
        assert!(least < 0.01, "{least}");
        assert_eq!(perfect.dims()[1], OUTPUTS);
        for (channel, row, column, value) in [
            (0, 16, 10, -12.0),
            (0, 3, 3, 12.0),
            (2, 16, 15, -1.0),
            (1, 16, 15, -12.0),
        ] {
            let index = [0..1, channel..channel + 1, row..row + 1, column..column + 1];
            let changed = perfect
                .clone()
                .slice_assign(index, Tensor::full([1, 1, 1, 1], value, &device));
            assert!(loss(changed) > least + 1e-3, "{channel}");
        }
    }
}
