//! The last part: the flow, which draws the residuals from mean and spread.

use burn::tensor::Device;
use serde_json::json;
use wake_physics::Scene;

use super::super::progress::counted;
use super::super::run::Run;
use super::super::sheet::write_sheet;
use super::super::stage_options::StageOptions;
use super::super::tasks::FlowTask;
use super::{ACROSS, SHEET, WakeTraining, keep};
use crate::error::Result;
use wake_ldm::network::{Flow, Part, WakeModel};
use wake_ldm::sampler::WakeSampler;

impl WakeTraining<'_> {
    /// Trains the flow, after all earlier parts that are not trained yet.
    pub(super) fn train_flow(&mut self, options: &StageOptions) -> Result<()> {
        if let Some(earlier) = self.earlier(Part::Parser)? {
            self.train_parser(&earlier)?;
        }
        if let Some(earlier) = self.earlier(Part::Prior)? {
            self.train_prior(&earlier)?;
        }
        let config = self.config.clone();
        let device = options.device();
        let model = WakeModel {
            patches: self.patches()?,
            parser: self.trained(config.init_parser(&device), Part::Parser)?,
            prior: self.trained(config.init_prior(&device), Part::Prior)?,
            flow: config.init_flow(&device),
        };
        let set = self.latents(&model.patches)?;
        let pairs = self.pairs()?;
        let identity = json!({
            "data": pairs.identity(), "patches": self.fingerprint(Part::Patches)?, "prior": self.fingerprint(Part::Prior)?,
        });
        let set = counted("residuals", set.len() as u64, self.progress, |done| {
            set.residuals(&model.prior, |n| done(n as u64))
        });
        let init = |device: &Device| config.init_flow(device);
        let run = self.run_of(Part::Flow, options, identity, init)?;
        let task = FlowTask {
            set: &set,
            patches: &model.patches,
            seed: options.seed,
        };
        let examples = pairs.first(ACROSS)?;
        let scenes: Vec<Scene> = examples.iter().map(|pair| pair.scene.clone()).collect();
        let (weights, sheet) = (self.out(Part::Flow.file()), self.out(SHEET));
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
        let stage = Self::stage(Part::Flow, options);
        stage.train(&mut self.folder, run, &task, self.progress, show)
    }
}
