//! Evaluates detectors on labelled real tiles.

use std::path::Path;

use rayon::prelude::*;
use wake_detector::{Detection, Finder};
use wake_train::detector::judging::{Tile, compared};

use super::report::Report;
use crate::exit::Outcome;
use crate::picture;

/// Reads the tiles of a folder with their labels.
pub(crate) fn tiles(folder: &Path) -> Outcome<Vec<Tile>> {
    Tile::read_all(folder).map_err(|error| match error {
        wake_train::Error::Detector(wake_detector::Error::Io { .. })
        | wake_train::Error::Value(wake_nn::Error::Io { .. }) => {
            format!("{error}; give the folder of tiles and labels.json as --real").into()
        }
        error => error.into(),
    })
}

/// Adds the rows of one detector, or of one per tile, and draws every tile into the folder.
///
/// - `finder`: detector of a tile, by its number
pub(crate) fn judge<'a>(
    name: &str,
    finder: impl Fn(usize) -> &'a (dyn Finder + 'a) + Sync,
    tiles: &[Tile],
    out: &Path,
    report: &mut Report,
) -> Outcome<()> {
    let search = |(n, tile): (usize, &Tile)| finder(n).find(&tile.image);
    let found: Vec<Vec<Detection>> = tiles.par_iter().enumerate().map(search).collect();
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
