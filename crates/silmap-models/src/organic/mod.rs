//! An octopus: lobes, curled limbs, a loop to look through, and a skin with fine relief and colour.
//!
//! The body is a blend of ellipsoids, eight tapering arms are swept along curves ([`arm`]), and the skin's warts,
//! wrinkles and suckers move the surface along its normal ([`skin`]). Up is +Y, the face looks along +Z.

mod arm;
mod skin;

use std::sync::LazyLock;

use glam::{DQuat, DVec3};

use super::field::{ellipsoid_distance, smooth_min};
use super::polygonise::Field;
use arm::{Arm, NearestOnArm};

/// The octopus; negative inside.
pub(super) struct Octopus {
    arms: Vec<Arm>,
}

/// The one octopus there is.
pub(super) static OCTOPUS: LazyLock<Octopus> = LazyLock::new(|| Octopus { arms: arm::all() });

/// Width of the blend between head and mantle.
const NECK_BLEND: f64 = 0.22;
/// Width of the blend between arms, and between them and the head: the web between the arms.
const WEB_BLEND: f64 = 0.13;
/// Width of the blend between an eye's socket and the head.
const SOCKET_BLEND: f64 = 0.10;
/// Width of the blend between an eyeball and the skin: a fine crease.
const LID_BLEND: f64 = 0.012;

/// Middle of the head.
const HEAD: DVec3 = DVec3::new(0.0, -0.02, 0.02);
/// Half-axes of the head.
const HEAD_RADII: DVec3 = DVec3::new(0.40, 0.40, 0.40);
/// Middle of the mantle, above and behind the head.
const MANTLE: DVec3 = DVec3::new(0.0, 0.68, -0.30);
/// Half-axes of the mantle before it is tilted.
const MANTLE_RADII: DVec3 = DVec3::new(0.56, 0.66, 0.56);
/// How far the mantle leans back, radians.
const MANTLE_TILT: f64 = -0.5;

/// Middle of the right eyeball; the left one is its mirror image.
const EYE: DVec3 = DVec3::new(0.265, 0.26, 0.295);
/// Radius of an eyeball.
const EYE_RADIUS: f64 = 0.145;
/// Middle and radius of the socket that the eyeball looks out of.
const SOCKET: (DVec3, f64) = (DVec3::new(0.245, 0.265, 0.245), 0.175);

/// Beyond this distance from the smooth shape there is no relief: it is nowhere deeper than half of it.
const RELIEF_REACH: f64 = 0.08;

/// What the surface is made of near a point.
struct Nearest {
    /// Distance to the shape without relief.
    smooth: f64,
    /// Distance to the nearer eyeball.
    eyeball: f64,
    /// Distance to head and mantle.
    body: f64,
    /// Distance to the nearest arm, and where on it.
    arm_distance: f64,
    arm: Option<NearestOnArm>,
}

/// The same point on the right side.
fn mirrored(point: DVec3) -> DVec3 {
    DVec3::new(point.x.abs(), point.y, point.z)
}

impl Octopus {
    fn nearest(&self, point: DVec3) -> Nearest {
        let right = mirrored(point);
        let leaning = DQuat::from_rotation_x(-MANTLE_TILT) * (point - MANTLE);
        let mantle = ellipsoid_distance(leaning, MANTLE_RADII);
        let head = ellipsoid_distance(point - HEAD, HEAD_RADII);
        let socket = right.distance(SOCKET.0) - SOCKET.1;
        let body = smooth_min(smooth_min(head, mantle, NECK_BLEND), socket, SOCKET_BLEND);
        let eyeball = right.distance(EYE) - EYE_RADIUS;

        let (mut smooth, mut arm_distance, mut arm) = (body, f64::INFINITY, None);
        for candidate in &self.arms {
            if candidate.is_farther_than(point, smooth.min(arm_distance) + WEB_BLEND) {
                continue;
            }
            let near = candidate.nearest(point);
            smooth = smooth_min(smooth, near.distance, WEB_BLEND);
            if near.distance < arm_distance {
                arm_distance = near.distance;
                arm = Some(near);
            }
        }
        Nearest {
            smooth,
            eyeball,
            body,
            arm_distance,
            arm,
        }
    }

    /// Linear RGB of the skin or eye at a point of the surface.
    pub(super) fn colour(&self, point: DVec3) -> [f32; 3] {
        let near = self.nearest(point);
        if near.eyeball < skin_distance(&near, point) {
            return skin::eye_colour((mirrored(point) - EYE).normalize_or_zero());
        }
        skin::colour(point, arm_share(&near), near.arm.as_ref(), |p| {
            self.nearest(p).smooth
        })
    }
}

/// How much of the surface at a point belongs to an arm, 0 to 1.
fn arm_share(near: &Nearest) -> f64 {
    smoothstep(
        -0.6 * WEB_BLEND,
        0.6 * WEB_BLEND,
        near.body - near.arm_distance,
    )
}

/// Distance to the skin with its relief.
fn skin_distance(near: &Nearest, point: DVec3) -> f64 {
    if near.smooth.abs() > RELIEF_REACH {
        return near.smooth;
    }
    near.smooth - skin::relief(point, arm_share(near), near.arm.as_ref(), near.eyeball)
}

impl Field for Octopus {
    fn value(&self, point: DVec3) -> f64 {
        let near = self.nearest(point);
        smooth_min(skin_distance(&near, point), near.eyeball, LID_BLEND)
    }

    fn extent(&self) -> f64 {
        1.75
    }

    fn slope_bound(&self) -> f64 {
        // Distances rise by at most 1.2, the relief by less than 1.
        2.2
    }

    fn fineness(&self, point: DVec3) -> f64 {
        let right = mirrored(point);
        if right.distance(EYE) < 1.3 * EYE_RADIUS {
            return 0.5;
        }
        let near = self.nearest(point);
        let slim = near.arm.as_ref().map_or(0.0, |a| a.along);
        1.0 - 0.45 * slim * arm_share(&near)
    }
}

/// 0 below `from`, 1 above `to`, smooth between.
fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
