//! The error budget, and the choice of terms given the change that each would make.

use crate::effects::Weight;
use crate::scene::{Term, TermRule, Terms};
use serde::Serialize;

/// Shares of the tolerance \[1\].
///
/// Errors of different sources are independent and rarely have the same sign at a pixel; even if they do, the shares add up
/// to the tolerance. The split follows how cost grows, and was not tuned by measurement: most goes to the terms left out,
/// which save whole stages, and to the table, whose nodes grow with error^(−1/4) along each axis; little to nodes, sums and
/// kernels, whose cost grows with the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Budget {
    /// Terms left out, by estimate.
    pub(crate) terms: f64,
    /// Nodes of the wake integral.
    pub(crate) wake_nodes: f64,
    /// Sums of waves on the raster, as largest error of a field over its root mean square.
    pub(crate) fields: f64,
    /// The table of σ⁰, as largest error over the mean.
    pub(crate) table: f64,
    /// The kernels of the imaging, as mean error over the mean.
    pub(crate) kernels: f64,
}

/// The budget in use.
pub(crate) const SHARES: Budget = Budget {
    terms: 0.3,
    wake_nodes: 0.1,
    fields: 0.15,
    table: 0.3,
    kernels: 0.15,
};

/// One term of the plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedTerm {
    /// The term.
    pub term: Term,
    /// Whether it is computed.
    pub used: bool,
    /// Estimated change without the term: three times the linear-theory root mean square change of the intensity before
    /// speckle, relative to its mean; for speckle itself, of the speckled image. 0 where the scene lacks the term. An
    /// estimate, not a bound: the image is not linear.
    pub estimate: f64,
    /// Reason, in words.
    pub why: String,
}

/// A term with its estimated change.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Weighed {
    pub(crate) term: Term,
    pub(crate) weight: Weight,
}

/// Chooses terms. Under the rule "needed", terms are left out in ascending order of estimate, as long as the sum of the
/// estimates left out stays within their share of the tolerance; speckle, which is not part of the image before speckle, is
/// compared with the whole tolerance. The impulse response determines the computed pixels: it is used whenever it is
/// present.
pub(crate) fn choose(effects: &[Weighed], terms: &Terms, tolerance: f64) -> Vec<PlannedTerm> {
    let alone = [Term::Speckle, Term::ImpulseResponse];
    let mut order: Vec<&Weighed> = effects
        .iter()
        .filter(|e| !alone.contains(&e.term))
        .collect();
    order.sort_by(|a, b| a.weight.estimate.total_cmp(&b.weight.estimate));
    let mut left_out = Vec::new();
    let mut sum = 0.0;
    for effect in order {
        sum += effect.weight.estimate;
        if sum <= SHARES.terms * tolerance {
            left_out.push(effect.term);
        }
    }
    if effects
        .iter()
        .any(|e| e.term == Term::Speckle && e.weight.estimate <= tolerance)
    {
        left_out.push(Term::Speckle);
    }
    effects
        .iter()
        .map(|effect| planned(effect, terms, left_out.contains(&effect.term)))
        .collect()
}

fn planned(effect: &Weighed, terms: &Terms, below_budget: bool) -> PlannedTerm {
    let (used, why) = match (effect.weight.absent, terms) {
        (Some(reason), _) => (false, reason.to_owned()),
        (None, Terms::List(list)) if list.contains(&effect.term) => (true, "requested".to_owned()),
        (None, Terms::List(_)) => (false, "not in model.terms".to_owned()),
        (None, Terms::Rule(TermRule::All)) => (true, "all terms requested".to_owned()),
        (None, Terms::Rule(TermRule::Needed)) if below_budget => {
            (false, "changes less than the tolerance allows".to_owned())
        }
        (None, Terms::Rule(TermRule::Needed)) => {
            (true, "may change more than the tolerance".to_owned())
        }
    };
    PlannedTerm {
        term: effect.term,
        used,
        estimate: match effect.weight.absent {
            Some(_) => 0.0,
            None => effect.weight.estimate,
        },
        why,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All shares are positive and sum to at most the tolerance (a new share does not compile here unless added).
    #[test]
    fn the_shares_are_at_most_the_tolerance() {
        let Budget {
            terms,
            wake_nodes,
            fields,
            table,
            kernels,
        } = SHARES;
        let shares = [terms, wake_nodes, fields, table, kernels];
        assert!(shares.iter().all(|&share| share > 0.0));
        // Sums of five decimal fractions round by a few 1e-16.
        assert!(shares.iter().sum::<f64>() <= 1.0 + 1e-15);
    }

    fn effect(term: Term, estimate: f64) -> Weighed {
        let absent = None;
        Weighed {
            term,
            weight: Weight { absent, estimate },
        }
    }

    fn used(effects: &[Weighed], terms: &Terms) -> Vec<bool> {
        choose(effects, terms, 1e-3)
            .iter()
            .map(|t| t.used)
            .collect()
    }

    #[test]
    fn small_terms_go_until_the_budget_is_spent() {
        let effects = [
            effect(Term::Sea, 0.3e-3),
            effect(Term::Kelvin, 0.15e-3),
            effect(Term::Specular, 0.1e-3),
            effect(Term::VelocityBunching, 1.0),
        ];
        let needed = Terms::Rule(TermRule::Needed);
        // 0.1 + 0.15 fit within 0.3; another 0.3 would make 0.55.
        assert_eq!(used(&effects, &needed), [true, false, false, true]);
        assert_eq!(used(&effects, &Terms::Rule(TermRule::All)), [true; 4]);
        let list = Terms::List(vec![Term::Kelvin]);
        assert_eq!(used(&effects, &list), [false, true, false, false]);
    }

    #[test]
    fn speckle_is_judged_alone() {
        let effects = [effect(Term::Sea, 0.2e-3), effect(Term::Speckle, 0.9e-3)];
        assert_eq!(
            used(&effects, &Terms::Rule(TermRule::Needed)),
            [false, false]
        );
    }

    #[test]
    fn what_is_not_there_is_never_used_and_counts_nothing() {
        let mut absent = effect(Term::Kelvin, f64::NAN);
        absent.weight.absent = Some("there is no ship");
        for terms in [Terms::Rule(TermRule::All), Terms::List(vec![Term::Kelvin])] {
            let plan = choose(&[absent.clone()], &terms, 1e-3);
            assert!(!plan[0].used && plan[0].estimate == 0.0);
        }
    }
}
