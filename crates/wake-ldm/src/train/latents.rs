//! Examples to learn from, as latents in memory.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use half::f16;

use crate::conditioning::{Conditions, MapGrid};
use crate::dataset::Pair;
use crate::error::{Error, Result};
use crate::small::{Known, PatchTransform, Prior, in_parallel};

/// Examples whose residuals are computed at once.
const RESIDUALS: usize = 8;

/// One example beside its latents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// The scene's numbers.
    pub conditions: Conditions,
    /// Mean grey of the image.
    pub grey: f32,
}

impl Example {
    /// The numbers of a pair; its mean grey follows from its image.
    pub fn of(pair: &Pair) -> Self {
        let values = &pair.parameters;
        let conditions = Conditions {
            ship: Some(values.ship),
            ship_speed: values.ship_speed,
            ship_heading: values.ship_heading,
            ship_position: values.ship_x.zip(values.ship_y).map(|(x, y)| [x, y]),
            wind_speed: Some(values.wind_speed),
            wind_toward: Some(values.wind_toward),
            fetch: Some(values.fetch),
            incidence: Some(values.incidence),
        };
        Self {
            conditions,
            grey: 0.0,
        }
    }
}

/// Latents of many images, 16 bits a number.
#[derive(Debug, Default)]
pub struct LatentSet {
    shape: [usize; 3],
    latents: Vec<f16>,
    examples: Vec<Example>,
}

impl LatentSet {
    /// Encodes an image and adds it.
    ///
    /// - `image`: grey, `size × size` pixels in rows
    ///
    /// # Errors
    ///
    /// [`Error::InvalidOption`] for an image of another size than those before.
    pub fn push(
        &mut self,
        transform: &PatchTransform,
        image: Vec<f32>,
        size: usize,
        mut example: Example,
    ) -> Result<()> {
        let data = TensorData::new(image, [1, 1, size, size]);
        let device = transform.devices().into_iter().next().unwrap_or_default();
        let (latents, grey) = transform.encode(Tensor::from_data(data, &device));
        let [_, channels, rows, columns] = latents.dims();
        let shape = [channels, rows, columns];
        if !self.examples.is_empty() && shape != self.shape {
            return Err(Error::InvalidOption {
                option: "image size".to_owned(),
                value: size.to_string(),
                expected: format!("{} as before", 8 * self.shape[1]),
            });
        }
        self.shape = shape;
        example.grey = grey.into_scalar::<f32>();
        self.latents
            .extend(latents.into_data().iter::<f32>().map(f16::from_f32));
        self.examples.push(example);
        Ok(())
    }

    /// The residuals of the latents about the mean and spread that a prior expects; computed on all cores.
    ///
    /// - `patches`: what the latents were encoded with
    /// - `done`: called with a number of examples when they are done, from several threads
    pub fn residuals(
        self,
        prior: &Prior,
        patches: &PatchTransform,
        grid: MapGrid,
        done: impl Fn(usize) + Sync,
    ) -> Self {
        let all: Vec<usize> = (0..self.len()).collect();
        let chunks: Vec<&[usize]> = all.chunks(RESIDUALS).collect();
        let residuals = in_parallel(&chunks, |indices| {
            let residuals = self.residual(indices, prior, patches, grid);
            done(indices.len());
            residuals
        });
        Self {
            latents: residuals.concat(),
            ..self
        }
    }

    fn residual(
        &self,
        indices: &[usize],
        prior: &Prior,
        patches: &PatchTransform,
        grid: MapGrid,
    ) -> Vec<f16> {
        let device = patches.devices().into_iter().next().unwrap_or_default();
        let conditions: Vec<Conditions> = indices
            .iter()
            .map(|&i| self.examples[i].conditions)
            .collect();
        let known = Known::new(&conditions, grid, &device);
        let expected = prior.expect(&conditions, &known, patches, grid);
        let residual = expected.residual(self.latents(indices, &device));
        residual
            .into_data()
            .iter::<f32>()
            .map(f16::from_f32)
            .collect()
    }

    /// Number of examples.
    pub fn len(&self) -> usize {
        self.examples.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.examples.is_empty()
    }

    /// Channels, rows and columns of the latents.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// One example.
    pub fn example(&self, index: usize) -> &Example {
        &self.examples[index]
    }

    /// Some latent pixels of one example, `[channels, cells]`.
    pub fn pixels(&self, index: usize, cells: &[usize]) -> Vec<f32> {
        let [channels, rows, columns] = self.shape;
        let image = &self.latents[index * channels * rows * columns..];
        (0..channels)
            .flat_map(|channel| {
                cells
                    .iter()
                    .map(move |cell| channel * rows * columns + cell)
            })
            .map(|i| image[i].to_f32())
            .collect()
    }

    /// Latents of some examples, `[indices, channels, rows, columns]`.
    pub fn latents(&self, indices: &[usize], device: &Device) -> Tensor<4> {
        let [channels, rows, columns] = self.shape;
        let length = channels * rows * columns;
        let numbers: Vec<f32> = indices
            .iter()
            .flat_map(|&i| &self.latents[i * length..(i + 1) * length])
            .map(|x| x.to_f32())
            .collect();
        let shape = [indices.len(), channels, rows, columns];
        Tensor::from_data(TensorData::new(numbers, shape), device)
    }
}
