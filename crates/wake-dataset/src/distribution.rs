//! Distributions of single values of a scene.

use crate::error::{Error, Result};
use serde::Serialize;

/// A value of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Value {
    Flag(bool),
    Number(f64),
    Word(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Word(word) => write!(f, "\"{word}\""),
        }
    }
}

/// Distribution of one value.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Distribution {
    /// A constant.
    Fixed(Value),
    /// `[low, high]`: uniform between two numbers; for whole numbers, each from `low` to `high` is equally likely.
    Even([f64; 2]),
    /// `{ log = [low, high] }`: uniform in the logarithm.
    Logarithmic { log: [f64; 2] },
    /// `{ one_of = [...], weights = [...] }`: one of several distributions, equally likely without weights.
    OneOf {
        one_of: Vec<Self>,
        #[serde(skip_serializing_if = "Option::is_none")]
        weights: Option<Vec<f64>>,
    },
}

impl Distribution {
    /// Whether a TOML table is a distribution, not a table of further keys.
    pub(super) fn is(table: &toml::Table) -> bool {
        table.contains_key("log") || table.contains_key("one_of")
    }

    /// Reads the distribution of the value `name`.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the name, the value and what is allowed.
    pub(super) fn parse(name: &str, value: &toml::Value) -> Result<Self> {
        match value {
            toml::Value::Boolean(flag) => Ok(Self::Fixed(Value::Flag(*flag))),
            toml::Value::String(word) => Ok(Self::Fixed(Value::Word(word.clone()))),
            toml::Value::Integer(number) => Ok(Self::Fixed(Value::Number(*number as f64))),
            toml::Value::Float(number) if number.is_finite() => {
                Ok(Self::Fixed(Value::Number(*number)))
            }
            // JSON, the format of the manifest, has no such numbers.
            toml::Value::Float(_) => Err(refused(
                name,
                value,
                "a finite number, or \"infinite\" for sea.depth",
            )),
            toml::Value::Array(_) => range(name, value).map(Self::Even),
            toml::Value::Table(table) if table.len() == 1 && table.contains_key("log") => {
                let log = range(name, &table["log"])?;
                match log[0] > 0.0 {
                    true => Ok(Self::Logarithmic { log }),
                    false => Err(refused(
                        name,
                        value,
                        "two positive numbers, the lower first",
                    )),
                }
            }
            toml::Value::Table(table) => Self::one_of(name, value, table),
            toml::Value::Datetime(_) => Err(refused(name, value, EXPECTED)),
        }
    }

    fn one_of(name: &str, value: &toml::Value, table: &toml::Table) -> Result<Self> {
        let Some(toml::Value::Array(choices)) = table.get("one_of") else {
            return Err(refused(name, value, EXPECTED));
        };
        if choices.is_empty() || table.keys().any(|key| key != "one_of" && key != "weights") {
            return Err(refused(name, value, EXPECTED));
        }
        let one_of = choices.iter().map(|choice| Self::parse(name, choice));
        let one_of: Vec<Self> = one_of.collect::<Result<_>>()?;
        let weights = table.get("weights").map(|given| {
            let numbers = numbers(given).filter(|w| w.len() == one_of.len() && are_weights(w));
            let expected = "a weight of 0 or more for each choice, not all 0";
            numbers.ok_or_else(|| refused(name, value, expected))
        });
        Ok(Self::OneOf {
            weights: weights.transpose()?,
            one_of,
        })
    }

    /// Value at a quantile 0…1 of the distribution.
    ///
    /// - `whole`: whether the value is a whole number
    pub(super) fn at(&self, place: f64, whole: bool) -> Value {
        match self {
            Self::Fixed(value) => value.clone(),
            Self::Even([low, high]) if whole => {
                let number = low + (place * (high - low + 1.0)).floor();
                Value::Number(number.min(*high))
            }
            Self::Even([low, high]) => Value::Number(low + (high - low) * place),
            Self::Logarithmic { log: [low, high] } => {
                let number = (low.ln() + (high / low).ln() * place)
                    .exp()
                    .clamp(*low, *high);
                Value::Number(if whole { number.round() } else { number })
            }
            Self::OneOf { one_of, weights } => {
                let weight = |i: usize| weights.as_ref().map_or(1.0, |w| w[i]);
                let (chosen, place) = choose(one_of.len(), weight, place);
                one_of[chosen].at(place, whole)
            }
        }
    }

    /// All ends of ranges, and all choices.
    pub(super) fn extremes(&self) -> Vec<Value> {
        match self {
            Self::Fixed(value) => vec![value.clone()],
            Self::Even(range) | Self::Logarithmic { log: range } => {
                range.map(Value::Number).to_vec()
            }
            Self::OneOf { one_of, .. } => one_of.iter().flat_map(Self::extremes).collect(),
        }
    }
}

/// Index of the weighted interval, of `count`, that holds a place 0…1, and the place within it.
pub(super) fn choose(count: usize, weight: impl Fn(usize) -> f64, place: f64) -> (usize, f64) {
    let all: f64 = (0..count).map(&weight).sum();
    let mut left = place * all;
    // Rounding may pass the end: the last interval with a weight takes the rest.
    let last = (0..count).rfind(|&i| weight(i) > 0.0).unwrap_or(0);
    for i in 0..count {
        if left < weight(i) || i == last {
            return (i, (left / weight(i)).clamp(0.0, 1.0));
        }
        left -= weight(i);
    }
    (last, 1.0)
}

const EXPECTED: &str =
    "a value, [low, high], { log = [low, high] }, or { one_of = [...], weights = [...] }";

fn are_weights(weights: &[f64]) -> bool {
    let good = |w: &f64| w.is_finite() && *w >= 0.0;
    weights.iter().all(good) && weights.iter().any(|&w| w > 0.0)
}

fn numbers(value: &toml::Value) -> Option<Vec<f64>> {
    let number = |value: &toml::Value| match value {
        toml::Value::Integer(number) => Some(*number as f64),
        toml::Value::Float(number) => Some(*number),
        _ => None,
    };
    value.as_array()?.iter().map(number).collect()
}

/// Reads two finite numbers, the lower first.
fn range(name: &str, value: &toml::Value) -> Result<[f64; 2]> {
    let numbers = numbers(value).and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
    let good = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low <= high;
    let expected = "two finite numbers, the lower first";
    numbers
        .filter(good)
        .ok_or_else(|| refused(name, value, expected))
}

pub(super) fn refused(name: &str, value: &toml::Value, expected: &str) -> Error {
    Error::Value(wake_nn::Error::InvalidOption {
        option: format!("draw.{name}"),
        value: whole_files::sentence(&value.to_string()),
        expected: expected.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Distribution> {
        let table: toml::Table = toml::from_str(&format!("v = {text}")).unwrap();
        Distribution::parse("a.b", &table["v"])
    }

    fn at(text: &str, place: f64) -> Value {
        parsed(text).unwrap().at(place, false)
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "ends and halves are exact")]
    fn places_are_values() {
        assert_eq!(at("[2, 4]", 0.25), Value::Number(2.5));
        let Value::Number(middle) = at("{ log = [10, 1000] }", 0.5) else {
            panic!("no number");
        };
        // Two logarithms and an exponential: some ulps of 100.
        assert!((middle - 100.0).abs() < 1e-12 * 100.0, "{middle}");
        assert_eq!(at("{ log = [10, 1000] }", 1.0), Value::Number(1000.0));
        assert_eq!(at("true", 0.9), Value::Flag(true));
        assert_eq!(
            at("{ one_of = [\"a\", \"b\"] }", 0.51),
            Value::Word("b".to_owned())
        );
        // Quantiles 0.4 to 1 belong to the range, whose middle is at 0.7.
        let nested = "{ one_of = [0, [10, 20]], weights = [2, 3] }";
        assert_eq!(at(nested, 0.39), Value::Number(0.0));
        assert_eq!(at(nested, 0.7), Value::Number(15.0));
        assert_eq!(
            at("{ one_of = [1, 2], weights = [1, 0] }", 1.0),
            Value::Number(1.0)
        );
    }

    /// Each whole number from 1 to 8 is equally likely: a thousand quantiles each.
    #[test]
    fn whole_numbers_are_equally_likely() {
        let looks = parsed("[1, 8]").unwrap();
        let mut counts = [0; 8];
        for k in 0..8000 {
            let Value::Number(n) = looks.at((f64::from(k) + 0.5) / 8000.0, true) else {
                panic!("no number");
            };
            counts[n as usize - 1] += 1;
        }
        assert_eq!(counts, [1000; 8]);
        assert_eq!(looks.at(1.0, true), Value::Number(8.0));
    }

    #[test]
    fn what_is_no_distribution_is_refused_by_name() {
        for text in [
            "[1]",
            "[1, 2, 3]",
            "[4, 2]",
            "inf",
            "nan",
            "{ one_of = [1, -inf] }",
            "[1, nan]",
            "[1, inf]",
            "[\"a\", \"b\"]",
            "{ log = [0, 1] }",
            "{ log = [-2, -1] }",
            "{ log = [1, 2], one_of = [3] }",
            "{ one_of = [] }",
            "{ one_of = [1, [3, 2]] }",
            "{ one_of = [1, 2], weights = [1] }",
            "{ one_of = [1, 2], weights = [0, 0] }",
            "{ one_of = [1, 2], weights = [1, -1] }",
            "{ even = [1, 2] }",
            "2020-01-01",
        ] {
            let message = parsed(text).unwrap_err().to_string();
            assert!(message.starts_with("draw.a.b is "), "{text}: {message}");
            assert!(message.contains("expected"), "{text}: {message}");
        }
    }

    #[test]
    fn extremes_are_all_ends_and_choices() {
        let found = parsed("{ one_of = [0, [10, 20], { log = [30, 40] }] }")
            .unwrap()
            .extremes();
        assert_eq!(found, [0.0, 10.0, 20.0, 30.0, 40.0].map(Value::Number));
    }
}
