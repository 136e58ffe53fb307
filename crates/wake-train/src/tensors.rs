//! The parameters of a module as a list of flat tensors, always in the same order.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{DType, GradientCheckpointingStrategy, Gradients, Tensor};

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
    let mut values = values.into_iter();
    let module = changed(module, |_| {
        values.next().expect("one value for each parameter")
    });
    assert!(values.next().is_none(), "more values than parameters");
    module
}

/// Changes the parameters of a module, flat and outside autodiff, in the order of [`values`].
pub(super) fn changed<M: Module>(module: M, change: impl FnMut(Tensor<1>) -> Tensor<1>) -> M {
    module.map(&mut Changer { change })
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
        self.found.push(flat(param.val().inner()));
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

struct Changer<F> {
    change: F,
}

struct Rounder;

impl ModuleMapper for Rounder {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|old| {
            let learning = Learning::of(&old);
            learning.given(cast_to(old.inner(), DType::BF16))
        })
    }
}

impl<F: FnMut(Tensor<1>) -> Tensor<1>> ModuleMapper for Changer<F> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|old| {
            let (learning, shape) = (Learning::of(&old), old.dims());
            learning.given((self.change)(flat(old.inner())).reshape(shape))
        })
    }
}

/// State of a parameter in autodiff.
struct Learning {
    /// Checkpointing strategy; `None` outside autodiff.
    strategy: Option<GradientCheckpointingStrategy>,
    gradient: bool,
}

impl Learning {
    fn of<const D: usize>(tensor: &Tensor<D>) -> Self {
        Self {
            strategy: tensor.gradient_checkpointing_strategy(),
            gradient: tensor.is_require_grad(),
        }
    }

    /// Gives this state to a new value.
    fn given<const D: usize>(self, new: Tensor<D>) -> Tensor<D> {
        let Some(strategy) = self.strategy else {
            return new;
        };
        let new = new
            .autodiff()
            .with_gradient_checkpointing_strategy(strategy);
        match self.gradient {
            true => new.require_grad(),
            false => new,
        }
    }
}
