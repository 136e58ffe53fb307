//! Every scheduler against diffusers, state by state.

use burn::tensor::{Device, Tensor};
use serde_json::Value;
use wake_ldm::scheduler::{
    NoiseLevel, NoiseSchedule, Scheduler, SchedulerConfig, StepInput, TerminalSnr,
};
use wake_nn::Error;

use crate::golden::{Golden, devices, difference, folder, json, largest, numbers, tensor};

/// The options that may be refused. Anything else in a fixture must run.
const REFUSABLE: [&str; 14] = [
    "_class_name",
    "algorithm_type",
    "beta_schedule",
    "final_sigmas_type",
    "lambda_min_clipped",
    "lower_order_final",
    "prediction_type",
    "s_churn",
    "solver_order",
    "solver_p",
    "solver_type",
    "use_beta_sigmas",
    "use_dynamic_shifting",
    "variance_type",
];

/// How far a correct f32 implementation may be from a state of the reference.
fn tolerance(run: &Value, expected: &[f32]) -> f64 {
    let floor = |key: &str| run.get(key).and_then(Value::as_f64).unwrap_or(0.0);
    let floor = floor("floor_f64_sample").max(floor("floor_initial_bump_2^-22"));
    2e-5 * largest(expected).max(1.0) + 10.0 * floor
}

/// What the fixtures' model answers: f64 arithmetic on f32 input, rounded to f32.
fn model(meta: &Value, sample: &Tensor<4>, timestep: f64) -> Tensor<4> {
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|key| meta["model"][key].as_f64().unwrap());
    let answer = |&x: &f32| {
        let x = f64::from(x);
        (a * x.tanh() + b * (c * x).sin() + d * timestep / 1000.0) as f32
    };
    let answers = numbers(sample).iter().map(answer).collect();
    tensor(answers, sample.dims().to_vec(), &sample.device())
}

/// A case of the manifest and where its numbers lie.
struct Case<'a> {
    name: &'a str,
    case: &'a Value,
    meta: &'a Value,
    golden: &'a Golden,
    device: &'a Device,
}

impl Case<'_> {
    /// Our scheduler, or the option that it refuses.
    fn config(&self, key: &str) -> Result<SchedulerConfig, String> {
        let mut options = self.case[key].as_object().unwrap().clone();
        options.insert("_class_name".to_owned(), self.case["class"].clone());
        options.extend(
            self.case["step_kwargs"]
                .as_object()
                .cloned()
                .unwrap_or_default(),
        );
        let text = Value::Object(options).to_string();
        match SchedulerConfig::from_json(&text, self.name.as_ref()) {
            Ok(config) => Ok(config),
            Err(Error::Unsupported { option, .. }) => Err(option),
            Err(error) => panic!("{}: {error}", self.name),
        }
    }

    fn expect_close(&self, what: &str, run: &Value, ours: &Tensor<4>, expected: &[f32]) {
        let (difference, allowed) = (
            difference(&numbers(ours), expected),
            tolerance(run, expected),
        );
        assert!(
            difference <= allowed,
            "{}, {what}: differs by {difference:e}, allowed {allowed:e}",
            self.name
        );
    }

    fn check_schedule(&self, scheduler: &dyn Scheduler, run: &Value, path: &str) {
        let expected: Vec<f64> = run["timesteps"]
            .as_array()
            .unwrap()
            .iter()
            .map(|t| t.as_f64().unwrap())
            .collect();
        assert_eq!(scheduler.timesteps().len(), expected.len(), "{path}");
        for (ours, expected) in scheduler.timesteps().iter().zip(&expected) {
            // Whole steps agree exactly; fractions come from f32 logarithms.
            assert!(
                (ours - expected).abs() <= 1e-6 * expected.abs().max(1.0),
                "{path}: {ours} {expected}"
            );
        }
        let sigma = run["init_noise_sigma"].as_f64().unwrap();
        assert!(
            (scheduler.init_noise_sigma() / sigma - 1.0).abs() < 1e-6,
            "{path}"
        );
        let draws: Vec<usize> = (0..expected.len())
            .filter(|&i| scheduler.needs_noise(i))
            .collect();
        let used: Vec<usize> = match &run["noise_used_at_steps"] {
            Value::String(word) if word == "all" => (0..expected.len()).collect(),
            Value::String(_) => vec![],
            list => list
                .as_array()
                .unwrap()
                .iter()
                .map(|i| i.as_u64().unwrap() as usize)
                .collect(),
        };
        assert_eq!(draws, used, "{path}");
    }

    fn check_sigmas(&self, scheduler: &dyn Scheduler, path: &str) {
        let name = format!("{path}/sigmas");
        if !self.golden.has(&name) {
            return;
        }
        for (i, &sigma) in self.golden.f32s(&name)[..scheduler.timesteps().len()]
            .iter()
            .enumerate()
        {
            let NoiseLevel { signal, noise } = scheduler.noise_level(i);
            let straight = (signal + noise - 1.0).abs() < 1e-9;
            let ours = if straight { noise } else { noise / signal };
            assert!(
                (ours / f64::from(sigma) - 1.0).abs() < 2e-6,
                "{path}: {ours} {sigma}"
            );
        }
    }

    /// One run, step by step; `teacher` starts every step from the reference's state.
    fn check_run(&self, config: &SchedulerConfig, steps: &str, run: &Value) {
        let path = format!("{}/{steps}", self.name);
        let scheduler = config.scheduler(steps.parse().unwrap());
        if run.get("error").is_some() {
            assert!(scheduler.is_err(), "{path} fails in diffusers");
            return;
        }
        let mut scheduler = scheduler.unwrap_or_else(|error| panic!("{path}: {error}"));
        self.check_schedule(scheduler.as_ref(), run, &path);
        self.check_sigmas(scheduler.as_ref(), &path);
        let [trajectory, denoised] =
            ["traj", "pred_original_sample"].map(|name| format!("{path}/{name}"));
        let mut sample: Tensor<4> =
            self.golden.tensor::<4>("latents", self.device) * scheduler.init_noise_sigma();
        let timesteps = scheduler.timesteps().to_vec();
        for (index, &timestep) in timesteps.iter().enumerate() {
            let input = scheduler.scale_model_input(sample.clone(), index);
            let prediction = model(self.meta, &input, timestep);
            let noise = scheduler
                .needs_noise(index)
                .then(|| self.golden.entry("noise", index, self.device));
            let output = scheduler.step(StepInput {
                index,
                prediction,
                sample,
                noise,
            });
            sample = output.sample;
            let state = self.golden.f32s_of(&trajectory, index + 1);
            self.expect_close(
                &format!("{steps} steps, state {}", index + 1),
                run,
                &sample,
                &state,
            );
            if self.golden.has(&denoised) {
                let clean = self.golden.f32s_of(&denoised, index);
                let what = format!("{steps} steps, clean image {index}");
                self.expect_close(&what, run, &output.denoised, &clean);
            }
        }
    }

    /// Noise added to clean images, and velocities, at the listed steps.
    fn check_noising(&self, config: &SchedulerConfig) {
        let listed = self.case["add_noise_timesteps"].as_array().unwrap();
        let after = self
            .case
            .get("add_noise_after_set_timesteps")
            .and_then(Value::as_u64);
        let scheduler = after.map(|steps| config.scheduler(steps as usize).unwrap());
        let level = |t: f64| match &scheduler {
            Some(scheduler) => {
                let index = scheduler
                    .timesteps()
                    .iter()
                    .position(|&s| (s - t).abs() < 1e-3);
                scheduler.noise_level(index.unwrap())
            }
            None => config.noise_schedule().unwrap().noise_level(t as usize),
        };
        let [clean, eps] = ["clean", "eps"].map(|name| self.golden.tensor::<4>(name, self.device));
        for (i, t) in listed.iter().enumerate() {
            let level = level(t.as_f64().unwrap());
            for (name, ours) in [
                ("add_noise", level.mix(clean.clone(), eps.clone())),
                ("velocity", level.velocity(clean.clone(), eps.clone())),
            ] {
                let name = format!("{}/{name}", self.name);
                if self.golden.has(&name) {
                    let expected = self.golden.f32s_of(&name, i);
                    self.expect_close(&format!("{name} {t}"), &Value::Null, &ours, &expected);
                }
            }
        }
    }

    /// The schedule itself is one of the stored ones, to the last bits of f32; `false` where none of its length and with
    /// its first and last β is stored.
    fn check_schedule_table(
        &self,
        config: &SchedulerConfig,
        tables: &[(Vec<f32>, Vec<f32>)],
    ) -> bool {
        let Some(schedule) = config.noise_schedule() else {
            return false;
        };
        let plain = NoiseSchedule::new(schedule.curve(), schedule.steps(), TerminalSnr::Kept);
        let ends = |betas: &[f32]| [0, betas.len() - 1].map(|t| betas[t]);
        let plain = plain.unwrap();
        let [first, last] = ends(plain.betas());
        let is_meant = |(betas, _): &&(Vec<f32>, Vec<f32>)| {
            let [a, b] = ends(betas);
            let near = |x: f32, y: f32| (x - y).abs() <= 1e-3 * y;
            betas.len() == plain.steps() && near(a, first) && near(b, last)
        };
        if !tables.iter().any(|table| is_meant(&table)) {
            return false;
        }
        let same = |ours: &[f32], stored: &[f32], ulps: f32| {
            ours.len() == stored.len()
                && ours
                    .iter()
                    .zip(stored)
                    .all(|(a, b)| (a - b).abs() <= ulps * f32::EPSILON * b.abs())
        };
        let found = tables.iter().any(|(betas, alphas)| {
            let stretched = alphas[alphas.len() - 1] < 1e-7;
            // PyTorch's vectorised linspace rounds the root of β differently by 1.5 ulp; squared, 3.
            // The last ᾱ of a stretched schedule is 0, or 2^-24 for methods that divide by it.
            let compared = alphas.len() - usize::from(stretched);
            let ours = &schedule.alphas_cumprod()[..compared.min(schedule.steps())];
            let last = f64::from(schedule.alphas_cumprod()[schedule.steps() - 1]);
            let close = same(ours, &alphas[..compared], 64.0) && (!stretched || last < 1e-7);
            close && (stretched || same(schedule.betas(), betas, 4.0))
        });
        let ends = [0, schedule.steps() - 1].map(|t| schedule.alphas_cumprod()[t]);
        assert!(
            found,
            "{}: no stored schedule has the ends {ends:?}",
            self.name
        );
        true
    }
}

/// The stored schedules: β and ᾱ, and ᾱ once more without terminal signal.
fn stored_schedules(golden: &Golden) -> Vec<(Vec<f32>, Vec<f32>)> {
    let mut tables = Vec::new();
    for name in golden
        .names()
        .filter_map(|name| name.strip_prefix("betas/"))
    {
        let betas = golden.f32s(&format!("betas/{name}"));
        for kind in ["alphas_cumprod", "alphas_cumprod_zsnr"] {
            let alphas = format!("{kind}/{name}");
            if golden.has(&alphas) {
                tables.push((betas.clone(), golden.f32s(&alphas)));
            }
        }
    }
    tables
}

#[test]
fn schedulers_follow_diffusers_state_by_state() {
    follow(|golden| golden);
}

/// The same files in another layout.
#[test]
fn images_of_a_batch_follow_their_own_states() {
    follow(|golden| golden.in_pairs(&["latents", "clean", "eps"]));
}

/// All cases, on numbers laid out anew.
fn follow(layout: fn(Golden) -> Golden) {
    let folder = folder().join("schedulers");
    let manifest = json(&folder.join("schedulers.json"));
    let golden = layout(Golden::read(&folder.join("trajectories.safetensors")));
    let tables = stored_schedules(&golden);
    let cases = manifest["cases"].as_object().expect("cases");
    assert!(!cases.is_empty(), "no cases in {}", folder.display());
    for (backend, device) in devices() {
        let (mut ran, mut compared, mut refused) = (0, 0, Vec::new());
        for (name, case) in cases {
            let meta = &manifest["meta"];
            let case = Case {
                name,
                case,
                meta,
                golden: &golden,
                device: &device,
            };
            match case.config("config") {
                Ok(config) => {
                    let full = case.config("full_config");
                    assert!(
                        full.is_ok(),
                        "{name}: spelling out defaults is refused: {full:?}"
                    );
                    compared += usize::from(case.check_schedule_table(&config, &tables));
                    for (steps, run) in case.case["runs"].as_object().unwrap() {
                        case.check_run(&config, steps, run);
                    }
                    case.check_noising(&config);
                    ran += 1;
                }
                Err(option) => {
                    let name = option.rsplit(' ').next().unwrap_or_default().to_owned();
                    assert!(
                        REFUSABLE.contains(&name.as_str()),
                        "{}: {option} refused",
                        case.name
                    );
                    refused.push(format!("{} ({name})", case.name));
                }
            }
        }
        println!(
            "{backend}: {ran} scheduler cases ran, {} refused {refused:?}",
            refused.len()
        );
        assert!(ran > 0, "no scheduler case ran");
        assert!(
            compared > 0 || tables.is_empty(),
            "no stored schedule was compared"
        );
    }
}
