//! The network with its weights, on a device.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use wake_ldm::weights::{Layout, load, load_bytes};

use super::decode::Maps;
use super::find::Mapper;
use super::network::{INPUTS, Network, STRIDE};

/// A trained network.
pub(crate) struct Model {
    network: Network,
    device: Device,
}

impl Model {
    /// The network of a file, or the one in the repository.
    ///
    /// # Errors
    ///
    /// What [`load`] finds for a file that is not there or does not fit.
    pub(crate) fn load(file: Option<&Path>, device: Device) -> wake_ldm::Result<Self> {
        let network = Network::new(&device);
        let network = match file {
            Some(file) => load(network, Layout::Diffusers, file)?,
            None => {
                let bytes = include_bytes!("../../assets/detector.safetensors");
                load_bytes(network, Layout::Diffusers, "detector.safetensors", bytes)?
            }
        };
        Ok(Self { network, device })
    }
}

impl Mapper for Model {
    fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps {
        let inputs = TensorData::new(inputs, [1, INPUTS, rows, columns]);
        let maps = self
            .network
            .forward(Tensor::from_data(inputs, &self.device));
        let values = maps.into_data().iter::<f32>().collect();
        Maps::new(rows / STRIDE, columns / STRIDE, values)
    }
}
