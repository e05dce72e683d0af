//! Extraction by a forest whose nodes are bounded by anchored cones.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5.

mod build;
mod cone;
mod file;
mod forest;

use glam::{DVec3, Vec4};

pub use self::file::ForestError;
pub use self::forest::ConeForest;

use self::cone::ConePair;
use crate::cluster_forest::{AT_ONCE, ClusterForest, Clusters, FacingBound, direction_key};
use crate::edge_mesh::EdgeMesh;
use crate::plane_block::transposed;
use crate::viewpoint::Query;

/// Both cones of a node, in the paper's form: neither a root nor an angle is needed to test them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnchoredCones {
    /// The axis over the cosine of the cones' angle, and how far the front apex is along that, negated.
    front_axis: Vec4,
    /// Its last coordinate is not used.
    front_apex: Vec4,
    /// The back apex, and how far it is along the scaled axis.
    back_apex: Vec4,
}

/// The forest laid out for searching.
pub(crate) fn search_forest(mesh: &EdgeMesh, forest: &ConeForest) -> ClusterForest<AnchoredCones> {
    let clusters = Clusters {
        nodes: (forest.nodes.iter())
            .map(|node| {
                let bound = AnchoredCones::new(node.cones.as_ref());
                (bound, node.child_count, node.edges_end)
            })
            .collect(),
        directions: (forest.nodes.iter())
            .map(|node| direction_key(node.cones.map_or(DVec3::Z, |c| c.axis)))
            .collect(),
        edges: forest.edges.clone(),
        unbounded: forest.unbounded.clone(),
    };
    ClusterForest::new(mesh, &clusters)
}

impl AnchoredCones {
    fn new(cones: Option<&ConePair>) -> Self {
        let Some(c) = cones else {
            // Cones of no points: the axis has no length, so no viewpoint is ahead of it.
            return Self {
                front_axis: Vec4::ZERO,
                front_apex: Vec4::ZERO,
                back_apex: Vec4::ZERO,
            };
        };
        let axis = c.axis / c.cos_angle;
        let with = |v: DVec3, w: f64| v.extend(w).as_vec4();
        Self {
            front_axis: with(axis, -axis.dot(c.front_apex)),
            front_apex: with(c.front_apex, 0.0),
            back_apex: with(c.back_apex, axis.dot(c.back_apex)),
        }
    }
}

impl FacingBound for AnchoredCones {
    /// Of four nodes at a time whether the viewpoint lies in one of the cones.
    #[inline(always)]
    fn culled(bounds: [&Self; AT_ONCE], query: &Query) -> u8 {
        let [px, py, pz] = query.point.to_array();
        let weight = query.weight;
        let [x, y, z, front] = transposed(bounds.map(|b| b.front_axis));
        let along = x * px + y * py + z * pz;
        let distance_squared = |x: Vec4, y: Vec4, z: Vec4| {
            let [x, y, z] = [x * weight - px, y * weight - py, z * weight - pz];
            x * x + y * y + z * z
        };
        let ahead = along + front * weight;
        let [x, y, z, _] = transposed(bounds.map(|b| b.front_apex));
        let in_front = (ahead * ahead.abs()).cmpgt(distance_squared(x, y, z));
        let [x, y, z, back] = transposed(bounds.map(|b| b.back_apex));
        let behind = back * weight - along;
        let in_back = (behind * behind.abs()).cmpgt(distance_squared(x, y, z));
        (in_front | in_back).bitmask() as u8
    }
}
