//! Rows of windows behind a ship in which its wake is searched.

use crate::raster::Raster;
use crate::track::Track;
use std::ops::Range;

/// Row number beyond which rows are not resolved: numbers round to 2⁻⁴ of a row.
const FARTHEST_ROW: f64 = (1u64 << 48) as f64;

/// Rows of windows, counted from the stern, that may hold a place of the image. Their number does not grow with the distance of
/// the ship: it is bounded by the length of the image along a straight track, and by half a circle along a turn.
///
/// - `half_length`: half the length of the hull \[m\]
/// - `step`: distance from row to row \[m\]
/// - returns no rows where the ship is so far away that rows are not resolved
pub(super) fn rows_in(
    track: &Track,
    raster: &Raster,
    half_length: f64,
    step: f64,
) -> [Range<u64>; 2] {
    let farthest = (track.farthest_astern(raster) - half_length).max(0.0);
    let end = (farthest / step).ceil();
    let mut next = 0.0f64;
    track.astern(raster).map(|[near, far]| {
        let row = |distance: f64| (distance - half_length) / step;
        let first = (row(near).floor() - 1.0).max(next);
        let last = (row(far).ceil() + 1.0).min(end);
        if last >= FARTHEST_ROW || first >= last {
            return 0..0;
        }
        next = last;
        first as u64..last as u64
    })
}
