//! Learned perceptual image patch similarity.

use std::collections::BTreeMap;
use std::path::Path;

use burn::tensor::activation::relu;
use burn::tensor::module::{conv2d, max_pool2d};
use burn::tensor::ops::{ConvOptions, MaxPoolOptions};
use burn::tensor::{Device, Tensor, TensorData};

use crate::error::{Error, Result};
use wake_nn::weights::files::{Stored, WeightFiles};
use wake_nn::{Mismatch, Misshapen};

/// The network whose features are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LpipsNetwork {
    /// `AlexNet`, the one that most papers report.
    Alex,
    /// `SqueezeNet` 1.1.
    Squeeze,
}

/// One step of a network; features are taken after steps with `Tap`.
#[derive(Clone, Copy)]
enum Step {
    /// Convolution and `ReLU`: number in torchvision's `features`, channels in and out, kernel, stride, padding.
    Conv(usize, [usize; 2], [usize; 3]),
    /// Fire module: number, channels in, squeezed, and of each of the two expansions.
    Fire(usize, [usize; 3]),
    /// Maximum over 3 × 3, stride 2; `true` rounds the output size up, as `SqueezeNet` does.
    Pool(bool),
    /// Features are compared here.
    Tap(usize),
}

use Step::{Conv, Fire, Pool, Tap};

const ALEX: [Step; 12] = [
    Conv(0, [3, 64], [11, 4, 2]),
    Tap(64),
    Pool(false),
    Conv(3, [64, 192], [5, 1, 2]),
    Tap(192),
    Pool(false),
    Conv(6, [192, 384], [3, 1, 1]),
    Tap(384),
    Conv(8, [384, 256], [3, 1, 1]),
    Tap(256),
    Conv(10, [256, 256], [3, 1, 1]),
    Tap(256),
];

const SQUEEZE: [Step; 19] = [
    Conv(0, [3, 64], [3, 2, 0]),
    Tap(64),
    Pool(true),
    Fire(3, [64, 16, 64]),
    Fire(4, [128, 16, 64]),
    Tap(128),
    Pool(true),
    Fire(6, [128, 32, 128]),
    Fire(7, [256, 32, 128]),
    Tap(256),
    Pool(true),
    Fire(9, [256, 48, 192]),
    Tap(384),
    Fire(10, [384, 48, 192]),
    Tap(384),
    Fire(11, [384, 64, 256]),
    Tap(512),
    Fire(12, [512, 64, 256]),
    Tap(512),
];

impl LpipsNetwork {
    fn steps(self) -> &'static [Step] {
        match self {
            Self::Alex => &ALEX,
            Self::Squeeze => &SQUEEZE,
        }
    }

    /// Name in files of linear weights that hold several networks.
    fn name(self) -> &'static str {
        match self {
            Self::Alex => "alex",
            Self::Squeeze => "squeeze",
        }
    }

    /// Names and shapes of the network's weights, as in torchvision.
    fn backbone(self) -> Vec<(String, Vec<usize>)> {
        let mut shapes = Vec::new();
        let mut conv = |name: String, [input, output]: [usize; 2], kernel: usize| {
            shapes.push((
                format!("{name}.weight"),
                vec![output, input, kernel, kernel],
            ));
            shapes.push((format!("{name}.bias"), vec![output]));
        };
        for step in self.steps() {
            match *step {
                Conv(n, channels, [kernel, ..]) => conv(format!("features.{n}"), channels, kernel),
                Fire(n, [input, squeezed, expanded]) => {
                    let name = |part: &str| format!("features.{n}.{part}");
                    conv(name("squeeze"), [input, squeezed], 1);
                    conv(name("expand1x1"), [squeezed, expanded], 1);
                    conv(name("expand3x3"), [squeezed, expanded], 3);
                }
                Pool(_) | Tap(_) => {}
            }
        }
        shapes
    }

    /// Names and shapes of the linear weights.
    fn linear(self, prefix: &str) -> Vec<(String, Vec<usize>)> {
        let taps = self.steps().iter().filter_map(|step| match step {
            Tap(channels) => Some(*channels),
            _ => None,
        });
        taps.enumerate()
            .map(|(n, channels)| {
                (
                    format!("{prefix}lin{n}.model.1.weight"),
                    vec![1, channels, 1, 1],
                )
            })
            .collect()
    }
}

/// Mean and standard deviation of the colours that the networks were trained with.
const SHIFT: [f32; 3] = [-0.030, -0.088, -0.188];
const SCALE: [f32; 3] = [0.458, 0.448, 0.450];

/// Perceptual distance of two images.
///
/// This crate holds no weights: they are read from the user's files, in the layout of torchvision (`features.…`) and
/// of the package `lpips` (`lin0.model.1.weight` …).
///
/// # References
///
/// Zhang, Isola, Efros, Shechtman and Wang (2018), "The Unreasonable Effectiveness of Deep Features as a Perceptual
/// Metric", equation 1.
#[derive(Debug, Clone)]
pub struct Lpips {
    network: LpipsNetwork,
    weights: BTreeMap<String, Tensor<4>>,
    biases: BTreeMap<String, Tensor<1>>,
    linear: Vec<Tensor<4>>,
    device: Device,
}

/// The distance of a pair of images, layer by layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LpipsDistance {
    /// Sum over the layers.
    pub total: f64,
    /// Contribution of each layer.
    pub layers: Vec<f64>,
}

impl Lpips {
    /// Reads the weights of a network and the linear weights that compare its features.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`], [`wake_nn::Error::InvalidSafetensors`], or [`wake_nn::Error::WeightsMismatch`] for tensors that
    /// are missing, of another shape or not floating-point; other tensors in the files are ignored.
    pub fn load(
        network: LpipsNetwork,
        backbone: &Path,
        linear: &Path,
        device: &Device,
    ) -> Result<Self> {
        let read = read(backbone, |_| network.backbone())?;
        let mut weights = BTreeMap::new();
        let mut biases = BTreeMap::new();
        for (name, data) in read {
            if let Some(layer) = name.strip_suffix(".weight") {
                weights.insert(layer.to_owned(), Tensor::from_data(data, device));
            } else {
                let layer = name.trim_end_matches(".bias").to_owned();
                biases.insert(layer, Tensor::from_data(data, device));
            }
        }
        let prefixed = format!("{}.", network.name());
        let lines = self::read(linear, |file| {
            let several = file.keys().any(|name| name.starts_with(&prefixed));
            network.linear(if several { &prefixed } else { "" })
        })?;
        Ok(Self {
            network,
            weights,
            biases,
            linear: lines
                .into_iter()
                .map(|(_, data)| Tensor::from_data(data, device))
                .collect(),
            device: device.clone(),
        })
    }

    /// Device of the computation; images must be on it.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Distance of each pair.
    ///
    /// # Shapes
    ///
    /// - `one`, `other`: `[pairs, 3, height, width]`, values 0 to 1
    ///
    /// # Panics
    ///
    /// If the shapes differ.
    #[must_use]
    pub fn distance(&self, one: Tensor<4>, other: Tensor<4>) -> Vec<LpipsDistance> {
        assert_eq!(
            one.dims(),
            other.dims(),
            "both images must have the same shape"
        );
        let pairs = one.dims()[0];
        let mut distances = vec![
            LpipsDistance {
                total: 0.0,
                layers: Vec::new()
            };
            pairs
        ];
        let features = self.features(one).into_iter().zip(self.features(other));
        for ((a, b), linear) in features.zip(&self.linear) {
            let difference = (unit(a) - unit(b)).square() * linear.clone();
            let layer = difference.sum_dim(1).mean_dim(2).mean_dim(3);
            for (distance, value) in distances.iter_mut().zip(layer.into_data().iter::<f64>()) {
                distance.layers.push(value);
                distance.total += value;
            }
        }
        distances
    }

    /// Features at every tap.
    fn features(&self, image: Tensor<4>) -> Vec<Tensor<4>> {
        let colour = |values: [f32; 3]| {
            Tensor::<4>::from_data(TensorData::new(values.to_vec(), [1, 3, 1, 1]), &self.device)
        };
        let mut x = (image * 2.0 - 1.0 - colour(SHIFT)) / colour(SCALE);
        let mut taps = Vec::new();
        for step in self.network.steps() {
            x = match *step {
                Conv(n, _, [_, stride, padding]) => {
                    self.convolution(x, &format!("features.{n}"), stride, padding)
                }
                Fire(n, _) => self.fire(x, n),
                Pool(ceil) => {
                    let options = MaxPoolOptions::new([3, 3]).with_stride([2, 2]);
                    max_pool2d(x, options.with_ceil_mode(ceil))
                }
                Tap(_) => {
                    taps.push(x.clone());
                    x
                }
            };
        }
        taps
    }

    /// Convolution and `ReLU`.
    fn convolution(&self, x: Tensor<4>, name: &str, stride: usize, padding: usize) -> Tensor<4> {
        let options = ConvOptions::new([stride; 2], [padding; 2], [1; 2], 1);
        relu(conv2d(
            x,
            self.weights[name].clone(),
            Some(self.biases[name].clone()),
            options,
        ))
    }

    fn fire(&self, x: Tensor<4>, n: usize) -> Tensor<4> {
        let name = |part: &str| format!("features.{n}.{part}");
        let squeezed = self.convolution(x, &name("squeeze"), 1, 0);
        let small = self.convolution(squeezed.clone(), &name("expand1x1"), 1, 0);
        let large = self.convolution(squeezed, &name("expand3x3"), 1, 1);
        Tensor::cat(vec![small, large], 1)
    }
}

/// Features scaled to length 1 at every place.
fn unit(features: Tensor<4>) -> Tensor<4> {
    let length = features.clone().square().sum_dim(1).sqrt();
    features / (length + 1e-10)
}

/// Reads tensors by name, in the requested order.
fn read(
    path: &Path,
    wanted: impl Fn(&BTreeMap<String, Stored<'_>>) -> Vec<(String, Vec<usize>)>,
) -> Result<Vec<(String, TensorData)>> {
    let files = WeightFiles::open(path)?;
    let stored = files.tensors()?;
    let (mut found, mut mismatch) = (Vec::new(), Mismatch::default());
    for (name, shape) in wanted(&stored) {
        match stored.get(&name) {
            None => mismatch.missing.push(name),
            Some(tensor) if tensor.is_float() && tensor.shape() == shape => {
                found.push((name, TensorData::new(tensor.read()?, shape)));
            }
            Some(tensor) => mismatch.misshapen.push(Misshapen {
                name,
                expected: format!("float {shape:?}"),
                found: format!("{tensor:?}"),
            }),
        }
    }
    if mismatch.is_empty() {
        return Ok(found);
    }
    Err(Error::Value(wake_nn::Error::WeightsMismatch {
        path: path.to_owned(),
        mismatch: Box::new(mismatch),
    }))
}
