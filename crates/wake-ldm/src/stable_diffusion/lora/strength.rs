//! Strength of each layer of a low-rank adaptation, from the header of its file.

use std::path::Path;

use serde_json::{Map, Value};

use crate::options::Options;
use wake_nn::{Error, Result, check_range};

/// Header entry in which diffusers stores how an adaptation was trained.
pub(super) const NOTE: &str = "lora_adapter_metadata";

/// Options of peft that matter only in training.
const TRAINING: [&str; 16] = [
    "arrow_config",
    "base_model_name_or_path",
    "eva_config",
    "exclude_modules",
    "init_lora_weights",
    "layers_to_transform",
    "loftq_config",
    "lora_dropout",
    "megatron_core",
    "peft_type",
    "peft_version",
    "qalora_group_size",
    "r",
    "rank_pattern",
    "target_modules",
    "task_type",
];

/// Factor α/r of each layer's change, or α/√r with rank stabilisation.
///
/// # References
///
/// Hu et al. (2022), "Low-Rank Adaptation of Large Language Models", section 4.1. Kalajdzievski (2023),
/// "A Rank Stabilization Scaling Factor for Fine-Tuning with LoRA", section 3.
#[derive(Debug)]
pub(super) struct Strength {
    /// α of most layers; `None`: the rank.
    alpha: Option<f64>,
    /// Endings of layer names that have an α of their own.
    patterns: Vec<(String, f64)>,
    rank_stabilised: bool,
}

impl Strength {
    /// Reads the entry for the layers below `prefix` from a file's note; without a note, α is the rank.
    pub(super) fn read(note: Option<&str>, prefix: &str, path: &Path) -> Result<Self> {
        let note: Map<String, Value> =
            serde_json::from_str(note.unwrap_or("{}")).map_err(|source| Error::Json {
                path: path.to_owned(),
                source,
            })?;
        let below = |key: String| Some(key.strip_prefix(prefix)?.strip_prefix('.')?.to_owned());
        let note: Map<String, Value> = note
            .into_iter()
            .filter_map(|(key, value)| Some((below(key)?, value)))
            .collect();
        let mut options = Options::parse("LoRA", &Value::Object(note).to_string(), path)?;
        options.ignore(&TRAINING);
        options.only("bias", &["none"])?;
        let alpha = options.optional_f64("lora_alpha")?;
        check_range("lora_alpha", alpha.unwrap_or(1.0), -1e6, 1e6)?;
        let strength = Self {
            alpha,
            patterns: take_patterns(&mut options)?,
            rank_stabilised: options.bool("use_rslora", false)?,
        };
        options.finish()?;
        Ok(strength)
    }

    /// Factor of the change of a layer of this rank.
    pub(super) fn factor(&self, layer: &str, rank: usize) -> f64 {
        let rank = rank as f64;
        let ends = |pattern: &str| {
            let before = layer.strip_suffix(pattern);
            before.is_some_and(|before| before.is_empty() || before.ends_with('.'))
        };
        let own = self.patterns.iter().find(|(pattern, _)| ends(pattern));
        let alpha = own.map(|(_, alpha)| *alpha).or(self.alpha);
        let divisor = if self.rank_stabilised {
            rank.sqrt()
        } else {
            rank
        };
        alpha.unwrap_or(rank) / divisor
    }
}

/// Takes the layer names that have an α of their own. peft treats them as regular expressions; only
/// plain names are accepted here.
fn take_patterns(options: &mut Options) -> Result<Vec<(String, f64)>> {
    let Some(value) = options.take("alpha_pattern") else {
        return Ok(vec![]);
    };
    let plain = |name: &str| {
        name.chars()
            .all(|c| c.is_alphanumeric() || "._".contains(c))
    };
    let entry = |(name, alpha): (&String, &Value)| {
        let alpha = alpha.as_f64().filter(|alpha| alpha.abs() <= 1e6)?;
        plain(name).then(|| (name.clone(), alpha))
    };
    let patterns = value
        .as_object()
        .and_then(|map| map.iter().map(entry).collect());
    let supported = "layer names, without wildcards, with numbers from -1e6 to 1e6";
    patterns.ok_or_else(|| options.unsupported("alpha_pattern", &value, supported))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(note: &str) -> Result<Strength> {
        Strength::read(Some(note), "unet", Path::new("test"))
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn alpha_comes_from_the_layer_then_the_file_then_the_rank() {
        let strength = read(
            r#"{"unet.lora_alpha": 6, "unet.r": 3, "text_encoder.lora_alpha": 99, "unet.bias": "none",
                "unet.alpha_pattern": {"mid.to_q": 1.5}, "unet.use_dora": false}"#,
        )
        .unwrap();
        assert!(close(strength.factor("a.to_q", 3), 2.0));
        assert!(close(strength.factor("unet_mid.to_q", 3), 2.0));
        assert!(close(strength.factor("a.mid.to_q", 3), 0.5));
        assert!(close(strength.factor("mid.to_q", 3), 0.5));
        let silent = Strength::read(None, "unet", Path::new("test")).unwrap();
        assert!(close(silent.factor("a", 7), 1.0));
        let stable = read(r#"{"unet.lora_alpha": 6, "unet.use_rslora": true}"#).unwrap();
        assert!(close(stable.factor("a", 4), 3.0));
    }

    #[test]
    fn what_would_change_the_numbers_is_refused_by_name() {
        for (note, name) in [
            (r#"{"unet.use_dora": true}"#, "LoRA use_dora"),
            (r#"{"unet.bias": "all"}"#, "LoRA bias"),
            (
                r#"{"unet.alpha_pattern": {"a.*": 2}}"#,
                "LoRA alpha_pattern",
            ),
            (
                r#"{"unet.layer_replication": [[0, 4]]}"#,
                "LoRA layer_replication",
            ),
        ] {
            let refused = read(note).unwrap_err();
            assert!(matches!(&refused, Error::Unsupported { option, .. } if option == name));
        }
        assert!(matches!(read("[]"), Err(Error::Json { .. })));
        let infinite = read(r#"{"unet.lora_alpha": 1e300}"#);
        assert!(matches!(infinite, Err(Error::OutOfRange { .. })));
    }
}
