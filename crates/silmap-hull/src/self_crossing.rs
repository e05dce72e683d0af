//! Whether a collapse would let the hull pass through itself.
//!
//! A tree of boxes over the faces is kept up to date while they change: its shape is that of the model's faces, which stay close
//! to where they were, and a face that changes only widens or narrows the boxes above it.
//!
//! Source: beyond the papers, whose hulls may cross themselves. Limits: faces that lie in one plane, and faces that only touch, do
//! not cross; where the model itself does, it stays as it is.

use glam::DVec3;
use silmap_geometry::predicates::triangles_cross;
use silmap_geometry::{Bvh, TriangleMesh};

use super::surface::Surface;

/// Cells of the curve along which faces are sorted, on each axis.
const CURVE_CELLS: f64 = (1 << 20) as f64;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NOTHING: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    fn of([a, b, c]: [DVec3; 3]) -> Self {
        Self {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// Boxes around the faces of a surface that changes.
#[derive(Clone, Debug)]
pub(super) struct FaceTree {
    /// A complete binary tree: below place i are places 2i and 2i + 1.
    boxes: Vec<Bounds>,
    /// Per leaf: its face.
    faces: Vec<u32>,
    /// Per face: its leaf.
    leaves: Vec<u32>,
    /// Scratch of the question: places to look at, the new faces, and those that they replace.
    open: Vec<u32>,
    fan: Vec<[DVec3; 3]>,
    replaced: Vec<u32>,
}

impl FaceTree {
    /// Takes in all faces that are there.
    pub(super) fn new(surface: &Surface) -> Self {
        let n = surface.origin.len() / 3;
        let bounds: Vec<Bounds> = (0..n as u32)
            .map(|face| match surface.is_gone(face * 3) {
                true => Bounds::NOTHING,
                false => Bounds::of(surface.corners(face).map(|v| surface.position(v))),
            })
            .collect();
        let all = bounds.iter().fold(Bounds::NOTHING, |a, b| a.union(*b));
        let scale = CURVE_CELLS / (all.high - all.low).max_element().max(f64::MIN_POSITIVE);
        let mut faces: Vec<u32> = (0..n as u32).collect();
        faces.sort_by_cached_key(|&face| {
            let Bounds { low, high } = bounds[face as usize];
            let middle = (low.midpoint(high) - all.low) * scale;
            (along_curve(middle), face)
        });
        let size = n.next_power_of_two();
        let mut boxes = vec![Bounds::NOTHING; 2 * size];
        let mut leaves = vec![0; n];
        for (place, &face) in faces.iter().enumerate() {
            boxes[size + place] = bounds[face as usize];
            leaves[face as usize] = (size + place) as u32;
        }
        for place in (1..size).rev() {
            boxes[place] = boxes[2 * place].union(boxes[2 * place + 1]);
        }
        Self {
            boxes,
            faces,
            leaves,
            open: Vec::new(),
            fan: Vec::new(),
            replaced: Vec::new(),
        }
    }

    /// Takes in what became of a face.
    pub(super) fn update(&mut self, surface: &Surface, face: u32) {
        let mut place = self.leaves[face as usize] as usize;
        let mut bounds = match surface.is_gone(face * 3) {
            true => Bounds::NOTHING,
            false => Bounds::of(surface.corners(face).map(|v| surface.position(v))),
        };
        while place > 0 && self.boxes[place] != bounds {
            self.boxes[place] = bounds;
            bounds = self.boxes[place & !1].union(self.boxes[place | 1]);
            place /= 2;
        }
    }

    /// Takes in faces that are gone, and those around a vertex that moved.
    pub(super) fn update_around<const N: usize>(
        &mut self,
        surface: &Surface,
        kept: u32,
        gone: [u32; N],
    ) {
        for face in gone {
            self.update(surface, face);
        }
        for spoke in surface.leaving(kept) {
            self.update(surface, spoke / 3);
        }
    }

    /// Whether the faces from the ring around the edge of `h` to `position` would cross one another or other faces.
    pub(super) fn would_cross(&mut self, surface: &Surface, h: u32, position: DVec3) -> bool {
        let twin = surface.twin(h);
        let faces = surface.ring(h).chain([h, twin]).map(|h| h / 3);
        self.replaced.clear();
        self.replaced.extend(faces);
        let ring = surface.ring(h);
        self.fan.clear();
        self.fan.extend(ring.map(|h| {
            let [from, to] = [surface.start(h), surface.end(h)].map(|v| surface.position(v));
            [from, to, position]
        }));
        self.does_fan_cross(surface)
    }

    /// Whether the faces around `vertex` would, with that vertex at `position`.
    pub(super) fn would_cross_moved(
        &mut self,
        surface: &Surface,
        vertex: u32,
        position: DVec3,
    ) -> bool {
        self.replaced.clear();
        self.replaced.extend(surface.leaving(vertex).map(|h| h / 3));
        self.fan.clear();
        self.fan.extend(self.replaced.iter().map(|&face| {
            surface.corners(face).map(|v| match v == vertex {
                true => position,
                false => surface.position(v),
            })
        }));
        self.does_fan_cross(surface)
    }

    fn does_fan_cross(&mut self, surface: &Surface) -> bool {
        let fan = std::mem::take(&mut self.fan);
        let do_cross_each_other = (fan.iter().enumerate())
            .any(|(k, one)| fan[k + 1..].iter().any(|two| triangles_cross(*one, *two)));
        let is_crossed = do_cross_each_other || fan.iter().any(|face| self.crosses(surface, *face));
        self.fan = fan;
        is_crossed
    }

    /// Whether a triangle crosses a face that is not about to be replaced.
    fn crosses(&mut self, surface: &Surface, triangle: [DVec3; 3]) -> bool {
        let bounds = Bounds::of(triangle);
        let first_leaf = self.boxes.len() / 2;
        self.open.clear();
        self.open.push(1);
        while let Some(place) = self.open.pop() {
            let place = place as usize;
            if !self.boxes[place].meets(&bounds) {
                continue;
            }
            if place < first_leaf {
                self.open.extend([2 * place as u32, 2 * place as u32 + 1]);
                continue;
            }
            let face = self.faces[place - first_leaf];
            let corners = || surface.corners(face).map(|v| surface.position(v));
            if !self.replaced.contains(&face) && triangles_cross(triangle, corners()) {
                return true;
            }
        }
        false
    }
}

/// Place on a curve through all cells on which neighbours in space are mostly neighbours.
///
/// Source: G. M. Morton. A Computer Oriented Geodetic Data Base and a New Technique in File Sequencing. 1966.
fn along_curve(p: DVec3) -> u64 {
    let spread = |value: f64| {
        let cell = value.clamp(0.0, CURVE_CELLS - 1.0) as u64;
        (0..20).fold(0, |bits, k| bits | ((cell >> k & 1) << (3 * k)))
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

/// How many pairs of a mesh's faces pass through one another. Faces that only touch, or lie in one plane, do not.
#[must_use]
pub fn count_self_crossings(mesh: &TriangleMesh) -> u32 {
    let tree = Bvh::new(mesh);
    let mut count = 0;
    for face in 0..mesh.faces.len() {
        let corners = mesh.corners(face);
        let Bounds { low, high } = Bounds::of(corners);
        tree.faces_near_hull((low, high), &corners, |other| {
            let is_later = other as usize > face;
            if is_later && triangles_cross(corners, mesh.corners(other as usize)) {
                count += 1;
            }
        });
    }
    count
}

#[cfg(test)]
mod tests {
    use super::super::{HullParams, Tightening, VerifyParams, build, verify};
    use super::*;
    use silmap_geometry::ClosedMesh;
    use silmap_geometry::Watch;
    use silmap_models as models;

    /// Two rings, one on top of the other, so close that coarse hulls of each reach into the other.
    fn stack() -> TriangleMesh {
        let mut all = models::torus(1200);
        let (low, high) = (all.positions.iter())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |b, p| {
                (b.0.min(p.z), b.1.max(p.z))
            });
        let (count, step) = (all.positions.len() as u32, 1.02 * (high - low));
        let above: Vec<DVec3> = all.positions.iter().map(|&p| p + DVec3::Z * step).collect();
        let faces: Vec<[u32; 3]> = all.faces.iter().map(|f| f.map(|v| v + count)).collect();
        all.positions.extend(above);
        all.faces.extend(faces);
        all
    }

    /// The same by looking at every pair.
    fn count_slowly(mesh: &TriangleMesh) -> u32 {
        let pairs = (0..mesh.faces.len()).flat_map(|f| (0..f).map(move |g| (f, g)));
        pairs
            .filter(|&(f, g)| triangles_cross(mesh.corners(f), mesh.corners(g)))
            .count() as u32
    }

    #[test]
    fn hulls_pass_through_themselves_only_where_they_may() {
        let mesh = ClosedMesh::try_from(stack()).unwrap();
        assert_eq!(count_self_crossings(mesh.mesh()), 0);
        for no_self_intersections in [false, true] {
            let params = HullParams {
                target_faces: 120,
                no_self_intersections,
                ..HullParams::default()
            };
            let hull = build(&mesh, &params, &Watch::silent()).unwrap();
            assert!(hull.least_faces() <= 160, "{}", hull.least_faces());
            let mut crossings = Vec::new();
            for faces in [1200, 600, 300, hull.least_faces()] {
                for how in [Tightening::Off, Tightening::Best] {
                    let level = hull.tightened_level(faces, how, &Watch::silent());
                    let level = level.unwrap().mesh;
                    let found = count_self_crossings(&level);
                    assert_eq!(found, count_slowly(&level));
                    let report = verify(mesh.mesh(), &level, &VerifyParams::default());
                    assert!(report.encloses, "at {faces} faces: {report:?}");
                    crossings.push(found);
                }
            }
            let is_clear = crossings.iter().all(|&n| n == 0);
            assert_eq!(is_clear, no_self_intersections, "{crossings:?}");
        }
    }

    #[test]
    fn the_tree_finds_what_looking_at_every_face_finds() {
        let mesh = stack();
        let mut surface = Surface::new(mesh.positions.clone(), &mesh.faces);
        let mut tree = FaceTree::new(&surface);
        let mut moved = Vec::new();
        let mut answers = [0; 2];
        for h in (0..surface.origin.len() as u32).step_by(7) {
            if surface.is_gone(h) || !surface.can_contract(h) {
                continue;
            }
            let ends = [surface.start(h), surface.end(h)].map(|v| surface.position(v));
            let middle = ends[0].midpoint(ends[1]);
            for position in [middle, middle * 1.2, middle + DVec3::Z * 0.3, -middle] {
                let ring: Vec<u32> = surface.ring(h).collect();
                let old: Vec<u32> = (ring.iter().copied())
                    .chain([h, surface.twin(h)])
                    .map(|h| h / 3)
                    .collect();
                let mut changed = TriangleMesh {
                    positions: surface.positions.clone(),
                    ..TriangleMesh::default()
                };
                changed.positions.push(position);
                let added = changed.positions.len() as u32 - 1;
                let fan = ring
                    .iter()
                    .map(|&h| [surface.start(h), surface.end(h), added]);
                changed.faces.extend(fan);
                let n_fan = changed.faces.len();
                changed.faces.extend(
                    (0..surface.origin.len() as u32 / 3)
                        .filter(|face| !surface.is_gone(face * 3) && !old.contains(face))
                        .map(|face| surface.corners(face)),
                );
                let expected = (0..n_fan).any(|f| {
                    (f + 1..changed.faces.len())
                        .any(|g| triangles_cross(changed.corners(f), changed.corners(g)))
                });
                assert_eq!(tree.would_cross(&surface, h, position), expected);
                answers[usize::from(expected)] += 1;
            }
            let contraction = surface.contract(h, middle, &mut moved);
            tree.update_around(&surface, contraction.kept, contraction.faces.map(|f| f.0));
        }
        assert!(answers.iter().all(|&n| n > 20), "{answers:?}");
    }
}
