//! The memory that a process takes.

use std::fs;

/// The most memory that a process (this one if none is given) held at once so far, bytes; `None` where the system does not
/// report it.
pub(crate) fn peak_bytes(process: Option<u32>) -> Option<u64> {
    status_bytes(process, "VmHWM:")
}

/// The memory that a process holds now, bytes; `None` where the system does not report it.
pub(crate) fn held_bytes(process: Option<u32>) -> Option<u64> {
    status_bytes(process, "VmRSS:")
}

/// A line of Linux's account of a process, which is in KiB.
fn status_bytes(process: Option<u32>, name: &str) -> Option<u64> {
    let process = process.map_or_else(|| "self".to_owned(), |id| id.to_string());
    let text = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_is_counted() {
        let (peak, held) = (peak_bytes(None).unwrap(), held_bytes(None).unwrap());
        assert!(peak > 1 << 20 && held > 1 << 20, "{peak} {held}");
        assert_eq!(held_bytes(Some(u32::MAX)), None);
    }
}
