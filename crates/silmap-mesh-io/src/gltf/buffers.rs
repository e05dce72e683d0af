//! The bytes behind a document: buffers, data URIs, files beside it, and buffer views, compressed or not.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, STANDARD_NO_PAD};

use super::super::error::GltfFault;
use super::document::{BufferView, Document, Whole, find};
use super::meshopt::{self, Compressed};

/// Names of one extension: the second is the first's heir.
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// All buffers that are needed, and the buffer views decoded so far.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    data: Vec<Option<Cow<'a, [u8]>>>,
    compressed: Vec<Option<Compressed>>,
    decoded: Vec<OnceCell<Vec<u8>>>,
}

/// The bytes of a buffer view.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// Bytes from one element to the next, where the view says.
    pub(super) stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Loads the buffers; `blob` is the binary chunk of a `.glb`. Buffers that only stand in for compressed views are not
    /// looked at.
    pub(super) fn load(
        document: &'a Document,
        blob: Option<&'a [u8]>,
        folder: &Path,
    ) -> Result<Self, GltfFault> {
        let compressed: Vec<Option<Compressed>> = document
            .buffer_views
            .iter()
            .map(|view| view.extensions.get_any(&MESHOPT))
            .collect::<Result<_, _>>()?;
        let mut is_needed = vec![false; document.buffers.len()];
        for (index, (view, compressed)) in document.buffer_views.iter().zip(&compressed).enumerate()
        {
            let buffer = compressed.as_ref().map_or(view.buffer, |c| c.buffer);
            find(&document.buffers, buffer, || {
                format!("bufferViews[{index}].buffer")
            })?;
            is_needed[buffer.0] = true;
        }
        let mut data = Vec::with_capacity(document.buffers.len());
        for (index, is_needed) in is_needed.into_iter().enumerate() {
            data.push(if is_needed {
                Some(load_buffer(document, index, blob, folder)?)
            } else {
                None
            });
        }
        Ok(Self {
            document,
            data,
            decoded: vec![OnceCell::new(); compressed.len()],
            compressed,
        })
    }

    /// A buffer view; `path` says where its index stands.
    pub(super) fn view(
        &self,
        index: Whole,
        path: impl FnOnce() -> String,
    ) -> Result<View<'_>, GltfFault> {
        let view = find(&self.document.buffer_views, index, path)?;
        let Some(compressed) = &self.compressed[index.0] else {
            return Ok(View {
                bytes: self.slice(index, view.buffer, view.byte_offset, view.byte_length)?,
                stride: Some(view.byte_stride.0).filter(|&stride| stride > 0),
            });
        };
        let cell = &self.decoded[index.0];
        let bytes = match cell.get() {
            Some(bytes) => bytes,
            None => {
                let bytes = self.decode(index, view, compressed)?;
                cell.get_or_init(|| bytes)
            }
        };
        Ok(View {
            bytes,
            stride: Some(view.byte_stride.0).filter(|&stride| stride > 0),
        })
    }

    fn decode(
        &self,
        index: Whole,
        view: &BufferView,
        compressed: &Compressed,
    ) -> Result<Vec<u8>, GltfFault> {
        let (offset, length) = (compressed.byte_offset, compressed.byte_length);
        let encoded = self.slice(index, compressed.buffer, offset, length)?;
        let fault = |reason: String| GltfFault::Compressed {
            view: index.0,
            reason,
        };
        let bytes = meshopt::decode(compressed, encoded).map_err(fault)?;
        if bytes.len() < view.byte_length.0 {
            return Err(fault(format!(
                "it holds {} bytes, and {} are announced",
                bytes.len(),
                view.byte_length.0
            )));
        }
        Ok(bytes)
    }

    fn slice(
        &self,
        view: Whole,
        buffer: Whole,
        offset: Whole,
        length: Whole,
    ) -> Result<&[u8], GltfFault> {
        let data = self.data.get(buffer.0).and_then(Option::as_ref);
        let data = data.ok_or(GltfFault::NoBufferData { buffer: buffer.0 })?;
        offset
            .0
            .checked_add(length.0)
            .and_then(|end| data.get(offset.0..end))
            .ok_or(GltfFault::ViewRange { view: view.0 })
    }

    /// How many bytes were loaded: a bound on claims that are accepted without data.
    pub(super) fn total_bytes(&self) -> usize {
        self.data.iter().flatten().map(|data| data.len()).sum()
    }
}

fn load_buffer<'a>(
    document: &Document,
    index: usize,
    blob: Option<&'a [u8]>,
    folder: &Path,
) -> Result<Cow<'a, [u8]>, GltfFault> {
    let buffer = &document.buffers[index];
    let bytes = match &buffer.uri {
        // The binary chunk is the first buffer, and that alone.
        None => blob
            .filter(|_| index == 0)
            .map(Cow::Borrowed)
            .ok_or(GltfFault::NoBufferData { buffer: index })?,
        Some(uri) if uri.starts_with("data:") => {
            Cow::Owned(decode_data_uri(uri).ok_or(GltfFault::DataUri { buffer: index })?)
        }
        Some(uri) => {
            let read = read_resource(uri, folder);
            Cow::Owned(read.map_err(|reason| GltfFault::MissingBuffer {
                buffer: index,
                uri: uri.to_owned(),
                reason,
            })?)
        }
    };
    if bytes.len() < buffer.byte_length.0 {
        return Err(GltfFault::ShortBuffer {
            buffer: index,
            claimed: buffer.byte_length.0 as u64,
            found: bytes.len() as u64,
        });
    }
    Ok(bytes)
}

/// The bytes of a data URI or of a file beside the document.
pub(super) fn read_resource(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        return decode_data_uri(uri).ok_or_else(|| "its data URI is not base64".to_owned());
    }
    let decoded = crate::input::read(&folder.join(decode_percent(uri)));
    // Some exporters write names as they are.
    decoded
        .or_else(|error| crate::input::read(&folder.join(uri)).map_err(|_| error))
        .map_err(|e| e.to_string())
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
