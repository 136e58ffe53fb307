//! stub
use crate::kelvin::KelvinWake;
use crate::raster::{Field, Raster};
pub struct TurbulentWake;
impl TurbulentWake {
    pub fn of(_: &KelvinWake) -> Self {
        Self
    }
    pub fn damping_at(&self, _: [f64; 2]) -> f64 {
        0.0
    }
    pub fn remaining(&self, raster: &Raster) -> Field {
        Field::constant(raster, 1.0)
    }
}
