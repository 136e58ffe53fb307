//! The crate's own operations on burn's CPU backend, with their gradients.

use burn::backend::flex::FlexTensor;
use burn::backend::{BackendTensor, DispatchAutodiffContext, DispatchTensor, DispatchTensorKind};
use burn::tensor::{DType, Tensor, TensorData};

/// Operation on contiguous f32 tensors.
pub(super) trait Operation<const N: usize>:
    Clone + std::fmt::Debug + Send + 'static
{
    /// Data that the forward pass saves for the gradients, in addition to its inputs.
    type Saved: Clone + std::fmt::Debug + Send + 'static;

    /// Returns the result and the saved data.
    fn forward(&self, inputs: [&[f32]; N]) -> (Vec<f32>, Self::Saved);

    /// Saves the result if the gradients need it; it is shared, not copied.
    #[cfg_attr(
        not(feature = "autodiff"),
        allow(dead_code, reason = "nothing is trained")
    )]
    fn keep(_: &mut Self::Saved, _: &FlexTensor) {}

    /// Returns the gradients with respect to the wanted inputs, from the gradient of the result.
    #[cfg_attr(
        not(feature = "autodiff"),
        allow(dead_code, reason = "nothing is trained")
    )]
    fn gradients(
        &self,
        inputs: [&[f32]; N],
        saved: &Self::Saved,
        gradient: &[f32],
        wanted: [bool; N],
    ) -> [Vec<f32>; N];
}

/// Applies an operation; `None` unless all tensors are in f32 on burn's CPU backend.
pub(super) fn apply<const N: usize, const D: usize, O: Operation<N>>(
    operation: O,
    inputs: [DispatchTensor; N],
    shape: [usize; D],
) -> Option<Tensor<D>> {
    if !inputs.iter().all(runs_here) {
        return None;
    }
    let context = inputs
        .iter()
        .fold(DispatchAutodiffContext::Disabled, |all, input| {
            all.merge(input.autodiff)
        });
    let kind = match context {
        DispatchAutodiffContext::Disabled => {
            let inputs = inputs.map(plain);
            let values = operation.forward(inputs.each_ref().map(values_of)).0;
            DispatchTensorKind::Flex(BackendTensor::Float(tensor(values, &shape)))
        }
        #[cfg(feature = "autodiff")]
        DispatchAutodiffContext::Enabled(_) => tracked::apply(operation, inputs, &shape),
        #[cfg(not(feature = "autodiff"))]
        DispatchAutodiffContext::Enabled(_) => return None,
    };
    Some(Tensor::from_dispatch(DispatchTensor {
        kind,
        autodiff: context,
    }))
}

pub(super) fn runs_here(tensor: &DispatchTensor) -> bool {
    let dtype = |kind: &DispatchTensorKind| match kind {
        DispatchTensorKind::Flex(BackendTensor::Float(tensor)) => Some(tensor.dtype()),
        #[cfg(feature = "autodiff")]
        DispatchTensorKind::Flex(BackendTensor::Autodiff(tensor)) => {
            Some(tensor.primitive().dtype())
        }
        _ => None,
    };
    let dtype = match &tensor.kind {
        #[cfg(feature = "autodiff")]
        DispatchTensorKind::Autodiff(kind) => dtype(kind),
        kind => dtype(kind),
    };
    dtype == Some(DType::F32)
}

fn plain(tensor: DispatchTensor) -> FlexTensor {
    match tensor.kind {
        DispatchTensorKind::Flex(tensor) => tensor.float().to_contiguous(),
        #[allow(
            unreachable_patterns,
            reason = "of a build with one backend it is the only kind"
        )]
        kind => unreachable!("looked at before: {kind:?}"),
    }
}

/// A tensor outside autodiff whose storage holds its elements alone, in order; for a tensor that [`runs_here`].
pub(super) fn unshared(tensor: DispatchTensor) -> FlexTensor {
    let tensor = plain(tensor);
    match tensor.storage::<f32>().len() == values_of(&tensor).len() {
        true => tensor,
        false => {
            let values = values_of(&tensor).to_vec();
            self::tensor(values, tensor.layout().shape())
        }
    }
}

/// A tensor outside autodiff.
pub(super) fn tensor_of<const D: usize>(tensor: FlexTensor) -> Tensor<D> {
    Tensor::from_dispatch(DispatchTensor {
        kind: DispatchTensorKind::Flex(BackendTensor::Float(tensor)),
        autodiff: DispatchAutodiffContext::Disabled,
    })
}

/// The elements of a contiguous tensor.
pub(super) fn values_of(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().unwrap_or_default()
}

fn tensor(values: Vec<f32>, shape: &[usize]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, shape.to_vec()))
}

/// Operations recorded for automatic differentiation.
#[cfg(feature = "autodiff")]
mod tracked {
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::NoCheckpointing};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
    use burn::backend::tensor::FloatTensor;
    use burn::backend::{Autodiff, Flex};

    use super::*;

    type Tracked = FloatTensor<Autodiff<Flex>>;

    pub(super) fn apply<const N: usize, O: Operation<N>>(
        operation: O,
        inputs: [DispatchTensor; N],
        shape: &[usize],
    ) -> DispatchTensorKind {
        let inputs = inputs.map(tracked);
        let guards = inputs.each_ref().map(Tracked::node);
        let inputs = inputs.map(|input| input.into_primitive().to_contiguous());
        let (values, mut saved) = operation.forward(inputs.each_ref().map(values_of));
        let result = tensor(values, shape);
        O::keep(&mut saved, &result);
        let step = Step(std::marker::PhantomData::<O>);
        let result = match step
            .prepare::<NoCheckpointing>(guards)
            .compute_bound()
            .stateful()
        {
            OpsKind::Tracked(step) => step.finish((operation, inputs, saved), result),
            OpsKind::UnTracked(step) => step.finish(result),
        };
        DispatchTensorKind::Autodiff(Box::new(DispatchTensorKind::Flex(BackendTensor::Autodiff(
            result,
        ))))
    }

    fn tracked(tensor: DispatchTensor) -> Tracked {
        let kind = match tensor.kind {
            DispatchTensorKind::Autodiff(kind) => *kind,
            kind => kind,
        };
        match kind {
            DispatchTensorKind::Flex(BackendTensor::Autodiff(tensor)) => tensor,
            DispatchTensorKind::Flex(tensor) => Tracked::new(tensor.float()),
            kind => unreachable!("looked at before: {kind:?}"),
        }
    }

    /// Backward pass of an operation.
    #[derive(Debug)]
    struct Step<O>(std::marker::PhantomData<O>);

    impl<const N: usize, O: Operation<N>> Backward<Flex, N> for Step<O> {
        type State = (O, [FlexTensor; N], O::Saved);

        fn backward(
            self,
            step: Ops<Self::State, N>,
            gradients: &mut Gradients,
            _: &mut Checkpointer,
        ) {
            let (operation, inputs, saved) = step.state;
            let gradient = gradients.consume::<Flex>(&step.node).to_contiguous();
            let results = operation.gradients(
                inputs.each_ref().map(values_of),
                &saved,
                values_of(&gradient),
                step.parents.each_ref().map(Option::is_some),
            );
            for ((parent, input), values) in step.parents.iter().zip(&inputs).zip(results) {
                if let Some(parent) = parent {
                    let shape = input.layout().shape().to_vec();
                    gradients.register::<Flex>(parent.id, tensor(values, &shape));
                }
            }
        }
    }
}
