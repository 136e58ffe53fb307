//! Speed and error of the model by steps, batch size and weight precision, against many steps from the same noise.

use super::model_row::{ModelRow, REFERENCE, STEPS};
use super::reference::{Reference, draw};
use super::rounding::{Rounding, rounded};
use super::row::seconds;
use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::Device;
use wake_physics::Scene;

use crate::exit::Outcome;

/// Batch sizes, at the sampler's own number of steps.
const BATCHES: [usize; 2] = [4, 16];

/// Measures all rows and calls `done` after each.
pub(crate) fn measure(done: impl Fn()) -> Outcome<Vec<ModelRow>> {
    let sampler = WakeSampler::pretrained(&Device::default())?;
    let own = sampler.steps();
    let scenes = scenes(&sampler);
    let many = sampler.clone().with_steps(REFERENCE)?;
    let (whole, images) = seconds(|| draw(&many, &scenes, 1));
    let reference = Reference {
        seconds: whole / scenes.len() as f64,
        images: images?,
        scenes,
    };
    done();
    let mut rows = Vec::new();
    let mut add = |sampler: &WakeSampler, precision, batch| -> Outcome<()> {
        rows.push(reference.row(sampler, precision, batch)?);
        done();
        Ok(())
    };
    for steps in STEPS {
        add(&sampler.clone().with_steps(steps)?, "f16", 1)?;
    }
    for batch in BATCHES {
        add(&sampler.clone().with_steps(own)?, "f16", batch)?;
    }
    for rounding in Rounding::ALL {
        let sampler = rounded(rounding)?.with_steps(own)?;
        add(&sampler, rounding.name(), 1)?;
    }
    Ok(rows)
}

/// Number of calls of `done` in [`measure`].
pub(crate) const PARTS: usize = 1 + STEPS.len() + BATCHES.len() + Rounding::ALL.len();

/// Four scenes with different seas, ship speeds and headings.
fn scenes(sampler: &WakeSampler) -> Vec<Scene> {
    let values = [
        (45.0, 10.0, 5.0, 90.0, 32.0),
        (135.0, 7.0, 3.0, 200.0, 25.0),
        (250.0, 12.0, 6.5, 320.0, 18.0),
        (330.0, 8.5, 4.0, 20.0, 29.0),
    ];
    let scene = |(heading, speed, wind_speed, wind_toward, incidence)| {
        let mut scene = sampler.base_scene();
        for ship in &mut scene.ships {
            (ship.heading, ship.speed) = (heading, speed);
        }
        (scene.sea.wind_speed, scene.sea.wind_toward) = (wind_speed, wind_toward);
        scene.radar.incidence = incidence;
        scene
    };
    values.map(scene).to_vec()
}
