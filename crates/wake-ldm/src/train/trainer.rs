//! One step of training, on one device or several.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use super::adam::{Adam, AdamOptions};
use super::average::Average;
use super::rate::Rate;
use super::tensors::{gradients, replaced, rounded, values};

/// Constants of a [`Trainer`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainerOptions {
    /// Size of the steps.
    pub rate: Rate,
    /// Constants of the optimizer.
    pub adam: AdamOptions,
    /// The largest norm of all gradients together; longer ones are shortened to it.
    pub largest_norm: f64,
    /// Decay of the averaged weights.
    pub average_decay: f64,
    /// Parts of a batch that one device takes after the other.
    pub accumulation: usize,
    /// Whether losses and gradients are computed with weights of type `bfloat16`, where the device has it; weights,
    /// averages and steps are 32 bits all the same (Micikevicius et al. 2018, "Mixed Precision Training", section 3.1).
    pub bf16: bool,
}

impl Default for TrainerOptions {
    fn default() -> Self {
        Self {
            rate: Rate {
                peak: 1e-3,
                warmup: 200,
                steps: 10_000,
            },
            adam: AdamOptions::default(),
            largest_norm: 1.0,
            average_decay: 0.999,
            accumulation: 1,
            bf16: false,
        }
    }
}

/// What a step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// Mean loss of all parts.
    pub loss: f64,
    /// Norm of the gradient before clipping.
    pub norm: f64,
    /// Size of the step.
    pub rate: f64,
    /// Whether the gradient was finite; if not, nothing was changed.
    pub applied: bool,
}

/// A model in training.
///
/// With several devices each computes the gradients of its own parts of the batch; they are averaged on the first
/// device, which makes the step, as one device would with the whole batch.
#[derive(Debug)]
pub struct Trainer<M> {
    model: M,
    adam: Adam,
    average: Average,
    options: TrainerOptions,
    devices: Vec<Device>,
    step: usize,
}

impl<M: Module> Trainer<M> {
    /// A trainer of a model on the first of some autodiff devices.
    ///
    /// # Panics
    ///
    /// When there is no device.
    pub fn new(model: M, options: TrainerOptions, devices: Vec<Device>) -> Self {
        let model = model.fork(devices.first().expect("at least one device"));
        let weights = values(&model);
        Self {
            adam: Adam::new(options.adam, &weights),
            average: Average::new(weights, options.average_decay),
            model,
            options,
            devices,
            step: 0,
        }
    }

    /// Goes back to what it was after `step` steps; the lists are those of [`state`](Self::state).
    pub fn resume(&mut self, [weights, average, first, second]: [Vec<Tensor<1>>; 4], step: usize) {
        self.model = replaced(self.model.clone(), weights);
        self.average = Average::new(average, self.options.average_decay);
        self.adam = Adam::resumed(self.options.adam, [first, second], step);
        self.step = step;
    }

    /// Weights, averaged weights, and both averages of the optimizer.
    pub fn state(&self) -> [Vec<Tensor<1>>; 4] {
        let [first, second] = self.adam.state();
        [
            values(&self.model),
            self.average.values().to_vec(),
            first.to_vec(),
            second.to_vec(),
        ]
    }

    /// The model as it is now, on its autodiff device.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The model with averaged weights, outside autodiff.
    pub fn averaged(&self) -> M {
        replaced(self.model.valid(), self.average.values().to_vec())
    }

    /// Steps made so far.
    pub fn steps(&self) -> usize {
        self.step
    }

    /// Parts that a batch is cut into.
    pub fn parts(&self) -> usize {
        self.devices.len() * self.options.accumulation
    }

    /// One step against the mean of `loss` over all parts.
    ///
    /// - `loss`: of the model on a device, and the number of a part, below [`parts`](Self::parts)
    pub fn step(&mut self, loss: impl Fn(&M, &Device, usize) -> Tensor<1> + Sync) -> StepReport {
        let (gradients, loss) = self.gradients(&loss);
        let norm = global_norm(&gradients);
        let rate = self.options.rate.at(self.step);
        let applied = norm.is_finite() && loss.is_finite();
        if applied {
            let scale = (self.options.largest_norm / (norm + 1e-6)).min(1.0);
            let weights = self.adam.step(values(&self.model), gradients, rate, scale);
            self.average.update(&weights, self.step + 1);
            self.model = replaced(self.model.clone(), weights);
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
        let accumulation = self.options.accumulation;
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
            [device] => work(self.model.clone(), device, 0),
            devices => in_threads(devices, |device| self.model.clone().fork(device), work),
        };
        let parts = self.parts() as f64;
        (sums.into_iter().map(|g| g / parts).collect(), total / parts)
    }
}

/// Sum of two lists of gradients and losses.
fn sum(a: (Vec<Tensor<1>>, f64), b: (Vec<Tensor<1>>, f64)) -> (Vec<Tensor<1>>, f64) {
    let gradients = a.0.into_iter().zip(b.0).map(|(a, b)| a + b).collect();
    (gradients, a.1 + b.1)
}

/// One thread for each device; the results are summed on the first, in the order of the devices.
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
