//! Table of profiles across the wakes of simulated and real images.

use super::figures::{ImageFigures, WakeFigures};
use super::profile::{Streak, WakeProfile};

/// Lines of the table with its title.
pub(crate) fn lines(simulated: &[ImageFigures], real: &[ImageFigures]) -> Vec<String> {
    let mut lines: Vec<String> = vec![
        String::new(),
        "## Across wakes".into(),
        String::new(),
        "| wake | dark line: strength | % | width | bright streak: strength | % | width | apart | arm: degrees (strength) | other arm |".into(),
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |".into(),
    ];
    let wakes = simulated.iter().chain(real).flat_map(|row| &row.wakes);
    lines.extend(wakes.map(of_wake));
    let wakes: Vec<&WakeFigures> = real.iter().flat_map(|row| &row.wakes).collect();
    if !wakes.is_empty() {
        lines.push(range(&wakes));
    }
    lines
}

type Part = fn(&WakeProfile) -> Option<Streak>;

fn of_wake(wake: &WakeFigures) -> String {
    let by_stretch = |part: Part, value: &dyn Fn(&Streak) -> String| {
        let found = wake.stretches.iter().map(|stretch| {
            let streak = stretch.as_ref().and_then(part);
            streak.map_or_else(|| "–".to_owned(), |streak| value(&streak))
        });
        found.collect::<Vec<_>>().join(" ")
    };
    let streak = |part: Part| {
        [
            by_stretch(part, &|s| format!("{:.1}", s.strength)),
            by_stretch(part, &|s| format!("{:+.0}", 100.0 * s.contrast)),
            by_stretch(part, &|s| format!("{:.0}", s.width)),
        ]
        .join(" | ")
    };
    let apart = wake.stretches.iter().map(|stretch| {
        let apart = stretch.as_ref().and_then(apart);
        apart.map_or_else(|| "–".to_owned(), |apart| format!("{apart:.0}"))
    });
    let arms = [0, 1].map(|side| {
        let found = wake.arms.iter().map(|arms| match arms[side] {
            None => "–".to_owned(),
            Some(arm) => format!("{:+.0} ({:.1})", arm.offset, arm.strength),
        });
        found.collect::<Vec<_>>().join(" ")
    });
    format!(
        "| {} | {} | {} | {} | {} |",
        wake.name,
        streak(|profile| profile.dark),
        streak(|profile| profile.bright),
        apart.collect::<Vec<_>>().join(" "),
        arms.join(" | ")
    )
}

/// Distance between dark line and bright streak \[pixels\].
fn apart(profile: &WakeProfile) -> Option<f64> {
    Some((profile.bright?.offset - profile.dark?.offset).abs())
}

/// Smallest and largest value of each figure over the real wakes, all stretches together.
fn range(wakes: &[&WakeFigures]) -> String {
    let profiles = || {
        wakes
            .iter()
            .flat_map(|wake| wake.stretches.iter().flatten())
    };
    let text = |values: Vec<f64>, digits: usize| {
        let [least, most] = [f64::min, f64::max].map(|of| values.iter().copied().reduce(of));
        match (least, most) {
            (Some(least), Some(most)) => format!("{least:.digits$} to {most:.digits$}"),
            _ => "–".to_owned(),
        }
    };
    let streaks = |part: Part| -> Vec<Streak> { profiles().filter_map(part).collect() };
    let of = |part: Part| {
        let streaks = streaks(part);
        let each = |value: fn(&Streak) -> f64| streaks.iter().map(value).collect();
        [
            text(each(|s| s.strength), 1),
            text(each(|s| 100.0 * s.contrast), 0),
            text(each(|s| s.width), 0),
        ]
        .join(" | ")
    };
    let arms = || {
        wakes
            .iter()
            .flat_map(|wake| wake.arms.iter().flatten().flatten())
    };
    format!(
        "| **real, least to most** | {} | {} | {} | {} ({}) | |",
        of(|profile| profile.dark),
        of(|profile| profile.bright),
        text(profiles().filter_map(apart).collect(), 0),
        text(arms().map(|arm| arm.offset.abs()).collect(), 0),
        text(arms().map(|arm| arm.strength).collect(), 1)
    )
}
