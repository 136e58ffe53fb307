//! Vector instructions of this machine.

use pulp::Arch;

/// The widest that this machine has; tests may hold it to AVX2.
pub(super) fn arch() -> Arch {
    #[cfg(all(test, target_arch = "x86_64"))]
    if narrow::is_held()
        && let Some(v3) = pulp::x86::V3::try_new()
    {
        return Arch::V3(v3);
    }
    Arch::new()
}

#[cfg(all(test, target_arch = "x86_64"))]
pub(super) mod narrow {
    use std::sync::atomic::{AtomicBool, Ordering};

    static HELD: AtomicBool = AtomicBool::new(false);

    pub(super) fn is_held() -> bool {
        HELD.load(Ordering::Relaxed)
    }

    /// Holds all kernels to AVX2, or frees them again.
    pub(in crate::kernels) fn hold(held: bool) {
        HELD.store(held, Ordering::Relaxed);
    }
}
