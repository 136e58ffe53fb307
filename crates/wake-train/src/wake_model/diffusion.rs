//! The last stage: the flow that draws what mean and spread leave open.

use burn::tensor::Device;
use serde_json::json;
use wake_physics::Scene;

use super::super::progress::counted;
use super::super::run::Run;
use super::super::sheet::write_sheet;
use super::super::tasks::FlowTask;
use super::{ACROSS, FLOW, PARSER, PATCHES, PRIOR, SHEET, WakeStage, WakeTraining, keep};
use crate::error::Result;
use wake_ldm::network::{Flow, WakeModel, WakeModelConfig};
use wake_ldm::sampler::WakeSampler;

impl WakeTraining<'_> {
    /// Trains the flow, after all stages that are not done yet.
    ///
    /// # Errors
    ///
    /// As [`mean`](Self::mean), and [`wake_nn::Error::InvalidOption`] when an earlier stage was begun with
    /// other values.
    pub fn diffusion(&mut self) -> Result<()> {
        if let Some(earlier) = self.earlier(WakeStage::Words)? {
            self.words_with(&earlier)?;
        }
        if let Some(earlier) = self.earlier(WakeStage::Mean)? {
            self.mean_with(&earlier)?;
        }
        let (config, options) = (self.config.clone(), self.options.clone());
        let device = options.device();
        let model = WakeModel {
            patches: self.patches()?,
            parser: self.part(config.init_parser(&device), PARSER)?,
            prior: self.part(config.init_prior(&device), PRIOR)?,
            flow: config.init_flow(&device),
        };
        let set = self.latents(&model.patches)?;
        let pairs = self.pairs()?;
        let identity = json!({
            "data": pairs.identity(), "patches": self.fingerprint(PATCHES)?, "prior": self.fingerprint(PRIOR)?,
        });
        let set = counted("residuals", set.len() as u64, self.progress, |done| {
            set.residuals(&model.prior, |n| done(n as u64))
        });
        let init = |config: &WakeModelConfig, device: &Device| config.init_flow(device);
        let run = Run::new(
            WakeStage::Diffusion.name(),
            &config,
            init,
            options.run(&WakeStage::Diffusion.usual(), identity),
            options.learning_devices()?,
        )?;
        let task = FlowTask {
            set: &set,
            patches: &model.patches,
            seed: options.seed,
        };
        let examples = pairs.first(ACROSS)?;
        let scenes: Vec<Scene> = examples.iter().map(|pair| pair.scene.clone()).collect();
        let (weights, sheet) = (self.out(FLOW), self.out(SHEET));
        let show = |run: &Run<Flow>| {
            let flow = run.averaged();
            keep(&flow, &weights)?;
            let model = WakeModel {
                flow,
                ..model.clone()
            };
            let drawn = WakeSampler::new(model, config.clone())?.sample_scenes(&scenes)?;
            let drawn: Vec<Vec<f32>> = drawn.into_iter().map(|image| image.grey.values).collect();
            write_sheet(&examples, &drawn, &sheet)
        };
        let stage = Self::stage(WakeStage::Diffusion, &options);
        stage.train(&mut self.folder, run, &task, self.progress, show)
    }
}
