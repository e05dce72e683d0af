//! The container of WebP: chunks, each with a name of four bytes and its length, padded to an even one.
//!
//! Source: WebP Container Specification, Google, 2023, sections "RIFF File Format" and "Extended File Format".

use std::io::{self, Write};

/// Bytes before a chunk's content.
const CHUNK_HEADER: usize = 8;

/// Bytes before the first chunk: `RIFF`, the length of what follows, `WEBP`.
pub(super) const FILE_HEADER: usize = 12;

/// The longest file: what follows the length is even and below 2³².
pub(super) const MOST_FILE_BYTES: u64 = (1 << 32) - 2;

/// The beginning of a file of this many bytes in all.
pub(super) fn file_header(file_bytes: u64) -> [u8; FILE_HEADER] {
    let mut header = *b"RIFF\0\0\0\0WEBP";
    let rest = file_bytes.saturating_sub(CHUNK_HEADER as u64) as u32;
    header[4..8].copy_from_slice(&rest.to_le_bytes());
    header
}

/// Writes a chunk whose content is in parts; returns how many bytes that were.
pub(super) fn write_chunk(out: &mut impl Write, name: [u8; 4], parts: &[&[u8]]) -> io::Result<u64> {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    out.write_all(&name)?;
    out.write_all(&(length as u32).to_le_bytes())?;
    for part in parts {
        out.write_all(part)?;
    }
    if length % 2 == 1 {
        out.write_all(&[0])?;
    }
    Ok((CHUNK_HEADER + length.next_multiple_of(2)) as u64)
}

/// The chunks of a file, each whole, by its name; ends where the file is broken.
pub(super) fn chunks(file: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = file.get(FILE_HEADER..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let (&name, after) = rest.split_first_chunk::<4>()?;
        let (&length, _) = after.split_first_chunk::<4>()?;
        let padded = (u32::from_le_bytes(length) as usize).next_multiple_of(2);
        let (chunk, others) = rest.split_at_checked(CHUNK_HEADER + padded)?;
        rest = others;
        Some((name, chunk))
    })
}

/// The lowest three bytes, lowest first.
pub(super) fn three_bytes(value: u32) -> [u8; 3] {
    let [low, middle, high, _] = value.to_le_bytes();
    [low, middle, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_back() {
        let mut file = file_header(0).to_vec();
        let odd = write_chunk(&mut file, *b"ODD ", &[b"on", b"e"]).unwrap();
        let even = write_chunk(&mut file, *b"EVEN", &[b"four"]).unwrap();
        assert_eq!((odd, even), (12, 12));
        let found: Vec<_> = chunks(&file).collect();
        assert_eq!(
            found,
            [
                (*b"ODD ", &b"ODD \x03\0\0\0one\0"[..]),
                (*b"EVEN", &b"EVEN\x04\0\0\0four"[..])
            ]
        );
        file.pop();
        assert_eq!(chunks(&file).count(), 1, "the last one is cut off");
        assert_eq!(chunks(b"RIFF").count(), 0);
        assert_eq!(three_bytes(0x0001_0203), [3, 2, 1]);
        assert_eq!(file_header(100)[4..8], 92_u32.to_le_bytes());
    }
}
