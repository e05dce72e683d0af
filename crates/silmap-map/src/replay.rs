//! Applying a stored collapse order: fewer views without the model.

use thiserror::Error;

use crate::asset::CollapseStep;
use crate::silhouette_map::SilhouetteMap;
use crate::simplified_polytope::{Collapse, Rule, SimplifiedPolytope};

/// Why a step of a collapse order cannot be carried out.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReplayError {
    /// A collapse is along no edge, or would leave no star-shaped polytope.
    #[error(
        "step {step} of the collapse order does not fit: view {removed} cannot collapse onto view {onto}"
    )]
    Collapse {
        /// Index of the step.
        step: usize,
        /// The view that should go.
        removed: u32,
        /// The neighbour it should go to.
        onto: u32,
    },
    /// An edge is not there, or turning it would leave no star-shaped polytope.
    #[error(
        "step {step} of the collapse order does not fit: the edge between views {from} and {to} cannot be turned"
    )]
    Edge {
        /// Index of the step.
        step: usize,
        /// One end of the edge.
        from: u32,
        /// The other end.
        to: u32,
    },
}

/// Carries `steps` out on `map`: the map that is left, and per view of it the number it had.
///
/// # Errors
/// Names the first step that does not fit the map.
pub fn replay(
    map: &SilhouetteMap,
    steps: &[CollapseStep],
) -> Result<(SilhouetteMap, Vec<u32>), ReplayError> {
    let mut polytope = SimplifiedPolytope::new(map, Rule::Sides);
    let is_there = |view: u32| (view as usize) < map.views.len();
    for (step, s) in steps.iter().enumerate() {
        let collapse = Collapse {
            removed: s.removed,
            onto: s.onto,
        };
        let is_possible = is_there(s.removed)
            && is_there(s.onto)
            && polytope.is_edge(collapse)
            && polytope.triangles_after(collapse).is_some();
        if !is_possible {
            return Err(ReplayError::Collapse {
                step,
                removed: s.removed,
                onto: s.onto,
            });
        }
        polytope.apply(collapse, []);
        for &[from, to] in &s.turned {
            let patch = (is_there(from) && is_there(to))
                .then(|| polytope.flip([from, to]))
                .flatten()
                .ok_or(ReplayError::Edge { step, from, to })?;
            polytope.apply_patch(&patch, []);
        }
    }
    let (kept, triangles) = polytope.compact();
    Ok((map.of_views(&kept, triangles), kept))
}
