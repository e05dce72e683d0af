//! Checks that a hull encloses a mesh, from the two meshes alone, whatever made them.
//!
//! A point of the mesh has escaped when the hull winds around it less often than the mesh itself does on the inner side of its surface.
//! Of an inner hull a point has escaped when the model does not wind around it at all, however the hull itself does: its
//! folds belong inside as well.
//!
//! Looked at are: every vertex of the mesh; the middle of every triangle with all corners on the hull; for every triangle of the mesh
//! and every triangle of the hull that cross, the corners of the one, and below the corners and the middles of the sides of
//! the other, as far as these are on the outer side; and random points of the mesh, evenly by area, by default 20,000. Crossings
//! alone prove nothing, as a hull may pass through itself, and there through the mesh as well.
//!
//! What that proves: a triangle that nothing crosses is as a whole where its corners are, or its middle where all of them lie on the hull;
//! there the answer rests on exact signs alone. A triangle that is crossed is sampled. What is outside between the looked-at points of
//! it may be missed: random points on a surface of area A are about √(A / 20,000) apart, 0.025 of the radius on a
//! sphere, and a crossing adds up to nine points near it.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::predicates::{side_of_plane, triangles_cross};
use silmap_geometry::{Bvh, TriangleMesh};

/// How to look.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyParams {
    /// How far a point may lie outside and still count as on the hull, in radii of the mesh's bounding sphere.
    ///
    /// Default 1e-6: what rounding to single precision may cost.
    pub tolerance_rel: f64,
    /// Random points on the mesh.
    pub samples: u32,
}

impl Default for VerifyParams {
    fn default() -> Self {
        Self {
            tolerance_rel: 1e-6,
            samples: 20_000,
        }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyReport {
    /// Whether nothing of the mesh is further outside than the tolerance.
    pub encloses: bool,
    /// Largest distance of a looked-at point of the mesh from the hull, among those outside it; in the model's units.
    pub escaped_distance: f64,
    /// The same in radii of the mesh's bounding sphere.
    pub escaped_rel: f64,
    /// Vertices of the mesh that lie outside by more than the tolerance.
    pub vertices_outside: u32,
    /// Pairs of a triangle of the mesh and one of the hull that pass through one another.
    pub crossing_pairs: u32,
    /// Those of them where the mesh is outside by more than the tolerance.
    pub leaking_pairs: u32,
    /// Random points of the mesh, and middles of faces with all corners on the hull, that lie outside by more than the tolerance.
    pub samples_outside: u32,
}

/// Looks whether `hull` encloses `mesh`; both are closed and oriented. For an inner hull there is [`verify_inner`].
#[must_use]
pub fn verify(mesh: &TriangleMesh, hull: &TriangleMesh, params: &VerifyParams) -> VerifyReport {
    look(mesh, hull, i32::MIN, params)
}

/// Looks whether all of the surface of an inner hull is inside `model`, whatever the hull itself winds around; both are closed and
/// oriented. In the report, the hull is the mesh.
#[must_use]
pub fn verify_inner(
    hull: &TriangleMesh,
    model: &TriangleMesh,
    params: &VerifyParams,
) -> VerifyReport {
    look(hull, model, 1, params)
}

/// Looks whether `hull` winds around points of `mesh` as often as `mesh` does, and `least` times.
fn look(
    mesh: &TriangleMesh,
    hull: &TriangleMesh,
    least: i32,
    params: &VerifyParams,
) -> VerifyReport {
    let bounds = mesh.bounds();
    let look = Look {
        mesh,
        hull,
        mesh_tree: Bvh::new(mesh),
        hull_tree: Bvh::new(hull),
        least,
        // Beside the surface: above rounding, and below the distance that vertices of a hull keep from planes, so that no
        // other sheet lies between.
        skin: bounds.radius * 1e-13 + bounds.center.abs().max_element() * 1e-14,
    };
    let tolerance = params.tolerance_rel * bounds.radius;
    let normals = mesh.vertex_normals();
    let of_vertices: Vec<f64> = (0..mesh.positions.len())
        .into_par_iter()
        .map(|v| look.escape(mesh.positions[v], normals[v]))
        .collect();
    let of_crossings: Vec<Vec<f64>> = (0..mesh.faces.len())
        .into_par_iter()
        .map(|f| look.crossings(f))
        .collect();
    let mut samples = sample_points(mesh, params.samples);
    // Where all corners lie on the hull they say nothing about the face between them.
    let on_hull: Vec<bool> = (mesh.positions.par_iter())
        .map(|&p| look.hull_tree.closest_point_within(p, look.skin).is_some())
        .collect();
    samples.extend((0..mesh.faces.len()).filter_map(|f| {
        let [a, b, c] = mesh.corners(f);
        let do_touch = mesh.faces[f].iter().all(|&v| on_hull[v as usize]);
        do_touch.then_some(((a + b + c) / 3.0, f))
    }));
    let of_samples: Vec<f64> = samples
        .into_par_iter()
        .map(|(p, face)| look.escape(p, mesh.face_cross(face).normalize_or_zero()))
        .collect();
    let beyond = |d: &&f64| **d > tolerance;
    let escaped_distance = of_vertices
        .iter()
        .chain(of_crossings.iter().flatten())
        .chain(&of_samples)
        .copied()
        .fold(0.0, f64::max);
    VerifyReport {
        encloses: !hull.faces.is_empty() && escaped_distance <= tolerance,
        escaped_distance,
        escaped_rel: if bounds.radius > 0.0 {
            escaped_distance / bounds.radius
        } else {
            0.0
        },
        vertices_outside: of_vertices.iter().filter(beyond).count() as u32,
        crossing_pairs: of_crossings.iter().map(Vec::len).sum::<usize>() as u32,
        leaking_pairs: of_crossings.iter().flatten().filter(beyond).count() as u32,
        samples_outside: of_samples.iter().filter(beyond).count() as u32,
    }
}

struct Look<'a> {
    mesh: &'a TriangleMesh,
    hull: &'a TriangleMesh,
    mesh_tree: Bvh,
    hull_tree: Bvh,
    /// How often the hull has to wind around a point at least.
    least: i32,
    /// How far beside the surface the mesh's own winding number is asked for.
    skin: f64,
}

impl Look<'_> {
    /// How far a point of the mesh, with its outward normal, is outside the hull; zero inside or on it.
    fn escape(&self, p: DVec3, normal: DVec3) -> f64 {
        let around = self.hull_tree.winding_number(p);
        if around < self.least && !self.hull_tree.is_empty() {
            return self.hull_tree.closest_point(p).0.distance(p);
        }
        // On the surface, a point belongs to the more deeply wound of the two sides.
        let skin = normal * self.skin;
        // That number may be negative: two sheets that lie within rounding of one another can enclose a sliver inside out.
        let [below, above] = [p - skin, p + skin].map(|q| self.mesh_tree.winding_number(q));
        let own = below.max(above);
        if around >= own {
            return 0.0;
        }
        if self.hull_tree.is_empty() {
            return f64::INFINITY;
        }
        self.hull_tree.closest_point(p).0.distance(p)
    }

    /// For each triangle of the hull that passes through a face of the mesh: how far that face is outside there.
    fn crossings(&self, face: usize) -> Vec<f64> {
        let corners = self.mesh.corners(face);
        let [a, b, c] = corners;
        let normal = self.mesh.face_cross(face).normalize_or_zero();
        let mut crossed = Vec::new();
        let bounds = (a.min(b).min(c), a.max(b).max(c));
        self.hull_tree
            .faces_near_hull(bounds, &corners, |hull_face| {
                if triangles_cross(corners, self.hull.corners(hull_face as usize)) {
                    crossed.push(hull_face);
                }
            });
        crossed.sort_unstable();
        crossed
            .into_iter()
            .map(|hull_face| self.escape_at_crossing(corners, normal, hull_face as usize))
            .collect()
    }

    /// The largest escape among points of the mesh's triangle on the outer side of the hull's triangle.
    fn escape_at_crossing(&self, corners: [DVec3; 3], normal: DVec3, hull_face: usize) -> f64 {
        let [p, q, r] = self.hull.corners(hull_face);
        // Corners outside were looked at as vertices; new are the places below the hull's corners and edges, where a
        // valley of the hull cuts into the face.
        let below = [p, q, r, p.midpoint(q), q.midpoint(r), r.midpoint(p)];
        below
            .into_iter()
            .map(|from| {
                let w = silmap_geometry::bvh::closest_weights(from, corners);
                corners[0] + (corners[1] - corners[0]) * w[1] + (corners[2] - corners[0]) * w[2]
            })
            .chain(corners)
            .filter(|&at| side_of_plane(p, q, r, at) > 0.0)
            .map(|at| self.escape(at, normal))
            .fold(0.0, f64::max)
    }
}

/// Random points of the surface, evenly by area: position and face. Always the same ones.
fn sample_points(mesh: &TriangleMesh, count: u32) -> Vec<(DVec3, usize)> {
    let mut area = 0.0;
    let sums: Vec<f64> = (0..mesh.faces.len())
        .map(|f| {
            area += mesh.face_cross(f).length();
            area
        })
        .collect();
    if area <= 0.0 {
        return Vec::new();
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    (0..count)
        .map(|_| {
            let at = random.unit() * area;
            let face = sums.partition_point(|&s| s <= at).min(sums.len() - 1);
            let [a, b, c] = mesh.corners(face);
            let (mut u, mut v) = (random.unit(), random.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            (a + (b - a) * u + (c - a) * v, face)
        })
        .collect()
}

/// G. Marsaglia. Xorshift RNGs. Journal of Statistical Software 8, 2003.
struct Random(u64);

impl Random {
    /// Between zero and one.
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
