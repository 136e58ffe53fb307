//! The texture of open sea in a simulated image beside that of real ones.

use std::path::{Path, PathBuf};
use wake_physics::measure::{Texture, texture};
use wake_physics::{Error, Field, Result};

/// Side of the windows of open sea \[pixels\].
const SIDE: usize = 256;

/// The textures by name, that of the simulated intensity first; images without a window of open sea have none.
pub(crate) fn textures(intensity: &Field, folder: &Path) -> Result<Vec<(String, Option<Texture>)>> {
    let mut amplitude = intensity.clone();
    amplitude.values.iter_mut().for_each(|v| *v = v.sqrt());
    let mut rows = vec![("simulated".to_owned(), texture(&amplitude, SIDE))];
    for path in pictures(folder)? {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        rows.push((name, texture(&grey(&path)?, SIDE)));
    }
    Ok(rows)
}

/// The PNG files of a folder, by name.
fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let fail = |e: std::io::Error| unreadable(folder, &e);
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("png"))
        {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        let none = std::io::Error::other("it holds no PNG image; name a folder of real images");
        return Err(unreadable(folder, &none));
    }
    Ok(paths)
}

fn grey(path: &Path) -> Result<Field> {
    let picture = image::open(path)
        .map_err(|e| unreadable(path, &e))?
        .into_luma8();
    Ok(Field {
        rows: picture.height() as usize,
        columns: picture.width() as usize,
        values: picture.into_raw().into_iter().map(f32::from).collect(),
    })
}

fn unreadable(path: &Path, cause: &dyn std::fmt::Display) -> Error {
    Error::File {
        action: "read",
        path: path.to_owned(),
        message: cause.to_string(),
    }
}

/// One line an image.
pub(crate) fn table(rows: &[(String, Option<Texture>)]) -> String {
    let mut lines = vec![format!(
        "{:<16} {:>7} {:>6}  {:<23}  {:<23} {:>8}  {:<12}",
        "image",
        "windows",
        "looks",
        "along rows, lag 1 to 4",
        "along columns",
        "skewness",
        "blocks 8, 32"
    )];
    for (name, texture) in rows {
        let Some(t) = texture else {
            lines.push(format!("{name:<16} no window of open sea"));
            continue;
        };
        let lags = |lags: [f64; 4]| lags.map(|r| format!("{r:5.2}")).join(" ");
        lines.push(format!(
            "{name:<16} {:>7} {:>6.1}  {}  {} {:>8.2}  {:.3} {:.3}",
            t.windows,
            t.looks,
            lags(t.along_rows),
            lags(t.along_columns),
            t.skewness,
            t.block_variation[0],
            t.block_variation[1]
        ));
    }
    lines.join("\n")
}
