//! A hull level in single precision, still enclosing.
//!
//! Each vertex moves to a single-precision point on or outside the planes of all faces around it, as those are at that
//! moment. By the same argument as for a collapse, no point loses winding number: rounding costs a little volume, never
//! enclosure. Where no such point is near (flat or saddle-shaped surroundings), the vertex is rounded to the nearest
//! point, which moves the surface by no more than half a unit in the last place.

use glam::{DVec3, Vec3};
use silmap_geometry::TriangleMesh;
use silmap_geometry::lp::{self, HalfSpace, Solution};
use silmap_geometry::predicates::side_of_plane;

use super::HullLevel;

/// Pushes tried along the direction that leads away from all planes, in units in the last place.
const PUSHES_ULP: [f64; 8] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// A hull in single precision, and what rounding did to it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundedHull {
    /// Vertex positions, object space.
    pub positions: Vec<[f32; 3]>,
    /// Faces, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// P(v): per vertex, the point of the original surface it stands for.
    pub surface_points: Vec<[f32; 3]>,
    /// Volume of the rounded hull over the original's.
    pub volume_ratio: f64,
    /// Largest distance a vertex moved, in the model's units.
    pub moved: f64,
    /// Bound on how far the level pokes out of it, in the model's units: zero when every vertex found a place outside.
    pub leak: f64,
}

impl HullLevel {
    /// Rounds the level to single precision, outwards (for an inner hull: inwards).
    #[must_use]
    pub fn round(&self) -> RoundedHull {
        let mut mesh = TriangleMesh {
            positions: self.mesh.positions.clone(),
            faces: self.mesh.faces.clone(),
            ..TriangleMesh::default()
        };
        if self.is_inner {
            for face in &mut mesh.faces {
                face.swap(1, 2);
            }
        }
        let mut faces_at: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions.len()];
        for (f, face) in mesh.faces.iter().enumerate() {
            for &v in face {
                faces_at[v as usize].push(f as u32);
            }
        }
        let (mut moved, mut leak) = (0.0_f64, 0.0_f64);
        for (v, faces) in faces_at.iter().enumerate() {
            let before = mesh.positions[v];
            let rounded = outside(&mesh, v, faces);
            let after = rounded.unwrap_or_else(|| nearest(before));
            moved = moved.max(before.distance(after));
            if rounded.is_none() {
                leak = leak.max(before.distance(after));
            }
            mesh.positions[v] = after;
        }
        let volume = if self.is_inner {
            -mesh.volume()
        } else {
            mesh.volume()
        };
        let single = |p: &DVec3| p.as_vec3().to_array();
        RoundedHull {
            positions: mesh.positions.iter().map(single).collect(),
            faces: self.mesh.faces.clone(),
            surface_points: self.surface_points.iter().map(single).collect(),
            volume_ratio: self.volume_ratio / self.volume * volume,
            moved,
            leak,
        }
    }
}

impl RoundedHull {
    /// The hull as a mesh in double precision, each position the one it is stored with.
    #[must_use]
    pub fn mesh(&self) -> TriangleMesh {
        let double = |&p: &[f32; 3]| Vec3::from_array(p).as_dvec3();
        TriangleMesh {
            positions: self.positions.iter().map(double).collect(),
            faces: self.faces.clone(),
            ..TriangleMesh::default()
        }
    }
}

fn nearest(p: DVec3) -> DVec3 {
    p.as_vec3().as_dvec3()
}

/// A single-precision point near vertex `v` that is on or outside all its faces' planes.
fn outside(mesh: &TriangleMesh, v: usize, faces: &[u32]) -> Option<DVec3> {
    let before = mesh.positions[v];
    let is_outside = |p: DVec3| {
        faces.iter().all(|&f| {
            let [a, b, c] = mesh.corners(f as usize);
            side_of_plane(a, b, c, p) >= 0.0
        })
    };
    let at = nearest(before);
    if is_outside(at) {
        return Some(at);
    }
    let normals: Vec<DVec3> = faces
        .iter()
        .filter_map(|&f| mesh.face_cross(f as usize).try_normalize())
        .collect();
    let away = away_from(&normals)?;
    let size = before.abs().max_element().max(f64::from(f32::MIN_POSITIVE));
    let ulp = f64::from(f32::EPSILON) * size;
    for push in PUSHES_ULP {
        let center = before + away * (ulp * push);
        let best = cell_corners(center)
            .filter(|&p| is_outside(p))
            .map(|p| (p.distance_squared(before), p))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, p)) = best {
            return Some(p);
        }
    }
    None
}

/// The single-precision points around `p`, the nearest in each octant.
fn cell_corners(p: DVec3) -> impl Iterator<Item = DVec3> {
    let single = p.as_vec3();
    let pair = |exact: f64, rounded: f32| {
        if f64::from(rounded) <= exact {
            [rounded, rounded.next_up()]
        } else {
            [rounded.next_down(), rounded]
        }
    };
    let (x, y, z) = (
        pair(p.x, single.x),
        pair(p.y, single.y),
        pair(p.z, single.z),
    );
    (0..8_usize).map(move |i| Vec3::new(x[i & 1], y[(i >> 1) & 1], z[i >> 2]).as_dvec3())
}

/// A direction that leads away from all planes at the same rate at least (one), and is as short as a linear program in
/// its sum with the normals makes it; `None` when there is none.
fn away_from(normals: &[DVec3]) -> Option<DVec3> {
    /// Longer directions belong to surroundings that are nearly folded: not worth the detour.
    const LONGEST: f64 = 16.0;
    let mut half_spaces: Vec<HalfSpace> = normals
        .iter()
        .map(|&normal| HalfSpace {
            normal,
            offset: 1.0,
        })
        .collect();
    match lp::minimise(normals.iter().sum(), &mut half_spaces, 1e3) {
        Solution::Optimal(x) if x.length() <= LONGEST => Some(x),
        _ => None,
    }
}
