//! `wake evaluate pipeline`: evaluates a model in diffusers layout, at its own image size.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use wake_dataset::{Folder, Recipe};
use wake_ldm::WakeSampler;
use wake_ldm::pipeline::Pipeline;
use wake_nn::burn::tensor::Device;
use wake_nn::device_named;
use wake_physics::grey::GreyScale;
use wake_train::evaluation::{
    Evaluation, HeldOut, ImageSource, Named, Reconstructed, TextToImage, View,
};

use super::common::Common;
use super::judged::Judged;
use super::schedulers::Drawn;
use super::{curve, effects, plot, schedulers};
use crate::exit::Outcome;
use crate::generate::scheduler_of;

/// Side length of an image of the paper's recipe [m].
const EXTENT: f64 = 1280.0;

/// Evaluate a text-to-image model in diffusers layout, at the size of its images.
///
/// Uses the scenes, pixels, grey and speckle of the model's data set. Writes the files of `wake evaluate`, and
/// `effects.png` (single values of a scene changed) and `radial.svg` (radial spectra in three bands). The row `its
/// autoencoder alone` encodes and decodes the simulated images themselves, the best result that the model can reach.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of a model in diffusers layout, such as one of `wake train`
    #[arg(long, value_name = "DIR")]
    weights: PathBuf,
    /// Low-rank adaptation (LoRA) to merge into the model
    #[arg(long, value_name = "FILE")]
    lora: Option<PathBuf>,
    /// Data set of the training [default: the one noted by `wake train`, else the paper's scenes with sides of 1,280 m
    /// and speckle]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Whether the model draws speckle [default: as in the data set]
    #[arg(long)]
    speckle: Option<bool>,
    /// Schedulers, separated by commas; the first generates all images [default: the model's own]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    scheduler: Vec<String>,
    /// Steps of each scheduler, separated by commas; the first generates all images
    #[arg(long, value_delimiter = ',', default_value = "50", value_parser = clap::value_parser!(u32).range(1..=1000))]
    steps: Vec<u32>,
    /// DDIM steps of the reference images for the error of each scheduler [default: no reference]
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=1000))]
    reference: Option<u32>,
    /// Guidance scale; 1 or less disables guidance
    #[arg(long, default_value_t = 1.0)]
    guidance: f64,
    /// Append the figures to this file of JSON lines
    #[arg(long, value_name = "FILE", requires = "samples")]
    curve: Option<PathBuf>,
    /// Number of training images seen, for --curve
    #[arg(long, requires = "curve")]
    samples: Option<u64>,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let common = &options.common;
    let device = device_named(&common.device)?;
    let perceptual = common.perceptual(&device)?;
    let mut pipeline = Pipeline::load(&options.weights, &device)?;
    if let Some(lora) = &options.lora {
        pipeline = pipeline.with_lora(lora, 1.0)?;
    }
    let (held_out, view) = options.scenes(&pipeline)?;
    let ways = options.ways(&pipeline, &view)?;
    let wake_model = wake_model(&held_out, &view, &device)?;
    let autoencoder = Reconstructed {
        pipeline: &pipeline,
        view,
    };
    let mut beside: Vec<Named<'_>> = vec![("its autoencoder alone", &autoencoder)];
    beside.extend(
        wake_model
            .as_ref()
            .map(|model| ("wake model", model as &dyn ImageSource)),
    );
    let evaluation = Evaluation {
        source: &ways[0].source,
        name: "text to image",
        has_network: true,
        beside,
        held_out,
        view,
        scenes: common.count as usize,
        conditions: Vec::new(),
    };
    let reference = options
        .reference
        .map(|steps| options.way(&pipeline, &view, Some("ddim"), steps));
    let reference = reference.transpose()?;
    let rows = match ways.len() > 1 || reference.is_some() {
        true => schedulers::rows(&ways, reference.as_ref(), &evaluation, &perceptual)?,
        false => Vec::new(),
    };
    let judged = Judged {
        evaluation,
        wake_model: wake_model.as_ref(),
        text_to_image: Some(&ways[0].source),
        perceptual: &perceptual,
    };
    let mut report = judged.report(&device, &common.out)?;
    report.schedulers = rows;
    effects::picture(&judged.evaluation)?.write(&common.out.join("effects.png"))?;
    plot::radial(&common.out.join("radial.svg"), &report)?;
    if let (Some(path), Some(samples)) = (&options.curve, options.samples) {
        curve::append(path, samples, &report)?;
    }
    report.write(common)
}

/// The wake model, if it can draw such scenes; its images have no speckle of their own.
fn wake_model(held_out: &HeldOut, view: &View, device: &Device) -> Outcome<Option<WakeSampler>> {
    let model = WakeSampler::pretrained(device)?;
    let fits = model.check_scene(&held_out.scene(0)).is_ok() && view.grey == GreyScale::default();
    Ok(fits.then_some(model))
}

/// The recipe that `wake train` recorded beside a model.
fn learnt_from(weights: &Path) -> Outcome<Option<Recipe>> {
    let path = weights.join("run.json");
    if !path.is_file() {
        return Ok(None);
    }
    let run: Value = serde_json::from_str(&whole_files::read_text(&path)?)?;
    let set = ["set", "data"].iter().find_map(|key| run["data"].get(key));
    let recipe = set.and_then(|set| set.get("recipe")).cloned();
    Ok(recipe.map(serde_json::from_value).transpose()?)
}

impl Options {
    /// Held-out scenes of the model's size, and the view (grey and speckle) of its images.
    fn scenes(&self, pipeline: &Pipeline) -> Outcome<(HeldOut, View)> {
        let [rows, columns] = pipeline.image_size();
        let recipe = match (&self.data, learnt_from(&self.weights)?) {
            (Some(path), _) => Folder::open(path)?.manifest().recipe.clone(),
            (None, Some(recipe)) => recipe,
            (None, None) => {
                let mut recipe = Recipe::paper();
                let grid = &mut recipe.scene.grid;
                (grid.rows, grid.columns) = (rows, columns);
                grid.spacing = EXTENT / rows as f64;
                recipe
            }
        };
        let grid = &recipe.scene.grid;
        if [grid.rows, grid.columns] != [rows, columns] {
            return Err(format!(
                "the data set has {} x {} pixels, but the model of --weights generates {rows} x {columns}; give its \
                 training set as --data",
                grid.rows, grid.columns
            )
            .into());
        }
        let view = View {
            grey: recipe.grey,
            speckle: self.speckle.unwrap_or(recipe.speckle),
        };
        let held_out = HeldOut { base: recipe.scene };
        held_out.scene(0).validate()?;
        Ok((held_out, view))
    }

    /// All combinations of schedulers and steps.
    fn ways<'a>(&self, pipeline: &'a Pipeline, view: &View) -> Outcome<Vec<Drawn<'a>>> {
        let own = vec![None];
        let named = self.scheduler.iter().map(|name| Some(name.as_str()));
        let names: Vec<Option<&str>> = named.collect();
        let names = if names.is_empty() { own } else { names };
        let pairs = names
            .iter()
            .flat_map(|&name| self.steps.iter().map(move |&steps| (name, steps)));
        pairs
            .map(|(name, steps)| self.way(pipeline, view, name, steps))
            .collect()
    }

    fn way<'a>(
        &self,
        pipeline: &'a Pipeline,
        view: &View,
        name: Option<&str>,
        steps: u32,
    ) -> Outcome<Drawn<'a>> {
        let scheduler = scheduler_of(pipeline, name)?;
        Ok(Drawn {
            scheduler: name.unwrap_or(scheduler.class()).to_owned(),
            source: TextToImage {
                pipeline,
                scheduler: Some(scheduler),
                steps: steps as usize,
                guidance: self.guidance,
                grey: view.grey,
                speckle: view.speckle,
            },
        })
    }
}
