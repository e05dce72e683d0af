//! A description of the machine, and the memory of a process.

use std::fs;

/// Processor, how many threads it has for this program, and the system.
pub(crate) fn describe() -> String {
    let processor = processor_name().unwrap_or_else(|| "an unknown processor".to_owned());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (system, kind) = (std::env::consts::OS, std::env::consts::ARCH);
    let cores = match cores {
        1 => "1 core".to_owned(),
        n => format!("{n} cores"),
    };
    format!("{processor}, {cores}, {system} on {kind}")
}

/// The name that Linux gives the processor; other systems do not say it in a file.
fn processor_name() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    let (_, name) = line.split_once(':')?;
    Some(name.trim().to_owned())
}

/// The most memory that a process (this one unless told another) held at once so far, bytes; `None` where the system does not
/// tell.
pub(crate) fn peak_bytes(process: Option<u32>) -> Option<u64> {
    status_bytes(process, "VmHWM:")
}

/// The memory that a process holds now, bytes; `None` where the system does not tell.
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

    #[test]
    fn the_machine_has_cores() {
        let text = describe();
        assert!(
            text.contains(" core") && text.contains(std::env::consts::OS),
            "{text}"
        );
    }
}
