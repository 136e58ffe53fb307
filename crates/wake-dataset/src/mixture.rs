//! Weighted mixture of sources.

use super::pair::Pair;
use super::source::Source;
use crate::error::{Error, Result};
use std::ops::Range;
use std::sync::Arc;

/// Denominator of the weights, which makes counts exact for every 64-bit position.
const WHOLE: u128 = 1 << 32;

/// Interleaves several sources in proportion to their weights.
///
/// Source k has its share of the first p positions, to within 1 for two sources and 2 for a few more, so that every batch
/// contains each source in proportion. Each source is read at its own positions 0, 1, 2, … without gaps, and once per batch.
///
/// ```text
/// n(p) = ⌊w p⌋       positions before p that are the first source's; p is its own if n(p + 1) > n(p)
/// p − n(p)           position among the others, which are shared out in the same way
/// ```
#[derive(Debug, Clone)]
pub struct Mixture {
    /// Sources, each with its weight relative to itself and all later sources [parts of `WHOLE`].
    parts: Vec<(u128, Arc<dyn Source>)>,
}

impl Mixture {
    /// Makes a mixture of sources with weights, which need not sum to one.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] without sources, for a weight that is not a positive finite number, and for images of
    /// different sizes.
    pub fn new(sources: Vec<(f64, Arc<dyn Source>)>) -> Result<Self> {
        let refused = |option: &str, value: String, expected: String| {
            Err(Error::Value(wake_nn::Error::InvalidOption {
                option: option.to_owned(),
                value,
                expected,
            }))
        };
        let Some((_, first)) = sources.first() else {
            let expected = "at least one source".to_owned();
            return refused("mixture", "empty".to_owned(), expected);
        };
        let [rows, columns] = first.size();
        for (weight, source) in &sources {
            if !(weight.is_finite() && *weight > 0.0) {
                let expected = "a finite number above 0".to_owned();
                return refused("weight of a mixture", weight.to_string(), expected);
            }
            let [r, c] = source.size();
            if [r, c] != [rows, columns] {
                let expected = format!("{rows} × {columns} pixels, as in the first source");
                let value = format!("{r} × {c} pixels");
                return refused("size of a mixture's images", value, expected);
            }
        }
        let mut left: f64 = sources.iter().map(|(weight, _)| weight).sum();
        let last = sources.len() - 1;
        let parts = sources
            .into_iter()
            .enumerate()
            .map(|(k, (weight, source))| {
                let share = (weight / left * WHOLE as f64).round() as u128;
                left -= weight;
                (if k == last { WHOLE } else { share.min(WHOLE) }, source)
            });
        Ok(Self {
            parts: parts.collect(),
        })
    }

    /// Index of the source of a position, and the position within that source.
    fn place(&self, position: u64) -> (usize, u64) {
        let mut position = position;
        for (k, &(share, _)) in self.parts.iter().enumerate() {
            let before = before(position, share);
            if before_next(position, share) > before {
                return (k, before);
            }
            position -= before;
        }
        // Unreachable: the last share is the whole.
        (self.parts.len() - 1, position)
    }
}

/// Number of positions before a given one that belong to a share.
fn before(position: u64, share: u128) -> u64 {
    (u128::from(position) * share / WHOLE) as u64
}

fn before_next(position: u64, share: u128) -> u64 {
    ((u128::from(position) + 1) * share / WHOLE) as u64
}

impl Source for Mixture {
    fn size(&self) -> [usize; 2] {
        self.parts.first().map_or([0, 0], |(_, first)| first.size())
    }

    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        let places: Vec<(usize, u64)> = positions.map(|p| self.place(p)).collect();
        let of = |k: usize| places.iter().filter(move |place| place.0 == k);
        let mut drawn = Vec::with_capacity(self.parts.len());
        for (k, (_, source)) in self.parts.iter().enumerate() {
            let first = of(k).map(|place| place.1).next().unwrap_or(0);
            let count = of(k).count() as u64;
            let items = match count {
                0 => Vec::new(),
                _ => source.items(first..first + count)?,
            };
            drawn.push(items.into_iter());
        }
        Ok(places
            .into_iter()
            .filter_map(|(k, _)| drawn[k].next())
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::grey::Grey;
    use super::*;
    use wake_physics::Scene;
    use wake_physics::labels::Labels;

    /// Source of pairs whose prompt names the source and whose index is the position in it.
    #[derive(Debug)]
    struct Named(&'static str, [usize; 2]);

    impl Source for Named {
        fn size(&self) -> [usize; 2] {
            self.1
        }

        fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
            let pair = |index| Pair {
                index,
                image: Grey::of_levels(&[0], 1, 1),
                prompt: self.0.to_owned(),
                scene: Scene::default(),
                labels: Labels::default(),
                amplitudes: None,
            };
            Ok(positions.map(pair).collect())
        }
    }

    fn mixture(weights: &[f64]) -> Mixture {
        let names = ["a", "b", "c"];
        let sources = weights.iter().zip(names).map(|(&weight, name)| {
            let source: Arc<dyn Source> = Arc::new(Named(name, [1, 1]));
            (weight, source)
        });
        Mixture::new(sources.collect()).unwrap()
    }

    fn told(pairs: Vec<Pair>) -> Vec<(String, u64)> {
        pairs.into_iter().map(|p| (p.prompt, p.index)).collect()
    }

    /// Each source is read at 0, 1, 2, …, and after p positions it has had its share to within two, from nested floors.
    #[test]
    fn every_source_has_its_share_without_gaps() {
        for weights in [&[1.0][..], &[3.0, 1.0], &[0.2, 0.5, 0.3], &[1e-3, 1.0, 7.0]] {
            let all = told(mixture(weights).items(0..4000).unwrap());
            let sum: f64 = weights.iter().sum();
            for (k, name) in ["a", "b", "c"].iter().take(weights.len()).enumerate() {
                let mut seen = 0;
                for (p, (of, index)) in all.iter().enumerate() {
                    if of == name {
                        assert_eq!(*index, seen);
                        seen += 1;
                    }
                    let expected = weights[k] / sum * (p + 1) as f64;
                    assert!((seen as f64 - expected).abs() < 2.0, "{weights:?} {p}");
                }
            }
        }
    }

    #[test]
    fn a_range_is_the_same_in_pieces_and_far_away() {
        let mixture = mixture(&[0.61, 0.2, 0.19]);
        assert_eq!(mixture.size(), mixture.parts[0].1.size());
        assert!(mixture.size()[0] > 0);
        for start in [0, 17, u64::MAX / 2] {
            let whole = told(mixture.items(start..start + 60).unwrap());
            let pieces = (0..12).flat_map(|k| {
                let first = start + 5 * k;
                told(mixture.items(first..first + 5).unwrap())
            });
            assert_eq!(pieces.collect::<Vec<_>>(), whole);
        }
    }

    #[test]
    fn what_cannot_be_mixed_is_named() {
        let source = |size| -> Arc<dyn Source> { Arc::new(Named("a", size)) };
        let refused = |sources| Mixture::new(sources).unwrap_err().to_string();
        assert!(refused(vec![]).contains("at least one source"));
        for weight in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let message = refused(vec![(1.0, source([1, 1])), (weight, source([1, 1]))]);
            assert!(message.contains(&weight.to_string()), "{message}");
        }
        let message = refused(vec![(1.0, source([4, 5])), (1.0, source([4, 6]))]);
        assert!(
            message.contains("4 × 6") && message.contains("4 × 5"),
            "{message}"
        );
    }
}
