//! The stages, each with its fast method, its oracle and the scale of its error.

mod backscatter;
mod bunching;
mod edge;
mod memo;
mod oracle;
mod response;
mod scene;
mod surface;
mod waves;

use crate::bench::row::Row;
pub(crate) use memo::Memo;
use wake_physics::Raster;

/// Stages in the order of the data flow.
pub(crate) const STAGES: [&str; 9] = [
    "sea",
    "swell",
    "kelvin",
    "edge",
    "unresolved",
    "backscatter",
    "bunching",
    "response",
    "scene",
];

/// Whether the method of a stage has a tolerance; the others are measured once per size.
pub(crate) fn has_tolerance(stage: &str) -> bool {
    !["edge", "response"].contains(&stage)
}

/// Measures one stage.
pub(crate) fn measure(
    stage: &'static str,
    size: usize,
    tolerance: f64,
    memo: &mut Memo,
) -> wake_physics::Result<Row> {
    let raster = Raster::image(size, size, 2.5);
    Ok(match stage {
        "sea" => waves::sea(&raster, tolerance),
        "kelvin" => waves::kelvin(&raster, tolerance),
        "backscatter" => backscatter::backscatter(&raster, tolerance, memo),
        "bunching" => bunching::bunching(&raster, tolerance),
        "swell" => waves::swell(&raster, tolerance),
        "edge" => edge::edge(size),
        "unresolved" => backscatter::unresolved(&raster, tolerance, memo),
        "response" => response::response(size),
        _ => return scene::scene(size, tolerance, memo),
    })
}
