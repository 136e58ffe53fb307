//! Blocks of the networks with weights and inputs drawn from seeded counters.

use wake_detector::network::{INPUTS, Network};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::{UNet, UNetConfig, UNetInput};
use wake_nn::attention::attention;
use wake_nn::burn::module::{Module, ModuleMapper, Param};
use wake_nn::burn::tensor::{DType, Device, Int, Tensor, TensorData};
use wake_nn::cast_to;
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::resnet::{ResnetBlock, ResnetShape};
use wake_nn::self_check::seeded;
use wake_nn::transformer::{Transformer2d, TransformerShape};

/// Closure that computes a block once.
pub(super) type Call = Box<dyn Fn() -> Tensor<1>>;
/// Makes a block's call for a device and a number format.
pub(super) type On = Box<dyn Fn(&Device, DType) -> Call>;

/// A block of a network.
pub(super) struct Block {
    pub(super) name: &'static str,
    /// Number of timed calls.
    pub(super) runs: usize,
    /// Draws the weights.
    pub(super) make: fn() -> On,
}

/// All blocks: layers of Stable Diffusion at its own sizes, then whole networks.
pub(super) const BLOCKS: &[Block] = &[
    block("residual block, 2 × 320 × 64²", 10, || {
        residual(2, 320, 64, Some(1280))
    }),
    block("residual block, 2 × 640 × 32²", 10, || {
        residual(2, 640, 32, Some(1280))
    }),
    block("residual block, 2 × 1280 × 16²", 10, || {
        residual(2, 1280, 16, Some(1280))
    }),
    block("residual block, 2 × 1280 × 8²", 10, || {
        residual(2, 1280, 8, Some(1280))
    }),
    block("transformer, 2 × 320 × 64²", 10, || transformer(320, 64)),
    block("transformer, 2 × 640 × 32²", 10, || transformer(640, 32)),
    block("transformer, 2 × 1280 × 16²", 10, || {
        transformer(1280, 16)
    }),
    block("attention, 8 heads of 40, 4096 × 4096", 10, || {
        attends(4096)
    }),
    block("attention, 8 heads of 40, 4096 × 77", 10, || attends(77)),
    block("half the size, 2 × 320 × 64²", 10, || {
        on(
            Downsample::padded(320, &reference()),
            vec![[2, 320, 64, 64]],
            |layer, x| flat(layer.forward(x[0].clone())),
        )
    }),
    block("twice the size, 2 × 640 × 32²", 10, || {
        on(
            Upsample::new(640, &reference()),
            vec![[2, 640, 32, 32]],
            |layer, x| flat(layer.forward(x[0].clone(), None)),
        )
    }),
    block("decoder's residual block, 1 × 256 × 256²", 5, || {
        residual(1, 256, 256, None)
    }),
    block("decoder to 512 × 512", 3, || {
        on(
            AutoencoderKlConfig::new().init(&reference()),
            vec![[1, 4, 64, 64]],
            |vae, x| flat(vae.decode(x[0].clone())),
        )
    }),
    block("encoder of 512 × 512", 3, || {
        on(
            AutoencoderKlConfig::new().init(&reference()),
            vec![[1, 3, 512, 512]],
            |vae, x| flat(vae.moments(x[0].clone())),
        )
    }),
    block("text encoder, batch 2", 5, text),
    block("Stable Diffusion's U-Net, batch 2, 64²", 3, || {
        unet(UNetConfig::new(), 2, 64)
    }),
    block("small U-Net, batch 2, 32²", 10, || unet(small(), 2, 32)),
    #[cfg(feature = "train")]
    block("small U-Net, batch 16, with gradients", 5, gradients),
    block("detector, 4 × 256²", 10, || {
        on(
            Network::new(&reference()),
            vec![[4, INPUTS, 256, 256]],
            |network, x| flat(network.forward(x[0].clone())),
        )
    }),
];

const fn block(name: &'static str, runs: usize, make: fn() -> On) -> Block {
    Block { name, runs, make }
}

/// Device on which weights are drawn, and the reference for other devices.
pub(super) fn reference() -> Device {
    Device::flex()
}

/// Seeds a model, and gives it inputs of the given shapes.
fn on<M: Module + 'static>(
    model: M,
    shapes: Vec<[usize; 4]>,
    forward: fn(&M, &[Tensor<4>]) -> Tensor<1>,
) -> On {
    let model = seeded(model, 1);
    Box::new(move |device, dtype| {
        let model = model.clone().to_device(device).map(&mut To(dtype));
        let inputs = inputs(&shapes, device, dtype);
        Box::new(move || forward(&model, &inputs))
    })
}

/// Random inputs of variance 1.
fn inputs(shapes: &[[usize; 4]], device: &Device, dtype: DType) -> Vec<Tensor<4>> {
    let input = |(k, &[batch, channels, rows, columns]): (usize, &[usize; 4])| {
        let sources: Vec<NoiseSource> = (0..batch)
            .map(|image| NoiseSource::new((100 * k + image) as u64))
            .collect();
        let drawn = normal_batch(&sources, 0, [channels, rows, columns], device);
        cast_to(drawn, dtype)
    };
    shapes.iter().enumerate().map(input).collect()
}

/// Converts weights to another number format.
struct To(DType);

impl ModuleMapper for To {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let dtype = self.0;
        param.map(|weights| cast_to(weights, dtype))
    }
}

fn flat<const D: usize>(x: Tensor<D>) -> Tensor<1> {
    x.reshape([-1])
}

fn residual(batch: usize, channels: usize, side: usize, time_channels: Option<usize>) -> On {
    let shape = ResnetShape {
        channels_in: channels,
        channels_out: channels,
        time_channels,
        groups: 32,
        epsilon: 1e-5,
    };
    let time = time_channels.map(|channels| [batch, channels, 1, 1]);
    on(
        ResnetBlock::new(shape, &reference()),
        [Some([batch, channels, side, side]), time]
            .into_iter()
            .flatten()
            .collect(),
        |block, x| {
            let time = x.get(1).map(|t| t.clone().flatten(1, 3));
            flat(block.forward(x[0].clone(), time))
        },
    )
}

/// Transformer of one layer that attends to 77 tokens of 768 channels.
fn transformer(channels: usize, side: usize) -> On {
    let shape = TransformerShape {
        channels,
        context_channels: Some(768),
        heads: 8,
        layers: 1,
        groups: 32,
        linear_projection: false,
    };
    on(
        Transformer2d::new(shape, &reference()),
        vec![[2, channels, side, side], [2, 1, 77, 768]],
        |block, x| {
            let context = x[1].clone().flatten(1, 2);
            flat(block.forward(x[0].clone(), Some(&context)))
        },
    )
}

fn attends(tokens: usize) -> On {
    Box::new(move |device, dtype| {
        let inputs = inputs(&[[1, 1, 4096, 320], [1, 1, tokens, 320]], device, dtype);
        Box::new(move || {
            let [query, context] = [0, 1].map(|k| inputs[k].clone().flatten::<3>(1, 2));
            flat(attention(query, context.clone(), context, 8, false))
        })
    })
}

fn text() -> On {
    on(
        ClipTextConfig::new().init(&reference()),
        vec![[1, 1, 1, 1]],
        |model, x| {
            let ids: Vec<i32> = (0..2 * 77).map(|i| i * 97 % 49_000).collect();
            let ids: Tensor<2, Int> =
                Tensor::from_data(TensorData::new(ids, [2, 77]), &x[0].device());
            flat(model.last_hidden_state(ids))
        },
    )
}

/// Small U-Net of text to image.
fn small() -> UNetConfig {
    UNetConfig::small(16, Some(256), None)
}

fn unet(config: UNetConfig, batch: usize, side: usize) -> On {
    let shapes = unet_inputs(&config, batch, side);
    on(config.init(&reference()), shapes, |unet, x| {
        flat(denoised(unet, x))
    })
}

fn unet_inputs(config: &UNetConfig, batch: usize, side: usize) -> Vec<[usize; 4]> {
    let width = config.cross_attention_dim.unwrap_or(1);
    vec![
        [batch, config.in_channels, side, side],
        [batch, 1, 77, width],
    ]
}

fn denoised(unet: &UNet, x: &[Tensor<4>]) -> Tensor<4> {
    let sample = x[0].clone();
    let steps = Tensor::full([sample.dims()[0]], 500.0, &sample.device());
    unet.forward(UNetInput {
        sample,
        timesteps: steps,
        context: Some(x[1].clone().flatten(1, 2)),
        condition: None,
    })
}

/// Gradient of the input, whose computation includes the gradients of all layers.
#[cfg(feature = "train")]
fn gradients() -> On {
    let config = small();
    let (model, shapes) = (
        seeded(config.init(&reference()), 1),
        unet_inputs(&config, 16, 32),
    );
    Box::new(move |device, dtype| {
        let device = device.clone().autodiff();
        let model = model.clone().to_device(&device).map(&mut To(dtype));
        let inputs = inputs(&shapes, &device, dtype);
        Box::new(move || {
            let sample = inputs[0].clone().require_grad();
            let loss = denoised(&model, &[sample.clone(), inputs[1].clone()])
                .square()
                .mean();
            let gradient = sample.grad(&loss.backward());
            flat(gradient.unwrap_or_else(|| sample.inner().zeros_like()))
        })
    })
}
