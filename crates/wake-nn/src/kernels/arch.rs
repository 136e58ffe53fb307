//! Vector instructions of the machine.

use pulp::Arch;

/// Returns the widest vector instructions of this machine; tests may limit them to AVX2.
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

    /// Limits all kernels to AVX2, or lifts the limit.
    pub(in crate::kernels) fn hold(held: bool) {
        HELD.store(held, Ordering::Relaxed);
    }
}
