//! Even triangles on an implicit surface, to an exact face count: collapse short edges, flip, relax.
//!
//! The mesh is a halfedge table: halfedge h = 3·face + corner runs from its own vertex to the next corner's, and
//! `twin[h]` runs back along the same edge. Collapses obey the link condition, so the surface stays the manifold it was.
//!
//! Source: Botsch, Kobbelt. A Remeshing Approach to Multiresolution Modeling. SGP 2004, section 4 (collapse, flip,
//! tangential relaxation). Dey, Edelsbrunner, Guha, Nekhayev. Topology Preserving Edge Contraction. 1999 (link condition).
//! Deviations: shortest edge first until the count is reached, in place of an edge length; flips are Delaunay flips
//! in place of valence flips; vertices go back to the surface by Newton steps along the gradient.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::{CostQueue, TriangleMesh};

use super::polygonise::Field;

/// Passes of collapses, with flips between them that make more possible; one or two do unless the count asked for is
/// too low for the shape.
const MOST_PASSES: usize = 12;

/// Rounds of flips and relaxation after the collapses; more change the angles by less than a degree.
const ROUNDS: usize = 6;

/// Part of the way to its neighbours' middle that a vertex goes in a round.
const RELAXATION: f64 = 0.6;

/// Newton steps back to the surface after a collapse; a relaxation moves so little that one does.
const NEWTON_STEPS: usize = 2;

/// A face may turn by at most the angle of this cosine in one operation.
const LEAST_TURN_COSINE: f64 = 0.3;

/// A face's normal must keep this cosine with the surface's normal at a vertex that is placed: small turns that each
/// pass must not add up to a fold.
const LEAST_NORMAL_COSINE: f64 = 0.2;

/// Cosine of the angle under which faces of opposite sides of a flipped edge must stay coplanar: creases are not cut.
const FLIP_COSINE: f64 = 0.5;

const DEAD: u32 = u32::MAX;

/// The mesh with edges collapsed to at most `faces` faces (an odd count is rounded down) and its triangles made even.
///
/// Stops above `faces` when no edge can be collapsed without harm; a mesh that has fewer faces keeps its count.
pub(super) fn remesh(mesh: &TriangleMesh, field: &impl Field, faces: usize) -> TriangleMesh {
    let mut table = HalfedgeTable::new(mesh, field);
    let wanted = faces - faces % 2;
    let surface = Surface {
        field,
        step: 1e-4 * field.extent(),
        // No move is longer than about two edges: a wild gradient must not throw a vertex across the model.
        reach: 2.0 * (mean_face_area(mesh) * mesh.faces.len() as f64 / faces.max(1) as f64).sqrt(),
    };
    for _ in 0..MOST_PASSES {
        if table.live_faces <= wanted || table.collapse_short_edges(wanted, &surface) == 0 {
            break;
        }
        table.flip_edges();
    }
    for _ in 0..ROUNDS {
        table.flip_edges();
        table.relax(&surface);
    }
    table.into_mesh()
}

fn mean_face_area(mesh: &TriangleMesh) -> f64 {
    let twice: f64 = (0..mesh.faces.len())
        .map(|f| mesh.face_cross(f).length())
        .sum();
    0.5 * twice / mesh.faces.len().max(1) as f64
}

/// A field and how to walk to its zero set.
struct Surface<'a, F> {
    field: &'a F,
    /// Step of the differences that the gradient comes from, model units.
    step: f64,
    /// Longest way of one projection, model units.
    reach: f64,
}

impl<F: Field> Surface<'_, F> {
    /// The surface's point near `start`, and its unit normal there.
    fn project(&self, start: DVec3, steps: usize) -> (DVec3, DVec3) {
        let mut p = start;
        let mut gradient = DVec3::ZERO;
        for _ in 0..steps {
            gradient = self.field.gradient(p, self.step);
            let squared = gradient.length_squared();
            if squared > 0.0 {
                p -= (gradient * (self.field.value(p) / squared)).clamp_length_max(self.reach);
            }
        }
        let normal = gradient.normalize_or_zero();
        if p.distance(start) <= self.reach {
            (p, normal)
        } else {
            (start, normal)
        }
    }
}

struct HalfedgeTable {
    positions: Vec<DVec3>,
    /// Per vertex: [`Field::fineness`] there.
    fineness: Vec<f64>,
    /// Per halfedge: the vertex it leaves; `DEAD` for halfedges of removed faces.
    vertex: Vec<u32>,
    twin: Vec<u32>,
    /// Per vertex: one halfedge that leaves it; `DEAD` for removed vertices.
    leaving: Vec<u32>,
    live_faces: usize,
}

fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

fn cross_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Whether a triangle keeps its direction within [`LEAST_TURN_COSINE`] when it becomes another.
fn keeps_direction(before: [DVec3; 3], after: [DVec3; 3]) -> bool {
    let (n, m) = (cross_of(before), cross_of(after));
    n.dot(m) > LEAST_TURN_COSINE * n.length() * m.length()
}

/// Whether a triangle faces along a unit normal within [`LEAST_NORMAL_COSINE`].
fn faces_along(triangle: [DVec3; 3], normal: DVec3) -> bool {
    let cross = cross_of(triangle);
    cross.dot(normal) > LEAST_NORMAL_COSINE * cross.length()
}

impl HalfedgeTable {
    fn new(mesh: &TriangleMesh, field: &impl Field) -> Self {
        let vertex: Vec<u32> = mesh.faces.iter().flatten().copied().collect();
        let mut table = Self {
            positions: mesh.positions.clone(),
            fineness: mesh
                .positions
                .par_iter()
                .map(|&p| field.fineness(p))
                .collect(),
            twin: vec![DEAD; vertex.len()],
            leaving: vec![DEAD; mesh.positions.len()],
            live_faces: mesh.faces.len(),
            vertex,
        };
        let mut edges: Vec<(u32, u32, u32)> = (0..table.vertex.len() as u32)
            .map(|h| {
                let (a, b) = (table.vertex[h as usize], table.head(h));
                (a.min(b), a.max(b), h)
            })
            .collect();
        edges.par_sort_unstable();
        for pair in edges.chunks_exact(2) {
            assert!(
                (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1),
                "each edge of a closed mesh has two faces"
            );
            table.twin[pair[0].2 as usize] = pair[1].2;
            table.twin[pair[1].2 as usize] = pair[0].2;
        }
        for h in 0..table.vertex.len() as u32 {
            let tail = table.tail(h);
            table.leaving[tail as usize] = h;
        }
        table
    }

    fn tail(&self, h: u32) -> u32 {
        self.vertex[h as usize]
    }

    fn head(&self, h: u32) -> u32 {
        self.vertex[next(h) as usize]
    }

    fn at(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    fn is_live(&self, h: u32) -> bool {
        self.vertex[h as usize] != DEAD
    }

    fn face_points(&self, h: u32) -> [DVec3; 3] {
        [h, next(h), previous(h)].map(|k| self.at(self.tail(k)))
    }

    /// The halfedges that leave the same vertex as `start`, clockwise, `start` first.
    fn around(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        let mut h = Some(start);
        std::iter::from_fn(move || {
            let current = h?;
            let following = next(self.twin[current as usize]);
            h = (following != start).then_some(following);
            Some(current)
        })
    }

    /// Squared length in units of the fineness wanted.
    fn cost(&self, h: u32) -> f64 {
        let fineness =
            0.5 * (self.fineness[self.tail(h) as usize] + self.fineness[self.head(h) as usize]);
        self.length_squared(h) / (fineness * fineness)
    }

    fn length_squared(&self, h: u32) -> f64 {
        self.at(self.tail(h))
            .distance_squared(self.at(self.head(h)))
    }

    /// Collapses edges, shortest first, until `wanted` faces are left or every edge has been tried; how many.
    fn collapse_short_edges<F: Field>(&mut self, wanted: usize, surface: &Surface<'_, F>) -> usize {
        let mut queue: CostQueue<u32> = (0..self.vertex.len() as u32)
            .filter(|&h| self.is_live(h) && h < self.twin[h as usize])
            .map(|h| (self.cost(h), h))
            .collect();
        let mut collapsed = 0;
        while self.live_faces > wanted {
            let Some((cost, h)) = queue.pop() else {
                break;
            };
            if !self.is_live(h) || self.cost(h) != cost {
                continue;
            }
            let (from, to) = (self.tail(h), self.head(h));
            let (middle, normal) =
                surface.project(0.5 * (self.at(from) + self.at(to)), NEWTON_STEPS);
            if !self.can_collapse(h, middle, normal) {
                continue;
            }
            let start = self.collapse(h, middle);
            collapsed += 1;
            for k in self.around(start) {
                let edge = k.min(self.twin[k as usize]);
                queue.push(self.cost(edge), edge);
            }
        }
        collapsed
    }

    /// The link condition, and that no face that stays turns over when the edge becomes the point `middle`, where
    /// the surface has the given normal.
    fn can_collapse(&self, h: u32, middle: DVec3, normal: DVec3) -> bool {
        let t = self.twin[h as usize];
        let opposite = [h, t].map(|k| self.tail(previous(k)));
        let valence = |v: u32| self.around(self.leaving[v as usize]).count();
        if opposite[0] == opposite[1] || opposite.into_iter().any(|v| valence(v) <= 3) {
            return false;
        }
        let around_to: Vec<u32> = self.around(t).map(|k| self.head(k)).collect();
        let common = self
            .around(h)
            .filter(|&k| around_to.contains(&self.head(k)))
            .count();
        if common != 2 {
            return false;
        }
        let doomed = [h / 3, t / 3];
        self.around(h).chain(self.around(t)).all(|k| {
            let before = self.face_points(k);
            let after = [middle, before[1], before[2]];
            doomed.contains(&(k / 3))
                || (keeps_direction(before, after) && faces_along(after, normal))
        })
    }

    /// Makes the edge one vertex at `middle`; returns a halfedge that leaves it.
    fn collapse(&mut self, h: u32, middle: DVec3) -> u32 {
        let t = self.twin[h as usize];
        let (from, to) = (self.tail(h), self.head(h));
        let moved: Vec<u32> = self.around(h).collect();
        for k in moved {
            self.vertex[k as usize] = to;
        }
        for doomed in [h, t] {
            let (after, before) = (next(doomed), previous(doomed));
            let (outer, inner) = (self.twin[after as usize], self.twin[before as usize]);
            self.twin[outer as usize] = inner;
            self.twin[inner as usize] = outer;
            let apex = self.tail(before);
            self.leaving[apex as usize] = outer;
            self.leaving[to as usize] = inner;
            for k in [doomed, after, before] {
                self.vertex[k as usize] = DEAD;
            }
        }
        self.positions[to as usize] = middle;
        self.leaving[from as usize] = DEAD;
        self.live_faces -= 2;
        self.leaving[to as usize]
    }

    /// One pass of Delaunay flips over all edges, in order.
    fn flip_edges(&mut self) {
        for h in 0..self.vertex.len() as u32 {
            if self.is_live(h) && h < self.twin[h as usize] && self.should_flip(h) {
                self.flip(h);
            }
        }
    }

    fn should_flip(&self, h: u32) -> bool {
        let t = self.twin[h as usize];
        let [a, b] = [self.tail(h), self.head(h)];
        let [c, d] = [self.tail(previous(h)), self.tail(previous(t))];
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.at(v));
        let angle = |apex: DVec3| (pa - apex).angle_between(pb - apex);
        // The small excess keeps cocircular pairs from flipping back and forth.
        if angle(pc) + angle(pd) <= std::f64::consts::PI + 1e-6 {
            return false;
        }
        let valence = |v: u32| self.around(self.leaving[v as usize]).count();
        if valence(a) <= 3 || valence(b) <= 3 {
            return false;
        }
        let adjacent = self
            .around(self.leaving[c as usize])
            .any(|k| self.head(k) == d);
        let old = [cross_of([pa, pb, pc]), cross_of([pb, pa, pd])];
        let new = [cross_of([pc, pd, pb]), cross_of([pd, pc, pa])];
        let coplanar = |n: DVec3, m: DVec3| n.dot(m) > FLIP_COSINE * n.length() * m.length();
        !adjacent
            && coplanar(new[0], new[1])
            && old.iter().all(|&o| new.iter().all(|&n| coplanar(o, n)))
    }

    /// Replaces the edge a→b of the faces (a, b, c) and (b, a, d) by c→d: (c, d, b) and (d, c, a).
    fn flip(&mut self, h: u32) {
        let t = self.twin[h as usize];
        let [bc, ca, ad, db] = [next(h), previous(h), next(t), previous(t)];
        let [a, b, c, d] = [self.tail(h), self.head(h), self.tail(ca), self.tail(db)];
        let [bc_twin, ca_twin, ad_twin, db_twin] = [bc, ca, ad, db].map(|k| self.twin[k as usize]);
        let place = |k: u32, from: u32, twin: u32, table: &mut Self| {
            table.vertex[k as usize] = from;
            table.twin[k as usize] = twin;
            table.twin[twin as usize] = k;
            table.leaving[from as usize] = k;
        };
        place(h, c, t, self);
        place(bc, d, db_twin, self);
        place(ca, b, bc_twin, self);
        place(t, d, h, self);
        place(ad, c, ca_twin, self);
        place(db, a, ad_twin, self);
    }

    /// Moves every vertex along its tangent plane towards its neighbours' middle, and back to the surface.
    fn relax<F: Field>(&mut self, surface: &Surface<'_, F>) {
        let moved: Vec<DVec3> = (0..self.positions.len())
            .into_par_iter()
            .map(|v| self.relaxed(v, surface))
            .collect();
        self.positions = moved;
    }

    fn relaxed<F: Field>(&self, v: usize, surface: &Surface<'_, F>) -> DVec3 {
        let p = self.positions[v];
        if self.leaving[v] == DEAD {
            return p;
        }
        let (mut middle, mut area, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for k in self.around(self.leaving[v]) {
            // Weighted by the faces' areas, so that dense sides draw less.
            let face = self.face_points(k);
            let cross = cross_of(face);
            middle += (face[0] + face[1] + face[2]) / 3.0 * cross.length();
            area += cross.length();
            normal += cross;
        }
        let normal = normal.normalize_or_zero();
        let step = (middle / area - p) * RELAXATION;
        // Where the whole step would fold a face, back to the surface is still worth having.
        [step - normal * step.dot(normal), DVec3::ZERO]
            .into_iter()
            .map(|way| surface.project(p + way, 1))
            .find(|&(target, surface_normal)| {
                self.around(self.leaving[v]).all(|k| {
                    let before = self.face_points(k);
                    let after = [target, before[1], before[2]];
                    // A face that is folded already must not keep its corners from moving.
                    faces_along(after, surface_normal) || !faces_along(before, surface_normal)
                })
            })
            .map_or(p, |(target, _)| target)
    }

    fn into_mesh(self) -> TriangleMesh {
        let mut renumbered = vec![DEAD; self.positions.len()];
        let mut mesh = TriangleMesh::default();
        for face in self.vertex.chunks_exact(3).filter(|f| f[0] != DEAD) {
            let corners = [face[0], face[1], face[2]].map(|v| {
                let slot = &mut renumbered[v as usize];
                if *slot == DEAD {
                    *slot = mesh.positions.len() as u32;
                    mesh.positions.push(self.positions[v as usize]);
                }
                *slot
            });
            mesh.faces.push(corners);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::gradient_noise;
    use crate::polygonise::polygonise;

    struct Ball;

    impl Field for Ball {
        fn value(&self, point: DVec3) -> f64 {
            point.length() - 1.0
        }
        fn extent(&self) -> f64 {
            1.2
        }
        fn slope_bound(&self) -> f64 {
            1.0
        }
    }

    /// Noise in a box: many pieces, tunnels and thin necks.
    struct Foam;

    impl Field for Foam {
        fn value(&self, point: DVec3) -> f64 {
            let wall = point.abs().max_element() - 0.9;
            wall.max(0.2 * gradient_noise(point * 3.0 + 0.37))
        }
        fn extent(&self) -> f64 {
            1.0
        }
        fn slope_bound(&self) -> f64 {
            3.0
        }
    }

    fn directed_edges(mesh: &TriangleMesh) -> Vec<(u32, u32)> {
        let mut edges: Vec<_> = mesh
            .faces
            .iter()
            .flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])])
            .collect();
        edges.sort_unstable();
        edges
    }

    fn is_closed(mesh: &TriangleMesh) -> bool {
        let edges = directed_edges(mesh);
        edges.windows(2).all(|p| p[0] != p[1])
            && edges
                .iter()
                .all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
    }

    fn characteristic(mesh: &TriangleMesh) -> i64 {
        mesh.positions.len() as i64 - mesh.faces.len() as i64 / 2
    }

    #[test]
    fn ball_is_even_exact_and_on_the_surface() {
        let fine = polygonise(&Ball, 24);
        for faces in [100, 501, 2_000] {
            let mesh = remesh(&fine, &Ball, faces);
            assert_eq!(mesh.faces.len(), faces - faces % 2);
            assert!(is_closed(&mesh));
            assert_eq!(characteristic(&mesh), 2);
            let worst = mesh
                .positions
                .iter()
                .map(|p| (p.length() - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-6, "{worst} from the surface");
            let smallest = (0..mesh.faces.len())
                .flat_map(|f| {
                    let c = mesh.corners(f);
                    [0, 1, 2].map(|k| (c[(k + 1) % 3] - c[k]).angle_between(c[(k + 2) % 3] - c[k]))
                })
                .fold(f64::INFINITY, f64::min);
            assert!(
                smallest.to_degrees() > 20.0,
                "{} degrees",
                smallest.to_degrees()
            );
            let outward =
                (0..mesh.faces.len()).all(|f| mesh.face_cross(f).dot(mesh.corners(f)[0]) > 0.0);
            assert!(outward);
        }
    }

    #[test]
    fn foam_keeps_its_topology() {
        let fine = polygonise(&Foam, 32);
        assert!(is_closed(&fine));
        let before = characteristic(&fine);
        assert!(before != 2, "the field must not be a mere ball");
        let coarse = remesh(&fine, &Foam, fine.faces.len() / 2);
        assert!(coarse.faces.len() < fine.faces.len() * 2 / 3);
        assert!(is_closed(&coarse));
        assert_eq!(characteristic(&coarse), before);
        let mut torn = coarse;
        torn.faces.truncate(torn.faces.len() - 1);
        assert!(!is_closed(&torn));
    }
}
