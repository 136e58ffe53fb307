//! Training of the detector.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use burn::tensor::{Device, Tensor};
use rayon::prelude::*;
use serde_json::{Value, json};
use wake_dataset::{Pair, Source};
use wake_nn::weights::{Layout, Precision, load, save_as};
use whole_files::fingerprint;

use super::data::TrainingData;
use super::draw::Draw;
use super::labelled::{self, LabelledImages};
use super::recipes::{ImageRecipe, in_turn};
use super::sample::Sample;
use super::targets::{Batch, Prepared};
use crate::error::Result;
use crate::folder::RunFolder;
use crate::progress::Progress;
use crate::run::{Run, RunOptions, Task, Terms, number};
use crate::stage::Stage;
use crate::stage_options::{StageDefaults, StageOptions};
use wake_detector::network::Network;
use wake_detector::self_check::self_check;

/// Defaults of a run.
const DEFAULTS: StageDefaults = StageDefaults {
    steps: 2500,
    batch: 16,
    rate: 2e-3,
};
/// Rows and columns of an image.
const SIZE: usize = 256;
/// Name of the stage, its checkpoints and its log.
const STAGE: &str = "detector";
/// File that is written: averaged weights.
const WEIGHTS: &str = "detector.safetensors";
/// Separates the random numbers of mirroring from the random numbers of the image.
const TURNED: u64 = 0x5151;

/// Task of the detector: maps with hills at tips, lines, directions and extents.
///
/// Images are mirrored and transposed at random, as in the geometry of other passes.
#[derive(Debug)]
pub struct DetectorTask {
    source: Arc<dyn Source>,
    seed: u64,
}

impl DetectorTask {
    /// Task on the square images of a source.
    ///
    /// - `seed`: seed of the mirroring
    #[must_use]
    pub fn new(source: Arc<dyn Source>, seed: u64) -> Self {
        Self { source, seed }
    }

    /// Makes the pairs at some positions, with one thread per core, since a source makes one at a time.
    fn pairs(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
        let each = (positions.end - positions.start).div_ceil(threads).max(1) as usize;
        let begins = positions.clone().step_by(each);
        let shares = begins.map(|begin| begin..positions.end.min(begin + each as u64));
        let made: Vec<wake_dataset::Result<Vec<Pair>>> = std::thread::scope(|scope| {
            let makers: Vec<_> = shares
                .map(|share| scope.spawn(|| self.source.items(share)))
                .collect();
            let join = |maker: std::thread::ScopedJoinHandle<'_, _>| {
                maker
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            makers.into_iter().map(join).collect()
        });
        let made = made.into_iter().collect::<wake_dataset::Result<Vec<_>>>()?;
        Ok(made.concat())
    }
}

/// Images of a part of a step, with their target maps.
#[derive(Debug)]
pub struct DetectorBatch(Vec<Prepared>);

impl Task<Network> for DetectorTask {
    type Batch = DetectorBatch;

    fn batch(&self, positions: Range<u64>) -> Result<DetectorBatch> {
        let pairs = self.pairs(positions.clone())?;
        let prepare = |(pair, position): (&Pair, u64)| {
            let draw = &mut Draw::new(self.seed ^ TURNED, position);
            Prepared::new(&Sample::of_pair(pair).turned(draw))
        };
        let pairs: Vec<(&Pair, u64)> = pairs.iter().zip(positions).collect();
        Ok(DetectorBatch(pairs.into_par_iter().map(prepare).collect()))
    }

    fn loss(&self, model: &Network, device: &Device, batch: &DetectorBatch) -> (Tensor<1>, Terms) {
        let batch = Batch::new(&batch.0, device);
        let (loss, terms) = batch.loss(model.forward(batch.images.clone()));
        let names = ["tips", "lines", "directions", "extents"];
        let terms = names.into_iter().zip(terms);
        (
            loss,
            terms.map(|(name, term)| (name, number(&term))).collect(),
        )
    }
}

/// Images made on the fly.
#[derive(Debug, Clone, Default)]
pub struct MadeImages {
    /// Recipe of the images.
    pub recipe: ImageRecipe,
    /// Number of different images, repeated endlessly; `None`: all are different. In the recipes mixed and full it counts
    /// simulated images, and painted ones do not repeat. Clutter over repeated images is new.
    pub distinct: Option<usize>,
}

/// Training images of a detector.
#[derive(Debug, Clone)]
pub enum TrainingImages {
    /// Images made on the fly.
    Recipe(MadeImages),
    /// The training pairs of a folder that `wake dataset` made.
    Data(PathBuf),
    /// A few labelled images.
    Labelled(LabelledImages),
    /// A few labelled images in every other place of a batch, images made on the fly in the others.
    Both(LabelledImages, MadeImages),
}

impl Default for TrainingImages {
    fn default() -> Self {
        Self::Recipe(MadeImages::default())
    }
}

/// Training of a detector.
#[derive(Debug, Clone, Default)]
pub struct DetectorTraining {
    /// Training images.
    pub images: TrainingImages,
    /// Initial weights; `None`: random ones.
    pub weights: Option<PathBuf>,
    /// Options of the run.
    pub options: StageOptions,
}

impl DetectorTraining {
    /// Runs the training; a killed run can be resumed from its last checkpoint.
    ///
    /// Writes `detector.safetensors` (averaged weights, which [`Detector::load`](wake_detector::Detector::load) reads), a log,
    /// `config.json`, `run.json` and `checkpoints/`.
    ///
    /// # Errors
    ///
    /// As [`RunOptions::validate`]; [`wake_nn::Error::InvalidOption`] for a folder of another run;
    /// [`wake_dataset::Error::Dataset`] and [`wake_nn::Error::OutOfRange`] for a data set that cannot be learnt from;
    /// [`wake_detector::Error::WrongMaps`] for initial weights as [`Detector::load`](wake_detector::Detector::load).
    pub fn train(&self, out: &Path, progress: &dyn Fn(Progress)) -> Result<()> {
        let options = &self.options;
        let mut constants = self.constants()?;
        let (source, images) = self.images.source(options)?;
        constants.identity["images"] = images;
        let task = DetectorTask::new(source, options.seed);
        let devices = options.learning_devices()?;
        let begun = match &self.weights {
            Some(file) => {
                let network = load(Network::new(&devices[0]), Layout::Diffusers, file)?;
                self_check(&network, file, &devices[0])?;
                Some(network)
            }
            None => None,
        };
        let model = json!({"size": SIZE});
        let begin = (STAGE, options.resume);
        let mut folder = RunFolder::open(out, &model, &constants.identity, begin)?;
        let init = |device: &Device| begun.unwrap_or_else(|| Network::new(device));
        let run = Run::of(STAGE, &model, init, constants, devices)?;
        let show = |run: &Run<Network>| -> Result<()> {
            let file = out.join(WEIGHTS);
            Ok(save_as(
                &run.averaged(),
                Layout::Diffusers,
                &file,
                Precision::F16,
            )?)
        };
        let stage = Stage {
            name: STAGE,
            resume: options.resume,
            every: options.every,
            keep: options.keep,
            steps: options.steps(&DEFAULTS),
            results: &[WEIGHTS],
        };
        stage.train(&mut folder, run, &task, progress, show)
    }

    /// Constants of the run, validated before any image is made.
    fn constants(&self) -> Result<RunOptions> {
        let mut constants = self.options.run(&DEFAULTS, Value::Null);
        let trainer = &mut constants.trainer;
        trainer.rate.warmup = trainer.rate.warmup.min(trainer.rate.steps);
        trainer.adam.weight_decay = 1e-3;
        trainer.max_grad_norm = 5.0;
        trainer.ema_decay = 0.995;
        constants.validate(self.options.devices.len())?;
        let weights = self.weights.as_deref().map(fingerprint).transpose()?;
        constants.identity = json!({"weights": weights});
        Ok(constants)
    }
}

impl MadeImages {
    /// Source of the pairs, and their identity for the record of a run.
    fn source(&self, options: &StageOptions) -> Result<(Arc<dyn Source>, Value)> {
        let Self { recipe, distinct } = self;
        let source = recipe.repeated(options.seed, SIZE, &options.device(), *distinct)?;
        let noted = json!({"recipe": recipe.name(), "distinct": distinct});
        Ok((source, noted))
    }
}

impl TrainingImages {
    /// Source of the pairs, and their identity for the record of a run.
    fn source(&self, options: &StageOptions) -> Result<(Arc<dyn Source>, Value)> {
        let seed = options.seed;
        Ok(match self {
            Self::Recipe(made) => made.source(options)?,
            Self::Data(folder) => {
                let data = TrainingData::open(folder, seed, SIZE)?;
                let noted = json!({"data": data.identity()});
                (Arc::new(data), noted)
            }
            Self::Labelled(images) => {
                let noted = json!({"labelled": images.identity()});
                (Arc::new(labelled::source(images, seed, SIZE)?), noted)
            }
            Self::Both(images, made) => {
                let labelled = labelled::source(images, seed, SIZE)?;
                let (made, mut noted) = made.source(options)?;
                noted["labelled"] = images.identity();
                (in_turn([Ok(made), Ok(Arc::new(labelled))])?, noted)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights after two steps on painted images, from those that ship.
    fn trained(options: StageOptions) -> Vec<u8> {
        let out = tempfile::tempdir().expect("a folder");
        let start = out.path().join("start.safetensors");
        let shipped = wake_detector::Detector::pretrained_weights();
        std::fs::write(&start, shipped).expect("a file");
        let training = DetectorTraining {
            images: TrainingImages::Recipe(MadeImages {
                recipe: ImageRecipe::Painted,
                distinct: None,
            }),
            weights: Some(start),
            options: StageOptions {
                steps: Some(2),
                batch: Some(2),
                ..options
            },
        };
        let run = out.path().join("run");
        training.train(&run, &|_| {}).expect("a training");
        let file = run.join(WEIGHTS);
        wake_detector::Detector::load(&file, &Device::default()).expect("finite weights");
        std::fs::read(file).expect("weights")
    }

    /// Labelled images and made ones take turns, each from its own source.
    #[test]
    fn every_other_image_is_labelled() {
        let folder = tempfile::tempdir().expect("a folder");
        let image = image::GrayImage::from_fn(256, 256, |x, y| image::Luma([(x ^ y) as u8]));
        image.save(folder.path().join("a.png")).expect("an image");
        let labels = r#"{"images": {"a.png": {"width": 256, "height": 256, "wakes": []}}}"#;
        std::fs::write(folder.path().join("labels.json"), labels).expect("labels");
        let labelled = LabelledImages {
            folder: folder.path().to_owned(),
            without: Vec::new(),
            count: None,
        };
        let made = MadeImages {
            recipe: ImageRecipe::Painted,
            distinct: Some(2),
        };
        let pairs = |images: TrainingImages, count| {
            let (source, _) = images.source(&StageOptions::default()).expect("a source");
            source.items(0..count).expect("pairs")
        };
        let both = pairs(TrainingImages::Both(labelled.clone(), made.clone()), 4);
        let labelled = pairs(TrainingImages::Labelled(labelled), 2);
        let made = pairs(TrainingImages::Recipe(made), 2);
        for n in 0..2 {
            assert!(both[2 * n].image == labelled[n].image, "{n}");
            assert!(both[2 * n + 1].image == made[n].image, "{n}");
        }
        assert!(made[0].image != labelled[0].image);
    }

    /// Gradient checkpointing gives the same weights; gradients in bfloat16 give others.
    #[test]
    fn options_that_save_memory_train() {
        let plain = trained(StageOptions::default());
        let checkpointing = StageOptions {
            checkpointing: true,
            ..StageOptions::default()
        };
        assert!(trained(checkpointing) == plain);
        let bf16 = StageOptions {
            bf16: true,
            ..StageOptions::default()
        };
        assert!(trained(bf16) != plain);
    }
}
