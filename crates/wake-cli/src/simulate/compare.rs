//! Markdown page that compares simulated and real images.

use super::figures::{ImageFigures, StatedSpeckle};
use wake_physics::measure::Texture;

use super::across;

/// The tables of open sea and of wakes as a Markdown page.
pub(crate) fn page(simulated: &[ImageFigures], real: &[ImageFigures]) -> String {
    let mut lines: Vec<String> = vec![
        "## Open sea".into(),
        String::new(),
        "| image | looks | along rows, lag 1 to 4 | along columns | skewness | blocks of 8, of 32 |".into(),
        "| --- | --- | --- | --- | --- | --- |".into(),
    ];
    for row in simulated.iter().chain(real) {
        lines.extend(row.stated.as_ref().map(of_stated));
        lines.push(match &row.texture {
            Some(texture) => of_texture(&row.name, texture),
            None => format!("| {} | no window of open sea | | | | |", row.name),
        });
    }
    let textures: Vec<&Texture> = real.iter().filter_map(|row| row.texture.as_ref()).collect();
    if let Some(textures) = quantiles(&textures) {
        lines.extend(textures);
    }
    lines.extend(across::lines(simulated, real));
    lines.join("\n") + "\n"
}

fn of_stated(stated: &StatedSpeckle) -> String {
    let [x, y] = [stated.along_rows, stated.along_columns].map(|lags| joined(&lags, 2));
    format!(
        "| *closed form* | *{:.1}* | *{x}* | *{y}* | | |",
        stated.looks
    )
}

fn joined(values: &[f64], digits: usize) -> String {
    let values = values.iter().map(|v| {
        // Formats a correlation of −0.001 as 0.00.
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

/// Minimum, median and maximum of each figure over the real images.
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
