//! Where the asset stands: it and everything in it count from a point of their own, which may lie far from the origin.
//!
//! Single precision, which glTF and devices have, has few digits left far from the origin. Positions in an asset are therefore
//! relative to a point near the model, and the document's node moves the hull there, by numbers of double precision. The hull's
//! own arrays and the extension's are then those of the same model at the origin.

use glam::DVec3;
use serde::Deserialize;

/// Where the origin of an asset's coordinates lies. Both are zero unless the model is far from its file's origin, or the asset was
/// moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// In the coordinates of the model's file.
    pub in_model: DVec3,
    /// In the scene: the translation of the document's node. Another program may have moved it.
    pub in_scene: DVec3,
}

impl Placement {
    /// Of an asset that stands where its model did.
    #[must_use]
    pub fn at(origin: DVec3) -> Self {
        Self {
            in_model: origin,
            in_scene: origin,
        }
    }
}

/// A node, as far as it is read.
#[derive(Debug, Default, Deserialize)]
pub(super) struct PlainNode {
    mesh: Option<usize>,
    #[serde(default)]
    children: Vec<usize>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    matrix: Option<[f64; 16]>,
}

impl PlainNode {
    /// What the node does to what is below it, if it only moves it.
    fn shift(&self) -> Option<DVec3> {
        let is_upright = self
            .rotation
            .is_none_or(|[x, y, z, _]| [x, y, z] == [0.0; 3]);
        if !is_upright || self.scale.is_some_and(|scale| scale != [1.0; 3]) {
            return None;
        }
        let moved = self.translation.map_or(DVec3::ZERO, DVec3::from);
        let Some(matrix) = self.matrix else {
            return Some(moved);
        };
        let mut shift = glam::DMat4::IDENTITY;
        shift.w_axis = glam::DVec4::new(matrix[12], matrix[13], matrix[14], 1.0);
        (matrix == shift.to_cols_array()).then(|| shift.w_axis.truncate())
    }
}

/// Where the nodes put the origin of the first mesh; `None` when they do more than moving it, or no node shows it.
pub(super) fn in_scene(nodes: &[PlainNode]) -> Option<DVec3> {
    let mut at = nodes.iter().position(|node| node.mesh == Some(0))?;
    let mut parents = vec![None; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            *parents.get_mut(child)? = Some(parent);
        }
    }
    let mut place = nodes[at].shift()?;
    // A chain of parents is no longer than there are nodes, unless it runs in a ring.
    for _ in 0..nodes.len() {
        match parents[at] {
            Some(parent) => at = parent,
            None => return place.is_finite().then_some(place),
        }
        place += nodes[at].shift()?;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(nodes: &str) -> Option<DVec3> {
        let text = format!("{{\"nodes\": {nodes}}}");
        in_scene(
            &serde_json::from_str::<super::super::document::PlainDocument>(&text)
                .unwrap()
                .nodes,
        )
    }

    #[test]
    fn nodes_that_move_are_followed() {
        assert_eq!(place(r#"[{"mesh": 0}]"#), Some(DVec3::ZERO));
        assert_eq!(
            place(
                r#"[{"children": [2], "translation": [1, 2, 3]}, {"mesh": 1}, {"mesh": 0, "translation": [5400000.5, 0, -1]}]"#
            ),
            Some(DVec3::new(5_400_001.5, 2.0, 2.0))
        );
        let matrix = r#"[{"mesh": 0, "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]},
            {"children": [0], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]}]"#;
        assert_eq!(place(matrix), Some(DVec3::new(7.0, 8.0, 9.0)));
    }

    #[test]
    fn nodes_that_do_more_are_not() {
        for nodes in [
            "[]",
            r#"[{"mesh": 1}]"#,
            r#"[{"mesh": 0, "scale": [2, 2, 2]}]"#,
            r#"[{"mesh": 0, "rotation": [1, 0, 0, 0]}]"#,
            r#"[{"mesh": 0, "matrix": [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]}]"#,
            r#"[{"mesh": 0, "children": [9]}]"#,
            r#"[{"mesh": 0, "children": [1]}, {"children": [0]}]"#,
            r#"[{"mesh": 0, "translation": [1e308, 0, 0]}, {"children": [0], "translation": [1e308, 0, 0]}]"#,
        ] {
            assert_eq!(place(nodes), None, "{nodes}");
        }
    }
}
