//! Where nodes of a glTF put what they show, in all digits of the JSON text: the `gltf` crate rounds them to single precision,
//! which has steps of half a unit 5·10⁶ units away.

use glam::{DMat4, DVec3};
use serde::Deserialize;

#[derive(Default, Deserialize)]
struct Places {
    #[serde(default)]
    nodes: Vec<Place>,
}

/// What a node says about its place.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub(super) struct Place {
    translation: Option<[f64; 3]>,
    matrix: Option<[f64; 16]>,
}

/// The places of all nodes; none where the text is not understood, which the other reader of it has said then.
pub(super) fn places(json: &[u8]) -> Vec<Place> {
    serde_json::from_slice::<Places>(json)
        .unwrap_or_default()
        .nodes
}

impl Place {
    /// The transform of the node with its own numbers in place of those rounded to single precision.
    pub(super) fn refine(&self, rounded: DMat4) -> DMat4 {
        let mut exact = match self.matrix {
            Some(matrix) => DMat4::from_cols_array(&matrix),
            None => rounded,
        };
        if let Some(translation) = self.translation {
            exact.w_axis = DVec3::from(translation).extend(1.0);
        }
        exact
    }
}
