//! Painted images: a dark line, a bright streak beside it, a blob, correlated noise. No physics at all.

use super::draw::Draw;
use super::hidden::{HIDES, free_share};
use super::kind::Kind;
use super::sample::{Sample, pixel_snr};
use super::sea::{Echoes, Speckle, border, clutter, mottle, quick_look};
use rayon::prelude::*;
use std::ops::Range;
use wake_dataset::{Grey, Pair, Source};
use wake_detector::{Wake, direction};
use wake_physics::Scene;
use wake_physics::labels::{LabelledShip, Labels, ShipLabel, Visibility, WakeLabel};

/// Images painted from a seed.
#[derive(Debug, Clone, Copy)]
pub struct Painted {
    /// Seed of all images.
    pub seed: u64,
    /// Rows and columns.
    pub size: usize,
}

impl Source for Painted {
    fn size(&self) -> [usize; 2] {
        [self.size, self.size]
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let pair = |index| {
            let Sample { pixels, wakes, .. } = self.sample(index);
            let levels: Vec<u8> = pixels.iter().map(|&p| p as u8).collect();
            let mut scene = Scene {
                ships: Vec::new(),
                seed: index,
                ..Scene::default()
            };
            (scene.grid.rows, scene.grid.columns) = (self.size, self.size);
            Pair {
                index,
                image: Grey::of_levels(&levels, self.size, self.size),
                prompt: String::new(),
                scene,
                labels: Labels {
                    ships: wakes.iter().map(|wake| label(wake, self.size)).collect(),
                    ..Labels::default()
                },
                amplitudes: None,
            }
        };
        Ok(positions.into_par_iter().map(pair).collect())
    }
}

/// The label of a wake without a ship.
pub(super) fn label(wake: &Wake, size: usize) -> LabelledShip {
    let corners = wake.oriented_box().map(|corner| corner.map(f64::from));
    let inside = wake
        .tip
        .iter()
        .all(|x| (0.0..size as f32 - 1.0).contains(x));
    let [low, high] = [f64::min, f64::max].map(|pick: fn(f64, f64) -> f64| {
        [0, 1].map(|a| {
            corners
                .iter()
                .map(|c| c[a])
                .reduce(pick)
                .unwrap_or_default()
        })
    });
    LabelledShip {
        ship: ShipLabel::default(),
        wake: WakeLabel {
            tip_px: inside.then(|| wake.tip.map(f64::from)),
            axis_deg: Some(f64::from(wake.axis_deg)),
            half_angle_deg: Some(f64::from(wake.half_angle_deg)),
            length_px: f64::from(wake.length),
            visibility: Some(Visibility {
                contrast_db: 0.0,
                snr: pixel_snr(wake.snr, wake.length),
            }),
            box_px: Some([low[0], low[1], high[0] - low[0], high[1] - low[1]]),
            oriented_box_px: Some(corners),
            ..WakeLabel::default()
        },
    }
}

impl Painted {
    /// Image number `index`, always the same one.
    #[must_use]
    pub fn sample(&self, index: u64) -> Sample {
        self.sample_and_kinds(index).0
    }

    /// Kinds of the wakes of image number `index`, in the order of [`Sample::wakes`].
    #[must_use]
    pub fn kinds(&self, index: u64) -> Vec<Kind> {
        self.sample_and_kinds(index).1
    }

    fn sample_and_kinds(&self, index: u64) -> (Sample, Vec<Kind>) {
        let draw = &mut Draw::new(self.seed, index);
        let size = self.size;
        let speckle = Speckle::draw(draw);
        let mut mean = vec![1.0; size * size];
        mottle(&mut mean, size, draw);
        border(&mut mean, size, draw);
        let echoes = Echoes::draw(draw);
        let mut bright = vec![0.0; size * size];
        let (mut wakes, mut kinds) = (Vec::new(), Vec::new());
        // Ships of one image often have similar headings.
        let common = draw.between(0.0, 360.0);
        for _ in 0..draw.one_of(&[0.22, 0.45, 0.2, 0.13]) {
            let axis_deg = match draw.chance(0.3) {
                true => common + draw.between(-8.0, 8.0) + 180.0 * draw.one_of(&[0.7, 0.3]) as f32,
                false => draw.between(0.0, 360.0),
            };
            let (wake, kind) = wake(&mut mean, size, &speckle, axis_deg.rem_euclid(360.0), draw);
            if draw.chance(0.88) {
                let shift = echoes.shift(draw);
                echoes.add(&mut bright, size, [wake.tip, shift], wake.axis_deg, draw);
            }
            wakes.push(wake);
            kinds.push(kind);
        }
        let mut over = vec![0.0; size * size];
        clutter(&mut over, size, &echoes, draw);
        for wake in &mut wakes {
            hide(wake, size, &over);
        }
        speckle.apply(&mut mean, size, draw);
        for ((m, bright), over) in mean.iter_mut().zip(bright).zip(over) {
            *m += bright + over;
        }
        let pixels = quick_look(mean, draw);
        let sample = Sample {
            size,
            pixels,
            wakes,
        };
        (sample, kinds)
    }
}

/// A line along a wake.
#[derive(Clone, Copy)]
struct Line {
    /// Contrast at its beginning, relative to the mean.
    contrast: f32,
    /// Distance over which it falls to a third \[pixels\].
    fade: f32,
    /// Standard deviation of the profile at its beginning \[pixels\].
    width: f32,
    /// Distance from the axis at the beginning \[pixels\], and its growth along the wake.
    beside: f32,
    opening: f32,
}

impl Line {
    fn at(&self, along: f32, across: f32) -> f32 {
        // A turbulent wake widens with the fifth root of the distance.
        let wider = (1.0 + along / 20.0).powf(0.2);
        let off = (across - self.beside * wider - self.opening * along) / (self.width * wider);
        match off.abs() < 3.5 {
            true => self.contrast * (-0.5 * off * off - 1.1 * along / self.fade).exp(),
            false => 0.0,
        }
    }
}

/// The lines of a wake, contrasts relative to the dark line, the tangent of half their opening angle, and their kind.
fn lines(length: f32, draw: &mut Draw) -> (Vec<Line>, f32, Kind) {
    let zoom = draw.scale(0.7, 1.6);
    let side = draw.sign();
    let dark = Line {
        contrast: -1.0,
        fade: length,
        width: zoom * draw.scale(1.3, 6.0),
        beside: 0.0,
        opening: 0.0,
    };
    let opening = match draw.chance(0.5) {
        true => side * draw.between(0.0, 8f32.to_radians()),
        false => 0.0,
    };
    let bright = Line {
        contrast: draw.scale(0.4, 1.8),
        fade: length * draw.scale(0.4, 1.3),
        width: dark.width * draw.scale(0.5, 1.5),
        beside: side * 1.8 * dark.width,
        opening,
    };
    // A bright line is the axis itself where there is no dark one, or only a fainter one at its side.
    let axis = Line {
        beside: 0.0,
        opening: 0.0,
        ..bright
    };
    let kind = Kind::ALL[draw.one_of(&Kind::SHARES)];
    let mut lines = match kind {
        Kind::DarkBesideBright => vec![dark, bright],
        Kind::Dark => vec![dark],
        Kind::Bright => vec![axis],
        Kind::BrightBesideDark => vec![
            Line {
                contrast: -axis.contrast * draw.between(0.2, 0.7),
                beside: side * 1.8 * axis.width,
                ..dark
            },
            axis,
        ],
        Kind::Arms => {
            let opening = draw.between(2.0, 16.0).to_radians();
            let arm = |side: f32| Line {
                beside: 0.0,
                opening: side * opening,
                ..bright
            };
            vec![arm(-1.0), arm(1.0)]
        }
    };
    let mut half_angle = lines.iter().map(|l| l.opening.abs()).fold(0.0, f32::max);
    // Arms are fainter than a bright axis, so that the image shows which line is the axis.
    let strength = match kind {
        Kind::DarkBesideBright | Kind::Dark => 1.0,
        Kind::Bright | Kind::BrightBesideDark => 0.5 * axis.contrast,
        Kind::Arms => 0.0,
    };
    for side in [-1.0, 1.0] {
        if strength > 0.0 && draw.chance(0.25) {
            let opening = draw.between(10.0, 20.0).to_radians().tan();
            let sign = if draw.chance(0.75) { 0.8 } else { -0.5 };
            lines.push(Line {
                contrast: strength * sign * draw.scale(0.5, 1.5),
                fade: length * draw.scale(0.4, 1.2),
                width: zoom * draw.scale(1.2, 4.0),
                beside: 0.0,
                opening: side * opening,
            });
            half_angle = half_angle.max(opening);
        }
    }
    (lines, half_angle, kind)
}

/// Draws a tip, most often in the image, whose wake is at least partly visible.
fn place(mean: &[f32], size: usize, axis_deg: f32, length: f32, draw: &mut Draw) -> [f32; 2] {
    let s = size as f32;
    let margin = if draw.chance(0.1) { 0.15 } else { 0.0 };
    let [right, down] = direction(axis_deg);
    let seen = |x: f32, y: f32| {
        let inside = (0.0..s).contains(&x) && (0.0..s).contains(&y);
        inside && mean[y as usize * size + x as usize] > 0.0
    };
    let mut tip = [0.0; 2];
    for _ in 0..12 {
        tip = [0, 1].map(|_| draw.between(-margin, 1.0 + margin) * s);
        let far = length.min(80.0);
        if (margin > 0.0 || seen(tip[0], tip[1])) && seen(tip[0] + far * right, tip[1] + far * down)
        {
            break;
        }
    }
    tip
}

/// Multiplies a mean by a wake and returns the wake and its kind.
fn wake(
    mean: &mut [f32],
    size: usize,
    speckle: &Speckle,
    axis_deg: f32,
    draw: &mut Draw,
) -> (Wake, Kind) {
    let length = draw.scale(35.0, 500.0);
    let (lines, half_angle, kind) = lines(length, draw);
    let tip = place(mean, size, axis_deg, length, draw);
    let bend = match draw.chance(0.3) {
        true => draw.normal() * 12.0 / (length * length),
        false => 0.0,
    };
    let gap = match draw.chance(0.3) {
        true => draw.between(0.0, 30.0),
        false => 0.0,
    };
    let rough = draw.between(0.0, 0.6);
    let texture: Vec<f32> = (0..64).map(|_| (rough * draw.normal()).exp()).collect();
    let [right, down] = direction(axis_deg);
    // Pixels that the wake changes: index, distance along the wake, and change.
    let mut changes: Vec<(usize, f32, f32)> = Vec::new();
    for (i, m) in mean.iter().enumerate() {
        let (x, y) = ((i % size) as f32 - tip[0], (i / size) as f32 - tip[1]);
        let along = x * right + y * down;
        if *m <= 0.0 || !(0.0..2.5 * length).contains(&along) {
            continue;
        }
        let across = y * right - x * down - bend * along * along;
        // No line of a wake lies further from its axis.
        if across.abs() > 40.0 + 0.4 * along {
            continue;
        }
        let knot = along / 12.0;
        let [a, b] = [0, 1].map(|k| texture[(knot as usize + k) % 64]);
        let grain = a + (b - a) * knot.fract();
        let begin = ((along - gap + 4.0) / 8.0).clamp(0.0, 1.0);
        let change: f32 = lines.iter().map(|line| line.at(along, across)).sum();
        changes.push((i, along, begin * grain * change));
    }
    // The strength gives the drawn signal-to-noise ratio, up to the largest contrast.
    let power = changes.iter().map(|c| c.2 * c.2).sum::<f32>() / speckle.correlated_pixels();
    let peak = changes.iter().map(|c| c.2.abs()).fold(0.0, f32::max);
    let strength = (draw.scale(3.5, 35.0) / power.sqrt()).min(MOST / peak);
    let strength = if strength.is_finite() {
        strength * speckle.spread
    } else {
        0.0
    };
    let (mut power, mut reach) = (0.0, 0.0f32);
    for (i, along, change) in changes {
        let change = (strength * change).max(-0.8);
        mean[i] *= 1.0 + change;
        let z = change / speckle.spread;
        power += z * z;
        if z.abs() > VISIBLE {
            reach = reach.max(along);
        }
    }
    let wake = Wake {
        tip,
        axis_deg,
        half_angle_deg: half_angle.atan().to_degrees(),
        length: reach.max(20.0),
        snr: (power / speckle.correlated_pixels()).sqrt(),
        contrast_db: None,
    };
    (wake, kind)
}

/// Lowers a wake's signal-to-noise ratio by the part of its line under clutter.
fn hide(wake: &mut Wake, size: usize, clutter: &[f32]) {
    let ends = [0.0, wake.length].map(|along| wake.at(along).map(f64::from));
    let free = free_share(ends, size, |i| clutter[i] > HIDES);
    wake.snr *= free.sqrt() as f32;
}

/// The largest contrast \[standard deviations of a pixel\].
const MOST: f32 = 4.0;
/// Least visible contrast \[standard deviations of a pixel\].
const VISIBLE: f32 = 0.3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_follows_from_seed_and_number() {
        let source = Painted { seed: 5, size: 96 };
        assert_eq!(source.sample(3), source.sample(3));
        assert_ne!(source.sample(3).pixels, source.sample(4).pixels);
        assert_ne!(
            source.sample(3).pixels,
            Painted { seed: 6, size: 96 }.sample(3).pixels
        );
    }

    /// A painted image keeps its wakes as a pair of the source.
    #[test]
    fn pairs_keep_the_wakes() {
        let source = Painted { seed: 5, size: 96 };
        for index in 0..20 {
            let (sample, pair) = (
                source.sample(index),
                &source.items(index..index + 1).expect("a pair")[0],
            );
            let again = Sample::of_pair(pair);
            assert_eq!(again.pixels, sample.pixels);
            assert_eq!(again.wakes.len(), sample.wakes.len());
            for (a, b) in again.wakes.iter().zip(&sample.wakes) {
                // Corners, directions and roots in single precision, of numbers up to some hundred.
                let apart = (a.tip[0] - b.tip[0]).hypot(a.tip[1] - b.tip[1]);
                assert!(
                    apart < 1e-3 && (a.axis_deg - b.axis_deg).abs() < 1e-3,
                    "{a:?} {b:?}"
                );
                assert!(
                    (a.length - b.length).abs() < 1e-3 && (a.snr - b.snr).abs() <= 1e-4 * a.snr
                );
            }
        }
    }

    /// The line lies where the label says: pixels along the ray are darker or brighter than those beside it, as the kind says.
    #[test]
    fn a_line_of_its_kind_lies_on_the_ray() {
        let (size, speckle) = (
            256,
            Speckle {
                spread: 0.2,
                filter: [0.0; 2],
            },
        );
        let (mut found, mut wrong) = (0, 0);
        for index in 0..60 {
            let mut mean = vec![1.0; size * size];
            let draw = &mut Draw::new(1, index);
            let axis_deg = 37.0 * index as f32 % 360.0;
            let (wake, kind) = wake(&mut mean, size, &speckle, axis_deg, draw);
            let grey = |along: f32, across: f32| {
                let ([x, y], [right, down]) = (wake.at(along), wake.direction());
                let (x, y) = ((x - across * down).round(), (y + across * right).round());
                let inside = |v: f32| (0.0..size as f32).contains(&v);
                (inside(x) && inside(y)).then(|| mean[y as usize * size + x as usize])
            };
            let mean_of = |across: f32| {
                let greys: Vec<f32> = (20..60).filter_map(|a| grey(a as f32, across)).collect();
                greys.iter().sum::<f32>() / greys.len() as f32
            };
            let (on, beside) = (mean_of(0.0), mean_of(60.0));
            assert!((beside - 1.0).abs() < 1e-6 || beside.is_nan());
            let dark = match kind {
                Kind::DarkBesideBright | Kind::Dark => true,
                Kind::Bright | Kind::BrightBesideDark => false,
                Kind::Arms => continue,
            };
            found += usize::from((on - 1.0).abs() > 0.02);
            wrong += usize::from((on - 1.0).abs() > 0.02 && (on < 1.0) != dark);
        }
        // All but wakes outside the frame and the weakest; arms may cover a line.
        assert!(found > 36 && wrong <= 2, "{found} of 60, {wrong} wrong");
    }

    /// The brightest line of a bright kind is its axis; two arms have no third one.
    #[test]
    fn arms_are_fainter_than_a_bright_axis() {
        let mut arms = 0;
        for index in 0..200 {
            let (lines, _, kind) = lines(100.0, &mut Draw::new(1, index));
            let strongest = |open: bool| {
                let of = |line: &&Line| (line.opening.abs() > 0.17) == open;
                let contrasts = lines.iter().filter(of).map(|line| line.contrast.abs());
                contrasts.fold(0.0, f32::max)
            };
            match kind {
                Kind::Bright | Kind::BrightBesideDark => {
                    assert!(strongest(true) < 0.61 * strongest(false));
                    arms += usize::from(strongest(true) > 0.0);
                }
                Kind::Arms => assert_eq!(lines.len(), 2),
                Kind::DarkBesideBright | Kind::Dark => {}
            }
        }
        assert!(arms > 10, "{arms}");
    }

    /// Land over three quarters of a line leaves half its signal-to-noise ratio.
    #[test]
    fn a_wake_under_land_is_weaker() {
        let size = 96;
        let land: Vec<f32> = (0..size * size)
            .map(|i| if i % size < 70 { 2.0 } else { 0.1 })
            .collect();
        let mut wake = Wake {
            tip: [90.0, 40.0],
            axis_deg: 270.0,
            half_angle_deg: 0.0,
            length: 80.0,
            snr: 12.0,
            contrast_db: None,
        };
        hide(&mut wake, size, &land);
        // One of 64 places more or less.
        assert!((wake.snr - 6.0).abs() < 0.2, "{}", wake.snr);
    }

    /// Bright clutter over a whole line leaves no signal. (Lines in the border have none either, and are black.)
    #[test]
    fn a_covered_wake_has_no_signal() {
        let size = 96;
        let source = Painted { seed: 5, size };
        let mut covered = 0;
        for index in 0..200 {
            let sample = source.sample(index);
            let mut levels = sample.pixels.clone();
            levels.sort_by(f32::total_cmp);
            for wake in sample.wakes.iter().filter(|wake| wake.snr < 1e-6) {
                let along = (0..64).map(|k| wake.at(wake.length * k as f32 / 64.0));
                let inside = |at: &[f32; 2]| at.iter().all(|x| (0.0..95.5).contains(x));
                let line: Vec<f32> = along
                    .filter(inside)
                    .map(|[x, y]| sample.pixels[y.round() as usize * size + x.round() as usize])
                    .collect();
                let mean = line.iter().sum::<f32>() / line.len() as f32;
                covered += usize::from(mean > levels[levels.len() / 2]);
            }
        }
        assert!(covered > 0);
    }

    /// The shipped network finds its confident detections again in the image turned by a quarter, on average with the same score.
    /// A single score may differ where both ends of a line could be its tip, or be 0 beside filaments.
    #[test]
    fn a_quarter_turn_turns_what_is_found() {
        let model = wake_detector::Detector::pretrained(&burn::tensor::Device::flex())
            .and_then(|model| model.with_least_score(0.1))
            .expect("weights of the repository");
        let source = Painted {
            seed: 77,
            size: 384,
        };
        let (mut sure, mut kept, mut scores) = (0, 0.0, 0.0);
        for index in 0..60 {
            let image =
                wake_detector::GreyImage::from_levels(384, 384, &source.sample(index).pixels);
            let (upright, turned) = (model.find(&image), model.find(&image.turned()));
            for one in upright.iter().filter(|one| one.score > 0.3) {
                let [x, y] = one.wake.tip;
                let again = turned.iter().find(|other| {
                    let turn = (other.wake.axis_deg - one.wake.axis_deg - 90.0 + 180.0)
                        .rem_euclid(360.0)
                        - 180.0;
                    // (column, row) goes to (383 − row, column); the network's maps turn only nearly, so the ray rule applies.
                    let apart = (other.wake.tip[0] - 383.0 + y).hypot(other.wake.tip[1] - x);
                    turn.abs() < 10.0 && apart < 60.0
                });
                kept += again.map_or(0.0, |again| again.score);
                scores += one.score;
                sure += 1;
            }
        }
        assert!(sure >= 20, "{sure} wakes");
        // Scores scatter by a sixth of themselves, the mean of twenty by a twenty-fifth, and selection by a threshold favours
        // scores that are high by chance upright: a tenth.
        assert!(kept > 0.9 * scores, "{kept} of {scores}");
    }
}
