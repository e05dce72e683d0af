//! The chunks of a binary glTF.

use super::super::error::GltfFault;

const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const CHUNK_JSON: &[u8] = b"JSON";
const CHUNK_BIN: &[u8] = b"BIN\0";

/// The JSON chunk and, if there is one, the binary chunk; chunks of other kinds are skipped.
pub(super) fn split_chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfFault> {
    let word = |at: usize| -> Option<u32> {
        let field = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(field.try_into().ok()?))
    };
    if !bytes.starts_with(b"glTF") {
        return Err(GltfFault::Magic);
    }
    let (Some(version), Some(claimed)) = (word(4), word(8)) else {
        return Err(GltfFault::TruncatedChunk);
    };
    if version != 2 {
        return Err(GltfFault::Version { version });
    }
    let (mut json, mut binary) = (None, None);
    let mut at = HEADER_BYTES;
    while at < bytes.len() {
        let length = word(at).ok_or(GltfFault::TruncatedChunk)? as usize;
        let kind = bytes.get(at + 4..at + CHUNK_HEADER_BYTES);
        let start = at + CHUNK_HEADER_BYTES;
        let data = start
            .checked_add(length)
            .and_then(|end| bytes.get(start..end));
        let (Some(kind), Some(data)) = (kind, data) else {
            return Err(GltfFault::TruncatedChunk);
        };
        if at == HEADER_BYTES && kind != CHUNK_JSON {
            break;
        }
        match kind {
            CHUNK_JSON => json = json.or(Some(data)),
            CHUNK_BIN => binary = binary.or(Some(data)),
            _ => (),
        }
        at = start + length;
    }
    if u64::from(claimed) != bytes.len() as u64 {
        return Err(GltfFault::Length {
            claimed: claimed.into(),
            found: bytes.len() as u64,
        });
    }
    let json = json.ok_or_else(|| GltfFault::Json {
        part: "chunk ",
        reason: "there is none".to_owned(),
    })?;
    Ok((json, binary))
}
