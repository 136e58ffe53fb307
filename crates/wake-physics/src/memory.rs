//! Check that the fields of a scene fit in memory, before anything is computed.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Checks that `needed` bytes for a grid are free; `advice` names what would need less.
///
/// Free memory is what the machine has available, limited by the control groups of this process (containers). Requests of a
/// few megabytes are not checked. Nothing is refused where the system reports no figure (only Linux is supported).
///
/// # Errors
///
/// [`Error::TooLarge`] with the needed and the free memory.
pub(crate) fn check(
    [rows, columns]: [usize; 2],
    margin: [usize; 2],
    needed: u64,
    advice: &'static str,
) -> Result<()> {
    if needed <= NEVER_ASKED {
        return Ok(());
    }
    match available() {
        Some(free) if needed > free => Err(Error::TooLarge {
            rows,
            columns,
            margin,
            needed_gib: needed as f64 / GIB,
            available_gib: free as f64 / GIB,
            advice,
        }),
        _ => Ok(()),
    }
}

/// Requests up to this size are not checked \[bytes\]: a check takes as long as a small image.
const NEVER_ASKED: u64 = 32 << 20;
const GIB: f64 = (1u64 << 30) as f64;

/// Bytes of memory available to this process; `None` if the system does not report it.
pub fn available() -> Option<u64> {
    let machine = parse(&std::fs::read_to_string("/proc/meminfo").ok()?)?;
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let group = limits(&groups, Path::new("/sys/fs/cgroup"));
    Some(group.map_or(machine, |group| group.min(machine)))
}

/// Least memory left by the control groups of this process, version 2 or 1; `None` without a limit.
///
/// - `groups`: content of `/proc/self/cgroup`, lines `0::/PATH` or `N:memory:/PATH`
/// - `root`: where the groups are mounted
fn limits(groups: &str, root: &Path) -> Option<u64> {
    let number =
        |path: PathBuf| -> Option<u64> { std::fs::read_to_string(path).ok()?.trim().parse().ok() };
    let left = |folder: &Path, limit: &str, used: &str, cache: &str| {
        // "max" does not parse as a number: no limit.
        let limit = number(folder.join(limit))?;
        let used = number(folder.join(used))?;
        let stat = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let cached = stat
            .lines()
            .find_map(|line| line.strip_prefix(cache)?.trim().parse().ok());
        // Cached files count as used but can be evicted.
        Some(limit.saturating_sub(used.saturating_sub(cached.unwrap_or(0))))
    };
    let mut least = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(kind), Some(path)) = (fields.next(), fields.next()) else {
            continue;
        };
        let root = match kind {
            "" => root.to_owned(),
            "memory" => root.join("memory"),
            _ => continue,
        };
        // A container sees its own group as the root; limits of parent groups apply as well.
        let path = root.join(path.trim_start_matches('/'));
        for folder in path
            .ancestors()
            .take_while(|folder| folder.starts_with(&root))
        {
            let new = left(folder, "memory.max", "memory.current", "inactive_file ");
            let old = || {
                let names = ["memory.limit_in_bytes", "memory.usage_in_bytes"];
                left(folder, names[0], names[1], "total_inactive_file ")
            };
            least = least.into_iter().chain(new.or_else(old)).min();
        }
    }
    least
}

/// Parses the line `MemAvailable:  123 kB` of `/proc/meminfo`; returns bytes.
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

    /// Trees as the kernel presents them, of both versions.
    #[test]
    fn the_limit_of_a_container_is_read() {
        let tree = tempfile::tempdir().unwrap();
        let root = tree.path();
        let put = |name: &str, text: &str| {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let groups = "0::/a/b\n";
        assert_eq!(limits(groups, root), None);
        put("a/b/memory.max", "max\n");
        put("a/b/memory.current", "50\n");
        assert_eq!(limits(groups, root), None);
        // The parent has the limit; 30 of its used bytes are cached files.
        put("a/memory.max", "1000\n");
        put("a/memory.current", "130\n");
        put("a/memory.stat", "anon 70\ninactive_file 30\n");
        assert_eq!(limits(groups, root), Some(900));
        put("a/b/memory.max", "60\n");
        assert_eq!(limits(groups, root), Some(10));
        assert_eq!(limits("0::/\n", root), None);
        let old = "7:cpu,cpuacct:/c\n6:memory:/c\n";
        put("memory/c/memory.limit_in_bytes", "500\n");
        put("memory/c/memory.usage_in_bytes", "700\n");
        assert_eq!(limits(old, root), Some(0));
        put(
            "memory/c/memory.stat",
            "inactive_file 1\ntotal_inactive_file 300\n",
        );
        assert_eq!(limits(old, root), Some(100));
    }

    #[test]
    fn what_never_fits_is_refused_where_the_system_tells() {
        assert!(check([1, 1], [0, 0], 0, "").is_ok());
        if available().is_some() {
            let message = check([9, 9], [0, 0], u64::MAX, "lower grid.rows")
                .unwrap_err()
                .to_string();
            assert!(message.contains("grid.rows"), "{message}");
        }
    }
}
