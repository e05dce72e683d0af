//! Mesh connectivity: the faces at each edge and vertex.
//!
//! Built from the faces alone, for any index soup (no promise of manifoldness): unique undirected edges with every face
//! that uses them, the edges of every face, and the faces around every vertex, all in flat arrays. Nothing here depends
//! on hashing: edges are numbered by their lower, then their higher vertex, uses of an edge by face and corner.

/// One face's use of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeUse {
    /// The face.
    pub face: u32,
    /// Which of its edges: the one from corner `corner` to the next.
    pub corner: u8,
    /// Whether the face walks the edge from its lower to its higher vertex.
    pub is_forward: bool,
}

/// Adjacency of a list of triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topology {
    edges: Vec<[u32; 2]>,
    use_starts: Vec<u32>,
    uses: Vec<EdgeUse>,
    face_edges: Vec<[u32; 3]>,
    vertex_starts: Vec<u32>,
    vertex_faces: Vec<u32>,
}

impl Topology {
    /// Links up `faces`, whose indices are all below `vertex_count`.
    ///
    /// A face that repeats a corner has an edge from a vertex to itself, which is kept as an edge like any other.
    ///
    /// # Panics
    /// If an index is not below `vertex_count`, or there are more than `u32::MAX` corners.
    #[must_use]
    pub fn new(faces: &[[u32; 3]], vertex_count: usize) -> Self {
        assert!(
            u32::try_from(faces.len().saturating_mul(3)).is_ok(),
            "corners are counted in 32 bits"
        );
        let (bucket_starts, bucketed) = bucket_by_low_vertex(faces, vertex_count);
        let mut edges = Vec::with_capacity(faces.len() * 3 / 2 + 1);
        let mut use_starts = Vec::with_capacity(faces.len() * 3 / 2 + 2);
        let mut uses = Vec::with_capacity(faces.len() * 3);
        let mut face_edges = vec![[0; 3]; faces.len()];
        let mut bucket = Vec::new();
        for low in 0..vertex_count {
            bucket.clear();
            bucket.extend_from_slice(
                &bucketed[bucket_starts[low] as usize..bucket_starts[low + 1] as usize],
            );
            bucket.sort_unstable();
            for &(high, used) in &bucket {
                let edge = [low as u32, high];
                if edges.last() != Some(&edge) {
                    edges.push(edge);
                    use_starts.push(uses.len() as u32);
                }
                face_edges[used.face as usize][usize::from(used.corner)] = edges.len() as u32 - 1;
                uses.push(used);
            }
        }
        use_starts.push(uses.len() as u32);
        let (vertex_starts, vertex_faces) = faces_around_vertices(faces, vertex_count);
        Self {
            edges,
            use_starts,
            uses,
            face_edges,
            vertex_starts,
            vertex_faces,
        }
    }

    /// All edges as (lower vertex, higher vertex), sorted.
    #[must_use]
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Every use of an edge, by face and corner.
    #[must_use]
    pub fn edge_uses(&self, edge: usize) -> &[EdgeUse] {
        &self.uses[self.use_starts[edge] as usize..self.use_starts[edge + 1] as usize]
    }

    /// The two faces of an edge of a closed, oriented manifold: first the one that walks it from the lower to the higher
    /// vertex (it lies on the left of that direction, seen from outside), then the other. `None` for any other edge.
    #[must_use]
    pub fn edge_faces(&self, edge: usize) -> Option<[u32; 2]> {
        match self.edge_uses(edge) {
            [a, b] if a.is_forward && !b.is_forward => Some([a.face, b.face]),
            [a, b] if b.is_forward && !a.is_forward => Some([b.face, a.face]),
            _ => None,
        }
    }

    /// The edges of a face: entry k runs from corner k to the next.
    #[must_use]
    pub fn face_edges(&self, face: usize) -> [u32; 3] {
        self.face_edges[face]
    }

    /// The face on the other side of a face's edge, when the edge has exactly two uses.
    #[must_use]
    pub fn neighbour(&self, face: usize, corner: usize) -> Option<EdgeUse> {
        match self.edge_uses(self.face_edges[face][corner] as usize) {
            [a, b] if a.face as usize == face && usize::from(a.corner) == corner => Some(*b),
            [a, b] if b.face as usize == face && usize::from(b.corner) == corner => Some(*a),
            _ => None,
        }
    }

    /// The faces that use a vertex, ascending; a face that repeats the vertex is listed once a corner.
    #[must_use]
    pub fn vertex_faces(&self, vertex: usize) -> &[u32] {
        &self.vertex_faces
            [self.vertex_starts[vertex] as usize..self.vertex_starts[vertex + 1] as usize]
    }

    /// The edge between two vertices, if a face has it.
    #[must_use]
    pub fn find_edge(&self, a: u32, b: u32) -> Option<usize> {
        self.edges.binary_search(&[a.min(b), a.max(b)]).ok()
    }

    /// The number of vertices it was made for.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.vertex_starts.len() - 1
    }

    /// The connected part of every face, where parts hang together through edges; numbered by their first face.
    #[must_use]
    pub fn parts(&self) -> (Vec<u32>, usize) {
        const UNSEEN: u32 = u32::MAX;
        let mut part_of_face = vec![UNSEEN; self.face_edges.len()];
        let mut count = 0;
        let mut stack = Vec::new();
        for seed in 0..self.face_edges.len() {
            if part_of_face[seed] != UNSEEN {
                continue;
            }
            part_of_face[seed] = count;
            stack.push(seed);
            while let Some(face) = stack.pop() {
                for edge in self.face_edges[face] {
                    for other in self.edge_uses(edge as usize) {
                        let slot = &mut part_of_face[other.face as usize];
                        if *slot == UNSEEN {
                            *slot = count;
                            stack.push(other.face as usize);
                        }
                    }
                }
            }
            count += 1;
        }
        (part_of_face, count as usize)
    }
}

/// Edge uses grouped by the lower vertex of their edge: starts of the groups, and (higher vertex, use) in face order.
fn bucket_by_low_vertex(
    faces: &[[u32; 3]],
    vertex_count: usize,
) -> (Vec<u32>, Vec<(u32, EdgeUse)>) {
    let mut starts = vec![0_u32; vertex_count + 1];
    for face in faces {
        for k in 0..3 {
            starts[face[k].min(face[(k + 1) % 3]) as usize + 1] += 1;
        }
    }
    for v in 0..vertex_count {
        starts[v + 1] += starts[v];
    }
    let nothing = EdgeUse {
        face: 0,
        corner: 0,
        is_forward: false,
    };
    let mut bucketed = vec![(0, nothing); faces.len() * 3];
    let mut next = starts.clone();
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            assert!(
                (a.max(b) as usize) < vertex_count,
                "a face index is not below the vertex count"
            );
            let slot = &mut next[a.min(b) as usize];
            bucketed[*slot as usize] = (
                a.max(b),
                EdgeUse {
                    face: f as u32,
                    corner: k as u8,
                    is_forward: a < b,
                },
            );
            *slot += 1;
        }
    }
    (starts, bucketed)
}

fn faces_around_vertices(faces: &[[u32; 3]], vertex_count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; vertex_count + 1];
    for &v in faces.iter().flatten() {
        starts[v as usize + 1] += 1;
    }
    for v in 0..vertex_count {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut around = vec![0; faces.len() * 3];
    for (f, face) in faces.iter().enumerate() {
        for &v in face {
            around[next[v as usize] as usize] = f as u32;
            next[v as usize] += 1;
        }
    }
    (starts, around)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    #[test]
    fn a_tetrahedron_has_six_edges_with_two_faces_each() {
        let topology = Topology::new(&TETRAHEDRON, 4);
        assert_eq!(
            topology.edges(),
            [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
        );
        assert_eq!(topology.edge_faces(0), Some([1, 0]));
        assert_eq!(topology.vertex_faces(3), [1, 2, 3]);
        for face in 0..4 {
            for corner in 0..3 {
                let other = topology.neighbour(face, corner).unwrap();
                let back = topology
                    .neighbour(other.face as usize, usize::from(other.corner))
                    .unwrap();
                assert_eq!(
                    (back.face as usize, usize::from(back.corner)),
                    (face, corner)
                );
            }
        }
        assert_eq!(topology.parts(), (vec![0; 4], 1));
        assert_eq!(topology.find_edge(3, 1), Some(4));
    }

    #[test]
    fn open_and_crowded_edges_have_no_neighbour() {
        let topology = Topology::new(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]], 6);
        let crowded = topology.find_edge(0, 1).unwrap();
        assert_eq!(topology.edge_uses(crowded).len(), 3);
        assert_eq!(topology.edge_faces(crowded), None);
        assert_eq!(topology.neighbour(0, 0), None);
        assert_eq!(topology.neighbour(0, 1), None);
        assert!(topology.vertex_faces(5).is_empty());
        assert_eq!(topology.find_edge(3, 4), None);
    }

    #[test]
    fn parts_are_numbered_by_their_first_face() {
        let topology = Topology::new(&[[0, 1, 2], [3, 4, 5], [1, 0, 6]], 7);
        assert_eq!(topology.parts(), (vec![0, 1, 0], 2));
    }
}
