//! The outside of the file: the chunks of a binary glTF, and where the checksum is in a file that this program wrote.
//!
//! Files of version 1 have a checksum over the whole file: the CRC-32 with the checksum's own eight hexadecimal digits taken as
//! zeros. Later ones have it over what belongs to the extension: see [`references`](super::references).

use super::AssetError;

const MAGIC: u32 = 0x4654_6C67; // "glTF"
const GLTF_VERSION: u32 = 2;
const JSON_CHUNK: u32 = 0x4E4F_534A; // "JSON"
const BINARY_CHUNK: u32 = 0x004E_4942; // "BIN\0"
const FILE_HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// Bytes of a `.glb` file before its JSON text.
pub const HEADER_BYTES: usize = FILE_HEADER_BYTES + CHUNK_HEADER_BYTES;

/// Stands where the checksum goes until it is known.
pub(super) const CHECKSUM_BLANK: &str = "00000000";

/// What comes right before the checksum's digits in the JSON text. Quotes inside strings are escaped, so it cannot occur
/// in one.
const CHECKSUM_KEY: &[u8] = b"\"checksum\":\"";

/// The chunks of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunks<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: &'a [u8],
}

/// Puts a JSON text and a binary buffer into one file.
pub(super) fn join(json: &str, binary: &[u8]) -> Result<Vec<u8>, AssetError> {
    let json_length = json.len().next_multiple_of(4);
    let binary_length = binary.len().next_multiple_of(4);
    let bytes = HEADER_BYTES + CHUNK_HEADER_BYTES + json_length + binary_length;
    let word = |n: usize| u32::try_from(n).map_err(|_| AssetError::TooLarge { bytes });
    let mut file = Vec::with_capacity(bytes);
    for value in [
        MAGIC,
        GLTF_VERSION,
        word(bytes)?,
        word(json_length)?,
        JSON_CHUNK,
    ] {
        file.extend_from_slice(&value.to_le_bytes());
    }
    file.extend_from_slice(json.as_bytes());
    file.resize(HEADER_BYTES + json_length, b' ');
    for value in [word(binary_length)?, BINARY_CHUNK] {
        file.extend_from_slice(&value.to_le_bytes());
    }
    file.extend_from_slice(binary);
    file.resize(bytes, 0);
    Ok(file)
}

/// Bytes of the JSON text that follow the first [`HEADER_BYTES`] of a `.glb` file; `None` when it is not one.
#[must_use]
pub fn json_length(header: &[u8; HEADER_BYTES]) -> Option<u32> {
    let (magic, rest) = take_word(header)?;
    let (length, kind) = take_word(rest.get(8..)?)?;
    let (kind, _) = take_word(kind)?;
    (magic == MAGIC && kind == JSON_CHUNK).then_some(length)
}

/// Finds the chunks of a file. A file of JSON alone has an empty binary chunk.
pub(super) fn split(file: &[u8]) -> Result<Chunks<'_>, AssetError> {
    let fail = |reason| AssetError::NotGlb { reason };
    if file.is_empty() {
        return Err(fail("it is empty"));
    }
    let (magic, rest) = take_word(file).ok_or(fail("it is too short"))?;
    if magic != MAGIC {
        return Err(fail("it does not begin with \"glTF\""));
    }
    let (version, rest) = take_word(rest).ok_or(fail("it ends in its header"))?;
    if version != GLTF_VERSION {
        return Err(fail("it is not of glTF version 2"));
    }
    let (length, rest) = take_word(rest).ok_or(fail("it ends in its header"))?;
    match (length as usize).cmp(&file.len()) {
        std::cmp::Ordering::Less => return Err(fail("it is longer than its header says")),
        std::cmp::Ordering::Greater => return Err(fail("it is shorter than its header says")),
        std::cmp::Ordering::Equal => {}
    }
    let (json, rest) =
        take_chunk(rest, JSON_CHUNK).ok_or(fail("it does not begin with a JSON chunk"))?;
    if rest.is_empty() {
        return Ok(Chunks { json, binary: &[] });
    }
    // The format allows more chunks of other kinds after these two.
    let (binary, _) =
        take_chunk(rest, BINARY_CHUNK).ok_or(fail("its binary chunk is incomplete"))?;
    Ok(Chunks { json, binary })
}

fn take_word(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (word, rest) = bytes.split_first_chunk::<4>()?;
    Some((u32::from_le_bytes(*word), rest))
}

fn take_chunk(bytes: &[u8], kind: u32) -> Option<(&[u8], &[u8])> {
    let (length, rest) = take_word(bytes)?;
    let (found, rest) = take_word(rest)?;
    if found != kind {
        return None;
    }
    rest.split_at_checked(length as usize)
}

/// Where in the file the checksum's digits are.
fn checksum_range(file: &[u8]) -> Option<std::ops::Range<usize>> {
    let json = split(file).ok()?.json;
    let key = json
        .windows(CHECKSUM_KEY.len())
        .position(|window| window == CHECKSUM_KEY)?;
    let start = HEADER_BYTES + key + CHECKSUM_KEY.len();
    let end = start + CHECKSUM_BLANK.len();
    (end <= file.len()).then_some(start..end)
}

fn checksum(file: &[u8], digits: &std::ops::Range<usize>) -> String {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&file[..digits.start]);
    crc.update(CHECKSUM_BLANK.as_bytes());
    crc.update(&file[digits.end..]);
    format!("{:08x}", crc.finalize())
}

/// Writes a checksum over its placeholder, or over another.
pub(super) fn seal(file: &mut [u8], sum: &str) {
    if let Some(digits) = checksum_range(file)
        && digits.len() == sum.len()
    {
        file[digits].copy_from_slice(sum.as_bytes());
    }
}

/// Compares the checksum of a file of version 1 with its bytes; `by` is the program that wrote it.
pub(super) fn check_seal(file: &[u8], by: Option<&str>) -> Result<(), AssetError> {
    let digits = checksum_range(file);
    let computed = digits.as_ref().map(|digits| checksum(file, digits));
    let stored = digits.map(|digits| String::from_utf8_lossy(&file[digits]).into_owned());
    // A fuzzer is to get past the checksum, to what must hold without it.
    if (stored.is_some() && stored == computed) || cfg!(fuzzing) {
        return Ok(());
    }
    let nothing = || "nothing".to_owned();
    Err(AssetError::Damaged {
        stored: stored.unwrap_or_else(nothing),
        computed: computed.unwrap_or_else(nothing),
        by: by.map(str::to_owned),
    })
}
