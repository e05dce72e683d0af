//! A forest whose nodes are bounded by anchored cones.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5.

mod build;
mod cone;

use glam::Vec3;

use self::build::{Forest, build_forest};
use self::cone::ConePair;
use crate::cluster_forest::{ClusterForest, FacingBound};
use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;

/// Both cones of a node, in the paper's form: neither a root nor an angle is needed to test them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnchoredCones {
    /// The axis over the cosine of the cones' angle.
    scaled_axis: Vec3,
    front_apex: Vec3,
    back_apex: Vec3,
    /// How far the front apex is above the back apex, along the scaled axis.
    separation: f32,
}

/// The forest of a mesh.
pub(crate) fn cone_forest(mesh: &EdgeMesh) -> ClusterForest<AnchoredCones> {
    let forest = build_forest(mesh);
    let mut flat = ClusterForest::new(forest.unbounded.clone());
    for &root in &forest.roots {
        push_tree(&mut flat, mesh, &forest, root);
    }
    flat
}

fn push_tree(flat: &mut ClusterForest<AnchoredCones>, mesh: &EdgeMesh, forest: &Forest, root: u32) {
    /// What is still to be done: a node to be added, or the end of one that was.
    enum Step {
        Add(u32),
        Close(usize),
    }
    let mut steps = vec![Step::Add(root)];
    while let Some(step) = steps.pop() {
        match step {
            Step::Close(place) => flat.close_node(place),
            Step::Add(id) => {
                let node = &forest.nodes[id as usize];
                let bound = AnchoredCones::new(node.cones.as_ref());
                steps.push(Step::Close(flat.push_node(mesh, bound, &node.edges)));
                steps.extend(node.children.iter().rev().map(|&child| Step::Add(child)));
            }
        }
    }
}

impl AnchoredCones {
    fn new(cones: Option<&ConePair>) -> Self {
        match cones {
            // A cone of no points: the axis has no length, so no viewpoint is ahead of it.
            None => Self {
                scaled_axis: Vec3::ZERO,
                front_apex: Vec3::ZERO,
                back_apex: Vec3::ZERO,
                separation: 0.0,
            },
            Some(c) => {
                let scaled_axis = c.axis / c.cos_angle;
                Self {
                    scaled_axis: scaled_axis.as_vec3(),
                    front_apex: c.front_apex.as_vec3(),
                    back_apex: c.back_apex.as_vec3(),
                    separation: (c.front_apex - c.back_apex).dot(scaled_axis) as f32,
                }
            }
        }
    }
}

impl FacingBound for AnchoredCones {
    /// Whether the viewpoint lies in one of the cones.
    #[inline(always)]
    fn is_culled(&self, query: &Query) -> bool {
        let from_front = query.point - self.front_apex * query.weight;
        let ahead = from_front.dot(self.scaled_axis);
        let from_back = query.point - self.back_apex * query.weight;
        let behind = -(ahead + self.separation * query.weight);
        // Without branches between: which of the four decides is as good as random.
        ((ahead > 0.0) & (ahead * ahead >= from_front.length_squared()))
            | ((behind > 0.0) & (behind * behind >= from_back.length_squared()))
    }
}
