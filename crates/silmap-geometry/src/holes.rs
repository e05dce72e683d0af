//! Filling the holes of an open mesh.
//!
//! Every hole is a loop of edges with one face. Loops that touch themselves or each other in a vertex are cut there into
//! simple ones. Small loops are filled with the triangulation that bends least, then has the least area; large ones are
//! first cut along short chords. A fill never uses an edge that the mesh has already, which would give it more than two
//! faces; when nothing else is left, it is a fan about a new vertex in the middle.
//!
//! Source: G. Barequet, M. Sharir. Filling gaps in the boundary of a polyhedron. CAGD 12, 1995; P. Liepa. Filling Holes
//! in Meshes. SGP 2003, section 3 (the weight: largest bend first, then area).
//! Deviations: no refinement or fairing of the fill.
//! Limits: a fill is not kept from crossing the rest of the surface.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::defects::{DisjointSets, counted};
use crate::mesh::TriangleMesh;
use crate::topology::Topology;

/// Loops up to this many edges are filled in one piece; the time grows with the cube, to some hundredths of a second.
const LARGEST_PIECE: usize = 128;

/// Loops beyond this are filled by a fan; looking for chords takes time quadratic in their edges.
const LARGEST_LOOP: usize = 20_000;

/// What was filled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HoleReport {
    /// Edges of each loop that was filled.
    pub loops: Vec<usize>,
    /// Faces added.
    pub added_faces: usize,
    /// Vertices added.
    pub added_vertices: usize,
    /// For every vertex of the result, the vertex it was, or lies beside.
    pub vertex_of: Vec<u32>,
}

impl HoleReport {
    /// One sentence, if there were holes.
    pub fn changes(&self) -> impl Iterator<Item = String> {
        let count = self.loops.len();
        let sentence = format!(
            "{} with {} filled with {}",
            counted(count, "hole"),
            counted(self.loops.iter().sum(), "edge"),
            counted(self.added_faces, "face")
        );
        (count > 0).then_some(sentence).into_iter()
    }
}

/// A vertex on the rim of a hole.
#[derive(Clone, Copy, Debug)]
struct RimVertex {
    vertex: u32,
    /// The face beyond the edge to the next rim vertex.
    beyond: u32,
}

/// Fills all holes of a mesh whose indices are in range. Where edges have more than two faces, or orientation is
/// inconsistent, loops may not close and stay open.
pub fn close_holes(mesh: &mut TriangleMesh) -> HoleReport {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut report = HoleReport {
        vertex_of: (0..mesh.positions.len() as u32).collect(),
        ..HoleReport::default()
    };
    let (face_count, vertex_count) = (mesh.faces.len(), mesh.positions.len());
    let mut filler = Filler {
        topology: &topology,
        added_edges: BTreeSet::new(),
        mesh,
    };
    for rim in trace_loops(filler.mesh, &topology) {
        report.loops.push(rim.len());
        filler.fill(&rim);
    }
    report.added_faces = mesh.faces.len() - face_count;
    // A new vertex is reported as a vertex of its hole's rim, from the first face that uses it.
    let mut beside = vec![None; mesh.positions.len() - vertex_count];
    for face in &mesh.faces[face_count..] {
        let old = face.iter().copied().find(|&v| (v as usize) < vertex_count);
        for &v in face {
            if let Some(place) = (v as usize).checked_sub(vertex_count) {
                beside[place] = beside[place].or(old);
            }
        }
    }
    (report.vertex_of).extend(beside.iter().map(|old: &Option<u32>| old.unwrap_or(0)));
    split_touching_fans(mesh, face_count, &mut report);
    report.added_vertices = mesh.positions.len() - vertex_count;
    report
}

/// The rims of all holes as simple loops, walked such that a fill wound like the loop agrees with the faces beyond.
fn trace_loops(mesh: &TriangleMesh, topology: &Topology) -> Vec<Vec<RimVertex>> {
    // Rim edges (from, to, face beyond), against the direction of the face.
    let mut edges: Vec<(u32, u32, u32)> = (0..topology.edges().len())
        .filter_map(|e| match topology.edge_uses(e) {
            &[only] => {
                let face = mesh.faces[only.face as usize];
                let k = usize::from(only.corner);
                Some((face[(k + 1) % 3], face[k], only.face))
            }
            _ => None,
        })
        .filter(|(from, to, _)| from != to)
        .collect();
    edges.sort_unstable();
    let mut is_used = vec![false; edges.len()];
    // Per vertex: its first edge that may be unused; holes in great number may meet in one.
    let mut first_out = vec![0; mesh.positions.len()];
    for (e, edge) in edges.iter().enumerate().rev() {
        first_out[edge.0 as usize] = e;
    }
    let mut place_on_path = vec![usize::MAX; mesh.positions.len()];
    let mut loops = Vec::new();
    for start in 0..edges.len() {
        let mut path: Vec<RimVertex> = Vec::new();
        let mut next = (!is_used[start]).then_some(start);
        while let Some(edge) = next {
            is_used[edge] = true;
            let (from, to, beyond) = edges[edge];
            place_on_path[from as usize] = path.len();
            path.push(RimVertex {
                vertex: from,
                beyond,
            });
            let met = place_on_path[to as usize];
            if met != usize::MAX {
                let closed = path.split_off(met);
                for rim in &closed {
                    place_on_path[rim.vertex as usize] = usize::MAX;
                }
                if closed.len() >= 3 {
                    loops.push(closed);
                }
            }
            let at = &mut first_out[to as usize];
            while edges.get(*at).is_some_and(|e| e.0 == to) && is_used[*at] {
                *at += 1;
            }
            next = edges.get(*at).is_some_and(|e| e.0 == to).then_some(*at);
            if path.is_empty() {
                break;
            }
        }
        for rim in path {
            place_on_path[rim.vertex as usize] = usize::MAX;
        }
    }
    loops
}

struct Filler<'a> {
    mesh: &'a mut TriangleMesh,
    topology: &'a Topology,
    added_edges: BTreeSet<[u32; 2]>,
}

impl Filler<'_> {
    fn has_edge(&self, a: u32, b: u32) -> bool {
        self.topology.find_edge(a, b).is_some() || self.added_edges.contains(&[a.min(b), a.max(b)])
    }

    fn fill(&mut self, rim: &[RimVertex]) {
        // Pieces are lists of places on the rim; every piece is a simple loop.
        let mut pieces: Vec<Vec<usize>> = vec![(0..rim.len()).collect()];
        let mut triangles = Vec::new();
        while let Some(piece) = pieces.pop() {
            if rim.len() > LARGEST_LOOP {
                return self.fill_with_fan(rim);
            }
            if piece.len() > LARGEST_PIECE {
                let Some((i, j)) = self.shortest_chord(rim, &piece) else {
                    return self.fill_with_fan(rim);
                };
                let (a, b) = (rim[piece[i]].vertex, rim[piece[j]].vertex);
                self.added_edges.insert([a.min(b), a.max(b)]);
                let rest = [&piece[..=i], &piece[j..]].concat();
                pieces.extend([piece[i..=j].to_vec(), rest]);
                continue;
            }
            match self.best_triangulation(rim, &piece) {
                Some(found) => triangles.extend(found),
                None => return self.fill_with_fan(rim),
            }
        }
        let looks: Vec<(usize, usize)> = rim.iter().map(|r| self.look_of(*r)).collect();
        for triangle in triangles {
            let corners = triangle.map(|place| rim[place].vertex);
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                self.added_edges.insert([a.min(b), a.max(b)]);
            }
            self.mesh
                .push_face(corners, triangle.map(|place| looks[place]));
        }
    }

    /// The corner of an old face that shows a rim vertex.
    fn look_of(&self, rim: RimVertex) -> (usize, usize) {
        let face = rim.beyond as usize;
        let corner = self.mesh.faces[face].iter().position(|&v| v == rim.vertex);
        (face, corner.unwrap_or(0))
    }

    fn fill_with_fan(&mut self, rim: &[RimVertex]) {
        let sum: DVec3 = rim
            .iter()
            .map(|r| self.mesh.positions[r.vertex as usize])
            .sum();
        let middle = self.mesh.positions.len() as u32;
        self.mesh.positions.push(sum / rim.len() as f64);
        for (i, &a) in rim.iter().enumerate() {
            let b = rim[(i + 1) % rim.len()];
            let like = [self.look_of(a), self.look_of(b), self.look_of(a)];
            self.mesh.push_face([a.vertex, b.vertex, middle], like);
        }
    }

    /// The shortest new edge across a piece that leaves at least a quarter of its edges on either side.
    fn shortest_chord(&self, rim: &[RimVertex], piece: &[usize]) -> Option<(usize, usize)> {
        let n = piece.len();
        let vertex = |i: usize| rim[piece[i]].vertex;
        let mut chords: Vec<(f64, usize, usize)> = Vec::new();
        for i in 0..n {
            for j in i + n / 4..n.min(i + n - n / 4 + 1) {
                let length = self.mesh.positions[vertex(i) as usize]
                    .distance_squared(self.mesh.positions[vertex(j) as usize]);
                if chords.last().is_none_or(|best| length < best.0)
                    && !self.has_edge(vertex(i), vertex(j))
                {
                    chords.push((length, i, j));
                }
            }
        }
        chords.last().map(|&(_, i, j)| (i, j))
    }

    /// The triangulation of a piece with the smallest largest bend, and among those the least area; `None` when every
    /// one needs an edge that exists.
    fn best_triangulation(&self, rim: &[RimVertex], piece: &[usize]) -> Option<Vec<[usize; 3]>> {
        let n = piece.len();
        let points: Vec<DVec3> = piece
            .iter()
            .map(|&p| self.mesh.positions[rim[p].vertex as usize])
            .collect();
        // Chords of a larger loop have nothing beyond them yet.
        let beyond: Vec<Option<DVec3>> = (0..n)
            .map(|i| {
                let follows = (piece[i] + 1) % rim.len() == piece[(i + 1) % n];
                let face = rim[piece[i]].beyond as usize;
                follows.then(|| self.mesh.face_cross(face).normalize_or_zero())
            })
            .collect();
        let is_free = |i: usize, j: usize| {
            j - i == 1
                || (i == 0 && j == n - 1)
                || !self.has_edge(rim[piece[i]].vertex, rim[piece[j]].vertex)
        };
        let mut best = vec![Span::EMPTY; n * n];
        for length in 2..n {
            for i in 0..n - length {
                let k = i + length;
                if !is_free(i, k) {
                    best[i * n + k] = Span::IMPOSSIBLE;
                    continue;
                }
                let mut found = Span::IMPOSSIBLE;
                for m in i + 1..k {
                    let (left, right) = (best[i * n + m], best[m * n + k]);
                    if left.bend.max(right.bend) > found.bend {
                        continue;
                    }
                    let cross = (points[m] - points[i]).cross(points[k] - points[i]);
                    let normal = cross.normalize_or_zero();
                    let mut bend = left.bend.max(right.bend);
                    let sides = [(i, m, left), (m, k, right)];
                    for (from, to, span) in sides {
                        let other = if to - from == 1 {
                            beyond[from]
                        } else {
                            Some(span.normal)
                        };
                        bend = bend.max(other.map_or(0.0, |o| 1.0 - o.dot(normal)));
                    }
                    if i == 0 && k == n - 1 {
                        bend = bend.max(beyond[k].map_or(0.0, |o| 1.0 - o.dot(normal)));
                    }
                    let area = left.area + right.area + cross.length();
                    if (bend, area) < (found.bend, found.area) {
                        found = Span {
                            bend,
                            area,
                            normal,
                            apex: m,
                        };
                    }
                }
                best[i * n + k] = found;
            }
        }
        let mut triangles = Vec::with_capacity(n - 2);
        let mut open = vec![(0, n - 1)];
        while let Some((i, k)) = open.pop() {
            if k - i < 2 {
                continue;
            }
            let span = best[i * n + k];
            if span.bend == f64::INFINITY {
                return None;
            }
            triangles.push([piece[i], piece[span.apex], piece[k]]);
            open.extend([(i, span.apex), (span.apex, k)]);
        }
        Some(triangles)
    }
}

/// The best fill between two places of a piece, and the triangle at the chord between them.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// The largest 1 − cos of the angle between neighbouring normals.
    bend: f64,
    /// Twice the area.
    area: f64,
    normal: DVec3,
    apex: usize,
}

impl Span {
    const EMPTY: Self = Self {
        bend: 0.0,
        area: 0.0,
        normal: DVec3::ZERO,
        apex: 0,
    };
    const IMPOSSIBLE: Self = Self {
        bend: f64::INFINITY,
        area: f64::INFINITY,
        ..Self::EMPTY
    };
}

/// Where several holes met in a vertex, fills may have closed fans that have only that vertex in common; each fan then
/// gets its own copy. Only vertices of new faces are looked at.
fn split_touching_fans(mesh: &mut TriangleMesh, first_new: usize, report: &mut HoleReport) {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let mut candidates: Vec<u32> = mesh.faces[first_new..].iter().flatten().copied().collect();
    candidates.sort_unstable();
    candidates.dedup();
    for vertex in candidates {
        let around = topology.vertex_faces(vertex as usize);
        // Faces around one vertex that share another one belong to one fan.
        let mut fans = DisjointSets::new(around.len());
        let mut spokes: Vec<(u32, u32)> = (0..)
            .zip(around)
            .flat_map(|(i, &f)| mesh.faces[f as usize].map(|v| (v, i)))
            .filter(|&(v, _)| v != vertex)
            .collect();
        spokes.sort_unstable();
        for pair in spokes.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            fans.unite(pair[0].1, pair[1].1);
        }
        let mut copy_of_fan = vec![vertex; around.len()];
        for (i, &face) in around.iter().enumerate() {
            let fan = fans.find(i as u32) as usize;
            if fan == i && i > 0 {
                copy_of_fan[i] = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[vertex as usize]);
                report.vertex_of.push(report.vertex_of[vertex as usize]);
            }
            for v in &mut mesh.faces[face as usize] {
                if *v == vertex {
                    *v = copy_of_fan[fan];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_mesh::ClosedMesh;

    /// A tube of `n` sides along z, radius 1, without ends; `n` squares are cut into two faces each.
    fn tube(n: u32) -> TriangleMesh {
        let mut tube = TriangleMesh::default();
        for i in 0..n {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
            tube.positions.extend([out, out + DVec3::Z]);
        }
        for i in 0..n {
            let (a, b) = (2 * i, 2 * ((i + 1) % n));
            tube.faces.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
        tube
    }

    #[test]
    fn the_ends_of_a_tube_are_filled_flat() {
        for n in [3, 4, 40, 128, 129, 500] {
            let mut mesh = tube(n);
            let report = close_holes(&mut mesh);
            assert_eq!(report.loops, [n as usize; 2], "{n}");
            assert_eq!(
                (report.added_faces, report.added_vertices),
                (2 * n as usize - 4, 0)
            );
            let closed = ClosedMesh::try_from(mesh).unwrap();
            let ideal = 0.5 * f64::from(n) * (std::f64::consts::TAU / f64::from(n)).sin();
            assert!((closed.mesh().volume() - ideal).abs() < 1e-9, "{n}");
        }
    }

    #[test]
    fn an_endless_rim_gets_a_fan() {
        let mut mesh = tube(LARGEST_LOOP as u32 + 1);
        let report = close_holes(&mut mesh);
        assert_eq!(report.added_vertices, 2);
        assert_eq!(report.vertex_of.len(), mesh.positions.len());
        assert!(ClosedMesh::try_from(mesh).is_ok());
    }

    #[test]
    fn existing_edges_are_not_used_again() {
        // Two tetrahedra that share the edge 0–1 in the middle of a four-sided hole: both diagonals of the hole are
        // edges of the mesh already, so that only a fan is left.
        let mut mesh = TriangleMesh {
            positions: [
                [0, 0, 0],
                [2, 0, 0],
                [2, 2, 0],
                [0, 2, 0],
                [1, 1, -3],
                [1, 1, -1],
                [1, 1, -2],
            ]
            .map(|p: [i32; 3]| DVec3::from(p.map(f64::from)))
            .to_vec(),
            // An open pyramid below the square 0 1 2 3.
            faces: vec![[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]],
            ..TriangleMesh::default()
        };
        // Closed slivers that contain the diagonals 0–2 and 1–3.
        for [a, b, c, d] in [[0, 2, 5, 6], [1, 3, 6, 5]] {
            mesh.faces
                .extend([[a, c, b], [a, b, d], [b, c, d], [a, d, c]]);
        }
        let report = close_holes(&mut mesh);
        assert_eq!((report.loops.as_slice(), report.added_faces), (&[4][..], 4));
        let crowded = Topology::new(&mesh.faces, mesh.positions.len());
        assert!(
            (0..crowded.edges().len())
                .all(|e| { crowded.edge_uses(e).len() == 2 || crowded.edges()[e] == [5, 6] })
        );
    }

    #[test]
    fn holes_that_touch_in_a_vertex_are_filled_one_by_one() {
        // An octahedron without two faces that have only the top in common.
        let mut mesh = TriangleMesh {
            positions: [
                [1, 0, 0],
                [0, 1, 0],
                [-1, 0, 0],
                [0, -1, 0],
                [0, 0, 1],
                [0, 0, -1],
            ]
            .map(|p: [i32; 3]| DVec3::from(p.map(f64::from)))
            .to_vec(),
            faces: vec![
                [1, 2, 4],
                [3, 0, 4],
                [1, 0, 5],
                [2, 1, 5],
                [3, 2, 5],
                [0, 3, 5],
            ],
            ..TriangleMesh::default()
        };
        let report = close_holes(&mut mesh);
        assert_eq!(report.loops, [3, 3]);
        assert_eq!(
            report.changes().collect::<Vec<_>>(),
            ["2 holes with 6 edges filled with 2 faces"]
        );
        assert!((ClosedMesh::try_from(mesh).unwrap().mesh().volume() - 4.0 / 3.0).abs() < 1e-12);
    }
}
