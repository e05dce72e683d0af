//! Buffer views under EXT_meshopt_compression and KHR_meshopt_compression, decoded by `meshopt`.
//!
//! That library asserts what it is called with, in C: strides, counts and filters are checked here before. What the
//! encoded bytes hold it checks itself. A claimed size is accepted up to the ratio that the encoding can reach.

use ::meshopt as codec;
use serde::Deserialize;

use super::document::Whole;

/// The extension's object in a buffer view.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub(super) buffer: Whole,
    #[serde(default)]
    pub(super) byte_offset: Whole,
    pub(super) byte_length: Whole,
    byte_stride: Whole,
    count: Whole,
    mode: String,
    filter: Option<String>,
}

/// Two bits can stand for a block of 256 bytes in mode ATTRIBUTES; this is above that.
const MOST_BYTES_PER_BYTE: usize = 1100;

/// A triangle takes a byte at least, and so does an index of a sequence.
const MOST_BYTES_PER_INDEX_BYTE: usize = 16;

/// The decoded view; else what is wrong, as the end of a sentence.
pub(super) fn decode(view: &Compressed, encoded: &[u8]) -> Result<Vec<u8>, String> {
    let (stride, count) = (view.byte_stride.0, view.count.0);
    let size = stride.checked_mul(count);
    let most = encoded.len().saturating_mul(if view.mode == "ATTRIBUTES" {
        MOST_BYTES_PER_BYTE
    } else {
        MOST_BYTES_PER_INDEX_BYTE
    });
    if size.is_none_or(|size| size > most) {
        return Err(format!(
            "{count} elements of {stride} bytes do not come from {} bytes",
            encoded.len()
        ));
    }
    let filter = view.filter.as_deref().unwrap_or("NONE");
    if view.mode != "ATTRIBUTES" && filter != "NONE" {
        return Err(format!("mode {} has no filters", shown(&view.mode)));
    }
    if count == 0 {
        return Ok(Vec::new());
    }
    let fault = |_| "its encoded bytes are damaged".to_owned();
    match (view.mode.as_str(), stride) {
        ("ATTRIBUTES", stride) => {
            if stride % 4 != 0 || !(4..=256).contains(&stride) {
                return Err(format!("a stride of {stride} bytes cannot be"));
            }
            let mut words = decode_attributes(encoded, count, stride / 4).map_err(fault)?;
            apply(filter, &mut words, stride)?;
            Ok(words.into_iter().flat_map(u32::to_ne_bytes).collect())
        }
        ("TRIANGLES", _) if count % 3 != 0 => Err(format!("{count} indices do not make triangles")),
        ("TRIANGLES", 2) => codec::decode_index_buffer::<u16>(encoded, count)
            .map(|indices| indices.into_iter().flat_map(u16::to_ne_bytes).collect())
            .map_err(fault),
        ("TRIANGLES", 4) => codec::decode_index_buffer::<u32>(encoded, count)
            .map(|indices| indices.into_iter().flat_map(u32::to_ne_bytes).collect())
            .map_err(fault),
        ("INDICES", 2) => codec::decode_index_sequence::<u16>(encoded, count)
            .map(|indices| indices.into_iter().flat_map(u16::to_ne_bytes).collect())
            .map_err(fault),
        ("INDICES", 4) => codec::decode_index_sequence::<u32>(encoded, count)
            .map(|indices| indices.into_iter().flat_map(u32::to_ne_bytes).collect())
            .map_err(fault),
        ("TRIANGLES" | "INDICES", _) => Err(format!("indices of {stride} bytes cannot be")),
        (mode, _) => Err(format!("mode {} is not known", shown(mode))),
    }
}

fn shown(name: &str) -> String {
    super::super::error::excerpt(name)
}

/// Undoes a filter, in place.
fn apply(filter: &str, words: &mut [u32], stride: usize) -> Result<(), String> {
    match (filter, stride) {
        ("NONE", _) => (),
        ("OCTAHEDRAL", 4) => {
            codec::decode_filter_oct(bytemuck::cast_slice_mut::<_, [i8; 4]>(words))
        }
        ("OCTAHEDRAL", 8) => {
            codec::decode_filter_oct(bytemuck::cast_slice_mut::<_, [i16; 4]>(words))
        }
        ("QUATERNION", 8) => codec::decode_filter_quat(bytemuck::cast_slice_mut(words)),
        ("EXPONENTIAL", _) => {
            codec::decode_filter_exp(bytemuck::cast_slice_mut::<_, [u32; 1]>(words))
        }
        ("COLOR", 4) => codec::decode_filter_color(bytemuck::cast_slice_mut::<_, [u8; 4]>(words)),
        ("COLOR", 8) => codec::decode_filter_color(bytemuck::cast_slice_mut::<_, [u16; 4]>(words)),
        ("OCTAHEDRAL" | "QUATERNION" | "COLOR", _) => {
            return Err(format!("filter {filter} cannot be with {stride} bytes"));
        }
        (other, _) => return Err(format!("filter {} is not known", shown(other))),
    }
    Ok(())
}

/// An element of so many words; the library takes its size from the type.
#[derive(Clone)]
struct Element<const WORDS: usize>([u32; WORDS]);

impl<const WORDS: usize> Default for Element<WORDS> {
    fn default() -> Self {
        Self([0; WORDS])
    }
}

/// Elements of 1 to 64 words.
fn decode_attributes(encoded: &[u8], count: usize, words: usize) -> codec::Result<Vec<u32>> {
    fn of<const WORDS: usize>(encoded: &[u8], count: usize) -> codec::Result<Vec<u32>> {
        let elements = codec::decode_vertex_buffer::<Element<WORDS>>(encoded, count)?;
        Ok(elements.into_iter().flat_map(|element| element.0).collect())
    }
    macro_rules! by_words {
        ($($words:literal)*) => {
            match words {
                $($words => of::<$words>(encoded, count),)*
                _ => Err(codec::Error::Native(-1)),
            }
        };
    }
    by_words!(
        1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
        33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64
    )
}
