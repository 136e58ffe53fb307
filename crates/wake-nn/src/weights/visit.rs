//! Parameters of a model by their names in files.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{DType, Device, Tensor, TensorData};

use super::names::{Layout, ModulePath};
use crate::numbers::cast_to;

/// A parameter as a file holds it.
#[derive(Debug, Clone)]
pub struct Weight {
    /// Name in the file.
    pub name: String,
    /// Shape in the file.
    pub shape: Vec<usize>,
    /// Whether the model holds the transpose, as for the matrices of linear layers.
    pub transposed: bool,
    /// Device of the parameter.
    pub device: Device,
}

impl Weight {
    fn new<const D: usize>(param: &Param<Tensor<D>>, path: &ModulePath, layout: Layout) -> Self {
        let transposed = path.is_transposed(D);
        let mut shape = param.lazy_shape().to_vec();
        if transposed {
            shape.reverse();
        }
        Self {
            name: path.file_name(layout),
            shape,
            transposed,
            device: param.lazy_device(),
        }
    }
}

/// Numbers of a parameter, in the order of the file.
pub type Values<'a> = &'a dyn Fn() -> std::io::Result<TensorData>;

/// Calls a function with each parameter of a model; its numbers are computed on request.
pub fn visit<M: Module>(model: &M, layout: Layout, each: impl FnMut(Weight, Values<'_>)) {
    let path = ModulePath::default();
    model.visit(&mut Visitor { path, layout, each });
}

struct Visitor<F> {
    path: ModulePath,
    layout: Layout,
    each: F,
}

impl<F: FnMut(Weight, Values<'_>)> ModuleVisitor for Visitor<F> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let weight = Weight::new(param, &self.path, self.layout);
        let transposed = weight.transposed;
        (self.each)(weight, &|| {
            let values = param.transform_for_save().val();
            let values = as_in_file(values, transposed).try_into_data();
            values.map_err(std::io::Error::other)
        });
    }
}

/// Converts a matrix from the model's order to the file's, or back.
fn as_in_file<const D: usize>(tensor: Tensor<D>, transposed: bool) -> Tensor<D> {
    match transposed {
        true => tensor.swap_dims(0, 1),
        false => tensor,
    }
}

/// Change of a parameter.
#[derive(Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one at a time; a tensor's handle is large where wgpu is built"
)]
pub enum Change {
    /// No change.
    Kept,
    /// Adds this matrix, in f32 with one rounding, whatever the parameter's number type; the matrix is in the model's order
    /// and is reshaped to the parameter.
    Added(Tensor<2>),
    /// Replaces the parameter by these numbers, which are in the file's order, and holds them in this type.
    Replaced(TensorData, DType),
}

/// Changes the parameters of a model.
///
/// # Errors
///
/// The first error of `change`.
pub fn map<M: Module, E>(
    model: M,
    layout: Layout,
    change: impl FnMut(&Weight) -> Result<Change, E>,
) -> Result<M, E> {
    let mut mapper = Mapper {
        path: ModulePath::default(),
        layout,
        change,
        result: Ok(()),
    };
    let model = model.map(&mut mapper);
    mapper.result.map(|()| model)
}

struct Mapper<F, E> {
    path: ModulePath,
    layout: Layout,
    change: F,
    result: Result<(), E>,
}

impl<E, F: FnMut(&Weight) -> Result<Change, E>> ModuleMapper for Mapper<F, E> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        if self.result.is_err() {
            return param;
        }
        let weight = Weight::new(&param, &self.path, self.layout);
        match (self.change)(&weight) {
            Ok(Change::Kept) => param,
            Ok(Change::Added(change)) => param.map(|weight| {
                let (shape, dtype) = (weight.dims(), weight.dtype());
                cast_to(cast_to(weight, DType::F32) + change.reshape(shape), dtype)
            }),
            Ok(Change::Replaced(values, dtype)) => {
                let values = Tensor::from_data(values, (&weight.device, dtype));
                let id = param.id;
                param.transform_for_load(as_in_file(values, weight.transposed), id)
            }
            Err(error) => {
                self.result = Err(error);
                param
            }
        }
    }
}
