//! Simulated images beside real ones: the texture of their open sea, and what lies across their wakes.

use crate::real::{self, Real};
use serde::Serialize;
use wake_physics::measure::{
    Streak, Texture, WakeAxis, WakeProfile, amplitude_correlation, texture, wake_arms, wake_profile,
};
use wake_physics::window::Window;
use wake_physics::{Field, Result, Simulation};

/// Side of the windows of open sea \[pixels\].
const SIDE: usize = 256;
/// Stretches of a wake from its tip \[pixels\].
const STRETCHES: [[f64; 2]; 3] = [[25.0, 85.0], [85.0, 170.0], [170.0, 300.0]];

/// One image.
#[derive(Serialize)]
pub(crate) struct Row {
    name: String,
    /// What window, resolution and looks say of the speckle of a simulated image.
    stated: Option<Stated>,
    texture: Option<Texture>,
    wakes: Vec<Across>,
}

/// Speckle in closed form.
#[derive(Serialize)]
struct Stated {
    looks: f64,
    along_rows: [f64; 3],
    along_columns: [f64; 3],
}

/// What lies across one wake.
#[derive(Serialize)]
struct Across {
    name: String,
    stretches: [Option<WakeProfile>; 3],
    /// On either side of the axis.
    arms: [[Option<Streak>; 2]; 3],
}

impl Row {
    pub(crate) fn simulated(name: &str, simulation: &Simulation) -> Self {
        let mut amplitude = simulation.speckled.clone();
        amplitude.values.iter_mut().for_each(|v| *v = v.sqrt());
        let wakes = simulation.labels.ships.iter().map(|ship| &ship.wake);
        let axes = wakes.filter_map(|wake| {
            Some(WakeAxis {
                tip: wake.tip_px?,
                direction: wake.axis_deg?,
            })
        });
        let axes = axes.enumerate().map(|(n, axis)| (letter(n), axis));
        Self::new(name, Some(stated(simulation)), &amplitude, axes)
    }

    fn real(image: Real) -> Self {
        let wakes = image.wakes.into_iter();
        Self::new(&image.name, None, &image.amplitude, wakes)
    }

    fn new(
        name: &str,
        stated: Option<Stated>,
        amplitude: &Field,
        wakes: impl Iterator<Item = (String, WakeAxis)>,
    ) -> Self {
        let wakes = wakes.map(|(letter, axis)| Across {
            name: format!("{name} {letter}"),
            stretches: STRETCHES.map(|stretch| wake_profile(amplitude, &axis, stretch)),
            arms: STRETCHES.map(|stretch| wake_arms(amplitude, &axis, stretch)),
        });
        Self {
            name: name.to_owned(),
            stated,
            texture: texture(amplitude, SIDE),
            wakes: wakes.collect(),
        }
    }
}

/// The images of a folder.
pub(crate) fn real_rows(folder: &std::path::Path) -> Result<Vec<Row>> {
    Ok(real::images(folder)?.into_iter().map(Row::real).collect())
}

fn letter(n: usize) -> String {
    char::from(b'a' + (n % 26) as u8).to_string()
}

fn stated(simulation: &Simulation) -> Stated {
    let (radar, spacing) = (&simulation.scene.radar, simulation.raster.spacing);
    let window = radar.window.unwrap_or(Window::Uniform);
    let overlap = radar.look_overlap.unwrap_or(0.0);
    let looks = window.overlapping_looks(radar.looks, overlap);
    let lags = |resolution: Option<f64>, window: Window| {
        [1.0, 2.0, 3.0].map(|lag| match resolution {
            None => 0.0,
            Some(resolution) => {
                let x = lag * spacing / resolution * window.width();
                amplitude_correlation(looks, window.correlation(x))
            }
        })
    };
    let azimuth = radar.range_resolution.map(|_| radar.resolution);
    Stated {
        looks,
        along_rows: lags(radar.range_resolution, window),
        along_columns: lags(azimuth, radar.azimuth_window.unwrap_or(window)),
    }
}

/// Both tables as a page of Markdown.
pub(crate) fn page(simulated: &[Row], real: &[Row]) -> String {
    let mut lines: Vec<String> = vec![
        "## Open sea".into(),
        String::new(),
        "| image | looks | along rows, lag 1 to 4 | along columns | skewness | blocks of 8, of 32 |".into(),
        "| --- | --- | --- | --- | --- | --- |".into(),
    ];
    for row in simulated.iter().chain(real) {
        lines.extend(row.stated.as_ref().map(Stated::line));
        lines.push(match &row.texture {
            Some(texture) => of_texture(&row.name, texture),
            None => format!("| {} | no window of open sea | | | | |", row.name),
        });
    }
    let textures: Vec<&Texture> = real.iter().filter_map(|row| row.texture.as_ref()).collect();
    if let Some(textures) = quantiles(&textures) {
        lines.extend(textures);
    }
    lines.extend([
        String::new(),
        "## Across wakes".into(),
        String::new(),
        "| wake | dark line: strength | % | width | bright streak: strength | % | width | apart | arm: degrees (strength) | other arm |".into(),
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |".into(),
    ]);
    let wakes = simulated.iter().chain(real).flat_map(|row| &row.wakes);
    lines.extend(wakes.map(of_wake));
    let wakes: Vec<&Across> = real.iter().flat_map(|row| &row.wakes).collect();
    if !wakes.is_empty() {
        lines.push(range(&wakes));
    }
    lines.join("\n") + "\n"
}

impl Stated {
    fn line(&self) -> String {
        let [x, y] = [self.along_rows, self.along_columns].map(|lags| joined(&lags, 2));
        format!(
            "| *closed form* | *{:.1}* | *{x}* | *{y}* | | |",
            self.looks
        )
    }
}

fn joined(values: &[f64], digits: usize) -> String {
    let values = values.iter().map(|v| {
        // A correlation of −0.001 is 0.00.
        let text = format!("{v:.digits$}");
        if text.trim_start_matches(['-', '0', '.']).is_empty() {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    });
    values.collect::<Vec<_>>().join(" ")
}

fn of_texture(name: &str, t: &Texture) -> String {
    format!(
        "| {name} | {:.1} | {} | {} | {:.2} | {} |",
        t.looks,
        joined(&t.along_rows, 2),
        joined(&t.along_columns, 2),
        t.skewness,
        joined(&t.block_variation, 3)
    )
}

/// The smallest, the middle and the largest of each figure over the real images.
fn quantiles(textures: &[&Texture]) -> Option<[String; 3]> {
    let at = |share: f64, of: &dyn Fn(&Texture) -> f64| {
        let mut values: Vec<f64> = textures.iter().map(|t| of(t)).collect();
        values.sort_by(f64::total_cmp);
        values[(share * (values.len() - 1) as f64).round() as usize]
    };
    let line = |(name, share): (&str, f64)| {
        of_texture(
            name,
            &Texture {
                windows: 0,
                looks: at(share, &|t| t.looks),
                along_rows: std::array::from_fn(|n| at(share, &|t| t.along_rows[n])),
                along_columns: std::array::from_fn(|n| at(share, &|t| t.along_columns[n])),
                skewness: at(share, &|t| t.skewness),
                block_variation: std::array::from_fn(|n| at(share, &|t| t.block_variation[n])),
            },
        )
    };
    (!textures.is_empty()).then(|| {
        [
            ("**real, least**", 0.0),
            ("**real, median**", 0.5),
            ("**real, most**", 1.0),
        ]
        .map(line)
    })
}

type Part = fn(&WakeProfile) -> Option<Streak>;

fn of_wake(wake: &Across) -> String {
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

/// Distance between dark line and bright streak.
fn apart(profile: &WakeProfile) -> Option<f64> {
    Some((profile.bright?.offset - profile.dark?.offset).abs())
}

/// Least to most of each figure over the real wakes, all stretches together.
fn range(wakes: &[&Across]) -> String {
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
