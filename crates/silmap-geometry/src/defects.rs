//! Everything that keeps a triangle mesh from being a closed, oriented 2-manifold, found in one pass.
//!
//! Sound: every index in range, every coordinate finite, no face with a repeated corner, every edge used by exactly two
//! faces in opposite directions, one fan of faces around every vertex, no two faces on the same three vertices, no face
//! with its corners at three places on one line, a volume, and that volume positive. Slivers are no defect as long as they have an area
//! at all: scans are full of them, and an outline does not mind.

use std::fmt;

use glam::DVec3;

use crate::mesh::TriangleMesh;
use crate::predicates::are_collinear;
use crate::topology::Topology;

/// A mesh whose volume is below this fraction of its bounding sphere's cubed radius has none: the sum's own rounding
/// is about a thousand times smaller.
pub const LEAST_VOLUME_REL: f64 = 1e-12;

/// A mesh is flat when its vertices stay this close to one plane, as a fraction of the bounding sphere's radius.
const FLAT_REL: f64 = 1e-9;

/// One kind of defect, how often it occurs, and where first. Vertices and faces are numbered as
/// [`MeshDefects::renumber`] says, or as in the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Defect {
    /// There is nothing to draw.
    NoFaces,
    /// Faces name vertices that do not exist.
    VertexOutOfRange {
        /// Faces that do.
        count: usize,
        /// The first of them.
        face: u32,
        /// The vertex it names.
        vertex: u32,
    },
    /// Vertices with an infinite or not-a-number coordinate.
    NotFinite {
        /// Such vertices that a face uses.
        count: usize,
        /// The first of them.
        vertex: u32,
    },
    /// Faces that use a vertex twice.
    RepeatedCorner {
        /// Such faces.
        count: usize,
        /// The first of them.
        face: u32,
        /// The vertex.
        vertex: u32,
    },
    /// Edges with more than two faces.
    CrowdedEdge {
        /// Such edges.
        count: usize,
        /// The first of them.
        edge: [u32; 2],
        /// How many faces that one has.
        faces: usize,
    },
    /// Faces on the same three vertices as an earlier face.
    DuplicateFace {
        /// Such faces.
        count: usize,
        /// The first of them.
        face: u32,
        /// The earlier face.
        earlier: u32,
    },
    /// Edges that both of their faces walk in the same direction.
    Inconsistent {
        /// Such edges.
        count: usize,
        /// The first of them.
        edge: [u32; 2],
    },
    /// Edges with one face.
    Boundary {
        /// Such edges.
        count: usize,
        /// Connected pieces they form: the holes, unless holes touch.
        loops: usize,
        /// The first edge.
        edge: [u32; 2],
    },
    /// Vertices where several sheets meet in nothing but that point.
    SplitVertex {
        /// Such vertices.
        count: usize,
        /// The first of them.
        vertex: u32,
        /// Sheets there.
        fans: usize,
    },
    /// Faces whose vertices lie exactly on one line, at three places.
    ZeroArea {
        /// Such faces.
        count: usize,
        /// The first of them.
        face: u32,
    },
    /// All vertices lie in a plane, or the surface encloses nothing.
    NoVolume,
    /// Closed and consistent, but facing inward.
    Inward {
        /// The (negative) signed volume, in cubed model units.
        volume: f64,
    },
}

/// All defects of a mesh, at least one, the gravest first.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshDefects {
    defects: Vec<Defect>,
    /// What the first vertex is called: 0, or 1 in files that count from 1.
    first_vertex: u32,
    /// What the first face is called.
    first_face: u32,
}

impl MeshDefects {
    /// Looks for defects; `None` when the mesh is sound.
    #[must_use]
    pub fn of(mesh: &TriangleMesh) -> Option<Self> {
        let defects = find_defects(mesh);
        (!defects.is_empty()).then_some(Self {
            defects,
            first_vertex: 0,
            first_face: 0,
        })
    }

    /// The defects, one per kind, the gravest first.
    #[must_use]
    pub fn kinds(&self) -> &[Defect] {
        &self.defects
    }

    /// Speaks of vertices and faces by other numbers: those of the file they came from. `first_vertex` is added to
    /// all vertices, and faces are counted from 1.
    #[must_use]
    pub fn renumber(mut self, vertex_of: &[u32], face_of: &[u32], first_vertex: u32) -> Self {
        let other = |table: &[u32], index: u32| table.get(index as usize).copied().unwrap_or(index);
        for defect in &mut self.defects {
            match defect {
                Defect::NoFaces | Defect::NoVolume | Defect::Inward { .. } => {}
                Defect::VertexOutOfRange { face, .. } | Defect::ZeroArea { face, .. } => {
                    *face = other(face_of, *face);
                }
                Defect::NotFinite { vertex, .. } | Defect::SplitVertex { vertex, .. } => {
                    *vertex = other(vertex_of, *vertex);
                }
                Defect::RepeatedCorner { face, vertex, .. } => {
                    *face = other(face_of, *face);
                    *vertex = other(vertex_of, *vertex);
                }
                Defect::DuplicateFace { face, earlier, .. } => {
                    *face = other(face_of, *face);
                    *earlier = other(face_of, *earlier);
                }
                Defect::CrowdedEdge { edge, .. }
                | Defect::Inconsistent { edge, .. }
                | Defect::Boundary { edge, .. } => {
                    *edge = edge.map(|v| other(vertex_of, v));
                }
            }
        }
        self.first_vertex = first_vertex;
        self.first_face = 1;
        self
    }

    /// Whether the surface has holes.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.defects
            .iter()
            .any(|d| matches!(d, Defect::Boundary { .. }))
    }

    /// Whether something is wrong that [`crate::repair`] works on.
    #[must_use]
    pub fn is_repairable(&self) -> bool {
        self.defects.iter().any(|d| {
            matches!(
                d,
                Defect::RepeatedCorner { .. }
                    | Defect::CrowdedEdge { .. }
                    | Defect::DuplicateFace { .. }
                    | Defect::Inconsistent { .. }
                    | Defect::SplitVertex { .. }
                    | Defect::ZeroArea { .. }
            )
        })
    }
}

impl std::error::Error for MeshDefects {}

impl fmt::Display for MeshDefects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, defect) in self.defects.iter().enumerate() {
            f.write_str(["", "; "][usize::from(i > 0)])?;
            defect.write(f, self.first_vertex, self.first_face)?;
        }
        Ok(())
    }
}

/// "1 face", "2 faces", "3 vertices".
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    match (count, noun.strip_suffix("ex")) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{count} {stem}ices"),
        (_, None) => format!("{count} {noun}s"),
    }
}

impl Defect {
    fn write(&self, f: &mut fmt::Formatter<'_>, first_vertex: u32, first_face: u32) -> fmt::Result {
        let name = |vertex: u32| u64::from(vertex) + u64::from(first_vertex);
        let face_name = |face: u32| u64::from(face) + u64::from(first_face);
        // "edge 3–7 has 4 faces", and how many more there are like it.
        let more = |f: &mut fmt::Formatter<'_>, count: usize| match count {
            0 | 1 => Ok(()),
            _ => write!(f, " (and {} more like it)", count - 1),
        };
        match *self {
            Self::NoFaces => f.write_str("it has no faces"),
            Self::VertexOutOfRange {
                count,
                face,
                vertex,
            } => {
                write!(
                    f,
                    "face {} uses vertex {}, which does not exist",
                    face_name(face),
                    name(vertex)
                )?;
                more(f, count)
            }
            Self::NotFinite { count, vertex } => {
                write!(f, "vertex {} is not finite", name(vertex))?;
                more(f, count)
            }
            Self::RepeatedCorner {
                count,
                face,
                vertex,
            } => {
                write!(
                    f,
                    "face {} uses vertex {} twice",
                    face_name(face),
                    name(vertex)
                )?;
                more(f, count)
            }
            Self::CrowdedEdge { count, edge, faces } => {
                let [a, b] = edge.map(name);
                write!(f, "non-manifold edge: edge ({a}, {b}) has {faces} faces")?;
                more(f, count)
            }
            Self::DuplicateFace {
                count,
                face,
                earlier,
            } => {
                write!(
                    f,
                    "face {} has the same vertices as face {}",
                    face_name(face),
                    face_name(earlier)
                )?;
                more(f, count)
            }
            Self::Inconsistent { count, edge } => {
                let [a, b] = edge.map(name);
                write!(
                    f,
                    "inconsistent orientation at edge ({a}, {b}): both faces run along it the same way"
                )?;
                more(f, count)
            }
            Self::Boundary { count, loops, edge } => {
                let [a, b] = edge.map(name);
                write!(
                    f,
                    "open: {} in {}, the first is ({a}, {b})",
                    counted(count, "boundary edge"),
                    counted(loops, "loop")
                )
            }
            Self::SplitVertex {
                count,
                vertex,
                fans,
            } => {
                write!(
                    f,
                    "non-manifold vertex: {fans} sheets meet only in vertex {}",
                    name(vertex)
                )?;
                more(f, count)
            }
            Self::ZeroArea { count, face } => {
                write!(
                    f,
                    "face {} has no area: its corners lie on one line",
                    face_name(face)
                )?;
                more(f, count)
            }
            Self::NoVolume => f.write_str("no volume: it is flat, or its sheets enclose nothing"),
            Self::Inward { volume } => write!(f, "it faces inward (signed volume {volume:.3e})"),
        }
    }
}

fn find_defects(mesh: &TriangleMesh) -> Vec<Defect> {
    let mut defects = Vec::new();
    if mesh.faces.is_empty() {
        return vec![Defect::NoFaces];
    }
    let vertex_count = mesh.positions.len();
    let out_of_range = |face: &[u32; 3]| face.iter().copied().find(|&v| v as usize >= vertex_count);
    if let Some((first, count)) = first_and_count(mesh, |f| out_of_range(f).is_some()) {
        let vertex = out_of_range(&mesh.faces[first]).unwrap_or(u32::MAX);
        // Nothing else can be asked of such a mesh.
        return vec![Defect::VertexOutOfRange {
            count,
            face: first as u32,
            vertex,
        }];
    }
    defects.extend(not_finite(mesh));
    if let Some((first, count)) = first_and_count(mesh, |f| repeated_corner(f).is_some()) {
        let vertex = repeated_corner(&mesh.faces[first]).unwrap_or(u32::MAX);
        defects.push(Defect::RepeatedCorner {
            count,
            face: first as u32,
            vertex,
        });
    }
    let proper: Vec<u32> = (0..mesh.faces.len() as u32)
        .filter(|&f| repeated_corner(&mesh.faces[f as usize]).is_none())
        .collect();
    let faces: Vec<[u32; 3]> = proper.iter().map(|&f| mesh.faces[f as usize]).collect();
    let topology = Topology::new(&faces, vertex_count);
    let is_finite = !defects
        .iter()
        .any(|d| matches!(d, Defect::NotFinite { .. }));
    let [crowded, inconsistent, boundary] = edge_defects(&topology);
    let is_closed = boundary.is_none() && crowded.is_none() && inconsistent.is_none();
    defects.extend(crowded);
    defects.extend(duplicate_faces(&faces, &proper));
    defects.extend(inconsistent);
    defects.extend(boundary);
    defects.extend(split_vertices(&faces, &topology));
    if is_finite {
        let is_line = |f: &[u32; 3]| has_corners_on_line(f.map(|v| mesh.positions[v as usize]));
        if let Some((first, count)) = first_and_count(mesh, is_line) {
            let face = first as u32;
            defects.push(Defect::ZeroArea { count, face });
        }
        defects.extend(volume_defect(mesh, is_closed));
    }
    defects
}

fn first_and_count(
    mesh: &TriangleMesh,
    is_bad: impl Fn(&[u32; 3]) -> bool,
) -> Option<(usize, usize)> {
    let first = mesh.faces.iter().position(&is_bad)?;
    Some((first, mesh.faces.iter().filter(|f| is_bad(f)).count()))
}

/// The vertex a face uses twice, if any.
#[must_use]
pub fn repeated_corner(&[a, b, c]: &[u32; 3]) -> Option<u32> {
    if a == b || a == c {
        Some(a)
    } else if b == c {
        Some(b)
    } else {
        None
    }
}

/// Whether three corners at three places lie exactly on one line. Corners at one place are another matter: reading a file
/// welds them, and sheets that touch are kept apart by them.
pub(crate) fn has_corners_on_line([a, b, c]: [DVec3; 3]) -> bool {
    a != b && b != c && c != a && are_collinear([a, b, c])
}

fn not_finite(mesh: &TriangleMesh) -> Option<Defect> {
    let mut is_bad: Vec<bool> = mesh.positions.iter().map(|p| !p.is_finite()).collect();
    if !is_bad.contains(&true) {
        return None;
    }
    let mut is_used = vec![false; is_bad.len()];
    for &v in mesh.faces.iter().flatten() {
        is_used[v as usize] = true;
    }
    for (bad, used) in is_bad.iter_mut().zip(is_used) {
        *bad &= used;
    }
    let vertex = is_bad.iter().position(|&bad| bad)? as u32;
    let count = is_bad.iter().filter(|&&bad| bad).count();
    Some(Defect::NotFinite { count, vertex })
}

/// Crowded, inconsistent and boundary edges.
fn edge_defects(topology: &Topology) -> [Option<Defect>; 3] {
    let (mut crowded, mut inconsistent, mut open) = (Vec::new(), Vec::new(), Vec::new());
    for edge in 0..topology.edges().len() {
        match topology.edge_uses(edge) {
            [_] => open.push(edge),
            [a, b] if a.is_forward == b.is_forward => inconsistent.push(edge),
            [_, _] => {}
            _ => crowded.push(edge),
        }
    }
    let edges = topology.edges();
    [
        crowded.first().map(|&e| Defect::CrowdedEdge {
            count: crowded.len(),
            edge: edges[e],
            faces: topology.edge_uses(e).len(),
        }),
        inconsistent.first().map(|&e| Defect::Inconsistent {
            count: inconsistent.len(),
            edge: edges[e],
        }),
        open.first().map(|&e| Defect::Boundary {
            count: open.len(),
            loops: connected_pieces(topology, &open),
            edge: edges[e],
        }),
    ]
}

/// The number of pieces some edges hang together in.
fn connected_pieces(topology: &Topology, chosen: &[usize]) -> usize {
    let mut sets = DisjointSets::new(topology.vertex_count());
    for &e in chosen {
        let [a, b] = topology.edges()[e];
        sets.unite(a, b);
    }
    let mut roots: Vec<u32> = chosen
        .iter()
        .map(|&e| sets.find(topology.edges()[e][0]))
        .collect();
    roots.sort_unstable();
    roots.dedup();
    roots.len()
}

fn duplicate_faces(faces: &[[u32; 3]], names: &[u32]) -> Option<Defect> {
    let mut by_corners: Vec<([u32; 3], usize)> = (faces.iter().enumerate())
        .map(|(f, face)| {
            let mut sorted = *face;
            sorted.sort_unstable();
            (sorted, f)
        })
        .collect();
    by_corners.sort_unstable();
    let copies = by_corners.chunk_by(|a, b| a.0 == b.0);
    // Of each group the first is no copy; the earliest copy of all is reported.
    let count: usize = copies.clone().map(|group| group.len() - 1).sum();
    let first = copies
        .filter_map(|group| Some((group.get(1)?.1, group[0].1)))
        .min()?;
    Some(Defect::DuplicateFace {
        count,
        face: names[first.0],
        earlier: names[first.1],
    })
}

/// Vertices with more than one fan of faces, where faces at one edge belong to one fan however many they are.
fn split_vertices(faces: &[[u32; 3]], topology: &Topology) -> Option<Defect> {
    let mut corners = DisjointSets::new(faces.len() * 3);
    for edge in 0..topology.edges().len() {
        let uses = topology.edge_uses(edge);
        for pair in uses.windows(2) {
            let ends = [pair[0], pair[1]].map(|u| {
                let corner = u32::from(u.corner);
                let (from, to) = (u.face * 3 + corner, u.face * 3 + (corner + 1) % 3);
                if u.is_forward { [from, to] } else { [to, from] }
            });
            corners.unite(ends[0][0], ends[1][0]);
            corners.unite(ends[0][1], ends[1][1]);
        }
    }
    let (mut count, mut first) = (0, None);
    let mut fans = vec![0_u32; topology.vertex_count()];
    for (f, face) in faces.iter().enumerate() {
        for (k, &v) in face.iter().enumerate() {
            let corner = (f * 3 + k) as u32;
            if corners.find(corner) == corner {
                fans[v as usize] += 1;
            }
        }
    }
    for (v, &n) in fans.iter().enumerate() {
        if n > 1 {
            count += 1;
            first = first.or(Some((v as u32, n as usize)));
        }
    }
    first.map(|(vertex, fans)| Defect::SplitVertex {
        count,
        vertex,
        fans,
    })
}

fn volume_defect(mesh: &TriangleMesh, is_closed: bool) -> Option<Defect> {
    let radius = mesh.bounds().radius;
    let volume = mesh.volume();
    if is_flat(mesh, radius) || (is_closed && volume.abs() <= LEAST_VOLUME_REL * radius.powi(3)) {
        return Some(Defect::NoVolume);
    }
    (is_closed && volume < 0.0).then_some(Defect::Inward { volume })
}

/// Whether all faces lie in the plane of the largest one.
fn is_flat(mesh: &TriangleMesh, radius: f64) -> bool {
    let largest = (0..mesh.faces.len())
        .map(|f| (mesh.face_cross(f).length_squared(), f))
        .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let Some((_, largest)) = largest else {
        return true;
    };
    let normal = mesh.face_cross(largest).normalize_or_zero();
    let origin = mesh.corners(largest)[0];
    mesh.faces
        .iter()
        .flatten()
        .all(|&v| (mesh.positions[v as usize] - origin).dot(normal).abs() <= FLAT_REL * radius)
}

/// Sets of numbers that are only ever joined; the root of a set is its smallest member.
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    pub(crate) fn find(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }

    pub(crate) fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
