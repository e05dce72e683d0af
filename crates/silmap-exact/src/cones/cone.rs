//! Anchored cones: bounds of the viewpoints that see all of some faces from the front, or all from the back.
//!
//! Both cones have the same angle and opposite axes. The axis is the one for which the largest cone fits: it passes
//! through the point of the convex hull of the face normals that is nearest to the origin. The apexes are as far along
//! the axis, towards the faces, as the planes of the faces allow.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5, "Anchored Cone
//! Construction". E. G. Gilbert, D. W. Johnson, S. S. Keerthi. A Fast Procedure for Computing the Distance Between Complex
//! Objects in Three-Dimensional Space. IEEE Journal of Robotics and Automation 4, 1988.
//! Deviations: Gilbert's algorithm keeps the simplex that its point lies in, as in the second source, and so ends after a
//! few steps. Cones are smaller by what single precision may get wrong when a viewpoint is tested.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::lp::{HalfSpace, Solution, minimise};

use crate::EdgeMesh;

/// A plane in the unit ball: unit normal and offset, positive in front.
pub(super) type Plane = [f64; 4];

/// The planes of all faces that are known well enough.
pub(super) fn planes_of(mesh: &EdgeMesh) -> Vec<Option<Plane>> {
    (0..mesh.faces().len())
        .into_par_iter()
        .map(|face| mesh.exact_plane(face))
        .collect()
}

/// The regions of a set of faces, in the unit ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConePair {
    /// Unit axis of the front cone; the back cone's is opposite.
    pub(super) axis: DVec3,
    /// Cosine of the angle between the axis and a cone's surface.
    pub(super) cos_angle: f64,
    /// From points in the cone that starts here all faces show their front.
    pub(super) front_apex: DVec3,
    /// From points in the opposite cone that starts here no face shows its front.
    pub(super) back_apex: DVec3,
}

/// Half a unit in the last place of a number about 1 in single precision.
const UNIT: f64 = 0.5 * f32::EPSILON as f64;
/// Single precision may move a viewpoint against an apex at distance r by a part of this times (1 + r)²; this margin is
/// left between apexes and planes. The square covers eyes far away, whose weight is small. A place along the axis comes from
/// an apex's own rounded one: an error of some units of both distances, which margin and cosine cover several times.
const APEX_ROOM: f64 = 24.0 * UNIT;
/// By so much the cosine of a cone's angle is larger than need be.
const COSINE_ROOM: f64 = 24.0 * UNIT;
/// Apexes farther out than this are of no use: the cones they start hold few viewpoints.
const FARTHEST_APEX: f64 = 8.0;
/// Apexes are first sought with the margin for this distance.
const NEAR_APEX: f64 = 2.0;
/// Cosines of cone angles below this are raised to it, so that scaled normals stay of moderate length.
const LEAST_COSINE: f64 = 1e-4;
/// Gilbert's algorithm stops when a step gains less than this.
const LEAST_GAIN: f64 = 1e-12;
const MOST_STEPS: usize = 64;

impl ConePair {
    /// The cones of some faces; `None` when there are none, or none of use. `scratch` is a buffer.
    pub(super) fn of(planes: &[Plane], scratch: &mut Vec<HalfSpace>) -> Option<Self> {
        let axis = nearest_to_origin(planes)?.try_normalize()?;
        // The sine of the cones' angle is the cosine of the largest angle to a normal.
        let sin_angle = planes
            .iter()
            .map(|p| normal(p).dot(axis))
            .fold(f64::INFINITY, f64::min);
        if sin_angle <= 0.0 {
            return None;
        }
        let cos_angle = (1.0 - sin_angle * sin_angle).max(0.0).sqrt();
        let cos_angle = (cos_angle + COSINE_ROOM).max(LEAST_COSINE);
        if cos_angle >= 1.0 {
            return None;
        }
        let (front_apex, back_apex) = [NEAR_APEX, FARTHEST_APEX].into_iter().find_map(|far| {
            let room = APEX_ROOM * (1.0 + far) * (1.0 + far);
            let front = lowest_in_front(planes, axis, room, scratch)?;
            let back = highest_behind(planes, axis, room, scratch)?;
            (front.length() < far && back.length() < far).then_some((front, back))
        })?;
        Some(Self {
            axis,
            cos_angle,
            front_apex,
            back_apex,
        })
    }

    /// The share of viewpoints at `distance` from the center of the ball that are in neither cone, with the apexes on the
    /// axis through the center: to first order only their place along it counts.
    pub(super) fn unculled_share(&self, distance: f64) -> f64 {
        let angle = self.cos_angle.acos();
        let sin_angle = angle.sin();
        let cap = |height: f64| {
            // Seen from the center, the cone holds directions up to this angle from the axis.
            let half_width = angle - (height * sin_angle / distance).clamp(-1.0, 1.0).asin();
            (1.0 - half_width.max(0.0).cos()) * 0.5
        };
        (1.0 - cap(self.front_apex.dot(self.axis)) - cap(-self.back_apex.dot(self.axis))).max(0.0)
    }
}

pub(super) fn normal(plane: &Plane) -> DVec3 {
    DVec3::new(plane[0], plane[1], plane[2])
}

/// The point lowest along `axis` that is in front of all planes by `room`.
fn lowest_in_front(
    planes: &[Plane],
    axis: DVec3,
    room: f64,
    scratch: &mut Vec<HalfSpace>,
) -> Option<DVec3> {
    scratch.clear();
    scratch.extend(planes.iter().map(|p| HalfSpace {
        normal: normal(p),
        offset: room - p[3],
    }));
    optimum(axis, scratch)
}

/// The point highest along `axis` that is behind all planes by `room`.
fn highest_behind(
    planes: &[Plane],
    axis: DVec3,
    room: f64,
    scratch: &mut Vec<HalfSpace>,
) -> Option<DVec3> {
    scratch.clear();
    scratch.extend(planes.iter().map(|p| HalfSpace {
        normal: -normal(p),
        offset: room + p[3],
    }));
    optimum(-axis, scratch)
}

fn optimum(objective: DVec3, half_spaces: &mut [HalfSpace]) -> Option<DVec3> {
    match minimise(objective, half_spaces, 4.0 * FARTHEST_APEX) {
        Solution::Optimal(point) => Some(point),
        Solution::Infeasible | Solution::Unbounded => None,
    }
}

/// The point of the normals' convex hull that is nearest to the origin; `None` when the hull holds the origin.
fn nearest_to_origin(planes: &[Plane]) -> Option<DVec3> {
    let mut simplex = [normal(planes.first()?); 4];
    let mut corners = 1;
    let mut nearest = simplex[0];
    for _ in 0..MOST_STEPS {
        let (support, least) =
            planes
                .iter()
                .map(normal)
                .fold((DVec3::ZERO, f64::INFINITY), |(best, least), n| {
                    let value = n.dot(nearest);
                    if value < least {
                        (n, value)
                    } else {
                        (best, least)
                    }
                });
        if nearest.length_squared() - least < LEAST_GAIN {
            break;
        }
        simplex[corners] = support;
        corners += 1;
        let before = nearest.length_squared();
        nearest = reduce(&mut simplex, &mut corners)?;
        if nearest.length_squared() >= before {
            break;
        }
    }
    Some(nearest)
}

/// The point of a simplex nearest to the origin; the simplex becomes the corners that it depends on, at most three.
/// `None` when the origin lies inside.
fn reduce(simplex: &mut [DVec3; 4], corners: &mut usize) -> Option<DVec3> {
    let mut best: Option<(f64, DVec3, [usize; 3], usize)> = None;
    let mut offer = |point: DVec3, kept: [usize; 3], count: usize| {
        let length = point.length_squared();
        if best.is_none_or(|(least, ..)| length < least) {
            best = Some((length, point, kept, count));
        }
    };
    for i in 0..*corners {
        offer(simplex[i], [i, i, i], 1);
        for j in 0..i {
            if let Some(point) = foot_on_line(simplex[i], simplex[j]) {
                offer(point, [j, i, i], 2);
            }
            for k in 0..j {
                if let Some(point) = foot_on_plane([simplex[i], simplex[j], simplex[k]]) {
                    offer(point, [k, j, i], 3);
                }
            }
        }
    }
    if *corners == 4 && holds_origin(simplex) {
        return None;
    }
    let (_, point, kept, count) = best?;
    let old = *simplex;
    for (place, &corner) in kept[..count].iter().enumerate() {
        simplex[place] = old[corner];
    }
    *corners = count;
    Some(point)
}

/// The foot of the origin's perpendicular on a line, when it lies between the points.
fn foot_on_line(a: DVec3, b: DVec3) -> Option<DVec3> {
    let along = b - a;
    let s = -a.dot(along) / along.length_squared();
    (s > 0.0 && s < 1.0).then(|| a + along * s)
}

/// The foot of the origin's perpendicular on a triangle's plane, when it lies within.
fn foot_on_plane([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let weights = [(b, c), (c, a), (a, b)].map(|(s, t)| s.cross(t).dot(normal));
    let is_within = weights.iter().all(|&w| w > 0.0);
    is_within.then(|| normal * (a.dot(normal) / normal.length_squared()))
}

fn holds_origin(s: &[DVec3; 4]) -> bool {
    let volume = |a: DVec3, b: DVec3, c: DVec3| a.cross(b).dot(c);
    let signs = [
        volume(s[1], s[2], s[3]),
        -volume(s[0], s[2], s[3]),
        volume(s[0], s[1], s[3]),
        -volume(s[0], s[1], s[2]),
    ];
    signs.iter().all(|&v| v > 0.0) || signs.iter().all(|&v| v < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plane_through(normal: DVec3, point: DVec3) -> Option<Plane> {
        let n = normal.try_normalize()?;
        Some([n.x, n.y, n.z, -n.dot(point)])
    }

    #[test]
    fn a_corner_of_a_cube() {
        let planes = [DVec3::X, DVec3::Y, DVec3::Z].map(|n| [n.x, n.y, n.z, -0.5]);
        let cones = ConePair::of(&planes, &mut Vec::new()).expect("a corner has cones");
        let diagonal = DVec3::ONE / 3.0_f64.sqrt();
        assert!(cones.axis.distance(diagonal) < 1e-9);
        // The largest cone in an octant touches its sides.
        assert!((cones.cos_angle - (2.0_f64 / 3.0).sqrt()).abs() < 1e-5);
        assert!(cones.front_apex.distance(DVec3::splat(0.5)) < 1e-3);
        assert!(cones.back_apex.distance(DVec3::splat(0.5)) < 1e-3);
        let opposite = [DVec3::X, -DVec3::X].map(|n| [n.x, n.y, n.z, -0.5]);
        assert!(ConePair::of(&opposite, &mut Vec::new()).is_none());
    }

    proptest! {
        #[test]
        fn cones_lie_within_the_regions(
            faces in prop::collection::vec((prop::array::uniform3(-1.0..1.0), prop::array::uniform3(-0.5..0.5)), 1..12),
            lean in 0.5..4.0,
            directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0), 20),
        ) {
            let planes: Vec<Plane> = faces
                .iter()
                .filter_map(|&(n, p)| plane_through(DVec3::from(n) + DVec3::Z * lean, DVec3::from(p)))
                .collect();
            prop_assume!(!planes.is_empty());
            let Some(cones) = ConePair::of(&planes, &mut Vec::new()) else { return Ok(()) };
            let value = |plane: &Plane, p: DVec3| normal(plane).dot(p) + plane[3];
            for d in directions {
                let direction = DVec3::from(d).normalize_or_zero();
                if direction.dot(cones.axis) >= cones.cos_angle {
                    for far in [0.0, 1e-3, 1.0, 1e3] {
                        let front = cones.front_apex + direction * far;
                        let back = cones.back_apex - direction * far;
                        prop_assert!(planes.iter().all(|p| value(p, front) > 0.0));
                        prop_assert!(planes.iter().all(|p| value(p, back) < 0.0));
                    }
                }
            }
            prop_assert!((0.0..=1.0).contains(&cones.unculled_share(3.0)));
        }
    }
}
