//! The parts of a model whose silhouettes are interpolated by themselves.
//!
//! Source: beyond the paper. Where a near part of a model begins to hide a far one, the outline jumps from one rim to another, and no view beside
//! has the rim behind: interpolated as a whole, such outlines tear. So the model is cut into a few parts that are nearly convex, which do
//! not hide themselves, and each has outlines of its own from every view. Whatever any part covers is inside, and the gap between two parts
//! opens and closes where it does in space. Parts reach a little into each other, so that errors of the two do not part them.
//!
//! Cutting solids by planes until each piece is nearly convex is what convex decompositions do: X. Wei et al., Approximate Convex Decomposition
//! for 3D Meshes with Collision-Aware Concavity and Tree Search, SIGGRAPH 2022. Deviation: pieces are those of the solid, not their hulls; the
//! search is greedy, and concavity is measured at the surface along its normals.

mod clip;
mod concavity;
mod cut;
pub(crate) mod hidden;

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{ClosedMesh, TriangleMesh};

pub use cut::PartParams;

use crate::capture::MeshEdges;

/// A part of a model: a solid.
#[derive(Debug)]
pub struct Part {
    /// Its surface: of the model, or where it is cut.
    pub mesh: TriangleMesh,
    /// Over its faces.
    pub tree: Bvh,
    /// Its edges.
    pub edges: MeshEdges,
}

/// The half-space of points x with normal·x ≤ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HalfSpace {
    normal: DVec3,
    offset: f64,
}

impl HalfSpace {
    /// How far beyond it a point is.
    fn beyond(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }

    /// The other one.
    fn opposite(&self) -> Self {
        Self {
            normal: -self.normal,
            offset: -self.offset,
        }
    }

    fn widened(&self, by: f64) -> Self {
        Self {
            offset: self.offset + by,
            ..*self
        }
    }
}

/// Cuts a model into parts that are nearly convex and together are the model; one that is nearly convex itself is one part.
///
/// # Errors
/// When interrupted.
pub fn parts(
    model: &ClosedMesh,
    params: &PartParams,
    watch: &Watch<'_>,
) -> Result<Vec<Part>, Interrupted> {
    let pieces = cut::pieces(model, params, watch)?;
    let parts = pieces
        .into_par_iter()
        .filter(|mesh| !mesh.faces.is_empty())
        .map(|mesh| Part {
            tree: Bvh::new(&mesh),
            edges: MeshEdges::new(&mesh),
            mesh,
        });
    Ok(parts.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{cpu, view_sphere};
    use proptest::prelude::*;
    use silmap_geometry::{CoverageRule, Mask};
    use silmap_models as models;

    fn closed(mesh: TriangleMesh) -> ClosedMesh {
        ClosedMesh::try_from(mesh).unwrap()
    }

    fn parts_of(model: &ClosedMesh, params: &PartParams) -> Vec<Part> {
        parts(model, params, &Watch::silent()).unwrap()
    }

    #[test]
    fn what_is_convex_is_one_part() {
        let params = PartParams::default();
        for (mesh, is_convex) in [
            (models::bicone(60), true),
            (models::flat_drum(60), true),
            (models::torus(2000), false),
        ] {
            let found = parts_of(&closed(mesh), &params).len();
            assert_eq!(found == 1, is_convex, "{found} parts");
        }
    }

    #[test]
    fn one_part_is_the_model_itself() {
        let model = closed(models::trefoil_knot(3000));
        let params = PartParams {
            most: 1,
            ..PartParams::default()
        };
        let found = parts_of(&model, &params);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].mesh.faces, model.mesh().faces);
    }

    /// All parts together cover what the model does, from any eye, by either rule; without one of them something is missing.
    #[test]
    fn parts_together_cover_what_the_model_does() {
        for mesh in [models::trefoil_knot(4000), models::three_holed_torus(4000)] {
            let model = closed(mesh);
            let found = parts_of(&model, &PartParams::default());
            assert!(found.len() > 3, "{} parts", found.len());
            let bounds = model.bounds();
            let cameras = view_sphere(bounds, 3.0 * bounds.radius, 20, 128).unwrap();
            let mut is_missed = false;
            for camera in &cameras {
                let cover = |mesh: &TriangleMesh, rule| {
                    let mut mask = Mask::new(128, 128);
                    cpu::rasterise(mesh, camera, rule, &mut mask).unwrap();
                    mask
                };
                for rule in [CoverageRule::Center, CoverageRule::Any] {
                    let whole = cover(model.mesh(), rule);
                    let mut left: i64 = whole.count() as i64;
                    let mut all = Mask::new(128, 128);
                    for part in &found {
                        let mask = cover(&part.mesh, rule);
                        // Not all of a part's pixels are the model's where it is cut: there the cut is within the model.
                        assert_eq!(mask.count_missing_in(&whole), 0);
                        for (a, b) in all.words_mut().iter_mut().zip(mask.words()) {
                            *a |= b;
                        }
                    }
                    left -= all.count() as i64;
                    assert_eq!(left, 0, "{rule:?}");
                    let mut but_one = Mask::new(128, 128);
                    for part in &found[1..] {
                        let mask = cover(&part.mesh, rule);
                        for (a, b) in but_one.words_mut().iter_mut().zip(mask.words()) {
                            *a |= b;
                        }
                    }
                    is_missed |= but_one.count() < whole.count();
                }
            }
            assert!(is_missed, "the control misses nothing");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// Both halves of a solid are closed, and together as large as it.
        #[test]
        fn halves_are_solids(x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, offset in -0.8..0.8_f64) {
            let mesh = models::trefoil_knot(2000);
            let normal = DVec3::new(x, y, z);
            prop_assume!(normal.length() > 0.2);
            let normal = normal.normalize_or_zero();
            let bounds = mesh.bounds();
            let at = HalfSpace { normal, offset: normal.dot(bounds.center) + offset * bounds.radius };
            let halves = [at, at.opposite()].map(|half| clip::clip(&mesh, &half).unwrap());
            let volume: f64 = halves.iter().map(TriangleMesh::volume).sum();
            prop_assert!((volume / mesh.volume() - 1.0).abs() < 1e-6, "{} for {}", volume, mesh.volume());
            for half in &halves {
                let mut sides: Vec<(u32, u32)> = half.faces.iter()
                    .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
                let mut turned: Vec<(u32, u32)> = sides.iter().map(|&(a, b)| (b, a)).collect();
                sides.sort_unstable();
                turned.sort_unstable();
                prop_assert_eq!(sides, turned);
            }
        }
    }
}
