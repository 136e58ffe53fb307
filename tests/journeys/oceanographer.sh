#!/usr/bin/env bash
# An oceanographer: a new effect in one file, entered where docs/contributing.md says, and drawn.
. "$(dirname "$0")/common.sh"
clone
source=crates/wake-physics/src
cat >$source/effects/rain.rs <<'END'
//! Return of a calm sea roughened by rain: a toy.

use super::effect::{Effect, Site, Weight};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Term};

#[derive(Debug)]
pub(crate) struct Rain {
    sigma0: f64,
}

impl Rain {
    pub(super) fn new(scene: &Scene, _: &Models) -> Self {
        Self {
            sigma0: if scene.sea.wind_speed < 4.0 { 0.01 } else { 0.0 },
        }
    }
}

impl Effect for Rain {
    fn term(&self) -> Term {
        Term::Rain
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: (self.sigma0 <= 0.0).then_some("the wind hides it"),
            estimate: amplitudes.first.over_mean(self.sigma0),
        }
    }

    fn change_sigma0(&self, _: &Site<'_>, sigma0: &mut Field, _: Option<&Field>) {
        sigma0.values.iter_mut().for_each(|s| *s += self.sigma0 as f32);
    }
}
END
# The two places of the map: the list of effects, with the module, and the list of terms.
sed -i 's/^mod slicks;/mod rain;\n&/; s/^    noise: noise::Noise,/    rain: rain::Rain,\n&/' $source/effects/mod.rs
sed -i 's/^    Noise = "noise",/&\n    \/\/\/ Rain.\n    Rain = "rain",/' $source/scene/model.rs
plan() {
  cargo run --quiet --release --no-default-features --example simulate -- grid.rows=64 grid.columns=64 "$@"
}
plan sea.wind_speed=3 | grep -E '^rain +yes'
plan sea.wind_speed=5 | grep -E '^rain +no .*the wind hides it'
echo "oceanographer: an effect in one file"
