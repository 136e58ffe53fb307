//! Sampling of a learnt sea, and rejection of bad files.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::module::ModuleMapper;
use half::f16;

use super::super::WINDOW;
use super::*;

/// Amplitudes 100 + 20 n, with noise n of which neighbours in a row share half.
fn patch(seed: u64) -> Field {
    let white = NoiseSource::new(seed).normal(0, WINDOW * WINDOW + 1);
    let value = |n: usize| 100.0 + 20.0 * (white[n] + white[n + 1]) / f32::sqrt(2.0);
    Field {
        rows: WINDOW,
        columns: WINDOW,
        values: (0..WINDOW * WINDOW).map(value).collect(),
    }
}

fn styles(count: u64) -> Vec<SeaStyle> {
    (0..count)
        .map(|seed| SeaStyle::of(&patch(seed)).unwrap())
        .collect()
}

fn texture() -> SeaTexture {
    SeaTexture::new(SeaFlow::new(&Device::flex()), &styles(3), Some(10.0)).unwrap()
}

/// Sets all weights to zero, which makes the velocity zero.
struct Still;

impl ModuleMapper for Still {
    fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
        weight.map(|weight| weight.zeros_like())
    }
}

fn still() -> SeaTexture {
    SeaTexture {
        flow: SeaFlow::new(&Device::flex()).map(&mut Still),
        ..texture()
    }
}

fn distance(a: &Field, b: &Field) -> f32 {
    let pairs = a.values.iter().zip(&b.values);
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// With zero velocity, the sea is its initial noise without the margin.
#[test]
fn without_a_flow_the_sea_is_gaussian_noise_of_its_style() {
    let (sea, style) = (still(), &styles(1)[0]);
    let drawn = sea.amplitude(style, 7, 40, 51).unwrap();
    assert_eq!([drawn.rows, drawn.columns], [40, 51]);
    let noise = style.noise(NoiseSource::new(7), 104, 120);
    for (n, value) in drawn.values.iter().enumerate() {
        let noise = noise.at(MARGIN + n / 51, MARGIN + n % 51);
        let expected = (style.mean() + style.spread() * noise).max(0.0);
        assert!((value - expected).abs() < 1e-6, "{n}: {value} {expected}");
    }
}

#[test]
fn a_seed_is_one_sea_of_mean_1() {
    let sea = texture();
    let draw = |seed: u64| sea.sample(seed, 50, 61).unwrap();
    let (one, other) = (draw(3), draw(4));
    assert_eq!(one, draw(3));
    assert!(distance(&one, &other) > 0.1);
    assert!((one.mean() - 1.0).abs() < 1e-5 && one.values.iter().all(|&v| v >= 0.0));
    assert!(
        sea.sample(3, 0, 61)
            .unwrap_err()
            .to_string()
            .contains("rows is 0")
    );
}

/// If there are few styles, all are kept; if there are many, the kept ones are spread over all.
#[test]
fn styles_are_kept_from_first_to_last() {
    let sea = texture();
    assert_eq!(sea.styles().len(), STYLES);
    assert_eq!(sea.styles()[..3], styles(3));
    let source: Vec<SeaStyle> = (0..3 * STYLES)
        .map(|n| styles(3)[n / STYLES].clone())
        .collect();
    let kept = SeaTexture::new(SeaFlow::new(&Device::flex()), &source, None).unwrap();
    assert_eq!(
        [0, STYLES / 2, STYLES - 1]
            .map(|n| kept.styles()[n].clone())
            .to_vec(),
        styles(3)
    );
    let none = SeaTexture::new(SeaFlow::new(&Device::flex()), &[], None);
    assert!(none.unwrap_err().to_string().contains("at least one patch"));
}

/// Weights and styles are rounded to 16 bits, 2⁻¹¹ each; over 12 convolutions in 4 steps, a sea changes by some hundred of these.
#[test]
fn a_file_holds_all_of_a_sea() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sea.safetensors");
    let sea = texture();
    sea.save(&path).unwrap();
    let read = SeaTexture::load(&path, &Device::flex()).unwrap();
    assert_eq!(read.spacing(), Some(10.0));
    let drawn = [&sea, &read].map(|sea| sea.sample(5, 64, 64).unwrap());
    let far = distance(&drawn[0], &drawn[1]);
    assert!(far < 100.0 / 2048.0, "{far}");
    let unknown = SeaTexture {
        spacing: None,
        ..sea
    };
    unknown.save(&path).unwrap();
    assert_eq!(
        SeaTexture::load(&path, &Device::flex()).unwrap().spacing(),
        None
    );
}

/// Overwrites one 16-bit number of a tensor in a file.
fn with_number(path: &Path, tensor: &str, at: usize, value: f32) {
    let mut bytes = std::fs::read(path).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&bytes[8..8 + header]).unwrap();
    let start = json[tensor]["data_offsets"][0].as_u64().unwrap() as usize;
    let place = 8 + header + start + 2 * at;
    bytes[place..place + 2].copy_from_slice(&f16::from_f32(value).to_le_bytes());
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn files_that_hold_no_sea_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sea.safetensors");
    let refused = || {
        let error = SeaTexture::load(&path, &Device::flex()).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("sea.safetensors") && !text.contains('\n'),
            "{text}"
        );
        text
    };
    assert!(refused().contains("cannot read"));
    let correlation = (LAGS + 1) * (2 * LAGS + 1);
    for (tensor, at, value, word) in [
        ("numbers", NUMBERS + 1, 9.0, "style 1: spread is 9, outside"),
        ("numbers", 0, -1.0, "style 0: mean is -1, outside"),
        ("numbers", 3, f32::NAN, "numbers"),
        (
            "correlations",
            2 * correlation + 5,
            1.5,
            "style 2: 'correlation'",
        ),
        ("correlations", LAGS, 0.5, "style 0: 'correlation'"),
    ] {
        texture().save(&path).unwrap();
        with_number(&path, tensor, at, value);
        let text = refused();
        assert!(
            text.contains(word.trim_matches('\'')) || text.contains(&word.replace('\'', "")),
            "{text}"
        );
    }
    for (note, word) in [("ten", "spacing"), ("-3", "spacing is -3")] {
        let stored = Stored {
            flow: SeaFlow::new(&Device::flex()),
            numbers: Param::from_tensor(Tensor::zeros([STYLES, NUMBERS], &Device::flex())),
            correlations: Param::from_tensor(Tensor::zeros(
                [STYLES, LAGS + 1, 2 * LAGS + 1],
                &Device::flex(),
            )),
        };
        // The styles of a good file, with another header.
        texture().save(&path).unwrap();
        let good = load(stored, Layout::Diffusers, &path).unwrap();
        save_noted(
            &good,
            Layout::Diffusers,
            &path,
            Precision::F16,
            Some((SPACING, note)),
        )
        .unwrap();
        assert!(refused().contains(word), "{}", refused());
    }
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(refused().contains("not a valid safetensors file"));
}

#[test]
fn weights_that_overflow_say_so() {
    let mut sea = texture();
    sea.flow = sea.flow.map(&mut Poison);
    let refused = sea.sample(1, 40, 40).unwrap_err().to_string();
    assert!(refused.contains("learnt sea"), "{refused}");
}

struct Poison;

impl ModuleMapper for Poison {
    fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
        weight.map(|weight| weight * f64::INFINITY)
    }
}

/// A ship with its dark wake and its echo, on a sea of pixels of 10 m.
fn scene() -> Scene {
    let changes = [
        "grid.rows=128",
        "grid.columns=128",
        "grid.spacing=10",
        "ship.echo=true",
        "seed=11",
    ];
    Scene::default().with_assignments(&changes).unwrap()
}

/// Averaged over many seeds, the sea is 1 in the wake as elsewhere. Neighbours in a row share half of their noise: a mean over n
/// intensities of spread s has a standard error of s √(2/n), here over the darkest tenth of the expected image.
#[test]
fn the_image_is_the_expected_one_times_the_sea_and_the_echo_on_it() {
    let (sea, scene) = (still(), scene());
    let mut silent = scene.clone();
    silent.ships[0].echo = false;
    let [all, expected] = [&scene, &silent].map(|scene| expected_intensity(scene).unwrap());
    let mut order: Vec<usize> = (0..expected.values.len()).collect();
    order.sort_by(|&a, &b| expected.values[a].total_cmp(&expected.values[b]));
    let dark = &order[..order.len() / 10];
    let seeds = 8;
    let (mut ratio, mut spread) = (0.0, 0.0);
    for seed in 0..seeds {
        let [scene, silent] = [&scene, &silent].map(|scene| Scene {
            seed,
            ..scene.clone()
        });
        let [image, without] = [&scene, &silent].map(|scene| sea.image(scene).unwrap());
        let drawn = expected_intensity(&scene).unwrap();
        for n in 0..image.values.len() {
            let echo = image.values[n] - without.values[n];
            let asked = drawn.values[n] - expected.values[n];
            assert!((echo - asked).abs() <= 1e-5 * image.values[n].abs(), "{n}");
        }
        let ratios = dark
            .iter()
            .map(|&n| f64::from(without.values[n] / expected.values[n]));
        let (sum, squares) = ratios.fold((0.0, 0.0), |(s, q), r| (s + r, q + r * r));
        let count = dark.len() as f64;
        ratio += sum / count / seeds as f64;
        spread += (squares / count - (sum / count).powi(2)).sqrt() / seeds as f64;
    }
    let error = 5.0 * spread * (2.0 / (seeds as f64 * dark.len() as f64)).sqrt();
    assert!((ratio - 1.0).abs() < error, "{ratio} {error}");
    // The scene has a visible wake, and a ship.
    let open = f64::from(expected.values[order[order.len() / 2]]);
    let darkest = dark
        .iter()
        .map(|&n| f64::from(expected.values[n]))
        .sum::<f64>()
        / dark.len() as f64;
    assert!(darkest < 0.95 * open, "{darkest} {open}");
    assert!(
        all.values
            .iter()
            .zip(&expected.values)
            .any(|(a, e)| a - e > *e)
    );
}

#[test]
fn pixels_of_another_size_are_refused_where_the_size_is_known() {
    let sea = texture();
    for (spacing, fits) in [
        (10.0, true),
        (12.4, true),
        (8.1, true),
        (12.6, false),
        (4.0, false),
    ] {
        assert_eq!(sea.check_spacing(spacing).is_ok(), fits, "{spacing}");
    }
    let refused = sea.image(&Scene::default()).unwrap_err().to_string();
    assert!(
        refused.contains("2.5 m") && refused.contains("10 m"),
        "{refused}"
    );
    let any = SeaTexture::new(SeaFlow::new(&Device::flex()), &styles(1), None).unwrap();
    assert!(any.check_spacing(4.0).is_ok());
    let wrong = SeaTexture::new(SeaFlow::new(&Device::flex()), &styles(1), Some(0.0));
    assert!(wrong.unwrap_err().to_string().contains("spacing is 0"));
}
