//! Errors, calibration and bounds over many scenes.

use serde::Serialize;
use wake_physics::Scene;
use wake_physics::estimate::{Bound, Fitted, Parameter, Value, Wake};
use wake_physics::measure::{angle_between, axis_between};
use wake_train::evaluation::{Quantity, Reading};

/// One scene and what was read from its image.
pub(crate) struct Case {
    pub(crate) scene: Scene,
    pub(crate) found: Option<Wake>,
    pub(crate) bound: Bound,
    pub(crate) measured: Reading,
    pub(crate) seconds: f64,
}

/// Figures of one value.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    /// Standard deviations of the errors in stated ones: 1.48 times the median absolute pull, and the largest.
    pub(crate) pulls: [f64; 2],
    /// Scenes, those whose bound is below a tenth of the range, and those with an estimate that is identifiable.
    pub(crate) scenes: [usize; 3],
    /// Of the second, how many are identifiable.
    pub(crate) given: usize,
    /// Median and 90th percentile of the errors of the identifiable.
    pub(crate) errors: [f64; 2],
    /// Shares of the identifiable whose truth lies within 1, 2 and 3 deviations.
    pub(crate) within: [f64; 3],
    /// Rank of the truth in the stated distribution, by tenths.
    pub(crate) ranks: [usize; 10],
    /// Median of the squared error over the square of the bound, over that of a normal number, and the mean without the worst
    /// twentieth over 0.76, what it would be for normal numbers.
    pub(crate) over_bound: [f64; 2],
    /// Errors of the middle of the range on all images: median and 90th percentile.
    pub(crate) middle: [f64; 2],
    /// The measurement without error bars on the same images: how many it gives, median and 90th percentile.
    pub(crate) measured: Option<(usize, [f64; 2])>,
}

/// What was read from one image.
#[derive(Debug, Serialize)]
pub(crate) struct Line {
    pub(crate) identifiable: bool,
    pub(crate) consistent: bool,
    pub(crate) seconds: f64,
    /// Truth, estimate, its standard deviation and the bound of each value, in the order of the rows.
    pub(crate) values: Vec<[f64; 4]>,
}

/// Figures of a set of scenes.
#[derive(Debug, Serialize)]
pub(crate) struct Figures {
    pub(crate) cases: Vec<Line>,
    pub(crate) rows: Vec<Row>,
    pub(crate) wakes: usize,
    pub(crate) consistent: usize,
}

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) ranges: Figures,
    /// Scenes without a ship, and how many of them gave a wake.
    pub(crate) empty: [u64; 2],
    /// Largest ln likelihood ratio of a wake in a scene without a ship.
    pub(crate) largest_of_empty: f64,
    /// Median seconds of an estimate.
    pub(crate) seconds: f64,
}

/// A value that is judged.
struct Judged {
    name: &'static str,
    unit: &'static str,
    value: Value,
    /// A tenth of the range of the scenes, and its middle.
    tenth: f64,
    middle: f64,
    of: fn(&Wake) -> Fitted,
    measured: Option<Quantity>,
}

const JUDGED: [Judged; 6] = [
    Judged {
        name: "heading",
        unit: "deg",
        value: Value::Heading,
        tenth: 36.0,
        middle: 180.0,
        of: |found| found.heading,
        measured: Some(Quantity::Heading),
    },
    Judged {
        name: "speed",
        unit: "m/s",
        value: Value::Speed,
        tenth: 0.6,
        middle: 9.0,
        of: |found| found.speed,
        measured: Some(Quantity::Speed),
    },
    Judged {
        name: "midship, range",
        unit: "m",
        value: Value::X,
        tenth: 8.0,
        middle: 0.0,
        of: |found| found.position[0],
        measured: None,
    },
    Judged {
        name: "midship, azimuth",
        unit: "m",
        value: Value::Y,
        tenth: 8.0,
        middle: 0.0,
        of: |found| found.position[1],
        measured: None,
    },
    Judged {
        name: "wind speed",
        unit: "m/s",
        value: Value::WindSpeed,
        tenth: 0.4,
        middle: 5.0,
        of: |found| found.wind_speed,
        measured: Some(Quantity::WindSpeed),
    },
    Judged {
        name: "wind direction",
        unit: "deg",
        value: Value::WindToward,
        tenth: 36.0,
        middle: 180.0,
        of: |found| found.wind_toward,
        measured: Some(Quantity::WindDirection),
    },
];

impl Figures {
    pub(crate) fn of(cases: &[Case]) -> Self {
        let found = || cases.iter().filter_map(|case| case.found.as_ref());
        Self {
            cases: cases.iter().map(line).collect(),
            rows: JUDGED.iter().map(|judged| row(judged, cases)).collect(),
            wakes: found().count(),
            consistent: found().filter(|f| f.goodness_of_fit.consistent).count(),
        }
    }
}

fn line(case: &Case) -> Line {
    let found = case.found.as_ref();
    let value = |judged: &Judged| {
        let fitted = found.map(judged.of);
        [
            judged.value.of(&case.scene),
            fitted.map_or(f64::NAN, |f| f.value),
            fitted.map_or(f64::NAN, |f| f.deviation),
            case.bound.of(Parameter::Value(judged.value)),
        ]
    };
    Line {
        identifiable: found.is_some_and(|f| f.identifiable),
        consistent: found.is_some_and(|f| f.goodness_of_fit.consistent),
        seconds: case.seconds,
        values: JUDGED.iter().map(value).collect(),
    }
}

fn row(judged: &Judged, cases: &[Case]) -> Row {
    let angle = matches!(judged.value, Value::Heading | Value::WindToward);
    let error = |value: f64, scene: &Scene| match (judged.value.of(scene), angle) {
        (truth, true) => angle_between(value, truth),
        (truth, false) => value - truth,
    };
    let limit = |case: &Case| case.bound.of(Parameter::Value(judged.value));
    let told = |case: &&Case| limit(case) < judged.tenth;
    // A wind with another mode of the opposite direction is not given.
    let single = |found: &&Wake| {
        judged.value != Value::WindToward || found.alternatives.iter().all(|a| a.weight < 0.1)
    };
    let identified = |case: &Case| {
        let found = case
            .found
            .as_ref()
            .filter(|f| f.identifiable)
            .filter(single);
        found.map(|f| (judged.of)(f))
    };
    let given: Vec<(&Case, Fitted)> = cases
        .iter()
        .filter_map(|case| Some((case, identified(case)?)))
        .collect();
    let mut errors: Vec<f64> = given
        .iter()
        .map(|(c, f)| error(f.value, &c.scene).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    let pulls: Vec<f64> = given
        .iter()
        .map(|(c, f)| error(f.value, &c.scene) / f.deviation)
        .collect();
    let mut ranks = [0; 10];
    for pull in &pulls {
        ranks[((10.0 * normal(*pull)) as usize).min(9)] += 1;
    }
    let telling = || given.iter().filter(|(case, _)| told(case));
    let mut squares: Vec<f64> = telling()
        .map(|(c, f)| (error(f.value, &c.scene) / limit(c)).powi(2))
        .collect();
    squares.sort_by(f64::total_cmp);
    let kept = squares.len() - squares.len() / 20;
    let mean = squares[..kept].iter().sum::<f64>() / kept.max(1) as f64;
    Row {
        name: judged.name,
        unit: judged.unit,
        scenes: [cases.len(), cases.iter().filter(told).count(), given.len()],
        given: telling().count(),
        errors: [quantile(&errors, 0.5), quantile(&errors, 0.9)],
        pulls: {
            let mut sizes: Vec<f64> = pulls.iter().map(|p| p.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            [1.4826 * quantile(&sizes, 0.5), quantile(&sizes, 1.0)]
        },
        within: [1.0, 2.0, 3.0].map(|k| share(&pulls, |p| p.abs() < k)),
        ranks,
        over_bound: [quantile(&squares, 0.5) / 0.4549, mean / 0.7584],
        middle: middle(judged, cases, &error),
        measured: judged.measured.map(|quantity| measured(quantity, cases)),
    }
}

/// Errors of the middle of the range: the simplest answer.
fn middle(judged: &Judged, cases: &[Case], error: impl Fn(f64, &Scene) -> f64) -> [f64; 2] {
    let errors = cases.iter().map(|c| error(judged.middle, &c.scene).abs());
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_by(f64::total_cmp);
    [quantile(&errors, 0.5), quantile(&errors, 0.9)]
}

/// How many images the measurement reads, and its errors; of a wind the axis.
fn measured(quantity: Quantity, cases: &[Case]) -> (usize, [f64; 2]) {
    let error = |case: &Case| {
        let value = case.measured.values[quantity as usize].measurable_value()?;
        let truth = quantity.truth(&case.scene)?;
        Some(match quantity {
            Quantity::Heading => angle_between(value, truth).abs(),
            Quantity::WindDirection => axis_between(value, truth).abs(),
            _ => (value - truth).abs(),
        })
    };
    let mut errors: Vec<f64> = cases.iter().filter_map(error).collect();
    errors.sort_by(f64::total_cmp);
    (
        errors.len(),
        [quantile(&errors, 0.5), quantile(&errors, 0.9)],
    )
}

fn share(values: &[f64], inside: impl Fn(&f64) -> bool) -> f64 {
    values.iter().filter(|v| inside(v)).count() as f64 / values.len().max(1) as f64
}

/// Of sorted values; NaN of none.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted
        .get((part * last).round() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}

/// Distribution of a normal number, by Abramowitz and Stegun 26.2.17: to 1e-7.
fn normal(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series = [
        0.319_381_53,
        -0.356_563_782,
        1.781_477_937,
        -1.821_255_978,
        1.330_274_429,
    ];
    let polynomial = series.iter().rev().fold(0.0, |sum, c| (sum + c) * t);
    let tail = polynomial * (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    if x > 0.0 { 1.0 - tail } else { tail }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_that_of_tables() {
        for (x, p) in [
            (0.0, 0.5),
            (1.0, 0.841_345),
            (-1.96, 0.024_998),
            (3.0, 0.998_650),
        ] {
            assert!((normal(x) - p).abs() < 1e-6, "{x}");
        }
    }
}
