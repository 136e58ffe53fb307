//! Will the fields fit? Asked before anything is computed.

use crate::error::{Error, Result};

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
