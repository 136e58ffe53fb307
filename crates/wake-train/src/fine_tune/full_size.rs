//! Time and memory of training steps at the size of Stable Diffusion v1.4, with random weights.
//!
//! ```text
//! SIDE=512 RANK=8 cargo test --release -p wake-train --lib full_size -- --ignored --nocapture
//! ```
//!
//! Environment: `SIDE` of the images \[pixels\], `RANK` (without it the whole U-Net is trained), `BATCH`, `STEPS`, `DEVICE`
//! (flex), and `CHECKPOINTING` and `BF16`, which are on if they are set. `benches/torch_reference.py fine-tune` measures the
//! same with torch.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::print_stdout, reason = "figures are what it is for")]

use std::env::var;
use std::time::Instant;

use serde_json::{Value, json};
use wake_dataset::Grey;

use super::batches::Prompted;
use super::*;
use crate::run::{Run, RunOptions};
use crate::tensors::values;
use crate::trainer::TrainerOptions;
use crate::{LrSchedule, StageOptions};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::UNetConfig;
use wake_nn::weights::Layout;

/// Noise with one prompt.
#[derive(Debug)]
struct Noise {
    side: usize,
}

impl PromptedSource for Noise {
    fn at(&self, position: u64) -> Result<Prompted> {
        let pixels = NoiseSource::new(position).normal(0, self.side * self.side);
        Ok(Prompted {
            image: Grey {
                rows: self.side,
                columns: self.side,
                pixels: pixels
                    .iter()
                    .map(|x| (0.5 + 0.2 * x).clamp(0.0, 1.0))
                    .collect(),
            },
            ids: (0..77).collect(),
        })
    }
}

fn number(name: &str, default: usize) -> usize {
    var(name).map_or(default, |text| text.parse().unwrap())
}

/// Largest memory of this process so far \[GB\], as Linux counts it.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or(f64::NAN) * 1024e-9
}

/// Initializes the random weights of a module now; otherwise every copy would do so in its first step.
fn drawn<M: Module>(module: M) -> M {
    values(&module);
    module
}

/// Makes some steps, and prints the seconds of each.
fn steps<M: Module>(mut run: Run<M>, task: &impl Task<M>) {
    for step in 1..=number("STEPS", 2) {
        let begin = Instant::now();
        let (report, _) = run.step(task).unwrap();
        assert!(report.applied, "{report:?}");
        let seconds = begin.elapsed().as_secs_f64();
        println!(
            "step {step}: {seconds:.1} s, loss {:.4}, peak {:.2} GB",
            report.loss,
            peak()
        );
    }
}

#[test]
#[ignore = "gigabytes and minutes; prints figures"]
fn full_size() {
    let device = wake_nn::device_named(&var("DEVICE").unwrap_or("flex".into())).unwrap();
    let options = StageOptions {
        checkpointing: var("CHECKPOINTING").is_ok(),
        bf16: var("BF16").is_ok(),
        devices: vec![device.clone()],
        ..StageOptions::default()
    };
    let devices = options.learning_devices().unwrap();
    let constants = RunOptions {
        batch: number("BATCH", 1),
        seed: 1,
        identity: Value::Null,
        trainer: TrainerOptions {
            rate: LrSchedule {
                peak: 1e-5,
                warmup: 1,
                steps: 10,
            },
            bf16: options.bf16,
            ..TrainerOptions::default()
        },
    };
    let frozen = Frozen {
        text: drawn(ClipTextConfig::new().init(&device)),
        autoencoder: drawn(AutoencoderKlConfig::new().init(&device)),
    };
    let unet = drawn(UNetConfig::new().init(&device));
    let scheduler = SchedulerConfig::stable_diffusion("ddim").unwrap();
    let schedule = scheduler.noise_schedule().unwrap().clone();
    let source = Noise {
        side: number("SIDE", 512),
    };
    let how = (schedule, Prediction::Epsilon);
    let task = FineTuneTask::new(source, &frozen, how, 1, &devices).unwrap();
    println!(
        "{} weights, {:.2} GB with all models",
        unet.num_params(),
        peak()
    );
    match var("RANK") {
        Err(_) => {
            let run = Run::of("whole", &json!({}), |_| unet.train(), constants, devices);
            steps(run.unwrap(), &task);
        }
        Ok(rank) => {
            let task = task.with_base(&unet);
            let base = unet.no_grad().train().fork(&devices[0]);
            let rank = rank.parse().unwrap();
            let changes = LowRank::of_attentions(&base, Layout::Diffusers, rank).unwrap();
            drop(base);
            let run = Run::of("changes", &json!({}), |_| changes, constants, devices);
            steps(run.unwrap(), &task);
        }
    }
}
