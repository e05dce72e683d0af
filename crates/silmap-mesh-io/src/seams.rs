//! Joining of open edges that miss each other by rounding.
//!
//! Modelling tools close a sphere by walking around it by 2π, where the sine is not zero but 2.4·10⁻¹⁶, and exporters scatter
//! the corners of one vertex by single-precision noise. Vertices at equal places are merged already; here vertices of open
//! edges are that lie within a few units in the last place of the file's own numbers.
//!
//! Closeness alone joins nothing. Two vertices become one only where an open edge runs against another one that lies within
//! the distance at both ends, or where an open edge is as short as that itself. So sheets a thickness apart stay apart, and a
//! closed mesh is left as it is. Which vertices join follows from where they are, not from their order: they are sorted into
//! cells as large as the distance, neighbouring cells whose boxes come that close belong together, and groups that reach too
//! far are left alone. Time is n log n.

use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_geometry::defects::repeated_corner;

use super::raw::RawMesh;

/// How many units in the last place of binary numbers corners of one vertex may lie apart: a few roundings on either side.
const BINARY_PLACES: f64 = 8.0;
/// The same for decimal numbers.
const DECIMAL_PLACES: f64 = 4.0;
/// Fewer digits than this say nothing about how exact numbers are: `0.5` is exact.
const FEWEST_DIGITS: u8 = 6;
/// Numbers of so many digits count as full double precision.
const MOST_DIGITS: u8 = 16;
/// A group of vertices that reaches further, in distances, is no single place.
const WIDEST_GROUP: f64 = 4.0;

/// What was joined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Joined {
    /// Vertices that became another one.
    pub(super) vertices: usize,
    /// Faces lost because their corners were joined.
    pub(super) faces: usize,
    /// The largest extent of the places that became one, model units.
    pub(super) widest: f64,
}

/// A few units in the last place of a file's numbers, model units; 0 when there is no vertex.
pub(super) fn rounding_distance(raw: &RawMesh) -> f64 {
    let coordinates = || raw.mesh.positions.iter().flat_map(|p| p.to_array());
    let largest = coordinates().map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 || !largest.is_finite() {
        return 0.0;
    }
    let unit_below = |bits: i32| f64::powi(2.0, largest.log2().floor() as i32 - bits);
    let mut distance = BINARY_PLACES * unit_below(52);
    if raw.is_single || coordinates().all(|x| f64::from(x as f32) == x) {
        distance = distance.max(BINARY_PLACES * unit_below(23));
    }
    // Facets of few digits among others with all of them miss those.
    let digits = if raw.digits >= MOST_DIGITS && raw.facet_digits > 0 {
        raw.facet_digits
    } else {
        raw.digits
    };
    if digits > 0 && digits < MOST_DIGITS {
        let digits = i32::from(digits.max(FEWEST_DIGITS));
        let last_place = f64::powi(10.0, largest.log10().floor() as i32 + 1 - digits);
        distance = distance.max(DECIMAL_PLACES * last_place);
    }
    distance
}

/// The least power of ten, larger than `distance`, at which joining leaves fewer than half of a mesh's open edges and loses no
/// face; `None` when there is none up to a ten-thousandth of its size.
pub(super) fn wider_distance(mesh: &TriangleMesh, distance: f64) -> Option<f64> {
    const WIDEST: f64 = 1e-4;
    let open = open_edges(&mesh.faces).len();
    let size = extent(
        mesh.faces
            .iter()
            .flatten()
            .map(|&v| mesh.positions[v as usize]),
    );
    if open == 0 || !size.is_finite() {
        return None;
    }
    // Closer than that, numbers of double precision are equal.
    let first = distance.max(1e-15 * size).log10().floor() as i32 + 1;
    let last = (WIDEST * size).log10().floor() as i32;
    let bare = TriangleMesh {
        positions: mesh.positions.clone(),
        faces: mesh.faces.clone(),
        ..TriangleMesh::default()
    };
    (first..=last)
        .map(|power| format!("1e{power}").parse().unwrap_or(0.0))
        .find(|&wider| {
            let mut joined = bare.clone();
            let mut vertex_of = vec![0; joined.positions.len()];
            let mut face_of = vec![0; joined.faces.len()];
            let lost = join(&mut joined, &mut vertex_of, &mut face_of, wider).faces;
            lost == 0 && 2 * open_edges(&joined.faces).len() < open
        })
}

/// Joins open edges that lie within `distance` of each other, see above. `vertex_of` and `face_of` name vertices and faces,
/// and follow them.
pub(super) fn join(
    mesh: &mut TriangleMesh,
    vertex_of: &mut Vec<u32>,
    face_of: &mut Vec<u32>,
    distance: f64,
) -> Joined {
    let open = open_edges(&mesh.faces);
    if open.is_empty() || distance <= 0.0 {
        return Joined::default();
    }
    let mut candidates: Vec<u32> = open.iter().flatten().copied().collect();
    candidates.sort_unstable();
    candidates.dedup();
    let groups = Groups::of(&mesh.positions, &candidates, distance);
    let is_seam = groups.seams(&open);
    let mut joined = Joined::default();
    let mut new_of_old: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for (group, members) in groups.members.iter().enumerate() {
        if !is_seam[group] {
            continue;
        }
        let places = || members.iter().map(|&v| mesh.positions[v as usize]);
        // Zero rather than the sine of 2π, and the same one whatever the order.
        let place = places()
            .min_by(|a, b| simplest_first(*a, *b))
            .unwrap_or_default();
        joined.widest = joined.widest.max(extent(places()));
        joined.vertices += members.len() - 1;
        mesh.positions[members[0] as usize] = place;
        for &v in members {
            new_of_old[v as usize] = members[0];
        }
    }
    if joined.vertices == 0 {
        return joined;
    }
    let was_proper: Vec<bool> = mesh
        .faces
        .iter()
        .map(|f| repeated_corner(f).is_none())
        .collect();
    for v in mesh.faces.iter_mut().flatten() {
        *v = new_of_old[*v as usize];
    }
    let keeps: Vec<bool> = mesh
        .faces
        .iter()
        .zip(&was_proper)
        .map(|(f, &was_proper)| !was_proper || repeated_corner(f).is_none())
        .collect();
    joined.faces = keeps.iter().filter(|&&keep| !keep).count();
    if joined.faces > 0 {
        mesh.retain_faces(|f| keeps[f]);
        let mut keep = keeps.iter();
        face_of.retain(|_| keep.next().copied().unwrap_or(true));
    }
    compact(mesh, vertex_of, &new_of_old);
    joined
}

/// Takes vertices that became another one out of a mesh; no face uses them.
fn compact(mesh: &mut TriangleMesh, vertex_of: &mut Vec<u32>, became: &[u32]) {
    let kept: Vec<u32> = (0..became.len() as u32)
        .filter(|&v| became[v as usize] == v)
        .collect();
    let mut new_of_old = vec![ALONE; became.len()];
    for (new, &old) in (0..).zip(&kept) {
        new_of_old[old as usize] = new;
    }
    mesh.positions = kept.iter().map(|&v| mesh.positions[v as usize]).collect();
    *vertex_of = kept.iter().map(|&v| vertex_of[v as usize]).collect();
    for v in mesh.faces.iter_mut().flatten() {
        *v = new_of_old[*v as usize];
    }
}

/// Edges that one face has, in that face's direction.
fn open_edges(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<([u32; 2], bool)> = faces
        .iter()
        .filter(|f| repeated_corner(f).is_none())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[from, to]| ([from.min(to), from.max(to)], from < to))
        .collect();
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|uses| match *uses {
            [([low, high], true)] => Some([low, high]),
            [([low, high], false)] => Some([high, low]),
            _ => None,
        })
        .collect()
}

fn extent(places: impl Iterator<Item = DVec3>) -> f64 {
    let (low, high) = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    (high - low).length()
}

/// Orders places by the size of their coordinates, then by the coordinates.
fn simplest_first(a: DVec3, b: DVec3) -> std::cmp::Ordering {
    let key = |p: DVec3| [p.abs().to_array(), p.to_array()].concat();
    let (a, b) = (key(a), key(b));
    a.iter()
        .zip(&b)
        .map(|(x, y)| x.total_cmp(y))
        .find(|order| order.is_ne())
        .unwrap_or(std::cmp::Ordering::Equal)
}

/// Vertices of open edges by the place they may be.
struct Groups {
    /// Per group its vertices, the first one lowest; only groups of several that do not reach too far.
    members: Vec<Vec<u32>>,
    /// Group of every vertex of the mesh, or [`ALONE`].
    group_of: Vec<u32>,
}

const ALONE: u32 = u32::MAX;

/// A cell of space and what lies in it.
struct Cell {
    key: [i64; 3],
    low: DVec3,
    high: DVec3,
    /// Where its vertices begin among the sorted ones.
    first: usize,
}

impl Groups {
    fn of(positions: &[DVec3], candidates: &[u32], distance: f64) -> Self {
        let place = |v: u32| positions[v as usize];
        let low = candidates
            .iter()
            .fold(DVec3::INFINITY, |low, &v| low.min(place(v)));
        let key = |v: u32| {
            ((place(v) - low) / distance)
                .to_array()
                .map(|x| x.floor() as i64)
        };
        let mut sorted: Vec<([i64; 3], u32)> = candidates.iter().map(|&v| (key(v), v)).collect();
        sorted.sort_unstable();
        let mut cells: Vec<Cell> = Vec::new();
        let mut at = 0;
        for chunk in sorted.chunk_by(|a, b| a.0 == b.0) {
            let first = at;
            at += chunk.len();
            let places = chunk.iter().map(|&(_, v)| place(v));
            let (low, high) = places
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                    (low.min(p), high.max(p))
                });
            cells.push(Cell {
                key: chunk[0].0,
                low,
                high,
                first,
            });
        }
        let mut parent: Vec<u32> = (0..cells.len() as u32).collect();
        for (c, cell) in cells.iter().enumerate() {
            for step in forward_steps() {
                let key = [0, 1, 2].map(|i| cell.key[i].saturating_add(step[i]));
                let Ok(other) = cells.binary_search_by(|known| known.key.cmp(&key)) else {
                    continue;
                };
                let gap = (cells[other].low - cell.high)
                    .max(cell.low - cells[other].high)
                    .max(DVec3::ZERO);
                if gap.length() <= distance {
                    unite(&mut parent, c as u32, other as u32);
                }
            }
        }
        let mut by_root: Vec<(u32, u32)> = Vec::with_capacity(sorted.len());
        for (c, cell) in cells.iter().enumerate() {
            let root = find(&mut parent, c as u32);
            let end = cells.get(c + 1).map_or(sorted.len(), |next| next.first);
            by_root.extend(sorted[cell.first..end].iter().map(|&(_, v)| (root, v)));
        }
        by_root.sort_unstable();
        let mut groups = Self {
            members: Vec::new(),
            group_of: vec![ALONE; positions.len()],
        };
        for chunk in by_root.chunk_by(|a, b| a.0 == b.0).filter(|c| c.len() > 1) {
            if extent(chunk.iter().map(|&(_, v)| place(v))) > WIDEST_GROUP * distance {
                continue;
            }
            for &(_, v) in chunk {
                groups.group_of[v as usize] = groups.members.len() as u32;
            }
            groups.members.push(chunk.iter().map(|&(_, v)| v).collect());
        }
        groups
    }

    /// Per group, whether open edges meet in it.
    fn seams(&self, open: &[[u32; 2]]) -> Vec<bool> {
        let mut is_seam = vec![false; self.members.len()];
        // A group, or a vertex that is in none.
        let node = |v: u32| match self.group_of[v as usize] {
            ALONE => (1, v),
            group => (0, group),
        };
        let mut edges: Vec<([(u32, u32); 2], bool)> = Vec::with_capacity(open.len());
        for &[from, to] in open {
            let (from, to) = (node(from), node(to));
            if from == to {
                is_seam[from.1 as usize] = true;
            } else {
                edges.push(([from.min(to), from.max(to)], from < to));
            }
        }
        edges.sort_unstable();
        for uses in edges.chunk_by(|a, b| a.0 == b.0) {
            let runs_both_ways = uses.iter().any(|u| u.1) && uses.iter().any(|u| !u.1);
            for &(kind, group) in &uses[0].0 {
                if runs_both_ways && kind == 0 {
                    is_seam[group as usize] = true;
                }
            }
        }
        is_seam
    }
}

/// Steps to half of a cell's neighbours, such that each pair is seen once.
fn forward_steps() -> impl Iterator<Item = [i64; 3]> {
    (0..27)
        .map(|i| [i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1])
        .filter(|step| *step > [0; 3])
}

fn find(parent: &mut [u32], mut member: u32) -> u32 {
    while parent[member as usize] != member {
        let grandparent = parent[parent[member as usize] as usize];
        parent[member as usize] = grandparent;
        member = grandparent;
    }
    member
}

fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
