//! Real tiles with labels, searched.

use std::path::Path;

use rayon::prelude::*;
use wake_detector::{Detection, Finder};
use wake_train::detector::judging::{Tile, compared};

use super::report::Report;
use crate::exit::Outcome;
use crate::picture;

/// The tiles of a folder with their labels.
pub(crate) fn tiles(folder: &Path) -> Outcome<Vec<Tile>> {
    Tile::read_all(folder).map_err(|error| match error {
        wake_train::Error::Detector(wake_detector::Error::Io { .. })
        | wake_train::Error::Value(wake_nn::Error::Io { .. }) => {
            format!("{error}; --real names the folder of tiles and labels.json").into()
        }
        error => error.into(),
    })
}

/// Adds the rows of a finder, and draws every tile into the folder.
pub(crate) fn judge(
    name: &str,
    finder: &dyn Finder,
    tiles: &[Tile],
    out: &Path,
    report: &mut Report,
) -> Outcome<()> {
    let found: Vec<Vec<Detection>> = tiles.par_iter().map(|t| finder.find(&t.image)).collect();
    let searched = || tiles.iter().zip(&found);
    let clear: Vec<_> = searched()
        .map(|(t, found)| t.clear.with_found(found))
        .collect();
    let both: Vec<_> = searched()
        .map(|(t, found)| t.probable.with_found(found))
        .collect();
    report.add("real, clear wakes", name, &clear);
    report.add("real, clear and probable wakes", name, &both);
    for (i, (tile, found)) in searched().enumerate() {
        let file = format!("real-{}-{:02}.png", name.to_lowercase(), i + 1);
        picture::write(
            &compared(&tile.image, &tile.wakes(), found),
            &out.join(file),
        )?;
    }
    Ok(())
}
