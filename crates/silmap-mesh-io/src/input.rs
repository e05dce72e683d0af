//! The bytes of an input file: whole, in pieces, and never more than memory allows.
//!
//! A device or a pipe may never end, and a file may be larger than the memory, so that whatever is read as a whole is read here.
//! A caller that wants to be interrupted while a pipe has nothing to say does this on a thread of its own and leaves it waiting.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path};

/// Most bytes that are read of one file. A mesh of as many faces as can be counted here would be larger, but none that its memory
/// would suffice for.
pub const MOST_BYTES: u64 = 4 << 30;

/// What is read at once.
const PIECE_BYTES: usize = 1 << 20;

/// Up to this size the machine's memory is not checked.
const SMALL_BYTES: u64 = 64 << 20;

/// A file is at most this part of the memory: what is made of it needs more than its bytes.
const MEMORY_SHARE: u64 = 2;

/// Reads a file to its end.
///
/// # Errors
/// What the system says; [`io::ErrorKind::FileTooLarge`] when there are more than [`MOST_BYTES`], and
/// [`io::ErrorKind::OutOfMemory`] when there are more than half of the memory of this machine or container holds.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let about = file.metadata()?;
    let expected = if about.is_file() { about.len() } else { 0 };
    read_within(file, expected, MOST_BYTES, memory_bytes)
}

/// Reads a file of UTF-8 text to its end.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] when it is no such text.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

/// Reads files that lie beside another one, by the names that it has for them, as `asset::read_with` asks for. Names that lead out of its
/// folder are not followed.
pub fn beside(path: &Path) -> impl Fn(&str) -> Option<Vec<u8>> + use<> {
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    move |name: &str| {
        let is_plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        let is_plain = Path::new(name).components().all(is_plain);
        is_plain.then(|| read(&folder.join(name)).ok()).flatten()
    }
}

/// Reads to the end. `expected` is the length that the input claims: an input may be refused for it, but it is not relied on.
fn read_within(
    mut input: impl Read,
    expected: u64,
    most: u64,
    memory: impl Fn() -> Option<u64>,
) -> io::Result<Vec<u8>> {
    let mut bytes: Vec<u8> = Vec::new();
    let mut piece = vec![0; PIECE_BYTES];
    let mut of_memory = None;
    loop {
        let have = bytes.len() as u64;
        let known = have.max(expected);
        if known > most {
            let sentence = format!(
                "it has more than {} bytes, the most that are read of one file",
                shown(most)
            );
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, sentence));
        }
        if known > SMALL_BYTES.min(most / MEMORY_SHARE) {
            let total = *of_memory.get_or_insert_with(&memory);
            if let Some(total) = total.filter(|total| known > total / MEMORY_SHARE) {
                let sentence = format!(
                    "it has more than {} bytes, half of the memory that there is",
                    shown(total / MEMORY_SHARE)
                );
                return Err(io::Error::new(io::ErrorKind::OutOfMemory, sentence));
            }
        }
        let found = match input.read(&mut piece) {
            Ok(0) => return Ok(bytes),
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        if bytes.capacity() - bytes.len() < found {
            // Twice as much each time, but no more than may come. What the system does not give is no reason to end all.
            let wanted = (2 * have).max(expected).min(most) + PIECE_BYTES as u64;
            let more = usize::try_from(wanted - have).unwrap_or(usize::MAX);
            bytes.try_reserve_exact(more).map_err(|_| {
                let sentence = format!(
                    "there is no memory for more than {} bytes of it",
                    shown(have)
                );
                io::Error::new(io::ErrorKind::OutOfMemory, sentence)
            })?;
        }
        bytes.extend_from_slice(&piece[..found]);
    }
}

/// Memory of this machine, or of the container that this runs in, where the system says so in a file.
fn memory_bytes() -> Option<u64> {
    let number = |path: &str| fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let of_machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix("MemTotal:"))?;
        let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        kibibytes.checked_mul(1024)
    });
    let of_container = number("/sys/fs/cgroup/memory.max")
        .or_else(|| number("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
    match (of_machine, of_container) {
        (Some(machine), Some(container)) => Some(machine.min(container)),
        (machine, container) => machine.or(container),
    }
}

/// A number of bytes in the largest unit that leaves three digits.
fn shown(bytes: u64) -> String {
    let (mut value, mut unit) = (bytes as f64, "");
    for larger in [" Ki", " Mi", " Gi"] {
        if value >= 1024.0 {
            (value, unit) = (value / 1024.0, larger);
        }
    }
    // 4 Gi bytes, 1.5 Gi bytes.
    format!("{}{unit}", (value * 10.0).round() / 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_never_ends_is_refused_by_its_limit() {
        let error = read_within(io::repeat(0), 0, 3 << 20, || None).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(
            error.to_string(),
            "it has more than 3 Mi bytes, the most that are read of one file"
        );
        let error = read_within(io::repeat(0), 0, 64 << 20, || Some(80 << 20)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::OutOfMemory);
        assert!(error.to_string().contains("40 Mi bytes"), "{error}");
    }

    #[test]
    fn what_says_that_it_is_too_large_is_not_read() {
        struct Untouched;
        impl Read for Untouched {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                panic!("it is read")
            }
        }
        assert!(read_within(Untouched, 11, 10, || None).is_err());
        assert!(read_within(Untouched, 9, 10, || Some(16)).is_err());
    }

    #[test]
    fn all_of_the_rest_is_read() {
        let bytes: Vec<u8> = (0..3_000_001_u32).map(|i| (i % 251) as u8).collect();
        // The expected length is not relied on.
        for expected in [0, 5, 4_000_000] {
            let read = read_within(&bytes[..], expected, 1 << 30, || Some(1 << 30)).unwrap();
            assert_eq!(read, bytes);
        }
        assert_eq!(
            read_within(&bytes[..0], 0, 10, || None).unwrap(),
            Vec::<u8>::new()
        );
        assert_eq!(
            read_within(&bytes[..10], 10, 10, || None).unwrap().len(),
            10
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_memory_is_known() {
        assert!(memory_bytes().is_some_and(|bytes| bytes > 64 << 20));
        assert_eq!(
            [shown(5), shown(1536), shown(4 << 30)],
            ["5", "1.5 Ki", "4 Gi"]
        );
    }
}
