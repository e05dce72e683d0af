//! What this program runs on, in words, for figures that depend on it.

use std::fs;

/// Processor, how many threads it has for this program, and the system.
#[must_use]
pub fn describe() -> String {
    let processor = processor_name().unwrap_or_else(|| "an unknown processor".to_owned());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (system, kind) = (std::env::consts::OS, std::env::consts::ARCH);
    let cores = match cores {
        1 => "1 core".to_owned(),
        n => format!("{n} cores"),
    };
    format!("{processor}, {cores}, {system} on {kind}")
}

/// How the device's times were taken.
#[must_use]
pub fn timing(has_timestamps: bool) -> &'static str {
    if has_timestamps {
        "timestamps"
    } else {
        "submit-to-idle"
    }
}

/// The name that Linux gives the processor; other systems do not say it in a file.
fn processor_name() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    let (_, name) = line.split_once(':')?;
    Some(name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_has_cores() {
        let text = describe();
        assert!(
            text.contains(" core") && text.contains(std::env::consts::OS),
            "{text}"
        );
    }
}
