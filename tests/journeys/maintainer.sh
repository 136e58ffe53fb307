#!/usr/bin/env bash
# The next maintainer: a toy scheduler in one file, entered where docs/contributing.md says, and drawn with.
. "$(dirname "$0")/common.sh"
clone
rooms=crates/wake-ldm/src/stable_diffusion/scheduler
cat >$rooms/toy.rs <<'END'
//! A toy: jumps to the clean image in one step.

use super::betas::DEFAULTS;
use super::prediction::{Clipping, Prediction};
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::error::Result;
use crate::options::Options;

/// Options of the toy.
#[derive(Debug, Clone)]
pub(super) struct ToyConfig {
    schedule: NoiseSchedule,
    prediction: Prediction,
    clipping: Clipping,
}

impl Method for ToyConfig {
    fn take(options: &mut Options) -> Result<Self> {
        Ok(Self {
            schedule: NoiseSchedule::take(options, &DEFAULTS)?,
            prediction: Prediction::take(options, &Prediction::CURVED)?,
            clipping: Clipping::take(options, false)?,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, _n: usize) -> Result<Box<dyn Scheduler>> {
        let last = self.schedule.steps() - 1;
        Ok(Box::new(Toy {
            timesteps: vec![last as f64],
            config: self.clone(),
        }))
    }
}

#[derive(Debug)]
struct Toy {
    timesteps: Vec<f64>,
    config: ToyConfig,
}

impl Scheduler for Toy {
    fn timesteps(&self) -> &[f64] {
        &self.timesteps
    }

    fn noise_level(&self, _index: usize) -> NoiseLevel {
        self.config.schedule.noise_level(self.config.schedule.steps() - 1)
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let (level, config) = (self.noise_level(input.index), &self.config);
        let denoised = input.denoised(level, config.prediction, config.clipping);
        StepOutput {
            sample: denoised.clone(),
            denoised,
        }
    }
}
END
# The three places of the map: the module, its use, its entry in the list of classes.
sed -i 's/^mod whole_path;/mod toy;\n&/' $rooms/mod.rs
sed -i 's/^use super::unipc::UniPcConfig;/use super::toy::ToyConfig;\n&/' $rooms/config.rs
count=$(sed -n 's/^static CLASSES: \[Class; \([0-9]*\)\].*/\1/p' $rooms/config.rs)
sed -i "s/^static CLASSES: \[Class; $count\]/static CLASSES: [Class; $((count + 1))]/" $rooms/config.rs
sed -i 's/^    Class::of::<DdpmConfig>/    Class::of::<ToyConfig>("toy", "ToyScheduler"),\n&/' $rooms/config.rs
program
"$wake" generate --weights tests/fixtures/pipeline_a --scheduler toy --steps 1 --prompt "a ship" \
  --out "$scratch/out"
made "$scratch"/out/{image.png,report.json}
echo "maintainer: a scheduler in one file"
