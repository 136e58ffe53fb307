//! Training steps, on one device or several.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use serde_json::{Value, json};

use super::checkpoint::{Checkpoint, Tensors};
use super::optimizer::{AdamOptions, LrSchedule, Optimizer};
use super::tensors::{changed, gradients, names, replaced, rounded, values};
use crate::error::{Error, Result};
use wake_nn::{check_range, on_pool};

/// Groups of a checkpoint's tensors, in the order of [`Trainer::state`].
const GROUPS: [&str; 4] = ["weights", "average", "first", "second"];
/// Number of steps in a row without a finite loss and gradient that ends a run.
const LOST: usize = 20;

/// Constants of a training loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainerOptions {
    /// Learning-rate schedule.
    pub rate: LrSchedule,
    /// Constants of the optimizer.
    pub adam: AdamOptions,
    /// Largest norm of the whole gradient; longer gradients are clipped to it.
    pub max_grad_norm: f64,
    /// Decay of the averaged weights.
    pub ema_decay: f64,
    /// Parts of its batch that a device processes one after the other.
    pub grad_accumulation_steps: usize,
    /// Whether losses and gradients are computed with weights of type `bfloat16`, on a device that has it; weights, averages
    /// and updates keep 32 bits (Micikevicius et al. 2018, "Mixed Precision Training", section 3.1).
    pub bf16: bool,
}

impl Default for TrainerOptions {
    fn default() -> Self {
        Self {
            rate: LrSchedule {
                peak: 1e-3,
                warmup: 200,
                steps: 10_000,
            },
            adam: AdamOptions::default(),
            max_grad_norm: 1.0,
            ema_decay: 0.999,
            grad_accumulation_steps: 1,
            bf16: false,
        }
    }
}

impl TrainerOptions {
    /// Checks that all constants are in range.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] with the constant at fault.
    pub fn validate(&self) -> Result<()> {
        let AdamOptions {
            beta_1,
            beta_2,
            epsilon,
            weight_decay,
        } = self.adam;
        check_range("rate", self.rate.peak, 1e-12, 1.0)?;
        check_range("beta_1", beta_1, 0.0, 0.9999)?;
        check_range("beta_2", beta_2, 0.0, 0.999999)?;
        check_range("epsilon", epsilon, 1e-16, 1.0)?;
        check_range("weight_decay", weight_decay, 0.0, 1.0)?;
        check_range("max_grad_norm", self.max_grad_norm, 1e-6, 1e6)?;
        check_range("ema_decay", self.ema_decay, 0.0, 0.999999)?;
        Ok(check_range(
            "grad_accumulation_steps",
            self.grad_accumulation_steps as f64,
            1.0,
            65536.0,
        )?)
    }

    /// Values that two runs must share for one to resume the other. The number of steps may differ, and so may
    /// `grad_accumulation_steps`, which changes no result.
    pub(super) fn state(&self) -> Value {
        let AdamOptions {
            beta_1,
            beta_2,
            epsilon,
            weight_decay,
        } = self.adam;
        json!({
            "rate": self.rate.peak, "warmup": self.rate.warmup, "beta_1": beta_1, "beta_2": beta_2,
            "epsilon": epsilon, "weight_decay": weight_decay, "max_grad_norm": self.max_grad_norm,
            "ema_decay": self.ema_decay, "bf16": self.bf16,
        })
    }
}

/// Result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// Mean loss of all parts.
    pub loss: f64,
    /// Norm of the gradient before clipping.
    pub norm: f64,
    /// Learning rate.
    pub rate: f64,
    /// Whether the gradient was finite; if not, nothing was changed.
    pub applied: bool,
}

/// A model in training.
///
/// With several devices each computes the gradients of its own parts of the batch; they are averaged on the first
/// device, which makes the step, as one device would with the whole batch.
#[derive(Debug)]
pub(crate) struct Trainer<M> {
    /// The model; taken out while a step changes its weights in place.
    model: Option<M>,
    optimizer: Optimizer,
    options: TrainerOptions,
    devices: Vec<Device>,
    /// Steps made; those of the optimizer are the ones that changed the weights.
    step: usize,
    /// Steps since the last one that changed the weights.
    lost: usize,
}

impl<M: Module> Trainer<M> {
    /// Trainer of a model on the first of some autodiff devices.
    ///
    /// # Panics
    ///
    /// When there is no device.
    pub(crate) fn new(model: M, options: TrainerOptions, devices: Vec<Device>) -> Self {
        let model = model.fork(devices.first().expect("at least one device"));
        Self {
            optimizer: Optimizer::new(options.adam, options.ema_decay, values(&model)),
            model: Some(model),
            options,
            devices,
            step: 0,
            lost: 0,
        }
    }

    /// Weights, averaged weights, and both moments of the optimizer.
    pub(super) fn state(&self) -> [Vec<Tensor<1>>; 4] {
        let [first, second, average] = self.optimizer.state();
        [values(self.model()), average, first, second]
    }

    /// The model as it is now, on its autodiff device.
    pub(super) fn model(&self) -> &M {
        self.model.as_ref().expect("a model between steps")
    }

    /// The model with averaged weights, outside autodiff.
    pub(crate) fn averaged(&self) -> M {
        replaced(self.model().valid(), self.optimizer.averages())
    }

    /// Steps made so far.
    pub(crate) fn steps(&self) -> usize {
        self.step
    }

    /// Number of parts of a batch.
    pub(crate) fn parts(&self) -> usize {
        self.devices.len() * self.options.grad_accumulation_steps
    }

    /// Checks that the run still makes steps.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] when many steps in a row, or all so far, had no finite loss and gradient.
    pub(crate) fn check(&self) -> Result<()> {
        let never = self.step > 0 && self.optimizer.steps() == 0;
        if self.lost >= LOST || (never && self.step >= self.options.rate.steps) {
            return Err(Error::Diverged {
                step: self.step,
                what: format!(
                    "loss or gradient was not finite in the last {} steps",
                    self.lost
                ),
            });
        }
        Ok(())
    }

    /// Makes one step on the mean of `loss` over all parts.
    ///
    /// - `loss`: loss of the model on a device, for a part numbered below [`parts`](Self::parts)
    pub(crate) fn step(
        &mut self,
        loss: impl Fn(&M, &Device, usize) -> Tensor<1> + Sync,
    ) -> StepReport {
        match self.devices.as_slice() {
            [device] => on_pool(&device.clone().inner(), || self.step_here(&loss)),
            // Threads of several devices share the pool, so this one stays outside.
            _ => self.step_here(&loss),
        }
    }

    fn step_here(
        &mut self,
        loss: &(impl Fn(&M, &Device, usize) -> Tensor<1> + Sync),
    ) -> StepReport {
        let (gradients, loss) = self.gradients(loss);
        let norm = global_norm(&gradients);
        let rate = self.options.rate.at(self.step);
        let applied = norm.is_finite() && loss.is_finite();
        if applied {
            let scale = (self.options.max_grad_norm / (norm + 1e-6)).min(1.0);
            let update = self.optimizer.step(gradients, rate, scale);
            self.model = self.model.take().map(|model| changed(model, update));
            self.lost = 0;
        } else {
            self.lost += 1;
        }
        self.step += 1;
        StepReport {
            loss,
            norm,
            rate,
            applied,
        }
    }

    /// Mean gradients and mean loss over all parts.
    fn gradients(
        &self,
        loss: &(impl Fn(&M, &Device, usize) -> Tensor<1> + Sync),
    ) -> (Vec<Tensor<1>>, f64) {
        let accumulation = self.options.grad_accumulation_steps;
        let bf16 = self.options.bf16;
        let work = |model: M, device: &Device, worker: usize| {
            let model = match bf16 {
                true => rounded(model),
                false => model,
            };
            let parts = (0..accumulation).map(|i| {
                let loss = loss(&model, device, worker * accumulation + i);
                let value = f64::from(loss.clone().inner().into_scalar::<f32>());
                (gradients(&model, loss.backward()), value)
            });
            parts.reduce(sum).unwrap_or_default()
        };
        let (sums, total) = match self.devices.as_slice() {
            [device] => work(self.model().clone(), device, 0),
            devices => in_threads(devices, |device| self.model().clone().fork(device), work),
        };
        let count = self.parts();
        let parts = count as f64;
        let mean = |g: Tensor<1>| if count == 1 { g } else { g / parts };
        (sums.into_iter().map(mean).collect(), total / parts)
    }
}

/// Sum of two lists of gradients and losses.
fn sum(a: (Vec<Tensor<1>>, f64), b: (Vec<Tensor<1>>, f64)) -> (Vec<Tensor<1>>, f64) {
    let gradients = a.0.into_iter().zip(b.0).map(|(a, b)| a + b).collect();
    (gradients, a.1 + b.1)
}

/// Runs one thread per device, and sums the results on the first device in the order of the devices.
fn in_threads<M: Send>(
    devices: &[Device],
    copy: impl Fn(&Device) -> M,
    work: impl Fn(M, &Device, usize) -> (Vec<Tensor<1>>, f64) + Sync,
) -> (Vec<Tensor<1>>, f64) {
    let (work, home) = (&work, devices[0].clone().inner());
    std::thread::scope(|scope| {
        let workers: Vec<_> = devices
            .iter()
            .enumerate()
            .map(|(i, device)| {
                let model = copy(device);
                scope.spawn(move || work(model, device, i))
            })
            .collect();
        let results = workers.into_iter().map(|worker| match worker.join() {
            Ok((gradients, loss)) => {
                let home = gradients.into_iter().map(|g| g.to_device(&home)).collect();
                (home, loss)
            }
            Err(panic) => std::panic::resume_unwind(panic),
        });
        results.reduce(sum).unwrap_or_default()
    })
}

/// Euclidean norm of all gradients together.
fn global_norm(gradients: &[Tensor<1>]) -> f64 {
    let squares = gradients.iter().map(|g| g.clone().square().sum()).collect();
    f64::from(Tensor::cat(squares, 0).sum().sqrt().into_scalar::<f32>())
}

impl<M: Module> Trainer<M> {
    /// Checkpoint of the weights, their average and the optimizer's averages.
    ///
    /// - `state`: values that a run must share to resume from here
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] for weights that are not finite.
    pub(crate) fn checkpoint(&self, state: &Value) -> Result<Checkpoint> {
        let names = names(self.model());
        let mut tensors = Tensors::new();
        for (group, values) in GROUPS.iter().zip(self.state()) {
            for ((name, shape), value) in names.iter().zip(values) {
                let numbers: Vec<f32> = value.into_data().iter::<f32>().collect();
                if numbers.iter().any(|number| !number.is_finite()) {
                    return Err(Error::Diverged {
                        step: self.step,
                        what: format!("{group}.{name} has NaN or infinite numbers"),
                    });
                }
                tensors.insert(format!("{group}.{name}"), (shape.clone(), numbers));
            }
        }
        Ok(Checkpoint {
            step: self.step,
            applied: self.optimizer.steps(),
            state: state.clone(),
            tensors,
        })
    }

    /// Resumes from a checkpoint.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for a checkpoint of another `state`, or without a tensor of the model.
    pub(crate) fn restore(&mut self, checkpoint: Checkpoint, state: &Value) -> Result<()> {
        if let Some(error) = checkpoint.differs(state) {
            return Err(error);
        }
        let mut tensors = checkpoint.tensors;
        let devices = self.model().devices();
        let device = devices.into_iter().next().unwrap_or_default().inner();
        let names = names(self.model());
        let mut group = |group: &str| -> Result<Vec<Tensor<1>>> {
            let take = |(name, shape): &(String, Vec<usize>)| {
                let name = format!("{group}.{name}");
                let found = tensors.remove(&name).filter(|(found, _)| found == shape);
                let (_, numbers) = found.ok_or_else(|| {
                    Error::Value(wake_nn::Error::InvalidOption {
                        option: "checkpoint".to_owned(),
                        value: format!("without the tensor {name} of shape {shape:?}"),
                        expected: "all tensors of the model".to_owned(),
                    })
                })?;
                let length = numbers.len();
                Ok(Tensor::from_data(
                    TensorData::new(numbers, [length]),
                    &device,
                ))
            };
            names.iter().map(take).collect()
        };
        let [a, b, c, d] = GROUPS;
        let state = [group(a)?, group(b)?, group(c)?, group(d)?];
        let [weights, average, first, second] = state;
        self.model = self.model.take().map(|model| replaced(model, weights));
        self.optimizer
            .resume([first, second, average], checkpoint.applied);
        (self.step, self.lost) = (checkpoint.step, 0);
        Ok(())
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use std::sync::Mutex;

    use burn::nn::{Linear, LinearConfig};

    use super::*;

    /// For each part of a step: true if its loss is computed on a thread of rayon's pool.
    fn on_the_pool(devices: usize) -> Vec<bool> {
        let devices = vec![Device::flex().autodiff(); devices];
        let model = LinearConfig::new(3, 2).init(&devices[0]);
        let mut trainer = Trainer::new(model, TrainerOptions::default(), devices);
        let seen = Mutex::new(Vec::new());
        let report = trainer.step(|model: &Linear, device, _| {
            let inside = rayon::current_thread_index().is_some();
            seen.lock().expect("no panic").push(inside);
            model
                .forward(Tensor::<2>::ones([4, 3], device))
                .square()
                .mean()
        });
        assert!(report.applied && report.loss > 0.0);
        seen.into_inner().expect("no panic")
    }

    #[test]
    fn a_step_on_one_device_runs_on_the_pool_and_one_on_several_does_not() {
        assert_eq!(on_the_pool(1), [true]);
        // Their threads would occupy the pool while they wait for it.
        assert_eq!(on_the_pool(2), [false, false]);
    }
}
