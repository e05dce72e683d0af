//! Primitives under KHR_draco_mesh_compression, decoded by `draco-core`.

use std::collections::BTreeMap;

use draco_core::decode_limits::DecodeLimits;
use draco_core::{DecoderBuffer, Mesh, MeshDecoder};
use serde::Deserialize;

use super::super::guard::guarded;
use super::super::text::in_one_line;
use super::accessor::Component;
use super::document::Whole;

/// The extension's object in a primitive.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub(super) buffer_view: Whole,
    /// What stands under which of the compressed mesh's numbers.
    attributes: BTreeMap<String, Whole>,
}

/// As many faces as are read elsewhere.
const MOST_FACES: u64 = 100_000_000;
const MOST_BYTES: u64 = 4 << 30;

/// A decoded primitive.
pub(super) struct Decoded {
    mesh: Mesh,
    numbers: BTreeMap<String, Whole>,
}

/// Decodes a primitive; else says what is wrong, as the end of a sentence.
pub(super) fn decode(compressed: &Compressed, encoded: &[u8]) -> Result<Decoded, String> {
    let limits = DecodeLimits::default()
        .with_max_faces(MOST_FACES)
        .with_max_decoded_bytes(MOST_BYTES);
    let decoded = guarded(|| {
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(encoded).with_limits(limits);
        let status = MeshDecoder::new().decode(&mut buffer, &mut mesh);
        status.map(|()| mesh).map_err(in_one_line)
    });
    Ok(Decoded {
        mesh: decoded.unwrap_or_else(|| Err("the decoder gave up".to_owned()))?,
        numbers: compressed.attributes.clone(),
    })
}

impl Decoded {
    /// The corners of all triangles, one after the other.
    pub(super) fn indices(&self) -> Vec<u32> {
        let corners = self.mesh.faces().iter().flatten();
        corners.map(|point| point.0).collect()
    }

    /// An attribute by its glTF name: components an element, and all of them. Integers are divided by the largest of
    /// `fraction_of`.
    pub(super) fn attribute(
        &self,
        name: &str,
        fraction_of: Option<Component>,
    ) -> Option<(usize, Vec<f64>)> {
        let number = u32::try_from(self.numbers.get(name)?.0).ok()?;
        let attribute = self.mesh.attribute_by_unique_id(number)?;
        let width = usize::from(attribute.num_components());
        let values = guarded(|| attribute.read_f32s(self.mesh.num_points(), width))?;
        let largest = fraction_of.map_or(1.0, Component::largest);
        let values = values.into_iter().map(|x| f64::from(x) / largest);
        Some((width, values.collect()))
    }
}
