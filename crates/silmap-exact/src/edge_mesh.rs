//! The input of every extraction method: the edges of a manifold mesh with their two faces, and the faces' planes.
//!
//! A face shows its front when the value of its plane is positive. Single precision decides that for all but one face in
//! a hundred thousand; where the value is within its error bound the exact predicate decides, so that all methods give
//! the same answer for any viewpoint. Faces whose plane is not known well enough, slivers above all, have a plane of
//! zeros: they are always decided exactly.

use glam::DVec3;
use silmap_geometry::{ClosedMesh, TriangleMesh};
use thiserror::Error;

use crate::DirectedEdge;
use crate::viewpoint::{Frame, Query, Viewpoint};

/// Why a mesh has no silhouettes by edges with two faces each.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum EdgeMeshError {
    /// An edge is not used once in each direction. Close and repair the mesh, or use
    /// [`BoundaryEdges`](crate::BoundaryEdges).
    #[error(
        "edge {from}-{to} has {forward} faces on one side and {backward} on the other; one and one are needed"
    )]
    NotManifold {
        /// One end of the first such edge.
        from: u32,
        /// Its other end.
        to: u32,
        /// Faces with the edge in this direction.
        forward: usize,
        /// Faces with the edge in the other direction.
        backward: usize,
    },
}

/// A normal counts as known when its error, of unit length, is below this: a sixtieth of what single precision rounds away.
const NORMAL_ERROR: f64 = 1e-9;

/// A mesh prepared for extraction. An edge's left face runs through it in the edge's own direction.
#[derive(Clone, Debug)]
pub struct EdgeMesh {
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// In the order in which faces use them first.
    edges: Vec<DirectedEdge>,
    /// The faces on the left and on the right of each edge.
    edge_faces: Vec<[u32; 2]>,
    /// The edges of each face, in the order of its corners.
    face_edges: Vec<[u32; 3]>,
    /// Unit normal and offset in the unit ball of `frame`: positive in front; zeros when not known well enough.
    planes: Vec<[f32; 4]>,
    frame: Frame,
}

impl EdgeMesh {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// When some edge does not have exactly one face on each side. A [`ClosedMesh`] never fails.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, EdgeMeshError> {
        let bounds = mesh.bounds();
        let frame = Frame {
            center: bounds.center,
            radius: bounds.radius,
        };
        let (edges, edge_faces, face_edges) = pair_sides(&mesh.faces)?;
        Ok(Self {
            positions: mesh.positions.clone(),
            faces: mesh.faces.clone(),
            edges,
            edge_faces,
            face_edges,
            planes: (0..mesh.faces.len())
                .map(|f| unit_plane(mesh.corners(f), &frame))
                .map(|plane| plane.map_or([0.0; 4], |p| p.map(|x| x as f32)))
                .collect(),
            frame,
        })
    }

    /// The edges, each once, in one of its directions.
    #[must_use]
    pub fn edges(&self) -> &[DirectedEdge] {
        &self.edges
    }

    /// The faces on the left and on the right of each edge.
    #[must_use]
    pub fn edge_faces(&self) -> &[[u32; 2]] {
        &self.edge_faces
    }

    /// The edges of each face, in the order of its corners.
    #[must_use]
    pub fn face_edges(&self) -> &[[u32; 3]] {
        &self.face_edges
    }

    /// The faces as vertex ids.
    #[must_use]
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The vertices.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    pub(crate) fn planes(&self) -> &[[f32; 4]] {
        &self.planes
    }

    pub(crate) fn query(&self, viewpoint: &Viewpoint) -> Query {
        Query::new(viewpoint, &self.frame)
    }

    /// An eye's distance from the middle of the mesh.
    pub(crate) fn distance_from_center(&self, eye: DVec3) -> f64 {
        eye.distance(self.frame.center)
    }

    /// The same in the unit ball.
    pub(crate) fn distance_in_ball(&self, eye: DVec3) -> f64 {
        self.distance_from_center(eye) / self.frame.radius
    }

    fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|v| self.positions[v as usize])
    }

    /// The plane of a face in the unit ball, in double precision; `None` when the normal is not known well enough.
    pub(crate) fn exact_plane(&self, face: usize) -> Option<[f64; 4]> {
        unit_plane(self.corners(face), &self.frame)
    }

    /// A vertex in the unit ball.
    pub(crate) fn ball_position(&self, vertex: u32) -> DVec3 {
        (self.positions[vertex as usize] - self.frame.center) / self.frame.radius
    }

    /// Whether the face shows its front, exactly.
    #[inline(always)]
    pub(crate) fn is_front(&self, face: u32, viewpoint: &Viewpoint, query: &Query) -> bool {
        let value = query.value(&self.planes[face as usize]);
        if value.abs() > query.value_error {
            value > 0.0
        } else {
            self.is_front_exactly(face, viewpoint)
        }
    }

    #[cold]
    #[inline(never)]
    pub(crate) fn is_front_exactly(&self, face: u32, viewpoint: &Viewpoint) -> bool {
        viewpoint.sees_front_of(self.corners(face as usize))
    }

    /// The edge with its front face on the left, given which of its faces show their front.
    #[inline(always)]
    pub(crate) fn directed(&self, edge: u32, left_is_front: bool) -> DirectedEdge {
        let e = self.edges[edge as usize];
        if left_is_front { e } else { e.reversed() }
    }

    /// A checksum of the vertices and faces.
    pub(crate) fn crc32(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for p in &self.positions {
            for c in p.to_array() {
                hasher.update(&c.to_le_bytes());
            }
        }
        for v in self.faces.as_flattened() {
            hasher.update(&v.to_le_bytes());
        }
        hasher.finalize()
    }

    /// Bytes of edges and planes, which brute force needs.
    pub(crate) fn brute_bytes(&self) -> usize {
        size_of_val(&*self.planes) + size_of_val(&*self.edges) + size_of_val(&*self.edge_faces)
    }
}

impl From<&ClosedMesh> for EdgeMesh {
    fn from(mesh: &ClosedMesh) -> Self {
        Self::new(mesh.mesh()).expect("a closed mesh has one face on each side of every edge")
    }
}

/// The plane of a face in the unit ball of `frame`, unit normal and offset, positive in front.
fn unit_plane([a, b, c]: [DVec3; 3], frame: &Frame) -> Option<[f64; 4]> {
    let (u, v) = (b - a, c - a);
    let cross = u.cross(v);
    let length = cross.length();
    // Of the cross product: each difference, product and sum is rounded once.
    let error = 8.0 * f64::EPSILON * u.length() * v.length();
    // Also false for what is not a number.
    let is_known = error < NORMAL_ERROR * length;
    if !is_known {
        return None;
    }
    let normal = cross / length;
    let offset = -normal.dot((a - frame.center) / frame.radius);
    offset
        .is_finite()
        .then_some([normal.x, normal.y, normal.z, offset])
}

/// One side of an edge: a face and which of its edges it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct FaceEdge {
    low: u32,
    high: u32,
    is_downward: bool,
    face: u32,
    corner: u8,
}

/// Edges, their faces, and the edges of each face.
type PairedSides = (Vec<DirectedEdge>, Vec<[u32; 2]>, Vec<[u32; 3]>);

fn pair_sides(faces: &[[u32; 3]]) -> Result<PairedSides, EdgeMeshError> {
    let mut sides: Vec<FaceEdge> = Vec::with_capacity(3 * faces.len());
    for (face, corners) in faces.iter().enumerate() {
        for k in 0..3_u8 {
            let (from, to) = (corners[k as usize], corners[(k as usize + 1) % 3]);
            sides.push(FaceEdge {
                low: from.min(to),
                high: from.max(to),
                is_downward: to < from,
                face: face as u32,
                corner: k,
            });
        }
    }
    sides.sort_unstable();
    // The other face of each face's edges.
    let mut across = vec![[u32::MAX; 3]; faces.len()];
    for edge in sides.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
        match *edge {
            [up, down] if !up.is_downward && down.is_downward => {
                across[up.face as usize][up.corner as usize] = down.face;
                across[down.face as usize][down.corner as usize] = up.face;
            }
            _ => {
                let backward = edge.iter().filter(|s| s.is_downward).count();
                return Err(EdgeMeshError::NotManifold {
                    from: edge[0].low,
                    to: edge[0].high,
                    forward: edge.len() - backward,
                    backward,
                });
            }
        }
    }
    let mut edges = Vec::with_capacity(sides.len() / 2);
    let mut edge_faces = Vec::with_capacity(sides.len() / 2);
    let mut face_edges = vec![[u32::MAX; 3]; faces.len()];
    for (face, corners) in faces.iter().enumerate() {
        for k in 0..3 {
            if face_edges[face][k] != u32::MAX {
                continue;
            }
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let other = across[face][k] as usize;
            let twin = (0..3)
                .find(|&j| faces[other][j] == to && faces[other][(j + 1) % 3] == from)
                .expect("the faces were paired by this edge");
            face_edges[face][k] = edges.len() as u32;
            face_edges[other][twin] = edges.len() as u32;
            edges.push(DirectedEdge { from, to });
            edge_faces.push([face as u32, other as u32]);
        }
    }
    Ok((edges, edge_faces, face_edges))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, torus};

    #[test]
    fn every_edge_lies_between_its_faces() {
        let mesh = EdgeMesh::new(&torus(7, 5)).expect("a torus is manifold");
        assert_eq!(mesh.edges().len() * 2, mesh.faces().len() * 3);
        let has = |face: u32, from: u32, to: u32| {
            let f = mesh.faces()[face as usize];
            (0..3).any(|k| f[k] == from && f[(k + 1) % 3] == to)
        };
        for (e, [left, right]) in mesh.edges().iter().zip(mesh.edge_faces()) {
            assert!(has(*left, e.from, e.to) && has(*right, e.to, e.from));
        }
        for (face, edges) in mesh.face_edges().iter().enumerate() {
            for &e in edges {
                assert!(mesh.edge_faces()[e as usize].contains(&(face as u32)));
            }
        }
    }

    #[test]
    fn open_and_doubled_edges_are_refused() {
        let mut open = cube();
        open.faces.pop();
        assert!(EdgeMesh::new(&open).is_err());
        let mut doubled = cube();
        doubled.faces.push(doubled.faces[0]);
        assert!(matches!(
            EdgeMesh::new(&doubled),
            Err(EdgeMeshError::NotManifold { forward, backward, .. }) if forward + backward == 3
        ));
    }

    #[test]
    fn slivers_have_no_plane() {
        let frame = Frame {
            center: DVec3::ZERO,
            radius: 1.0,
        };
        let thin = |height: f64| [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0)];
        assert!(unit_plane(thin(1e-3), &frame).is_some());
        assert!(unit_plane(thin(1e-9), &frame).is_none());
        assert!(unit_plane([DVec3::ONE; 3], &frame).is_none());
    }
}
