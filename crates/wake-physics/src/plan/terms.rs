//! Which terms are computed: the choice, given what each would change.

use super::SHARES;
use crate::scene::{Term, TermRule, Terms};
use serde::Serialize;

/// One term of the plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedTerm {
    /// The term.
    pub term: Term,
    /// Whether it is computed.
    pub used: bool,
    /// What leaving it out changes, by estimate: three times the root mean square that linear theory gives of the
    /// change of the intensity before speckle, relative to its mean; for speckle itself, of the speckled image.
    /// 0 where the scene has nothing of it. No estimate: the image is not linear.
    pub estimate: f64,
    /// Why, in words.
    pub why: String,
}

/// What leaving a term out would change, and why the scene has nothing of it if so.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Effect {
    pub(crate) term: Term,
    pub(crate) estimate: f64,
    /// `Some` where the scene does not have the term at all: the estimate is 0 exactly.
    pub(crate) absent: Option<&'static str>,
}

/// Chooses terms. By rule "needed" terms are left out from the smallest estimate up, as long as the sum of the
/// estimates left out stays within their share of the tolerance; speckle, which is no part of the image before speckle, has
/// the tolerance for itself. The impulse response decides on which pixels all is computed: it is used where it is there.
pub(crate) fn choose(effects: &[Effect], terms: &Terms, tolerance: f64) -> Vec<PlannedTerm> {
    let alone = [Term::Speckle, Term::ImpulseResponse];
    let mut order: Vec<&Effect> = effects
        .iter()
        .filter(|e| !alone.contains(&e.term))
        .collect();
    order.sort_by(|a, b| a.estimate.total_cmp(&b.estimate));
    let mut left_out = Vec::new();
    let mut sum = 0.0;
    for effect in order {
        sum += effect.estimate;
        if sum <= SHARES.terms * tolerance {
            left_out.push(effect.term);
        }
    }
    if effects
        .iter()
        .any(|e| e.term == Term::Speckle && e.estimate <= tolerance)
    {
        left_out.push(Term::Speckle);
    }
    effects
        .iter()
        .map(|effect| planned(effect, terms, left_out.contains(&effect.term)))
        .collect()
}

fn planned(effect: &Effect, terms: &Terms, below_budget: bool) -> PlannedTerm {
    let (used, why) = match (effect.absent, terms) {
        (Some(reason), _) => (false, reason.to_owned()),
        (None, Terms::List(list)) if list.contains(&effect.term) => (true, "asked for".to_owned()),
        (None, Terms::List(_)) => (false, "not in model.terms".to_owned()),
        (None, Terms::Rule(TermRule::All)) => (true, "all terms asked for".to_owned()),
        (None, Terms::Rule(TermRule::Needed)) if below_budget => (
            false,
            "changes less than the tolerance leaves room for".to_owned(),
        ),
        (None, Terms::Rule(TermRule::Needed)) => {
            (true, "may change more than the tolerance".to_owned())
        }
    };
    PlannedTerm {
        term: effect.term,
        used,
        estimate: if effect.absent.is_some() {
            0.0
        } else {
            effect.estimate
        },
        why,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(term: Term, estimate: f64) -> Effect {
        Effect {
            term,
            estimate,
            absent: None,
        }
    }

    fn used(effects: &[Effect], terms: &Terms) -> Vec<bool> {
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
        // 0.1 + 0.15 fit into 0.3 of 1; with 0.3 it would be 0.55.
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
        absent.absent = Some("there is no ship");
        for terms in [Terms::Rule(TermRule::All), Terms::List(vec![Term::Kelvin])] {
            let plan = choose(&[absent.clone()], &terms, 1e-3);
            assert!(!plan[0].used && plan[0].estimate == 0.0);
        }
    }
}
