//! The bytes behind a glTF document: buffers, buffer views, accessors and images, wherever another program has put them.

use std::borrow::Cow;

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, STANDARD_NO_PAD};

use super::document::{FLOAT, PlainDocument, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT};
use super::packing::Decoder;
use super::references::Kind;
use super::{AssetError, EncodedImage};

/// Gives the bytes of a file that a document names beside itself; `None` when it cannot be read.
pub type Beside<'a> = &'a dyn Fn(&str) -> Option<Vec<u8>>;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    /// `None` where a buffer cannot be read.
    bytes: Vec<Option<Cow<'a, [u8]>>>,
}

impl<'a> Buffers<'a> {
    /// Takes the binary chunk, what is in the document itself, and files beside it.
    pub(super) fn of(document: &PlainDocument, binary: &'a [u8], beside: Beside<'_>) -> Self {
        let of_uri = |uri: &Option<String>| match uri {
            None => Some(Cow::Borrowed(binary)),
            Some(uri) => resource(uri, beside).map(Cow::Owned),
        };
        let mut bytes: Vec<_> = (document.buffers.iter())
            .map(|buffer| of_uri(&buffer.uri))
            .collect();
        if bytes.is_empty() {
            bytes.push(Some(Cow::Borrowed(binary)));
        }
        Self { bytes }
    }
}

/// The bytes of a data URI or a file beside the document.
fn resource(uri: &str, beside: Beside<'_>) -> Option<Vec<u8>> {
    if !uri.starts_with("data:") {
        return beside(uri);
    }
    let (_, data) = uri.split_once(";base64,")?;
    STANDARD
        .decode(data)
        .or_else(|_| STANDARD_NO_PAD.decode(data))
        .ok()
}

pub(super) fn no_such(what: &'static str, index: usize, count: usize) -> AssetError {
    AssetError::NoSuch {
        what,
        index: index as u64,
        count,
    }
}

fn get<'b, T>(what: &'static str, items: &'b [T], index: usize) -> Result<&'b T, AssetError> {
    items.get(index).ok_or(no_such(what, index, items.len()))
}

/// A document with its buffers.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub(super) document: &'a PlainDocument,
    pub(super) buffers: &'a Buffers<'a>,
}

impl<'a> Data<'a> {
    /// The bytes of a buffer view.
    pub(super) fn view(self, index: usize) -> Result<&'a [u8], AssetError> {
        let view = get("buffer view", &self.document.buffer_views, index)?;
        let buffer = get("buffer", &self.buffers.bytes, view.buffer)?;
        (buffer.as_deref())
            .and_then(|bytes| bytes.get(view.byte_offset..)?.get(..view.byte_length))
            .ok_or(AssetError::Truncated {
                part: "buffer views",
            })
    }

    pub(super) fn view_if_there(
        self,
        index: Option<usize>,
    ) -> Result<Option<&'a [u8]>, AssetError> {
        index.map(|index| self.view(index)).transpose()
    }

    /// The numbers of an accessor, row by row, of `width` numbers of `read` bytes each.
    pub(super) fn rows<T>(
        self,
        index: usize,
        shape: &str,
        component_bytes: usize,
        width: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, AssetError> {
        let accessor = get("accessor", &self.document.accessors, index)?;
        let refuse = |what: &str| AssetError::Document {
            reason: format!("accessor {index} {what}"),
        };
        if accessor.shape != shape {
            return Err(refuse(&format!("is not a {shape}")));
        }
        if accessor.sparse.is_some() {
            return Err(refuse("is sparse"));
        }
        let view = accessor.buffer_view.ok_or(refuse("has no data"))?;
        let bytes = self
            .view(view)?
            .get(accessor.byte_offset..)
            .ok_or(AssetError::Truncated { part: "accessors" })?;
        let row_bytes = component_bytes * width;
        let stride = self.document.buffer_views[view].byte_stride;
        let stride = stride.filter(|&s| s > 0).unwrap_or(row_bytes);
        let is_room = (accessor.count.checked_sub(1))
            .and_then(|last| last.checked_mul(stride)?.checked_add(row_bytes))
            .is_none_or(|end| end <= bytes.len());
        if !is_room || stride < row_bytes {
            return Err(AssetError::Truncated {
                part: "mesh arrays",
            });
        }
        let row = |i: usize| &bytes[i * stride..][..row_bytes];
        Ok((0..accessor.count)
            .flat_map(|i| row(i).chunks_exact(component_bytes))
            .map(read)
            .collect())
    }

    pub(super) fn component_type(self, index: usize) -> Result<u32, AssetError> {
        Ok(get("accessor", &self.document.accessors, index)?.component_type)
    }

    pub(super) fn float_rows<const N: usize>(
        self,
        index: usize,
    ) -> Result<Vec<[f32; N]>, AssetError> {
        if self.component_type(index)? != FLOAT {
            return Err(AssetError::Document {
                reason: format!("accessor {index} does not hold floats"),
            });
        }
        let flat = self.rows(index, &format!("VEC{N}"), 4, N, |bytes| {
            Decoder::new(bytes, "mesh arrays").single().unwrap_or(0.0)
        })?;
        Ok(flat.as_chunks::<N>().0.to_vec())
    }

    pub(super) fn indices(self, index: usize) -> Result<Vec<u32>, AssetError> {
        let width = match self.component_type(index)? {
            UNSIGNED_BYTE => 1,
            UNSIGNED_SHORT => 2,
            UNSIGNED_INT => 4,
            _ => {
                return Err(AssetError::Document {
                    reason: format!("accessor {index} does not hold vertex indices"),
                });
            }
        };
        self.rows(index, "SCALAR", width, 1, |bytes| {
            // Four bytes at most, so the cast loses nothing.
            let read = Decoder::new(bytes, "mesh arrays").low_bytes(width);
            read.unwrap_or(0) as u32
        })
    }

    /// A picture as it is stored.
    pub(super) fn image(self, index: usize) -> Result<EncodedImage, AssetError> {
        let image = get("image", &self.document.images, index)?;
        let bytes = match (image.buffer_view, &image.uri) {
            (Some(view), _) => Some(self.view(view)?.to_vec()),
            (None, Some(uri)) => resource(uri, &|_| None),
            (None, None) => None,
        };
        let bytes = bytes.ok_or(AssetError::Truncated { part: "images" })?;
        Ok(EncodedImage {
            mime_type: mime_type(&image.mime_type, &bytes).to_owned(),
            bytes,
        })
    }

    /// Appends what an index stands for: the same bytes wherever and however it is stored.
    pub(super) fn meaning(
        self,
        kind: Kind,
        index: usize,
        bytes: &mut Vec<u8>,
    ) -> Result<(), AssetError> {
        match kind {
            Kind::View => bytes.extend_from_slice(self.view(index)?),
            Kind::Image => bytes.extend_from_slice(&self.image(index)?.bytes),
            Kind::Accessor => {
                let accessor = get("accessor", &self.document.accessors, index)?;
                match accessor.shape.as_str() {
                    "SCALAR" => {
                        let indices = self.indices(index)?;
                        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
                    }
                    "VEC2" => extend(bytes, self.float_rows::<2>(index)?.as_flattened()),
                    _ => extend(bytes, self.float_rows::<3>(index)?.as_flattened()),
                }
            }
        }
        Ok(())
    }
}

fn extend(bytes: &mut Vec<u8>, numbers: &[f32]) {
    bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
}

/// What a picture says that it is, or if it says nothing, what its first bytes are.
fn mime_type<'b>(said: &'b str, bytes: &[u8]) -> &'b str {
    match (said, bytes) {
        ("", [0x89, b'P', ..]) => "image/png",
        ("", [0xff, 0xd8, ..]) => "image/jpeg",
        ("", [b'R', b'I', b'F', b'F', ..]) => super::document::WEBP,
        _ => said,
    }
}
