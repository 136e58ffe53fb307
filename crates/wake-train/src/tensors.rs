//! The parameters of a module as a list of flat tensors, always in the same order.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{DType, Gradients, Tensor};

use wake_nn::cast_to;

/// Names and shapes of all parameters, in the order of [`values`].
pub(super) fn names<M: Module>(module: &M) -> Vec<(String, Vec<usize>)> {
    let mut lister = Names::default();
    module.visit(&mut lister);
    lister.found
}

/// The parameters, flat, outside autodiff.
pub(super) fn values<M: Module>(module: &M) -> Vec<Tensor<1>> {
    let mut lister = Values { found: Vec::new() };
    module.visit(&mut lister);
    lister.found
}

/// The gradients of all parameters, flat, of 32 bits; zeros where the loss does not depend on one.
pub(super) fn gradients<M: Module>(module: &M, gradients: Gradients) -> Vec<Tensor<1>> {
    let mut lister = Differentials {
        gradients,
        found: Vec::new(),
    };
    module.visit(&mut lister);
    lister.found
}

/// Replaces the parameters of a module.
///
/// # Panics
///
/// When the list does not match the parameters of the module.
pub(super) fn replaced<M: Module>(module: M, values: Vec<Tensor<1>>) -> M {
    let mut replacer = Replacer {
        values: values.into_iter(),
    };
    let module = module.map(&mut replacer);
    assert!(
        replacer.values.next().is_none(),
        "more values than parameters"
    );
    module
}

/// Casts the parameters of a module to `bfloat16`; they require gradients where the old ones did.
pub(super) fn rounded<M: Module>(module: M) -> M {
    module.map(&mut Rounder)
}

fn flat<const D: usize>(tensor: Tensor<D>) -> Tensor<1> {
    tensor.reshape([-1])
}

#[derive(Default)]
struct Names {
    path: Vec<String>,
    found: Vec<(String, Vec<usize>)>,
}

impl ModuleVisitor for Names {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.found
            .push((self.path.join("."), param.lazy_shape().to_vec()));
    }
}

struct Values {
    found: Vec<Tensor<1>>,
}

impl ModuleVisitor for Values {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.found.push(flat(plain(&param.val())));
    }
}

struct Differentials {
    gradients: Gradients,
    found: Vec<Tensor<1>>,
}

impl ModuleVisitor for Differentials {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let value = param.val();
        let gradient = value.grad_remove(&mut self.gradients);
        let gradient = gradient.unwrap_or_else(|| value.inner().zeros_like());
        self.found.push(cast_to(flat(gradient), DType::F32));
    }
}

struct Replacer {
    values: std::vec::IntoIter<Tensor<1>>,
}

struct Rounder;

impl ModuleMapper for Rounder {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|old| relearnt(&old, cast_to(plain(&old), DType::BF16)))
    }
}

impl ModuleMapper for Replacer {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let value = self.values.next().expect("one value for each parameter");
        param.map(|old| relearnt(&old, value.reshape(old.dims())))
    }
}

/// A tensor outside autodiff.
fn plain<const D: usize>(tensor: &Tensor<D>) -> Tensor<D> {
    if tensor.is_autodiff() {
        return tensor.clone().inner();
    }
    tensor.clone()
}

/// Gives a new value the autodiff state of the old one.
fn relearnt<const D: usize>(old: &Tensor<D>, new: Tensor<D>) -> Tensor<D> {
    if !old.is_autodiff() {
        return new;
    }
    let new = Tensor::from_inner(new);
    if old.is_require_grad() {
        new.require_grad()
    } else {
        new
    }
}
