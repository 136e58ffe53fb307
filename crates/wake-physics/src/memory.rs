//! Will the fields fit? Asked before anything is computed.

use crate::error::{Error, Result};
use std::sync::Once;

/// Checks that `needed` bytes for a grid are free.
///
/// Where the system does not tell (only Linux is asked, through `/proc/meminfo`) nothing is refused.
///
/// # Errors
///
/// [`Error::TooLarge`] with what is needed and what is free.
pub(crate) fn check([rows, columns]: [usize; 2], margin: [usize; 2], needed: u64) -> Result<()> {
    match available() {
        Some(free) if needed > free => Err(Error::TooLarge {
            rows,
            columns,
            margin,
            needed_gib: needed as f64 / GIB,
            available_gib: free as f64 / GIB,
        }),
        _ => Ok(()),
    }
}

/// Makes the C library keep large blocks that are freed, for the next simulation.
///
/// By default glibc gives blocks above 128 KiB back to the system, and every page of the next field is a page fault:
/// a quarter of the time of a simulation. It raises that bound, to 32 MiB at most, when a larger block is freed; this
/// frees one, of which no page was ever touched. Other allocators are not affected.
pub(crate) fn keep_large_blocks() {
    static ONCE: Once = Once::new();
    const LARGEST: usize = (32 << 20) - (64 << 10);
    ONCE.call_once(|| drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST))));
}

const GIB: f64 = (1u64 << 30) as f64;

fn available() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

/// The line `MemAvailable:  123 kB` of `/proc/meminfo`, in bytes.
fn parse(text: &str) -> Option<u64> {
    let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_the_system_is_read() {
        let text = "MemTotal: 10 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(parse(text), Some(2 << 20));
        assert_eq!(parse("MemTotal: 10 kB"), None);
        assert_eq!(parse("MemAvailable: lots"), None);
    }

    #[test]
    fn what_never_fits_is_refused_where_the_system_tells() {
        assert!(check([1, 1], [0, 0], 0).is_ok());
        if available().is_some() {
            let message = check([9, 9], [0, 0], u64::MAX).unwrap_err().to_string();
            assert!(message.contains("grid.rows"), "{message}");
        }
    }
}
