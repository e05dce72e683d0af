//! Outlines for an eye off the polytope: each sector of the picture as it is seen from where its own rays cross the polytope.
//!
//! A ray that touches the object is the same ray from wherever on it the object is looked at. Those that outline the object for an
//! eye off the polytope cross it beside the point that faces the eye, the farther the more the eye is off. So the picture is
//! divided into sectors about the center; one ray in the middle of each is followed to the polytope, the outline is
//! interpolated there, and of what is carried to the eye from there the sector keeps its own.
//!
//! Source: beyond the paper, which maps the outline from the one facing point by a homography. That a ray's radiance is the same
//! from all of its points is what light fields rest on (Gortler, Grzeszczuk, Szeliski, Cohen. The Lumigraph. SIGGRAPH 1996).

use glam::{DMat3, DQuat, DVec2, DVec3};
use silmap_geometry::Camera;

use crate::locate::Location;
use crate::off_polytope::merge::half_line;
use crate::polytope::Polytope;
use crate::rule::method::Method;
use crate::{CapturedView, SilhouetteMap};

/// Distances of the eye, over that of the polytope, between which nothing is divided; and those from which on sectors are
/// looked at from where their rays cross. In between it is from somewhere between there and the facing point, so that outlines
/// follow a moving eye. Near the polytope taking all as on a round object is almost as good, in a sixth of the time.
const ON_POLYTOPE: (f64, f64) = (0.8, 1.35);
const OFF_POLYTOPE: (f64, f64) = (0.7, 1.6);

/// Side of the picture that sectors are joined in. Its unit makes no difference.
pub(crate) const PICTURE_PX: u32 = 1024;

/// How often a ray is met with the polytope as if that were a sphere there.
const CROSSING_STEPS: usize = 3;

/// Where a view's contour generator lies: moments of its points about the center, weighted by length.
#[derive(Clone, Copy, Debug)]
struct RimMoments {
    mean: DVec3,
    square: DMat3,
}

impl RimMoments {
    const NONE: Self = Self {
        mean: DVec3::ZERO,
        square: DMat3::ZERO,
    };

    fn of_view(view: &CapturedView, center: DVec3) -> Self {
        let mut length_sum = 0.0;
        let (mut mean, mut square) = (DVec3::ZERO, DMat3::ZERO);
        // Where there are no depths, as if it lay beside the center.
        let beside = view.camera.depth(center);
        for contour in &view.contours {
            let n = contour.points.len();
            let place = |k: usize| {
                let depth = contour.depths.get(k).copied().unwrap_or(beside);
                view.camera.object_from_image(contour.points[k], depth) - center
            };
            for k in 0..n {
                let (a, b) = (place(k), place((k + 1) % n));
                let (middle, length) = ((a + b) * 0.5, a.distance(b));
                length_sum += length;
                mean += middle * length;
                square += outer(middle) * length;
            }
        }
        let per_length = if length_sum > 0.0 {
            1.0 / length_sum
        } else {
            0.0
        };
        Self {
            mean: mean * per_length,
            square: square * per_length,
        }
    }

    /// How far from the center a rim with these moments is crossed in a direction of a camera's image plane, right and up, if it is
    /// an ellipse there.
    fn reach(&self, direction: DVec2, camera: &Camera) -> f64 {
        let axes = [camera.right, camera.up];
        let mean = DVec2::from(axes.map(|axis| self.mean.dot(axis)));
        let [right, up] = axes.map(|axis| self.square * axis);
        // Twice the variances are the squares of an ellipse's half axes.
        let xx = 2.0 * (axes[0].dot(right) - mean.x * mean.x);
        let xy = 2.0 * (axes[0].dot(up) - mean.x * mean.y);
        let yy = 2.0 * (axes[1].dot(up) - mean.y * mean.y);
        let least = LEAST_VARIANCE * (xx + yy).max(f64::MIN_POSITIVE);
        let determinant = (xx * yy - xy * xy).max(least * least);
        let product = |p: DVec2, q: DVec2| {
            (yy * p.x * q.x - xy * (p.x * q.y + p.y * q.x) + xx * p.y * q.y) / determinant
        };
        // Where the product of t·direction − mean with itself is 1.
        let (aa, ab) = (product(direction, direction), product(direction, mean));
        let room = ab * ab - aa * (product(mean, mean) - 1.0);
        if aa > 0.0 && room >= 0.0 {
            ((ab + room.sqrt()) / aa).max(0.0)
        } else {
            // The ellipse is passed beside.
            mean.dot(direction).max(0.0)
        }
    }
}

/// A rim seen as flatter than this, relative to its extent, is taken to be as wide.
const LEAST_VARIANCE: f64 = 1e-4;

/// v·vᵀ
fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// From where on the polytope the sectors of an eye's picture are looked at.
#[derive(Clone, Debug)]
pub(crate) struct Sectors {
    /// Of each view.
    rims: Vec<RimMoments>,
}

impl Sectors {
    pub(crate) fn new(map: &SilhouetteMap) -> Self {
        let rims = map.views.iter().map(|v| RimMoments::of_view(v, map.center));
        Self {
            rims: rims.collect(),
        }
    }

    /// Appends the points of the polytope from which the sectors of the picture of `camera` are looked at, whose eye faces the polytope at
    /// `location`: that alone where the eye is on the polytope or nearly so, or the method divides nothing.
    pub(crate) fn aim(
        &self,
        (map, polytope): (&SilhouetteMap, &Polytope),
        camera: &Camera,
        location: &Location,
        method: Method,
        points: &mut Vec<Location>,
    ) {
        let eye = camera.eye;
        let distance = eye.distance(map.center);
        let share = share_off_polytope(distance / location.point.distance(map.center));
        let upright = facing_center(camera, map).filter(|_| share > 0.0);
        let (Some(upright), Some(count)) = (upright, method.sector_count()) else {
            points.push(*location);
            return;
        };
        let rim = self.rim_at(map, location);
        let mut at = *location;
        for k in 0..count {
            // In the middle of the sector; pixels go down.
            let d = half_line(2 * k + 1, 2 * count);
            let direction = upright.right * d.x - upright.up * d.y;
            let reach = (rim.reach(DVec2::new(d.x, -d.y), &upright)).min(map.radius);
            let ray = map.center + direction * (share * reach) - eye;
            at = crossing(polytope, map.center, eye, ray, &at).unwrap_or(*location);
            points.push(at);
        }
    }

    /// The rim seen from a point of the polytope: between those of the triangle's views.
    fn rim_at(&self, map: &SilhouetteMap, location: &Location) -> RimMoments {
        let ids = map.triangles[location.triangle as usize];
        let mut rim = RimMoments::NONE;
        for (v, weight) in ids.into_iter().zip(location.barycentric) {
            rim.mean += self.rims[v as usize].mean * weight;
            rim.square += self.rims[v as usize].square * weight;
        }
        rim
    }
}

/// How far towards their crossing with the polytope the rays of an eye are followed, whose distance is `ratio` times that of the
/// polytope: from 0 on the polytope to 1 off it.
fn share_off_polytope(ratio: f64) -> f64 {
    let (on, off) = if ratio > 1.0 {
        (ON_POLYTOPE.1, OFF_POLYTOPE.1)
    } else {
        (ON_POLYTOPE.0, OFF_POLYTOPE.0)
    };
    ((ratio - on) / (off - on)).clamp(0.0, 1.0)
}

/// The camera in whose picture sectors are joined: at the same eye, it looks at the center, turned there by the shortest way.
pub(crate) fn facing_center(camera: &Camera, map: &SilhouetteMap) -> Option<Camera> {
    let forward = (map.center - camera.eye).try_normalize()?;
    let up = DQuat::from_rotation_arc(camera.forward, forward) * camera.up;
    let size = (PICTURE_PX, PICTURE_PX);
    Camera::fit_sphere(camera.eye, map.center, map.radius, Some(up), size).ok()
}

/// Where the line of a ray from an eye crosses the polytope on the eye's side, beginning to look beside `near`.
fn crossing(
    polytope: &Polytope,
    center: DVec3,
    eye: DVec3,
    ray: DVec3,
    near: &Location,
) -> Option<Location> {
    let ray = ray.try_normalize()?;
    let from_center = eye - center;
    let along = from_center.dot(ray);
    let mut found = *near;
    for _ in 0..CROSSING_STEPS {
        let distance = found.point.distance(center);
        let room = along * along - from_center.length_squared() + distance * distance;
        if room <= 0.0 {
            return None;
        }
        let point = eye - ray * (along + room.sqrt());
        found = polytope.locate(point, found.triangle)?;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::tests::octahedron;
    use proptest::prelude::*;

    proptest! {
        /// What is found lies on the ray's line, on the polytope and on the eye's side.
        #[test]
        fn rays_are_followed_to_the_polytope(
            eye in prop::array::uniform3(-1.0..1.0_f64), distance in 1.2..20.0_f64, aside in prop::array::uniform3(-0.6..0.6_f64),
        ) {
            let center = DVec3::new(1.0, 2.0, 3.0);
            let direction = DVec3::from(eye);
            prop_assume!(direction.length() > 0.1);
            let eye = center + direction.normalize_or_zero() * distance;
            let (arms, triangles) = octahedron();
            let arms = arms.into_iter().map(|arm| arm * 3.0).collect();
            let polytope = Polytope::from_parts(center, arms, triangles).unwrap();
            let facing = polytope.locate(eye, 0).unwrap();
            let ray = center + DVec3::from(aside) - eye;
            let found = crossing(&polytope, center, eye, ray, &facing).unwrap();
            // A few steps bring it near.
            let off = (found.point - eye).cross(ray.normalize_or_zero()).length();
            let before = (facing.point - eye).cross(ray.normalize_or_zero()).length();
            prop_assert!(off < 0.2 * before + 1e-9, "{off} off the ray, {before} before");
            prop_assert!((found.point - center).dot(eye - center) > 0.0);
            let again = polytope.locate(found.point, 0).unwrap();
            prop_assert!(again.point.distance(found.point) < 1e-9);
        }
    }

    #[test]
    fn a_round_rim_reaches_to_its_radius() {
        let eye = DVec3::new(0.5, 2.5, 3.0);
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (512, 512)).unwrap();
        let n = 90;
        let offset = camera.right * 0.2;
        let places = (0..n).map(|k| {
            let d = half_line(k, n);
            offset + (camera.right * d.x + camera.up * d.y) * 0.7
        });
        let (points, depths) = places
            .map(|p| (camera.image_from_object(p), camera.depth(p)))
            .unzip();
        let contour = crate::ViewContour {
            points,
            depths,
            ..crate::ViewContour::default()
        };
        let view = CapturedView {
            camera,
            contours: vec![contour],
            photographed: None,
        };
        let rim = RimMoments::of_view(&view, DVec3::ZERO);
        let reach = |d: DVec2| rim.reach(d, &view.camera);
        assert!((reach(DVec2::X) - 0.9).abs() < 2e-3);
        assert!((reach(-DVec2::X) - 0.5).abs() < 2e-3);
        assert!((reach(DVec2::Y) - (0.7_f64 * 0.7 - 0.2 * 0.2).sqrt()).abs() < 2e-3);
    }

    /// On a long rim the ray that is followed meets it in the middle of the sector: farther out it would pass beside the object.
    #[test]
    fn a_long_rim_is_crossed_where_it_is() {
        let camera =
            Camera::fit_sphere(DVec3::Z * 3.0, DVec3::ZERO, 1.0, None, (512, 512)).unwrap();
        let (wide, high) = (0.2, 0.9);
        let square = DMat3::from_diagonal(DVec3::new(wide * wide, high * high, 0.3) * 0.5);
        let rim = RimMoments {
            mean: DVec3::ZERO,
            square,
        };
        for k in 0..24 {
            let d = half_line(k, 24);
            let p = d * rim.reach(d, &camera);
            let across = DVec2::new(p.x / wide, p.y / high).length();
            assert!((across - 1.0).abs() < 1e-9, "{p}");
        }
    }

    #[test]
    fn rays_are_followed_farther_the_farther_the_eye_is_off() {
        let shares = [0.5, 0.7, 0.75, 0.8, 1.0, 1.35, 1.475, 1.6, 9.0].map(share_off_polytope);
        let wanted = [1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0];
        assert!(shares.iter().zip(wanted).all(|(s, w)| (s - w).abs() < 1e-9));
    }
}
