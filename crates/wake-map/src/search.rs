//! Search of a product, tile by tile.

use std::path::Path;

use rayon::prelude::*;
use serde_json::json;
use wake_detector::{Detection, Detector, Raster, Tile};
use wake_geo::{LandMask, Product};

use crate::error::Result;
use crate::sea::SeaOf;
use crate::state::State;

/// Number of tiles searched at once, whatever the number of threads; each takes 170 MB.
const AT_ONCE: usize = 8;

/// Options of the search of a product.
#[derive(Debug, Clone, Copy, Default)]
pub struct Search<'a> {
    /// Land to exclude.
    pub land: Option<&'a LandMask>,
    /// File that records each searched tile; an interrupted search continues from it.
    pub state: Option<&'a Path>,
    /// Other inputs of the search, such as the weights and the lowest score; a file with other settings is refused.
    pub settings: &'a str,
}

/// Returns the wakes of a product in descending order of score, in its lines and pixels.
///
/// - `done`: called at the start and after every tile with the numbers of finished tiles and of all tiles, from any thread
///
/// # Errors
///
/// [`Error::Product`](crate::Error::Product) for pixels that cannot be read, [`Error::OtherSearch`](crate::Error::OtherSearch)
/// for a file of another search, [`Error::File`](crate::Error::File) for a file that cannot be read or written.
pub fn search(
    product: &Product,
    detector: &Detector,
    options: Search<'_>,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Detection>> {
    let sea = SeaOf {
        product,
        land: options.land,
    };
    let tiles = Tile::large(sea.rows(), sea.columns());
    let identity = json!({
        "product": product.path(), "lines": sea.rows(), "pixels": sea.columns(), "land": options.land.is_some(),
        "tiles": tiles.len(),
        "settings": options.settings,
    });
    let state = options.state.map(|path| State::open(path, &identity));
    let mut state = state.transpose()?;
    let known = state.as_mut().map(|state| std::mem::take(&mut state.done));
    let known = known.unwrap_or_default();
    let finished = std::sync::atomic::AtomicUsize::new(known.len());
    let count = tiles.len();
    done(known.len(), count);
    let one = |&(n, tile): &(usize, &Tile)| -> Result<Vec<Detection>> {
        if let Some(found) = known.get(&n) {
            return Ok(found.clone());
        }
        let found = detector.find_in(&sea, tile)?;
        if let Some(state) = &state {
            state.note(n, &found)?;
        }
        let finished = 1 + finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        done(finished, count);
        Ok(found)
    };
    let tiles: Vec<(usize, &Tile)> = tiles.iter().enumerate().collect();
    let mut found = Vec::new();
    for some in tiles.chunks(AT_ONCE) {
        let some: Vec<_> = some.par_iter().map(one).collect::<Result<_>>()?;
        found.extend(some.into_iter().flatten());
    }
    Ok(detector.merged(found))
}
