//! The arms: tapering tubes along curves that know which side of them is underneath.

use glam::{DQuat, DVec3};

use super::smoothstep;

/// Straight pieces of an arm.
const PIECES: usize = 56;

/// Pieces that share a bounding sphere.
const PIECES_PER_GROUP: usize = 8;

/// How an arm grows: lengths in model units, angles in radians.
struct ArmShape {
    /// Direction in which it leaves the body, about the y axis from +z towards +x.
    azimuth: f64,
    length: f64,
    /// Elevation at its root; it levels off over the first part.
    root_elevation: f64,
    /// How far it curls upwards over its whole length, and how late: the turn grows with this power of the way.
    curl: f64,
    lateness: f64,
    /// How far it turns sideways and back, and how many times.
    sway: f64,
    sways: f64,
}

/// From the middle of the face around; the last but one is raised and rests its tip on the mantle.
const SHAPES: [ArmShape; 8] = [
    ArmShape {
        azimuth: 0.36,
        length: 1.75,
        root_elevation: -0.95,
        curl: 5.2,
        lateness: 4.2,
        sway: 0.55,
        sways: 0.9,
    },
    ArmShape {
        azimuth: 1.15,
        length: 1.95,
        root_elevation: -0.85,
        curl: 4.4,
        lateness: 5.0,
        sway: -0.75,
        sways: 1.0,
    },
    ArmShape {
        azimuth: 1.95,
        length: 1.85,
        root_elevation: -0.80,
        curl: 6.0,
        lateness: 4.0,
        sway: 0.6,
        sways: 1.1,
    },
    ArmShape {
        azimuth: 2.70,
        length: 1.70,
        root_elevation: -0.85,
        curl: 4.0,
        lateness: 4.5,
        sway: -0.5,
        sways: 0.9,
    },
    ArmShape {
        azimuth: 3.55,
        length: 1.90,
        root_elevation: -0.85,
        curl: 5.6,
        lateness: 4.4,
        sway: 0.6,
        sways: 1.0,
    },
    ArmShape {
        azimuth: 4.30,
        length: 1.75,
        root_elevation: -0.80,
        curl: 3.6,
        lateness: 4.0,
        sway: -0.7,
        sways: 0.8,
    },
    ArmShape {
        azimuth: 5.05,
        length: 2.05,
        root_elevation: -0.45,
        curl: 3.35,
        lateness: 1.2,
        sway: 0.25,
        sways: 0.6,
    },
    ArmShape {
        azimuth: 5.90,
        length: 1.80,
        root_elevation: -0.95,
        curl: 4.8,
        lateness: 4.6,
        sway: -0.65,
        sways: 1.0,
    },
];

/// Distance of the arms' roots from the y axis, and their height.
const ROOT: (f64, f64) = (0.20, -0.22);
/// Radius of an arm at its root and at its tip.
const RADII: (f64, f64) = (0.165, 0.034);

/// A point of the curve inside an arm.
struct Joint {
    position: DVec3,
    radius: f64,
    /// Unit vector to the underside, where the suckers are.
    under: DVec3,
}

/// One arm.
pub(super) struct Arm {
    joints: Vec<Joint>,
    length: f64,
    /// Spheres about groups of pieces: centre and radius with the tube.
    groups: Vec<(DVec3, f64)>,
}

/// Where a point is in relation to an arm.
pub(super) struct NearestOnArm {
    /// Distance to the smooth tube; negative inside.
    pub(super) distance: f64,
    /// Way from the root, 0 to 1.
    pub(super) along: f64,
    /// Length of the arm, model units.
    pub(super) length: f64,
    /// Radius of the tube there.
    pub(super) radius: f64,
    /// Angle about the curve from the underside, radians, signed.
    pub(super) around: f64,
}

/// The eight arms.
pub(super) fn all() -> Vec<Arm> {
    SHAPES.iter().map(Arm::grow).collect()
}

impl Arm {
    fn grow(shape: &ArmShape) -> Self {
        let outward = DVec3::new(shape.azimuth.sin(), 0.0, shape.azimuth.cos());
        let side = outward.cross(DVec3::Y);
        let mut position = outward * ROOT.0 + DVec3::Y * ROOT.1;
        let mut forward = DQuat::from_axis_angle(side, shape.root_elevation) * outward;
        let mut under = DQuat::from_axis_angle(side, shape.root_elevation) * DVec3::NEG_Y;
        let step = shape.length / PIECES as f64;
        // Elevation levels off over the first two fifths while the curl sets in.
        let elevation = |t: f64| {
            shape.root_elevation * (1.0 - smoothstep(0.0, 0.45, t))
                + shape.curl * t.powf(shape.lateness)
        };
        let heading = |t: f64| shape.sway * (std::f64::consts::TAU * shape.sways * t).sin() * t;
        let mut joints = Vec::with_capacity(PIECES + 1);
        for k in 0..=PIECES {
            let t = k as f64 / PIECES as f64;
            let radius = RADII.1 + (RADII.0 - RADII.1) * (1.0 - t.powf(0.85));
            joints.push(Joint {
                position,
                radius,
                under,
            });
            position += forward * step;
            let t_next = (k + 1) as f64 / PIECES as f64;
            let across = forward.cross(under);
            // Up is away from the underside, whichever way the arm points by now.
            let turn = DQuat::from_axis_angle(across, elevation(t) - elevation(t_next))
                * DQuat::from_axis_angle(under, heading(t_next) - heading(t));
            forward = (turn * forward).normalize_or_zero();
            under = (turn * under).reject_from(forward).normalize_or_zero();
        }
        let groups = (0..PIECES)
            .step_by(PIECES_PER_GROUP)
            .map(|first| {
                let part = &joints[first..=(first + PIECES_PER_GROUP).min(PIECES)];
                let middle = part.iter().map(|j| j.position).sum::<DVec3>() / part.len() as f64;
                let reach = part
                    .iter()
                    .map(|j| j.position.distance(middle) + j.radius)
                    .fold(0.0, f64::max);
                (middle, reach)
            })
            .collect();
        Self {
            joints,
            length: shape.length,
            groups,
        }
    }

    /// Whether the whole arm is surely more than `distance` away.
    pub(super) fn is_farther_than(&self, point: DVec3, distance: f64) -> bool {
        self.groups.iter().all(|&(middle, reach)| {
            point.distance_squared(middle) > (reach + distance).max(0.0).powi(2)
        })
    }

    /// The nearest place of the arm.
    pub(super) fn nearest(&self, point: DVec3) -> NearestOnArm {
        let mut best = (f64::INFINITY, 0, 0.0);
        for (g, &(middle, reach)) in self.groups.iter().enumerate() {
            if point.distance(middle) - reach > best.0 {
                continue;
            }
            let first = g * PIECES_PER_GROUP;
            for k in first..(first + PIECES_PER_GROUP).min(PIECES) {
                let (a, b) = (&self.joints[k], &self.joints[k + 1]);
                let along = b.position - a.position;
                let t = ((point - a.position).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                let radius = a.radius + (b.radius - a.radius) * t;
                let distance = point.distance(a.position + along * t) - radius;
                if distance < best.0 {
                    best = (distance, k, t);
                }
            }
        }
        let (distance, k, t) = best;
        let (a, b) = (&self.joints[k], &self.joints[k + 1]);
        let out = point - a.position.lerp(b.position, t);
        let under = a.under.lerp(b.under, t);
        let across = (b.position - a.position).normalize_or_zero().cross(under);
        let along = (k as f64 + t) / PIECES as f64;
        NearestOnArm {
            distance,
            along,
            length: self.length,
            radius: a.radius + (b.radius - a.radius) * t,
            around: out.dot(across).atan2(out.dot(under)),
        }
    }
}
