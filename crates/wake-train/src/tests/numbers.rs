//! Numbers keep their bits through every file of a run and of its weights.

use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};
use wake_physics::Scene;

use crate::Checkpoint;
use crate::checkpoint::Tensors;
use crate::folder::RunFolder;
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::conditioning::Vocabulary;
use wake_ldm::network::{TrainingRanges, WakeModelConfig};
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::unet::UNetConfig;

/// Any finite number.
fn finite() -> impl Strategy<Value = f64> {
    let numbers = any::<u64>().prop_map(f64::from_bits);
    numbers.prop_filter("finite", |number| number.is_finite())
}

/// Several finite numbers, and one of 32 bits, as JSON.
fn numbers() -> impl Strategy<Value = Value> {
    let short = finite().prop_map(|number| number as f32);
    let short = short.prop_filter("finite", |number| number.is_finite());
    (prop::array::uniform8(finite()), short)
        .prop_map(|(numbers, short)| json!({"long": numbers, "short": short}))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn checkpoints(bits in prop::array::uniform16(any::<u32>()), state in numbers()) {
        let folder = tempfile::tempdir().unwrap();
        let values: Vec<f32> = bits.into_iter().map(f32::from_bits).collect();
        let checkpoint = Checkpoint {
            step: 3,
            applied: 2,
            state: state.clone(),
            tensors: Tensors::from([("a".to_owned(), (vec![4, 4], values))]),
        };
        checkpoint.write(folder.path(), 2).unwrap();
        let read = Checkpoint::newest(folder.path()).unwrap().unwrap();
        prop_assert!(read.differs(&state).is_none());
        prop_assert_eq!(read.state.to_string(), state.to_string());
        let read: Vec<u32> = read.tensors["a"].1.iter().map(|x| x.to_bits()).collect();
        prop_assert_eq!(read, bits);
    }

    /// Model and data of a run are read back to the last digit.
    #[test]
    fn runs(model in numbers(), data in numbers()) {
        let folder = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            let run = RunFolder::open(folder.path(), &model, &data, ("prior", false));
            prop_assert!(run.is_ok(), "{:?}", run.err().map(|error| error.to_string()));
        }
        let config = std::fs::read_to_string(folder.path().join("config.json")).unwrap();
        let config: Value = serde_json::from_str(&config).unwrap();
        prop_assert_eq!(config.to_string(), model.to_string());
    }

    #[test]
    fn wake_models(values in prop::array::uniform3(finite()), spacing in 0.1..100.0, ends in 0.0..50.0) {
        let mut config = WakeModelConfig::standard(&Vocabulary::new([1, 2]));
        let mut scene = Scene::default();
        [scene.sea.wind_speed, scene.sea.fetch, scene.ships[0].speed] = values;
        (config.training_ranges, config.spacing) = (TrainingRanges::of([&scene]).unwrap(), spacing);
        (config.scene, config.grey.brightest_db) = (scene, ends);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.json");
        whole_files::write_json(&path, &config).unwrap();
        let read = WakeModelConfig::read(&path).unwrap();
        prop_assert_eq!(json!(read).to_string(), json!(config).to_string());
        prop_assert_eq!(read.spacing.to_bits(), spacing.to_bits());
    }

    #[test]
    fn configurations(small in 1e-12..1.0, factor in 1e-6..1e6, beta in 1e-8..0.01) {
        let path = Path::new("config.json");
        let autoencoder = AutoencoderKlConfig { scaling_factor: factor, shift_factor: -factor, ..AutoencoderKlConfig::small(4, 2) };
        let unet = UNetConfig { norm_epsilon: small, frequency_shift: small, ..UNetConfig::new() };
        let text = format!("{:#}", autoencoder.to_json());
        let read = AutoencoderKlConfig::from_json(&text, path).unwrap();
        let bits = [read.scaling_factor, -read.shift_factor].map(f64::to_bits);
        prop_assert_eq!(bits, [factor.to_bits(); 2]);
        let read = UNetConfig::from_json(&format!("{:#}", unet.to_json()), path).unwrap();
        let bits = [read.norm_epsilon, read.frequency_shift].map(f64::to_bits);
        prop_assert_eq!(bits, [small.to_bits(); 2]);
        let mut scheduler = SchedulerConfig::stable_diffusion("ddim").unwrap().to_json();
        scheduler["beta_start"] = json!(beta);
        let read = SchedulerConfig::from_json(&scheduler.to_string(), path).unwrap();
        prop_assert_eq!(read.to_json(), scheduler);
    }
}

/// The pixel spacing is stored as text in the header of a learnt sea.
#[test]
fn the_pixels_of_a_learnt_sea() {
    use wake_ldm::sea_texture::{SeaFlow, SeaStyle, SeaTexture};
    use wake_nn::noise::NoiseSource;
    let (folder, device) = (tempfile::tempdir().unwrap(), burn::tensor::Device::flex());
    let path = folder.path().join("sea.safetensors");
    let random = NoiseSource::new(4);
    let patch = wake_physics::Field {
        rows: 128,
        columns: 128,
        values: random
            .normal(0, 128 * 128)
            .iter()
            .map(|n| 50.0 + 5.0 * n)
            .collect(),
    };
    let styles = [SeaStyle::of(&patch).unwrap()];
    for k in 0..20 {
        let spacing = 1000.0 * random.uniform(1, k) + 0.1;
        let sea = SeaTexture::new(SeaFlow::new(&device), &styles, Some(spacing.min(1000.0)));
        sea.unwrap().save(&path).unwrap();
        let read = SeaTexture::load(&path, &device).unwrap().spacing().unwrap();
        assert_eq!(read.to_bits(), spacing.min(1000.0).to_bits());
    }
}
