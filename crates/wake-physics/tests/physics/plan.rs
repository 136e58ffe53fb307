//! The plan: what it leaves out changes the image by less than it estimates, and not by much less.

use crate::satellite::EXTRAS;
use crate::small;
use std::collections::BTreeMap;
use wake_physics::scene::Term;
use wake_physics::{Scene, simulate};

/// Varied scenes: sea states, ships, radars, pixels and tolerances.
fn scenes() -> Vec<Scene> {
    let mut scenes = Vec::new();
    let winds = ["0", "1.5", "2.8", "4", "6", "9"];
    let tolerances = ["1e-3", "1e-2", "0.1"];
    for n in 0..72usize {
        let incidence = 15 + 7 * (n % 9);
        let spacing = [1.0, 2.5, 5.0, 20.0][n % 4];
        let assignments = [
            format!("sea.wind_speed={}", winds[(n / 2) % 6]),
            format!("sea.wind_toward={}", 25 * n),
            format!("sea.fetch={}", [3e3, 4e4, 2e5][n % 3]),
            format!("radar.incidence={incidence}"),
            format!(
                "radar.range_to_velocity={}",
                [0.0, 0.02, 5.0, 78.0, 120.0][n % 5]
            ),
            format!("radar.looks={}", [1, 4, 1000][(n / 3) % 3]),
            format!("radar.relaxation_rate={}", [0.5, 2.0, 100.0][(n / 5) % 3]),
            format!("grid.spacing={spacing}"),
            format!("model.tolerance={}", tolerances[(n / 7) % 3]),
            format!("ship.heading={}", 40 * n),
            format!("ship.speed={}", [0.0, 1.2, 4.0, 8.0, 12.0][(n / 4) % 5]),
            format!("ship.filter_depth={}", [0.0, 0.0, 8.0][(n / 11) % 3]),
            format!(
                "ship.position=[{}, {}]",
                [0.0, 0.0, 20.0][n % 3] * spacing,
                [0.0, 30.0][n % 2] * spacing
            ),
            format!("seed={n}"),
        ];
        let refs: Vec<&str> = assignments.iter().map(String::as_str).collect();
        let mut scene = small(96, 88, &refs);
        if n % 6 == 5 {
            scene.ships.clear();
        }
        scenes.push(scene);
    }
    scenes
}

/// Needed against all, same seed: the change stays below the estimate in each of these scenes; the estimate says
/// something (median of estimate over change at most 10); terms that a scene has are left out, and so fewer computed.
#[test]
fn what_is_left_out_changes_less_than_estimated() {
    let mut ratios = Vec::new();
    let mut left_out: BTreeMap<Term, usize> = BTreeMap::new();
    let mut computed = [0, 0];
    for (n, scene) in scenes().iter().enumerate() {
        let needed = simulate(scene).unwrap();
        let all = simulate(&scene.with_assignments(&["model.terms=all"]).unwrap()).unwrap();
        for (term, in_all) in needed.plan.terms.iter().zip(&all.plan.terms) {
            // What the scene does not have is computed in neither, and counts for nothing.
            computed[0] += usize::from(term.used);
            computed[1] += usize::from(in_all.used);
            if in_all.used && !term.used {
                *left_out.entry(term.term).or_default() += 1;
            }
        }
        let estimate = needed.plan.left_out();
        assert!(estimate <= scene.model.tolerance, "scene {n}");
        let mean = all.intensity.mean();
        let difference = needed.intensity.difference(&all.intensity).1;
        if mean == 0.0 {
            assert_eq!(difference, 0.0, "scene {n}");
            continue;
        }
        let actual = difference / mean;
        // Both runs carry the error of the numerical methods, mostly the same; where a field differs by its last bit,
        // the kernels of the imaging may take another step. A hundredth of the tolerance is allowed for that.
        let allowance = 0.01 * scene.model.tolerance;
        assert!(
            actual <= estimate + allowance,
            "scene {n}: {actual} above {estimate}\n{}",
            needed.plan
        );
        // Below 1e-6 there is only the rounding of f32 fields to be seen.
        if estimate > 0.0 && actual > 1e-6 {
            ratios.push(estimate / actual);
        }
    }
    ratios.sort_by(f64::total_cmp);
    assert!(
        ratios.len() >= 12,
        "only {} scenes leave something out",
        ratios.len()
    );
    assert!(ratios[ratios.len() / 2] <= 10.0, "{ratios:?}");
    // Where these scenes have a wake, or slopes to average over, they need them; satellite scenes are judged apart.
    let always = [Term::Kelvin, Term::Turbulent, Term::TiltAverage];
    let other = |term: &&Term| !always.contains(term) && !EXTRAS.contains(term);
    for term in Term::ALL.iter().filter(other) {
        assert!(
            left_out.contains_key(term),
            "{} is never left out of a scene that has it: {left_out:?}",
            term.name()
        );
    }
    assert!(
        computed[0] < computed[1],
        "{computed:?} terms computed, needed and all"
    );
}

/// A list of terms is followed to the letter, and what it leaves out is told.
#[test]
fn a_list_of_terms_is_followed() {
    let scene = small(64, 64, &["model.terms=[\"sea\", \"bunching\"]"]);
    let plan = simulate(&scene).unwrap().plan;
    let used: Vec<Term> = plan
        .terms
        .iter()
        .filter(|t| t.used)
        .map(|t| t.term)
        .collect();
    assert_eq!(used, [Term::Sea, Term::VelocityBunching]);
    assert!(plan.left_out() > 0.1);
}
