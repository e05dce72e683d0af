//! What of a solid lies in a half-space, closed where it is cut.
//!
//! Faces are clipped one by one; along the cut they leave closed polygons, which are filled. Where a surface passes through itself these may
//! cross, and cannot be filled: such a solid is not cut there.

use std::collections::{BTreeMap, HashMap};

use earcut::Earcut;
use glam::{DVec2, DVec3};
use silmap_geometry::TriangleMesh;
use silmap_geometry::polygon::signed_area;

use super::HalfSpace;

/// What is filled may differ from what the polygons bound by this share.
const FILLED_REL: f64 = 1e-6;

/// The part of `solid` in a half-space; `None` where it cannot be closed.
pub(super) fn clip(solid: &TriangleMesh, half: &HalfSpace) -> Option<TriangleMesh> {
    let beyond: Vec<f64> = solid.positions.iter().map(|&p| half.beyond(p)).collect();
    let mut cut = Cut {
        solid,
        beyond: &beyond,
        positions: Vec::new(),
        number: HashMap::new(),
    };
    let mut faces = Vec::new();
    // Along the cut, from one vertex to the next, as faces that close it must not go.
    let mut borders: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for face in &solid.faces {
        let mut polygon = [0_u32; 4];
        let mut n = 0;
        let (mut leaves, mut enters) = (None, None);
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let is_in = |v: u32| beyond[v as usize] < 0.0;
            if is_in(a) {
                polygon[n] = cut.vertex(a);
                n += 1;
            }
            if is_in(a) != is_in(b) {
                let crossing = cut.crossing(a, b);
                polygon[n] = crossing;
                n += 1;
                let end = if is_in(a) { &mut leaves } else { &mut enters };
                *end = Some(crossing);
            }
        }
        if n >= 3 {
            faces.push([polygon[0], polygon[1], polygon[2]]);
        }
        if n == 4 {
            faces.push([polygon[0], polygon[2], polygon[3]]);
        }
        if let (Some(from), Some(to)) = (leaves, enters)
            && from != to
        {
            borders.entry(from).or_default().push(to);
        }
    }
    let positions = cut.positions;
    let loops = chained(borders)?;
    fill(&loops, &positions, half.normal, &mut faces)?;
    Some(TriangleMesh {
        positions,
        faces,
        ..TriangleMesh::default()
    })
}

/// The vertices of what is left.
struct Cut<'a> {
    solid: &'a TriangleMesh,
    beyond: &'a [f64],
    positions: Vec<DVec3>,
    /// Of vertices of the solid, which stand twice, and of crossings of its edges.
    number: HashMap<(u32, u32), u32>,
}

impl Cut<'_> {
    fn vertex(&mut self, v: u32) -> u32 {
        let place = self.solid.positions[v as usize];
        self.add((v, v), place)
    }

    /// Where an edge crosses the plane.
    fn crossing(&mut self, a: u32, b: u32) -> u32 {
        // The same from both of its faces.
        let (a, b) = (a.min(b), a.max(b));
        let (s, t) = (self.beyond[a as usize], self.beyond[b as usize]);
        let [p, q] = [a, b].map(|v| self.solid.positions[v as usize]);
        let share = if s == t { 0.5 } else { s / (s - t) };
        self.add((a, b), p + (q - p) * share)
    }

    fn add(&mut self, key: (u32, u32), place: DVec3) -> u32 {
        let fresh = self.positions.len() as u32;
        let number = *self.number.entry(key).or_insert(fresh);
        if number == fresh {
            self.positions.push(place);
        }
        number
    }
}

/// Closed polygons of borders; `None` where one does not close.
fn chained(mut borders: BTreeMap<u32, Vec<u32>>) -> Option<Vec<Vec<u32>>> {
    let mut loops = Vec::new();
    while let Some((&start, _)) = borders.first_key_value() {
        let mut chain = vec![start];
        let mut at = start;
        loop {
            let ends = borders.get_mut(&at)?;
            let next = ends.pop()?;
            if ends.is_empty() {
                borders.remove(&at);
            }
            if next == start {
                break;
            }
            chain.push(next);
            at = next;
        }
        loops.push(chain);
    }
    Some(loops)
}

/// Appends faces that fill what loops in a plane bound, looking along its normal; `None` where that is not what they bound.
fn fill(
    loops: &[Vec<u32>],
    positions: &[DVec3],
    normal: DVec3,
    faces: &mut Vec<[u32; 3]>,
) -> Option<()> {
    let across = normal.any_orthonormal_vector();
    let up = normal.cross(across);
    let flat = |v: u32| {
        let p = positions[v as usize];
        DVec2::new(p.dot(across), p.dot(up))
    };
    // Faces that close run along borders the other way than these do, so that the loops around them are right-handed.
    let flattened: Vec<(Vec<u32>, Vec<DVec2>, f64)> = loops
        .iter()
        .map(|l| {
            let turned: Vec<u32> = l.iter().rev().copied().collect();
            let points: Vec<DVec2> = turned.iter().map(|&v| flat(v)).collect();
            let area = signed_area(&points);
            (turned, points, area)
        })
        .collect();
    let mut earcut = Earcut::new();
    let mut triangles: Vec<u32> = Vec::new();
    let (mut filled, mut bound, mut whole) = (0.0, 0.0, 0.0);
    for (_, _, area) in &flattened {
        bound += area;
        whole += area.abs();
    }
    for (k, (around, points, area)) in flattened.iter().enumerate() {
        if *area <= 0.0 {
            continue;
        }
        let mut vertices = around.clone();
        let mut places: Vec<[f64; 2]> = points.iter().map(|p| p.to_array()).collect();
        let mut hole_starts: Vec<u32> = Vec::new();
        for (hole, (inner, inner_points, hole_area)) in flattened.iter().enumerate() {
            let is_hole = *hole_area < 0.0 && home_of(hole, &flattened) == Some(k);
            if is_hole {
                hole_starts.push(vertices.len() as u32);
                vertices.extend(inner);
                places.extend(inner_points.iter().map(|p| p.to_array()));
            }
        }
        triangles.clear();
        earcut.earcut(places.iter().copied(), &hole_starts, &mut triangles);
        let corner = |i: u32| vertices[i as usize];
        for t in triangles.chunks_exact(3) {
            let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
            let double_area = (flat(b) - flat(a)).perp_dot(flat(c) - flat(a));
            filled += 0.5 * double_area.abs();
            // The library may give either turn.
            faces.push(if double_area >= 0.0 {
                [a, b, c]
            } else {
                [a, c, b]
            });
        }
    }
    // Loops that cross, or lie in none, leave too much or too little.
    ((filled - bound).abs() <= FILLED_REL * whole).then_some(())
}

/// The smallest outer loop around a hole.
fn home_of(hole: usize, loops: &[(Vec<u32>, Vec<DVec2>, f64)]) -> Option<usize> {
    let p = loops[hole].1[0];
    let around = |k: &usize| loops[*k].2 > 0.0 && holds(&loops[*k].1, p);
    (0..loops.len())
        .filter(around)
        .min_by(|&a, &b| loops[a].2.total_cmp(&loops[b].2))
}

/// Whether a polygon holds a point, by the crossings of a ray.
fn holds(polygon: &[DVec2], p: DVec2) -> bool {
    let mut is_in = false;
    for (k, &b) in polygon.iter().enumerate() {
        let a = polygon[(k + polygon.len() - 1) % polygon.len()];
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
            is_in = !is_in;
        }
    }
    is_in
}
