//! The bytes behind a glTF document: buffers, data URIs and accessors, with every range checked.

use std::ops::RangeInclusive;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, STANDARD_NO_PAD};
use gltf::accessor::DataType;

use super::error::{GltfFault, MeshFault};

/// Loads all buffers; `blob` is the binary chunk of a `.glb`.
pub(super) fn load_buffers(
    document: &gltf::Document,
    blob: Option<&[u8]>,
    folder: &Path,
) -> Result<Vec<Vec<u8>>, GltfFault> {
    document
        .buffers()
        .map(|buffer| {
            let index = buffer.index();
            let bytes = match buffer.source() {
                gltf::buffer::Source::Bin => blob
                    .map(<[u8]>::to_vec)
                    .ok_or(GltfFault::NoBufferData { buffer: index })?,
                gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
                    decode_data_uri(uri).ok_or(GltfFault::DataUri { buffer: index })?
                }
                gltf::buffer::Source::Uri(uri) => {
                    read_resource(uri, folder).map_err(|reason| GltfFault::MissingBuffer {
                        buffer: index,
                        uri: uri.to_owned(),
                        reason,
                    })?
                }
            };
            if bytes.len() < buffer.length() {
                return Err(GltfFault::ShortBuffer {
                    buffer: index,
                    claimed: buffer.length() as u64,
                    found: bytes.len() as u64,
                });
            }
            Ok(bytes)
        })
        .collect()
}

/// The bytes of a data URI or of a file beside the document.
pub(super) fn read_resource(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        return decode_data_uri(uri).ok_or_else(|| "its data URI is not base64".to_owned());
    }
    crate::input::read(&folder.join(decode_percent(uri))).map_err(|e| e.to_string())
}

fn decode_data_uri(uri: &str) -> Option<Vec<u8>> {
    let (_, data) = uri.split_once(";base64,")?;
    STANDARD
        .decode(data)
        .or_else(|_| STANDARD_NO_PAD.decode(data))
        .ok()
}

/// `%20` and the like in file names.
fn decode_percent(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = (first == b'%')
            .then(|| after.get(..2))
            .flatten()
            .and_then(|hex| std::str::from_utf8(hex).ok())
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_owned())
}

/// A checked accessor: element `i` begins at `start + i · stride` of `data`, and all of them lie inside.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    index: usize,
    data: &'a [u8],
    stride: usize,
    width: usize,
    data_type: DataType,
    is_normalized: bool,
    /// Elements.
    pub(super) count: usize,
}

impl<'a> Accessor<'a> {
    /// Checks that all elements lie in their buffer view, and that in its buffer.
    pub(super) fn new(
        accessor: &gltf::Accessor<'_>,
        buffers: &'a [Vec<u8>],
    ) -> Result<Self, MeshFault> {
        let index = accessor.index();
        let kind = |what| {
            let accessor = index;
            MeshFault::Gltf(GltfFault::AccessorKind { accessor, what })
        };
        if accessor.sparse().is_some() {
            return Err(kind("sparse accessors are not supported"));
        }
        let view = accessor.view().ok_or_else(|| kind("it has no data"))?;
        let size = accessor.size();
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let data = (|| {
            let buffer = buffers.get(view.buffer().index())?;
            let in_view = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?;
            let data = in_view.get(accessor.offset()..)?;
            let last = count.checked_sub(1)?.checked_mul(stride)?;
            (last.checked_add(size)? <= data.len() || count == 0).then_some(data)
        })();
        let data = match (data, count) {
            (Some(data), _) => data,
            (None, 0) => &[],
            (None, _) => {
                let accessor = index;
                return Err(MeshFault::Gltf(GltfFault::AccessorRange { accessor }));
            }
        };
        Ok(Self {
            index,
            data,
            stride,
            width: accessor.dimensions().multiplicity(),
            data_type: accessor.data_type(),
            is_normalized: accessor.normalized(),
            count,
        })
    }

    /// Refuses elements of another number of components.
    pub(super) fn with_width(self, allowed: RangeInclusive<usize>) -> Result<Self, MeshFault> {
        if allowed.contains(&self.width) {
            Ok(self)
        } else {
            Err(MeshFault::Gltf(GltfFault::AccessorKind {
                accessor: self.index,
                what: "its elements have the wrong number of components",
            }))
        }
    }

    /// The first four components of an element, zero where it has fewer; integers scaled where the document says so.
    pub(super) fn get(&self, element: usize) -> [f64; 4] {
        let mut values = [0.0; 4];
        let bytes = &self.data[element * self.stride..];
        for (k, value) in values.iter_mut().enumerate().take(self.width) {
            *value = self.component(bytes, k);
        }
        values
    }

    fn component(&self, bytes: &[u8], k: usize) -> f64 {
        fn field<const N: usize>(bytes: &[u8], k: usize) -> [u8; N] {
            let mut taken = [0; N];
            taken.copy_from_slice(&bytes[k * N..(k + 1) * N]);
            taken
        }
        let (value, largest) = match self.data_type {
            DataType::I8 => (f64::from(i8::from_le_bytes(field(bytes, k))), 127.0),
            DataType::U8 => (f64::from(bytes[k]), 255.0),
            DataType::I16 => (f64::from(i16::from_le_bytes(field(bytes, k))), 32_767.0),
            DataType::U16 => (f64::from(u16::from_le_bytes(field(bytes, k))), 65_535.0),
            DataType::U32 => (f64::from(u32::from_le_bytes(field(bytes, k))), 1.0),
            DataType::F32 => (f64::from(f32::from_le_bytes(field(bytes, k))), 1.0),
        };
        if self.is_normalized {
            (value / largest).max(-1.0)
        } else {
            value
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_decoded() {
        assert_eq!(decode_percent("my%20file%2.bin%"), "my file%2.bin%");
        let data = "data:application/octet-stream;base64,AAEC";
        assert_eq!(read_resource(data, Path::new("")), Ok(vec![0, 1, 2]));
        assert!(read_resource("data:,plain", Path::new("")).is_err());
        assert!(read_resource("data:x;base64,@@", Path::new("")).is_err());
    }
}
