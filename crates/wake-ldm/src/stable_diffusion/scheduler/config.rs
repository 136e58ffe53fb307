//! Reading a scheduler from diffusers' `scheduler_config.json`.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Map, Value};

use super::ddim::DdimConfig;
use super::ddpm::DdpmConfig;
use super::dpm_solver_pp::DpmSolverConfig;
use super::euler::Euler;
use super::euler_ancestral::EulerAncestral;
use super::flow_match_euler::FlowMatchEulerConfig;
use super::heun::Heun;
use super::known_options::KNOWN;
use super::lcm::LcmConfig;
use super::lms::Lms;
use super::pndm::PndmConfig;
use super::sigma_sampler::SigmaConfig;
use super::unipc::UniPcConfig;
use super::{Method, NoiseSchedule, Scheduler, SchedulerOption};
use crate::options::Options;
use wake_nn::{Error, Result};

/// Method with its short name, its class name in diffusers and the function that reads its options.
struct Class {
    short: &'static str,
    name: &'static str,
    take: fn(&mut Options) -> Result<Arc<dyn Method>>,
}

impl Class {
    const fn of<M: Method + 'static>(short: &'static str, name: &'static str) -> Self {
        Self {
            short,
            name,
            take: |options| Ok(Arc::new(M::take(options)?)),
        }
    }
}

static CLASSES: [Class; 11] = [
    Class::of::<DdpmConfig>("ddpm", "DDPMScheduler"),
    Class::of::<DdimConfig>("ddim", "DDIMScheduler"),
    Class::of::<PndmConfig>("pndm", "PNDMScheduler"),
    Class::of::<SigmaConfig<Euler>>("euler", "EulerDiscreteScheduler"),
    Class::of::<SigmaConfig<EulerAncestral>>("euler-ancestral", "EulerAncestralDiscreteScheduler"),
    Class::of::<DpmSolverConfig>("dpm++", "DPMSolverMultistepScheduler"),
    Class::of::<SigmaConfig<Heun>>("heun", "HeunDiscreteScheduler"),
    Class::of::<SigmaConfig<Lms>>("lms", "LMSDiscreteScheduler"),
    Class::of::<UniPcConfig>("unipc", "UniPCMultistepScheduler"),
    Class::of::<LcmConfig>("lcm", "LCMScheduler"),
    Class::of::<FlowMatchEulerConfig>("flow-match-euler", "FlowMatchEulerDiscreteScheduler"),
];

/// A scheduler and its options, named as in diffusers.
///
/// ```
/// use wake_ldm::scheduler::{SchedulerConfig, SchedulerOption};
///
/// # fn main() -> Result<(), wake_ldm::Error> {
/// let config = SchedulerConfig::stable_diffusion("dpm++")?.with(SchedulerOption::KarrasSigmas(true))?;
/// let scheduler = config.scheduler(10)?;
/// assert_eq!(scheduler.timesteps()[0], 999.0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct SchedulerConfig {
    options: Map<String, Value>,
    class: &'static str,
    method: Arc<dyn Method>,
}

impl SchedulerConfig {
    /// Short names that [`with_class`](Self::with_class) accepts.
    pub fn names() -> impl Iterator<Item = &'static str> {
        CLASSES.iter().map(|class| class.short)
    }

    /// Makes a scheduler with the noise schedule of Stable Diffusion v1.4.
    ///
    /// Its other options have their defaults, except that clipping is off.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for a name that is neither one of [`names`](Self::names) nor an implemented class of diffusers.
    pub fn stable_diffusion(name: &str) -> Result<Self> {
        let options = [
            ("_class_name", Value::from(class_of(name)?.name)),
            ("beta_schedule", "scaled_linear".into()),
            ("beta_start", 0.00085.into()),
            ("beta_end", 0.012.into()),
            ("clip_sample", false.into()),
            ("set_alpha_to_one", (name == "lcm").into()),
            ("skip_prk_steps", true.into()),
            ("steps_offset", 1.into()),
        ];
        Self::from_options(
            options
                .map(|(key, value)| (key.to_owned(), value))
                .into_iter()
                .collect(),
        )
    }

    /// Reads a `scheduler_config.json`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] and [`Error::Json`] for a bad file, otherwise as [`with`](Self::with).
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_json(&whole_files::read_text(path)?, path)
    }

    /// Reads the text of a `scheduler_config.json`; `path` is used only in messages.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        let options = serde_json::from_str(&finite(text)).map_err(|source| Error::Json {
            path: path.to_owned(),
            source,
        })?;
        Self::from_options(options)
    }

    /// Returns the configuration with one option changed.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for an option or value that would change the result and is not
    /// implemented, [`Error::OutOfRange`] or [`Error::InvalidOption`] for an invalid one.
    pub fn with(self, option: SchedulerOption) -> Result<Self> {
        let (key, value) = option.entry();
        self.with_entry(key, value)
    }

    fn with_entry(mut self, key: &str, value: Value) -> Result<Self> {
        self.options.insert(key.to_owned(), value);
        Self::from_options(self.options)
    }

    /// Returns another scheduler with the same options, as diffusers' `from_config` does.
    ///
    /// # Errors
    ///
    /// As [`with`](Self::with).
    pub fn with_class(self, name: &str) -> Result<Self> {
        let class = class_of(name)?.name;
        self.with_entry("_class_name", class.into())
    }

    /// Class name in diffusers.
    pub fn class(&self) -> &'static str {
        self.class
    }

    /// Content of the `scheduler_config.json` of this configuration.
    pub fn to_json(&self) -> Value {
        Value::Object(self.options.clone())
    }

    /// Noise of the training steps; `None` for straight paths, which have none.
    pub fn noise_schedule(&self) -> Option<&NoiseSchedule> {
        self.method.schedule()
    }

    /// Makes a scheduler for one run with a number of steps.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a number of steps that the method does not support, or that leads to
    /// training steps that do not exist; [`Error::InvalidOption`] for noise prediction where no
    /// signal is left.
    pub fn scheduler(&self, steps: usize) -> Result<Box<dyn Scheduler>> {
        self.method.start(steps)
    }

    fn from_options(options: Map<String, Value>) -> Result<Self> {
        let name = options
            .get("_class_name")
            .and_then(Value::as_str)
            .unwrap_or("absent");
        let class = class_of(name)?;
        let text = Value::Object(options.clone()).to_string();
        let mut left = Options::parse(class.name, &text, Path::new("scheduler_config.json"))?;
        let method = (class.take)(&mut left)?;
        left.ignore(&KNOWN);
        left.finish()?;
        Ok(Self {
            options,
            class: class.name,
            method,
        })
    }
}

/// Class with a short name or a class name in diffusers.
fn class_of(name: &str) -> Result<&'static Class> {
    let found = CLASSES
        .iter()
        .find(|class| [class.short, class.name].contains(&name));
    found.ok_or_else(|| Error::Unsupported {
        option: "scheduler _class_name".to_owned(),
        value: name.to_owned(),
        supported: CLASSES
            .iter()
            .map(|class| format!("{} ({})", class.short, class.name))
            .collect::<Vec<_>>()
            .join(", "),
    })
}

/// Replaces the infinities that Python writes, and JSON does not have, by the largest finite numbers.
fn finite(text: &str) -> String {
    text.replace("-Infinity", "-1.7976931348623157e308")
        .replace(": Infinity", ": 1.7976931348623157e308")
}

#[cfg(test)]
mod tests {
    use super::super::{Prediction, Spacing};
    use super::*;

    fn read(text: &str) -> Result<SchedulerConfig> {
        SchedulerConfig::from_json(text, Path::new("scheduler_config.json"))
    }

    #[test]
    fn every_name_gives_its_class_and_a_schedule_for_any_number_of_steps() {
        for name in SchedulerConfig::names() {
            let config = SchedulerConfig::stable_diffusion(name).unwrap();
            let again = SchedulerConfig::stable_diffusion(config.class()).unwrap();
            assert_eq!(config.class(), again.class());
            let most = if name == "lcm" { 50 } else { 999 };
            for steps in [1, 2, 10, 50, most] {
                let scheduler = config.scheduler(steps).unwrap();
                assert!(scheduler.timesteps().len() >= steps, "{name} {steps}");
            }
            assert!(config.scheduler(0).is_err() && config.scheduler(1001).is_err());
        }
    }

    #[test]
    fn a_foreign_option_is_ignored_and_an_unknown_one_refused() {
        assert!(read(r#"{"_class_name": "PNDMScheduler", "use_karras_sigmas": true}"#).is_ok());
        let error = read(r#"{"_class_name": "DDIMScheduler", "swirl": 2}"#).unwrap_err();
        assert!(matches!(&error, Error::Unsupported { option, .. } if option.ends_with("swirl")));
        let error =
            read(r#"{"_class_name": "DDIMScheduler", "prediction_type": "x"}"#).unwrap_err();
        assert!(error.to_string().contains("prediction_type"));
        assert!(read(r#"{"_class_name": "ScoreSdeVeScheduler"}"#).is_err());
        assert!(read(r#"{}"#).is_err() && read("[]").is_err() && read("").is_err());
    }

    #[test]
    fn python_infinities_are_read() {
        let text =
            r#"{"_class_name": "DPMSolverMultistepScheduler", "lambda_min_clipped": -Infinity}"#;
        let config = read(text).unwrap();
        assert_eq!(config.scheduler(10).unwrap().timesteps().len(), 10);
    }

    #[test]
    fn a_thousand_steps_beyond_the_last_training_step_are_refused_by_name() {
        let config = SchedulerConfig::stable_diffusion("ddim").unwrap();
        let error = config.scheduler(1000).unwrap_err();
        assert!(matches!(&error, Error::OutOfRange { name, .. } if name.contains("steps_offset")));
        assert!(
            config
                .with(SchedulerOption::StepsOffset(0))
                .unwrap()
                .scheduler(1000)
                .is_ok()
        );
    }

    #[test]
    fn noise_prediction_without_any_signal_is_refused() {
        let zero = SchedulerConfig::stable_diffusion("ddim")
            .unwrap()
            .with(SchedulerOption::ZeroTerminalSnr(true))
            .unwrap()
            .with(SchedulerOption::Spacing(Spacing::Trailing))
            .unwrap();
        assert!(matches!(
            zero.scheduler(4),
            Err(Error::InvalidOption { .. })
        ));
        assert!(
            zero.with(SchedulerOption::Prediction(Prediction::Velocity))
                .unwrap()
                .scheduler(4)
                .is_ok()
        );
    }
}
