//! The third part: mean and spread of the latents, from the numbers of a scene.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use serde_json::json;

use super::super::latents::LatentSet;
use super::super::run::Run;
use super::super::sheet::write_sheet;
use super::super::stage_options::StageOptions;
use super::super::tasks::PriorTask;
use super::{ACROSS, SHEET, WakeTraining, keep};
use crate::error::Result;
use wake_dataset::Pair;
use wake_ldm::network::{Part, PatchTransform, PhysicsPrior, Prior, WakeModelConfig};

impl WakeTraining<'_> {
    /// Trains the prior, after the patches.
    pub(super) fn train_prior(&mut self, options: &StageOptions) -> Result<()> {
        let patches = self.patches()?;
        let set = self.latents(&patches)?;
        let pairs = self.pairs()?;
        let identity =
            json!({"data": pairs.identity(), "patches": self.fingerprint(Part::Patches)?});
        let config = &self.config;
        let init = |device: &Device| config.init_prior(device);
        let run = self.run_of(Part::Prior, options, identity, init)?;
        let task = PriorTask {
            set: &set,
            seed: options.seed,
        };
        let examples = pairs.first(ACROSS)?;
        let (config, weights, sheet) = (
            self.config.clone(),
            self.out(Part::Prior.file()),
            self.out(SHEET),
        );
        let show = |run: &Run<Prior>| {
            let prior = run.averaged();
            keep(&prior, &weights)?;
            let means = expected_images(&prior, &patches, &config, &examples)?;
            write_sheet(&examples, &means, &sheet)
        };
        let stage = Self::stage(Part::Prior, options);
        stage.train(&mut self.folder, run, &task, self.progress, show)
    }
}

/// Images that the prior expects of some scenes.
fn expected_images(
    prior: &Prior,
    patches: &PatchTransform,
    config: &WakeModelConfig,
    examples: &[Pair],
) -> Result<Vec<Vec<f32>>> {
    let mut set = LatentSet::default();
    let mut images = Vec::new();
    for pair in examples {
        let physics = PhysicsPrior::new(&pair.scene, &config.grey, patches)?;
        images.extend_from_slice(&physics.grey);
        let pixels = pair.image.pixels.clone();
        set.extend(patches, vec![(pixels, physics, pair.scene.clone())])?;
    }
    let all: Vec<usize> = (0..set.len()).collect();
    let device = patches.devices().into_iter().next().unwrap_or_default();
    let inputs = set.inputs(&all, &device);
    let expected = prior.forward(&inputs);
    let size = config.image_size;
    let grey = TensorData::new(images, [set.len(), 1, size, size]);
    let grey: Tensor<4> = Tensor::from_data(grey, &inputs.wake.device());
    let added = patches.decode(expected.mean - inputs.wake, expected.grey);
    let data = (grey + added).clamp(0.0, 1.0).into_data();
    let pixels: Vec<f32> = data.iter::<f32>().collect();
    Ok(pixels.chunks(size * size).map(<[f32]>::to_vec).collect())
}
