//! Devices by name, as given on a command line or in a settings file.

use burn::tensor::Device;
#[cfg(feature = "wgpu")]
use burn::tensor::DeviceKind;
#[cfg(any(feature = "wgpu", feature = "cuda"))]
use burn::tensor::DeviceType;

use crate::error::{Error, Result};

/// Backends compiled into this build.
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

/// Returns the device with a name: `flex`, `ndarray`, `wgpu` or `cuda`, if that feature is enabled.
///
/// A GPU's number may follow, as in `cuda:1`: CUDA's own number or, for `wgpu`, the number of a discrete GPU. Without a
/// number, `cuda` is `cuda:0` and `wgpu` is the GPU that burn chooses.
///
/// ```
/// let device = wake_nn::device_named("flex")?;
/// # Ok::<(), wake_nn::Error>(())
/// ```
///
/// # Errors
///
/// [`Error::UnknownDevice`] with the names that this build supports; [`Error::NoDevice`] if this machine has no such GPU.
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
            there(name, found.len(), found.contains(&device))?;
            Ok(device)
        }
        #[cfg(feature = "cuda")]
        ("cuda", number) => {
            let device = Device::cuda(number.unwrap_or(0));
            let found = Device::enumerate(DeviceType::Cuda);
            there(name, found.len(), found.contains(&device))?;
            Ok(device)
        }
        _ => Err(unknown()),
    }
}

/// Returns an error if this machine lacks a GPU, because using it would panic.
///
/// - `found`: number of devices that the backend finds
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

/// The name of a device in messages, as [`device_named`] takes it.
#[doc(hidden)]
pub fn device_label(device: &Device) -> String {
    let known: &[(&str, Device)] = &[
        #[cfg(feature = "flex")]
        ("flex", Device::flex()),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "kept until burn drops it")]
        ("ndarray", Device::ndarray()),
        #[cfg(feature = "wgpu")]
        ("wgpu", Device::wgpu(DeviceKind::DefaultDevice)),
    ];
    if let Some((name, _)) = known.iter().find(|(_, one)| one == device) {
        return (*name).to_owned();
    }
    #[cfg(feature = "cuda")]
    if let Some(number) = (0..64_usize).find(|&number| *device == Device::cuda(number)) {
        return format!("cuda:{number}");
    }
    #[cfg(feature = "wgpu")]
    if let Some(number) =
        (0..64_usize).find(|&number| *device == Device::wgpu(DeviceKind::DiscreteGpu(number)))
    {
        return format!("wgpu:{number}");
    }
    format!("{device:?}")
}

/// Whether a device is a CPU, whose code is made by compilers and not by drivers.
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

/// Runs `work` on a thread of rayon's pool if the device is a CPU. From other threads, each kernel of a network would wait for a
/// thread of the pool to wake up, which takes a tenth of a small network's training step. On a GPU `work` runs on this thread,
/// since burn orders the work of GPUs by threads.
///
/// Several threads that wait for one another must not use this at once: together they may occupy the whole pool.
#[doc(hidden)]
pub fn on_pool<R: Send>(device: &Device, work: impl FnOnce() -> R + Send) -> R {
    match is_cpu(device) {
        true => rayon::scope(|_| work()),
        false => work(),
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    #[test]
    fn names_of_compiled_backends_are_devices_and_others_are_named() {
        for name in ["flex", "flex:0"] {
            assert_eq!(device_named(name).expect(name), Device::flex());
            assert_eq!(device_label(&Device::flex()), "flex");
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

    #[test]
    fn networks_run_on_the_pool_and_results_return() {
        assert_eq!(rayon::current_thread_index(), None);
        let inside = || rayon::current_thread_index().is_some();
        assert!(on_pool(&Device::flex(), inside));
        let text = "borrowed".to_owned();
        let nested = || on_pool(&Device::flex(), || text.len());
        assert_eq!(on_pool(&Device::flex(), nested), 8);
    }
}
