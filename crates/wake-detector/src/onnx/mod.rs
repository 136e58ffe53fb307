//! The network as an ONNX model, for other programs.
//!
//! ```text
//! inputs [batch, 2, rows, columns]  ─►  maps [batch, 8, rows/4, columns/4]
//! ```
//!
//! Rows and columns are multiples of [`MULTIPLE`](crate::network::MULTIPLE). docs/onnx.md describes how to convert pixels to
//! inputs, and maps to wakes.
//!
//! # References
//!
//! ONNX 1.12 (IR version 8, operator set 17), `onnx.proto3`: field numbers and types.

mod messages;

use std::collections::BTreeMap;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use prost::Message;

use crate::network::{INPUTS, Network, OUTPUTS, STRIDE};
use messages::{
    Attribute, Dimension, GraphProto, ModelProto, NodeProto, OperatorSet, TensorProto, TensorShape,
    TensorType, Type, ValueInfo,
};

/// Number of groups and ε of every normalization, as in `network`.
const GROUPS: usize = 8;
const EPSILON: f32 = 1e-5;
/// Dilations of the blocks at a sixteenth, as in `network`.
const DILATIONS: [usize; 4] = [1, 2, 4, 2];
/// Versions of the intermediate representation and of the operator set.
const IR_VERSION: i64 = 8;
const OPERATORS: i64 = 17;
/// Element types of tensors: f32 and i64.
const FLOAT: i32 = 1;
const INT64: i32 = 7;

/// Returns the bytes of an ONNX file with the network's weights in 32 bits.
pub fn onnx(network: &Network) -> Vec<u8> {
    let mut weights = Weights::default();
    network.visit(&mut weights);
    let mut graph = Builder::new(weights.tensors);
    graph.network();
    let model = ModelProto {
        ir_version: IR_VERSION,
        producer_name: env!("CARGO_PKG_NAME").to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        doc_string: "Ship wakes in radar images: maps of tips, lines and directions".to_owned(),
        graph: Some(graph.finish()),
        opset_import: vec![OperatorSet {
            domain: String::new(),
            version: OPERATORS,
        }],
    };
    model.encode_to_vec()
}

/// Shape and values of a tensor.
type Numbers = (Vec<usize>, Vec<f32>);

/// Parameters of a module by path, as in its weight file.
#[derive(Default)]
struct Weights {
    path: Vec<String>,
    tensors: BTreeMap<String, Numbers>,
}

impl ModuleVisitor for Weights {
    fn enter_module(&mut self, name: &str, _: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _: &str, _: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let value = param.val();
        let shape = value.dims().to_vec();
        let numbers = value.into_data().iter::<f32>().collect();
        self.tensors.insert(self.path.join("."), (shape, numbers));
    }
}

/// Nodes of a graph, in the order in which they are computed.
struct Builder {
    weights: BTreeMap<String, Numbers>,
    graph: GraphProto,
}

impl Builder {
    fn new(weights: BTreeMap<String, Numbers>) -> Self {
        let mut builder = Self {
            weights,
            graph: GraphProto {
                name: "detector".to_owned(),
                ..GraphProto::default()
            },
        };
        let groups = [0, GROUPS as i64, -1].map(i64::to_le_bytes).concat();
        builder.initializer("groups", vec![3], INT64, groups);
        for (name, value) in [("ones", 1.0), ("zeros", 0.0)] {
            builder.floats(name, &[GROUPS], &[value; GROUPS]);
        }
        builder.floats("twice", &[4], &[1.0, 1.0, 2.0, 2.0]);
        builder
    }

    /// Adds all nodes, in the order of [`Network::forward`].
    fn network(&mut self) {
        let fine = self.stem();
        let fine = self.block(&fine, "fine", 1);
        let down = self.convolution(&fine, "down1.conv", 2, 1);
        let middle = self.convolution(&down, "widen1", 1, 1);
        let middle = self.block(&middle, "middle", 1);
        let down = self.convolution(&middle, "down2.conv", 2, 1);
        let mut coarse = self.convolution(&down, "widen2", 1, 1);
        for (n, dilation) in DILATIONS.into_iter().enumerate() {
            coarse = self.block(&coarse, &format!("coarse.{n}"), dilation);
        }
        let up = self.convolution(&coarse, "narrow2", 1, 1);
        let up = self.doubled(&up, "up2");
        let middle = self.node("Add", "skip2", &[&middle, &up], Vec::new());
        let middle = self.block(&middle, "middle_up", 1);
        let up = self.convolution(&middle, "narrow1", 1, 1);
        let up = self.doubled(&up, "up1");
        let fine = self.node("Add", "skip1", &[&fine, &up], Vec::new());
        let fine = self.block(&fine, "fine_up", 1);
        let fine = self.normalized(&fine, "norm");
        let maps = self.convolution(&fine, "head", 1, 1);
        self.node("Identity", "maps", &[&maps], Vec::new());
    }

    /// The split into patches and their 3 × 3 convolution as one convolution of 12 × 12 pixels with stride 4.
    ///
    /// ```text
    /// w[o, c, 4 i + y, 4 j + x] = stem[o, 16 c + 4 y + x, i, j]
    /// ```
    fn stem(&mut self) -> String {
        let (shape, stem) = self.weights.remove("stem.weight").unwrap_or_default();
        let channels = shape.first().copied().unwrap_or_default();
        let side = 3 * STRIDE;
        let mut wide = Vec::with_capacity(stem.len());
        for o in 0..channels {
            for c in 0..INPUTS {
                for (row, column) in (0..side).flat_map(|r| (0..side).map(move |k| (r, k))) {
                    let patch = STRIDE * (row % STRIDE) + column % STRIDE;
                    let channel = STRIDE * STRIDE * c + patch;
                    let place = 3 * (row / STRIDE) + column / STRIDE;
                    wide.push(stem[(o * INPUTS * STRIDE * STRIDE + channel) * 9 + place]);
                }
            }
        }
        let shape = vec![channels, INPUTS, side, side];
        self.weights.insert("stem.weight".to_owned(), (shape, wide));
        let sizes = Sizes {
            stride: STRIDE,
            dilation: 1,
            border: STRIDE,
        };
        self.convolved("inputs", "stem", sizes)
    }

    fn block(&mut self, x: &str, name: &str, dilation: usize) -> String {
        let h = self.normalized(x, &format!("{name}.norm1"));
        let h = self.convolution(&h, &format!("{name}.conv1"), 1, dilation);
        let h = self.normalized(&h, &format!("{name}.norm2"));
        let h = self.convolution(&h, &format!("{name}.conv2"), 1, dilation);
        self.node("Add", &format!("{name}.sum"), &[x, &h], Vec::new())
    }

    /// Adds a convolution that keeps the size of the image, or divides it by its stride.
    fn convolution(&mut self, x: &str, name: &str, stride: usize, dilation: usize) -> String {
        let kernel = self.weights.get(&format!("{name}.weight"));
        let kernel = kernel.and_then(|(shape, _)| shape.last()).copied();
        let border = dilation * (kernel.unwrap_or(1) / 2);
        let sizes = Sizes {
            stride,
            dilation,
            border,
        };
        self.convolved(x, name, sizes)
    }

    fn convolved(&mut self, x: &str, name: &str, sizes: Sizes) -> String {
        let [weight, bias] = ["weight", "bias"].map(|kind| self.parameter(name, kind, None));
        let attributes = vec![
            Attribute::whole("strides", &[sizes.stride; 2]),
            Attribute::whole("dilations", &[sizes.dilation; 2]),
            Attribute::whole("pads", &[sizes.border; 4]),
        ];
        self.node("Conv", name, &[x, &weight, &bias], attributes)
    }

    /// Adds group normalization and SiLU.
    fn normalized(&mut self, x: &str, name: &str) -> String {
        let shape = self.node("Shape", &format!("{name}.shape"), &[x], Vec::new());
        let inside = [x, "groups"];
        let groups = self.node("Reshape", &format!("{name}.groups"), &inside, Vec::new());
        let epsilon = vec![Attribute::number("epsilon", EPSILON)];
        let inside = [&*groups, "ones", "zeros"];
        let unit = format!("{name}.unit");
        let groups = self.node("InstanceNormalization", &unit, &inside, epsilon);
        let inside = [&*groups, &*shape];
        let image = self.node("Reshape", &format!("{name}.image"), &inside, Vec::new());
        let each = Some([0, 1, 1]);
        let [weight, bias] = ["weight", "bias"].map(|kind| self.parameter(name, kind, each));
        let scaled = self.node(
            "Mul",
            &format!("{name}.scaled"),
            &[&image, &weight],
            Vec::new(),
        );
        let y = self.node("Add", name, &[&scaled, &bias], Vec::new());
        let gate = self.node("Sigmoid", &format!("{name}.gate"), &[&y], Vec::new());
        self.node("Mul", &format!("{name}.silu"), &[&y, &gate], Vec::new())
    }

    /// Adds an upsampling by two with a convolution.
    fn doubled(&mut self, x: &str, name: &str) -> String {
        let attributes = vec![
            Attribute::text("mode", "nearest"),
            Attribute::text("coordinate_transformation_mode", "asymmetric"),
            Attribute::text("nearest_mode", "floor"),
        ];
        let x = self.node(
            "Resize",
            &format!("{name}.twice"),
            &[x, "", "twice"],
            attributes,
        );
        self.convolution(&x, &format!("{name}.conv"), 1, 1)
    }

    /// Adds a node whose output has the node's name; returns that name.
    fn node(
        &mut self,
        operator: &str,
        name: &str,
        inputs: &[&str],
        attributes: Vec<Attribute>,
    ) -> String {
        self.graph.node.push(NodeProto {
            input: inputs.iter().map(|&input| input.to_owned()).collect(),
            output: vec![name.to_owned()],
            name: name.to_owned(),
            op_type: operator.to_owned(),
            attribute: attributes,
        });
        name.to_owned()
    }

    /// Moves a parameter into the graph, with further axes after its own if `axes` is given, whose first number is ignored.
    fn parameter(&mut self, of: &str, kind: &str, axes: Option<[usize; 3]>) -> String {
        let name = format!("{of}.{kind}");
        let (shape, numbers) = self.weights.remove(&name).unwrap_or_default();
        let shape = match axes {
            None => shape,
            Some([_, rows, columns]) => [shape, vec![rows, columns]].concat(),
        };
        self.floats(&name, &shape, &numbers);
        name
    }

    fn floats(&mut self, name: &str, shape: &[usize], numbers: &[f32]) {
        let bytes = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.initializer(name, shape.to_vec(), FLOAT, bytes);
    }

    fn initializer(&mut self, name: &str, shape: Vec<usize>, data_type: i32, raw_data: Vec<u8>) {
        self.graph.initializer.push(TensorProto {
            dims: shape.into_iter().map(|n| n as i64).collect(),
            data_type,
            name: name.to_owned(),
            raw_data,
        });
    }

    fn finish(mut self) -> GraphProto {
        debug_assert!(self.weights.is_empty(), "weights that no layer has");
        let image = |name: &str, channels: usize, of: &str| {
            let named = |axis: &str| Dimension {
                dim_value: None,
                dim_param: Some(format!("{axis}{of}")),
            };
            let channels = Dimension {
                dim_value: Some(channels as i64),
                dim_param: None,
            };
            ValueInfo {
                name: name.to_owned(),
                r#type: Some(Type {
                    tensor_type: Some(TensorType {
                        elem_type: FLOAT,
                        shape: Some(TensorShape {
                            dim: vec![
                                Dimension {
                                    dim_value: None,
                                    dim_param: Some("batch".to_owned()),
                                },
                                channels,
                                named("rows"),
                                named("columns"),
                            ],
                        }),
                    }),
                }),
            }
        };
        self.graph.input = vec![image("inputs", INPUTS, "")];
        self.graph.output = vec![image("maps", OUTPUTS, "_of_maps")];
        self.graph
    }
}

/// Stride, dilation and border of a convolution.
struct Sizes {
    stride: usize,
    dilation: usize,
    border: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::nn::PaddingConfig2d;
    use burn::nn::conv::Conv2dConfig;
    use burn::tensor::{Device, Distribution, TensorData};
    use std::collections::BTreeSet;
    use wake_nn::conv::{conv3x3, convolve};

    /// Every weight of the network is in the graph once, every input of a node is computed before the node, and every value but
    /// the maps is used.
    #[test]
    fn the_graph_is_whole() {
        let network = Network::new(&Device::flex());
        let model = ModelProto::decode(&*onnx(&network)).unwrap();
        let graph = model.graph.unwrap();
        let numbers = |tensor: &TensorProto| tensor.dims.iter().product::<i64>() as usize;
        let constants = ["groups", "ones", "zeros", "twice"];
        let weights = graph.initializer.iter();
        let weights = weights.filter(|tensor| !constants.contains(&tensor.name.as_str()));
        assert_eq!(weights.map(numbers).sum::<usize>(), network.num_params());
        for tensor in &graph.initializer {
            let bytes = if tensor.data_type == FLOAT { 4 } else { 8 };
            assert_eq!(
                tensor.raw_data.len(),
                bytes * numbers(tensor),
                "{}",
                tensor.name
            );
        }
        let mut known = BTreeSet::from([String::new(), "inputs".to_owned()]);
        known.extend(graph.initializer.iter().map(|tensor| tensor.name.clone()));
        let mut used = BTreeSet::new();
        for node in &graph.node {
            for input in &node.input {
                assert!(known.contains(input), "{} before {input}", node.name);
                used.insert(input.clone());
            }
            assert!(known.insert(node.output[0].clone()), "{} twice", node.name);
        }
        used.insert("maps".to_owned());
        known.remove("");
        used.remove("");
        assert_eq!(known, used);
    }

    /// The wide convolution equals the one of the patches, whose channels are in the order of `network`.
    #[test]
    fn the_stem_is_one_convolution_of_pixels() {
        let device = Device::flex();
        let stem = conv3x3(INPUTS * STRIDE * STRIDE, 5, &device);
        let mut builder = Builder::new(BTreeMap::new());
        let weight = stem.weight.val().into_data().iter::<f32>().collect();
        let shape = stem.weight.dims().to_vec();
        builder
            .weights
            .insert("stem.weight".to_owned(), (shape, weight));
        builder
            .weights
            .insert("stem.bias".to_owned(), (vec![5], vec![0.0; 5]));
        builder.stem();
        let wide = builder
            .graph
            .initializer
            .iter()
            .find(|t| t.name == "stem.weight")
            .unwrap();
        let numbers: Vec<f32> = wide
            .raw_data
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        let mut one = Conv2dConfig::new([INPUTS, 5], [12, 12])
            .with_stride([4, 4])
            .with_padding(PaddingConfig2d::Explicit(4, 4, 4, 4))
            .init(&device);
        let shape: Vec<usize> = wide.dims.iter().map(|&n| n as usize).collect();
        one.weight =
            Param::from_tensor(Tensor::from_data(TensorData::new(numbers, shape), &device));
        one.bias = stem.bias.clone();
        let x = Tensor::<4>::random([2, INPUTS, 16, 24], Distribution::Default, &device);
        let difference =
            one.forward(x.clone()) - convolve(&stem, wake_nn::patch::space_to_depth(x, STRIDE));
        // Sums of 288 products below 1, in another order.
        let largest = difference.abs().max().into_scalar::<f32>();
        assert!(largest < 288.0 * f32::EPSILON, "{largest}");
    }
}
