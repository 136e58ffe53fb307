//! Devices by the names that a command line or a settings file gives them.

use burn::tensor::Device;
#[cfg(feature = "wgpu")]
use burn::tensor::DeviceKind;
#[cfg(any(feature = "wgpu", feature = "cuda"))]
use burn::tensor::DeviceType;

use crate::error::{Error, Result};

/// The backends that are compiled in.
const BACKENDS: &[&str] = &[
    #[cfg(feature = "flex")]
    "flex",
    #[cfg(feature = "ndarray")]
    "ndarray",
    #[cfg(feature = "wgpu")]
    "wgpu",
    #[cfg(feature = "cuda")]
    "cuda",
];

/// The device of a name: `flex`, `ndarray`, `wgpu` or `cuda`, where that feature is on.
///
/// A GPU's number may follow, as in `cuda:1`: CUDA's own number, or that of a discrete GPU for `wgpu`. Without a
/// number, `cuda` is `cuda:0` and `wgpu` is the GPU that burn chooses.
///
/// ```
/// let device = wake_nn::device_named("flex")?;
/// # Ok::<(), wake_nn::Error>(())
/// ```
///
/// # Errors
///
/// [`Error::UnknownDevice`] with the names that this build knows; [`Error::NoDevice`] if this machine has no such GPU.
pub fn device_named(name: &str) -> Result<Device> {
    let unknown = || Error::UnknownDevice {
        name: name.to_owned(),
        compiled: BACKENDS.to_vec(),
    };
    let (backend, number): (&str, Option<usize>) = match name.split_once(':') {
        None => (name, None),
        Some((backend, number)) => (backend, Some(number.parse().map_err(|_| unknown())?)),
    };
    match (backend, number) {
        #[cfg(feature = "flex")]
        ("flex", None | Some(0)) => Ok(Device::flex()),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "kept until burn drops it")]
        ("ndarray", None | Some(0)) => Ok(Device::ndarray()),
        #[cfg(feature = "wgpu")]
        ("wgpu", None) => {
            let found = Device::enumerate(DeviceType::Wgpu);
            there(name, found.len(), !found.is_empty())?;
            Ok(Device::wgpu(DeviceKind::DefaultDevice))
        }
        #[cfg(feature = "wgpu")]
        ("wgpu", Some(number)) => {
            let device = Device::wgpu(DeviceKind::DiscreteGpu(number));
            let found = Device::enumerate(DeviceType::Wgpu);
            there(name, found.len(), found.iter().any(|one| *one == device))?;
            Ok(device)
        }
        #[cfg(feature = "cuda")]
        ("cuda", number) => {
            let device = Device::cuda(number.unwrap_or(0));
            let found = Device::enumerate(DeviceType::Cuda);
            there(name, found.len(), found.iter().any(|one| *one == device))?;
            Ok(device)
        }
        _ => Err(unknown()),
    }
}

/// An error where this machine lacks a GPU: to use it would panic.
///
/// - `found`: devices that the backend has here
#[cfg(any(feature = "wgpu", feature = "cuda"))]
fn there(name: &str, found: usize, is_there: bool) -> Result<()> {
    match is_there {
        true => Ok(()),
        false => Err(Error::NoDevice {
            name: name.to_owned(),
            found,
        }),
    }
}

/// Whether a device is a CPU, where compilers, not drivers, make the code.
pub fn is_cpu(device: &Device) -> bool {
    let cpus: &[Device] = &[
        #[cfg(feature = "flex")]
        Device::flex(),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "kept until burn drops it")]
        Device::ndarray(),
    ];
    cpus.contains(device)
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    #[test]
    fn names_of_compiled_backends_are_devices_and_others_are_named() {
        for name in ["flex", "flex:0"] {
            assert_eq!(device_named(name).expect(name), Device::flex());
        }
        #[cfg(feature = "ndarray")]
        assert_ne!(device_named("ndarray").expect("ndarray"), Device::flex());
        for name in [
            "", "tpu", "Flex", "flex:", "flex:1", "flex:x", "cuda:-1", "cuda:0:0",
        ] {
            let error = device_named(name).expect_err(name);
            assert!(
                matches!(&error, Error::UnknownDevice { name: n, compiled } if n == name && compiled.contains(&"flex"))
            );
            assert!(
                error.to_string().contains("'tpu'") == (name == "tpu"),
                "{error}"
            );
        }
    }
}
