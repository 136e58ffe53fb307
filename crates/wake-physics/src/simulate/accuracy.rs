//! What the numerical methods reached of the accuracy they were asked for.

use serde::Serialize;

/// An error asked for, and the one reached by the method's own bound or estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reached {
    /// Largest error asked for.
    pub asked: f64,
    /// Error stated by the method.
    pub reached: f64,
}

impl Reached {
    /// Whether the method is as exact as it was asked to be.
    #[must_use]
    pub fn met(&self) -> bool {
        self.reached <= self.asked
    }
}

/// What the numerical methods reached; absent is what was not computed, or computed directly.
///
/// The kernels of the imaging always keep their share of the tolerance, and FFTs their rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Accuracy {
    /// Sum of the waves of the wake: bound on the largest error of a field, relative to the field's root mean square.
    pub wake: Option<Reached>,
    /// Table of σ⁰: estimate of its largest error, relative to the mean σ⁰.
    pub table: Option<Reached>,
    /// Nodes of the table along the two principal axes of the unresolved slopes; 0 where there is none.
    pub table_nodes: [usize; 2],
}

impl Accuracy {
    /// What two parts of a scene reached together: the worse of both.
    pub(crate) fn and(&self, other: &Self) -> Self {
        let worse = |a: Option<Reached>, b: Option<Reached>| match (a, b) {
            (Some(a), Some(b)) if b.reached <= a.reached => Some(a),
            (a, None) => a,
            (_, b) => b,
        };
        let nodes = [self.table_nodes, other.table_nodes];
        Self {
            wake: worse(self.wake, other.wake),
            table: worse(self.table, other.table),
            table_nodes: [0, 1].map(|axis| nodes[0][axis].max(nodes[1][axis])),
        }
    }

    /// One sentence for every method that missed what it was asked for.
    #[must_use]
    pub fn missed(&self) -> Vec<String> {
        [
            ("the waves of the wake", self.wake),
            ("the table of σ⁰", self.table),
        ]
        .into_iter()
        .filter_map(|(what, reached)| {
            let Reached { asked, reached } = reached.filter(|r| !r.met())?;
            Some(format!(
                "{what} reached an error of {reached:.1e} where {asked:.1e} was asked for"
            ))
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missed_is_told() {
        let accuracy = |reached| Accuracy {
            table: Some(Reached {
                asked: 1e-3,
                reached,
            }),
            ..Accuracy::default()
        };
        assert!(accuracy(1e-3).missed().is_empty());
        let missed = accuracy(2e-3).missed();
        assert!(
            missed.len() == 1 && missed[0].contains("2.0e-3"),
            "{missed:?}"
        );
        // What is not a number is not met.
        assert_eq!(accuracy(f64::NAN).missed().len(), 1);
    }
}
