//! A mesh that is known to be a closed, oriented 2-manifold.
//!
//! [`ClosedMesh::try_from`] is the only way in, so that later stages need not check again. Several parts and cavities
//! (parts that face inward, within others) are allowed. What it cannot know: whether the surface crosses itself.

use glam::DVec3;

use crate::defects::MeshDefects;
use crate::mesh::{Bounds, TriangleMesh};

/// A [`TriangleMesh`] that is closed, consistently oriented, manifold at every edge and vertex, finite, without
/// duplicate faces or faces with three corners on one line, facing outward (its signed volume is positive), and without unused vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedMesh {
    mesh: TriangleMesh,
    bounds: Bounds,
    origin: DVec3,
}

impl ClosedMesh {
    /// The mesh itself.
    #[must_use]
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Its box and bounding sphere.
    #[must_use]
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Where the origin of the mesh's coordinates lies in those of its file: zero, but for models far from the file's origin.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The same mesh, whose coordinates are now said to be about that point of its file's.
    #[must_use]
    pub fn with_origin(self, origin: DVec3) -> Self {
        Self { origin, ..self }
    }

    /// The mesh at the same place of its file, in coordinates about another point of it. Nothing changes where that point is
    /// its origin already.
    #[must_use]
    pub fn about(mut self, origin: DVec3) -> Self {
        if origin != self.origin {
            let shift = self.origin - origin;
            for position in &mut self.mesh.positions {
                *position += shift;
            }
            self.bounds = self.mesh.bounds();
            self.origin = origin;
        }
        self
    }

    /// Gives the mesh back, to be changed and checked again.
    #[must_use]
    pub fn into_mesh(self) -> TriangleMesh {
        self.mesh
    }
}

impl AsRef<TriangleMesh> for ClosedMesh {
    fn as_ref(&self) -> &TriangleMesh {
        &self.mesh
    }
}

impl TryFrom<TriangleMesh> for ClosedMesh {
    type Error = MeshDefects;

    /// Checks a mesh, and drops the vertices that no face uses.
    ///
    /// # Errors
    /// Every defect by kind, with the first offending element of each.
    fn try_from(mut mesh: TriangleMesh) -> Result<Self, MeshDefects> {
        if let Some(defects) = MeshDefects::of(&mesh) {
            return Err(defects);
        }
        mesh.drop_unused_vertices();
        let bounds = mesh.bounds();
        Ok(Self {
            mesh,
            bounds,
            origin: DVec3::ZERO,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::defects::Defect;

    fn mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> TriangleMesh {
        TriangleMesh {
            positions: positions.iter().map(|&p| DVec3::from(p)).collect(),
            faces: faces.to_vec(),
            ..TriangleMesh::default()
        }
    }

    const CORNERS: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn kinds(m: TriangleMesh) -> Vec<Defect> {
        ClosedMesh::try_from(m).unwrap_err().kinds().to_vec()
    }

    #[test]
    fn a_tetrahedron_is_closed_and_loses_its_unused_vertex() {
        let closed = ClosedMesh::try_from(mesh(&CORNERS, &TETRAHEDRON)).unwrap();
        assert_eq!(closed.mesh().positions.len(), 4);
        assert_eq!(closed.bounds().max, DVec3::ONE);
        assert!((closed.mesh().volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn each_kind_is_named_with_its_first_element() {
        assert_eq!(kinds(mesh(&CORNERS, &[])), [Defect::NoFaces]);
        assert_eq!(
            kinds(mesh(&CORNERS, &[[0, 1, 2], [7, 1, 2]])),
            [Defect::VertexOutOfRange {
                count: 1,
                face: 1,
                vertex: 7
            }]
        );
        let mut nan = mesh(&CORNERS, &TETRAHEDRON);
        nan.positions[2].y = f64::NAN;
        nan.positions[4].y = f64::NAN;
        assert_eq!(
            kinds(nan),
            [Defect::NotFinite {
                count: 1,
                vertex: 2
            }]
        );
        let mut inward = mesh(&CORNERS, &TETRAHEDRON);
        for f in &mut inward.faces {
            f.swap(0, 1);
        }
        assert!(matches!(kinds(inward)[..], [Defect::Inward { volume }] if volume < 0.0));
        assert_eq!(
            kinds(mesh(&CORNERS, &TETRAHEDRON[..3])),
            [Defect::Boundary {
                count: 3,
                loops: 1,
                edge: [0, 2]
            }]
        );
        let mut twisted = TETRAHEDRON;
        twisted[3].swap(0, 1);
        assert_eq!(
            kinds(mesh(&CORNERS, &twisted)),
            [Defect::Inconsistent {
                count: 3,
                edge: [0, 2]
            }]
        );
        let mut repeated = TETRAHEDRON.to_vec();
        repeated.push([1, 2, 1]);
        assert_eq!(
            kinds(mesh(&CORNERS, &repeated)),
            [Defect::RepeatedCorner {
                count: 1,
                face: 4,
                vertex: 1
            }]
        );
    }

    #[test]
    fn a_face_whose_corners_lie_on_a_line_is_named() {
        let mut positions = CORNERS[..4].to_vec();
        positions.push([0.5, 0.5, 0.0]);
        // The edge from 1 to 2 has a vertex on it, and a face without area beside it.
        let faces = [
            [0, 2, 1],
            [0, 1, 3],
            [1, 4, 3],
            [4, 2, 3],
            [0, 3, 2],
            [1, 2, 4],
        ];
        let defects = MeshDefects::of(&mesh(&positions, &faces)).unwrap();
        assert_eq!(defects.kinds(), [Defect::ZeroArea { count: 1, face: 5 }]);
        assert!(defects.is_repairable());
        let text = defects.renumber(&[], &[], 0).to_string();
        assert_eq!(text, "face 6 has no area: its corners lie on one line");
        // The least that can be stored is an area.
        positions[4][2] = f64::MIN_POSITIVE;
        assert!(ClosedMesh::try_from(mesh(&positions, &faces)).is_ok());
    }

    #[test]
    fn joined_tetrahedra_share_too_much() {
        let below = [[0_u32, 1, 2], [0, 4, 1], [1, 4, 2], [0, 2, 4]];
        let both: Vec<[u32; 3]> = TETRAHEDRON.iter().chain(&below).copied().collect();
        assert_eq!(
            kinds(mesh(&CORNERS, &both)),
            [
                Defect::CrowdedEdge {
                    count: 3,
                    edge: [0, 1],
                    faces: 4
                },
                Defect::DuplicateFace {
                    count: 1,
                    face: 4,
                    earlier: 0
                },
            ]
        );
    }

    #[test]
    fn sheets_that_meet_in_a_vertex_are_named() {
        let mut positions = CORNERS[..4].to_vec();
        positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        let mut faces = TETRAHEDRON.to_vec();
        faces.extend([[0, 4, 5], [0, 6, 4], [4, 6, 5], [0, 5, 6]]);
        let found = kinds(mesh(&positions, &faces));
        assert_eq!(
            found,
            [Defect::SplitVertex {
                count: 1,
                vertex: 0,
                fans: 2
            }]
        );
    }

    #[test]
    fn flat_and_pillow_meshes_have_no_volume() {
        let flat = kinds(mesh(&CORNERS, &[[0, 1, 2]]));
        assert_eq!(
            flat,
            [
                Defect::Boundary {
                    count: 3,
                    loops: 1,
                    edge: [0, 1]
                },
                Defect::NoVolume
            ]
        );
        let pillow = kinds(mesh(&CORNERS, &[[0, 1, 2], [0, 2, 1]]));
        assert_eq!(
            pillow,
            [
                Defect::DuplicateFace {
                    count: 1,
                    face: 1,
                    earlier: 0
                },
                Defect::NoVolume
            ]
        );
    }

    #[test]
    fn the_sentence_names_elements_by_the_files_numbers() {
        let defects = MeshDefects::of(&mesh(&CORNERS, &TETRAHEDRON[..3])).unwrap();
        let text = defects.renumber(&[10, 11, 12, 13], &[], 1).to_string();
        assert_eq!(
            text,
            "open: 3 boundary edges in 1 loop, the first is (11, 13)"
        );
    }
}
