//! Where the nodes of a glTF file put its meshes.

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use super::same_hull::Triangles;

/// Deepest tree of nodes that is followed.
const MOST_PARENTS: usize = 1000;

/// Per node with a mesh: the mesh and where it is put.
pub(super) fn node_places(root: &Value) -> Vec<(usize, DMat4)> {
    let empty = Vec::new();
    let nodes = root
        .get("nodes")
        .and_then(Value::as_array)
        .unwrap_or(&empty);
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (n, node) in nodes.iter().enumerate() {
        let children = node.get("children").and_then(Value::as_array);
        for child in children.into_iter().flatten().filter_map(Value::as_u64) {
            if let Some(parent) = parents.get_mut(child as usize) {
                *parent = Some(n);
            }
        }
    }
    let mut places = Vec::new();
    for (n, node) in nodes.iter().enumerate() {
        let Some(mesh) = node.get("mesh").and_then(Value::as_u64) else {
            continue;
        };
        let mut place = node_matrix(node);
        let mut at = parents[n];
        for _ in 0..MOST_PARENTS {
            let Some(parent) = at else { break };
            place = node_matrix(&nodes[parent]) * place;
            at = parents[parent];
        }
        places.push((mesh as usize, place));
    }
    places
}

fn node_matrix(node: &Value) -> DMat4 {
    fn numbers<const N: usize>(node: &Value, key: &str) -> Option<[f64; N]> {
        let list = node.get(key)?.as_array()?;
        let list: Option<Vec<f64>> = list.iter().map(Value::as_f64).collect();
        list?.try_into().ok()
    }
    if let Some(matrix) = numbers::<16>(node, "matrix") {
        return DMat4::from_cols_array(&matrix);
    }
    let rotation = numbers::<4>(node, "rotation").map(DQuat::from_array);
    DMat4::from_scale_rotation_translation(
        numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array),
        rotation.map_or(DQuat::IDENTITY, DQuat::normalize),
        numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array),
    )
}

/// Triangles put somewhere; a mirror turns them over.
pub(super) fn moved(mesh: &Triangles, place: &DMat4) -> Triangles {
    let is_mirror = place.determinant() < 0.0;
    let face = |&[a, b, c]: &[u32; 3]| if is_mirror { [a, c, b] } else { [a, b, c] };
    Triangles {
        name: mesh.name.clone(),
        positions: (mesh.positions.iter())
            .map(|&p| place.transform_point3(p))
            .collect(),
        faces: mesh.faces.iter().map(face).collect(),
    }
}
