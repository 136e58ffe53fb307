//! Arguments of `wake generate`.

use std::path::PathBuf;

use clap::Args;
use wake_physics::Scene;

/// Generate an image from a prompt with a latent diffusion model.
#[derive(Args)]
#[command(after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md")]
pub(crate) struct Arguments {
    /// Prompt [default: prompt of the default scene]
    #[arg(long, value_name = "TEXT", conflicts_with = "scene")]
    pub(super) prompt: Option<String>,
    /// Scene file (TOML), instead of a prompt
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,
    /// Set one value of the scene, such as ship.speed=8; may be repeated; without --scene, starts from the model's own
    /// scene
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "prompt")]
    pub(super) set: Vec<String>,
    /// Folder of a model of `wake train`, or of a model in diffusers layout [default: the model shipped with
    /// `wake-ldm`]
    #[arg(long, value_name = "DIR")]
    pub(super) weights: Option<PathBuf>,
    /// Diffusers layout: low-rank adaptation (LoRA) to merge into the model
    #[arg(long, value_name = "FILE", requires = "weights")]
    pub(super) lora: Option<PathBuf>,
    /// Learnt sea from `wake train sea`; not in diffusers layout
    #[arg(long, value_name = "FILE", conflicts_with = "steps")]
    pub(super) sea: Option<PathBuf>,
    /// Sampling steps [default: 3, or 50 in diffusers layout]
    #[arg(long)]
    pub(super) steps: Option<usize>,
    /// Diffusers layout: ddpm, ddim, pndm, euler, euler-ancestral, dpm++, heun, lms, unipc, lcm or flow-match-euler
    /// [default: the model's own]
    #[arg(long, value_name = "NAME")]
    pub(super) scheduler: Option<String>,
    /// Diffusers layout: guidance scale; 1 or less disables guidance [default: 7.5]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) guidance: Option<f64>,
    /// Diffusers layout: negative prompt
    #[arg(long, value_name = "TEXT")]
    pub(super) negative: Option<String>,
    /// Seed; image k uses this seed plus k
    #[arg(long, default_value_t = 7)]
    pub(super) seed: u64,
    /// Number of images
    #[arg(long, default_value_t = 1)]
    pub(super) count: usize,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in; a GPU's number may follow, as in cuda:1
    #[arg(long, default_value = "flex")]
    pub(super) device: String,
    /// Also write a sheet of the images with boxes, arms and tips drawn on them (overlay.png); not in diffusers layout
    #[arg(long)]
    pub(super) overlay: bool,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/generate")]
    pub(super) out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(super) json: bool,
}

impl Arguments {
    /// The scene of --scene with --set; without a file, the model's own scene with --set.
    pub(super) fn scene(
        &self,
        base: impl FnOnce() -> Scene,
    ) -> wake_physics::Result<Option<Scene>> {
        let scene = match &self.scene {
            Some(path) => Scene::read(path)?,
            None if self.set.is_empty() => return Ok(None),
            None => base(),
        };
        scene.with_assignments(&self.set).map(Some)
    }

    /// The given prompt, or the prompt of the scene.
    pub(super) fn prompt(&self, scene: Option<&Scene>) -> wake_text::Result<String> {
        match &self.prompt {
            Some(prompt) => Ok(prompt.clone()),
            None => wake_text::prompt(scene.unwrap_or(&Scene::default())),
        }
    }
}
