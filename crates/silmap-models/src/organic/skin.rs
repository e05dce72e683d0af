//! The skin: warts and wrinkles, suckers in two rows, and the colours of a blue-ringed octopus.

use glam::DVec3;

use super::arm::NearestOnArm;
use super::smoothstep;
use crate::noise::{gradient_noise, nearest_cell};

/// Cells of the warts per model unit.
const WART_DENSITY: f64 = 9.5;
/// Cells of the coloured rings per model unit.
const RING_DENSITY: f64 = 4.0;
/// Greatest distance of a ring's feature point from the surface, cells.
const RING_DEPTH: f64 = 0.32;
/// Height of a wart and of the wrinkles, model units.
const WART_HEIGHT: f64 = 0.030;
const WRINKLE_HEIGHT: f64 = 0.010;
/// Height of a sucker's rim as a part of its radius.
const SUCKER_HEIGHT: f64 = 0.45;
/// A sucker's radius as a part of the arm's.
const SUCKER_RADIUS: f64 = 0.42;
/// Fall of the way from one sucker of a row to the next along an arm, model units, and the part of it left at the tip.
const SUCKER_SPACING: f64 = 0.155;
const SUCKER_TIP: f64 = 0.22;
/// Angle of the suckers' rows from the middle of the underside, radians.
const SUCKER_ROW: f64 = 0.55;

/// Height of the skin above the smooth shape, model units.
pub(super) fn relief(point: DVec3, arm_share: f64, arm: Option<&NearestOnArm>, eye: f64) -> f64 {
    let calm = smoothstep(0.0, 0.12, eye);
    let underside = arm.map_or(0.0, |a| arm_share * underside(a));
    let slim = arm.map_or(1.0, |a| 1.0 - arm_share * (1.0 - a.radius / 0.17));
    let warts = WART_HEIGHT * wart_shape(point);
    let wrinkles = WRINKLE_HEIGHT * gradient_noise(point * DVec3::new(7.0, 13.0, 7.0));
    let suckers = arm.map_or(0.0, |a| arm_share * sucker_height(a));
    (warts + wrinkles) * calm * slim * (1.0 - underside) + suckers
}

/// Warts as heights from 0 to 1.
fn wart_shape(point: DVec3) -> f64 {
    let wart = nearest_cell(point * WART_DENSITY);
    let size = 0.35 + 0.65 * wart.random;
    size * (1.0 - smoothstep(0.0, 0.24 + 0.2 * size, wart.distance))
}

/// 1 on an arm's underside, 0 on its back.
fn underside(arm: &NearestOnArm) -> f64 {
    1.0 - smoothstep(0.9, 1.6, arm.around.abs())
}

/// Height of the suckers: rims with a hollow inside, smaller towards the tip.
fn sucker_height(arm: &NearestOnArm) -> f64 {
    sucker_profile(arm).map_or(0.0, |(r, size)| {
        let rim = 1.0 - smoothstep(0.0, 0.42, (r - 0.62).abs());
        let fade = smoothstep(0.12, 0.3, arm.along) * (1.0 - smoothstep(0.93, 1.0, arm.along));
        SUCKER_HEIGHT * size * rim * fade
    })
}

/// Distance from the nearest sucker's middle in units of its radius, and that radius; none far from any.
fn sucker_profile(arm: &NearestOnArm) -> Option<(f64, f64)> {
    let size = SUCKER_RADIUS * arm.radius;
    // The spacing falls linearly with the way, so the number of suckers passed is a logarithm of what is left.
    let left = 1.0 - arm.along + SUCKER_TIP;
    let passed = -left.ln() * arm.length / SUCKER_SPACING;
    // The rows are out of step by half a sucker.
    let place = passed + 0.25 * arm.around.signum();
    let offset = (place - place.round()) * SUCKER_SPACING * left;
    let across = (arm.around.abs() - SUCKER_ROW) * arm.radius;
    let r = offset.hypot(across) / size;
    (r < 1.2).then_some((r, size))
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t)
}

fn finish(colour: [f64; 3]) -> [f32; 3] {
    colour.map(|c| c.clamp(0.0, 1.0) as f32)
}

const SAND: [f64; 3] = [0.78, 0.40, 0.10];
const RUST: [f64; 3] = [0.52, 0.10, 0.025];
const CREAM: [f64; 3] = [0.88, 0.66, 0.44];
const PINK: [f64; 3] = [0.85, 0.36, 0.30];
const BROWN: [f64; 3] = [0.11, 0.025, 0.012];
const BLUE: [f64; 3] = [0.02, 0.28, 0.85];

/// Linear RGB of the skin.
///
/// `height` is the distance of any point from the smooth shape.
pub(super) fn colour(
    point: DVec3,
    arm_share: f64,
    arm: Option<&NearestOnArm>,
    height: impl Fn(DVec3) -> f64,
) -> [f32; 3] {
    let clouds = 0.5 + 0.5 * gradient_noise(point * 2.6) + 0.22 * gradient_noise(point * 11.0);
    let mut colour = mix(RUST, SAND, smoothstep(0.25, 0.75, clouds));

    let wart = wart_shape(point);
    colour = mix(colour, SAND, 0.7 * wart);

    // A ring is where the surface cuts a sphere about a feature point: only points near the surface give round ones.
    let feature = nearest_cell(point * RING_DENSITY);
    let depth = (height(feature.position / RING_DENSITY) * RING_DENSITY).abs();
    if depth < RING_DEPTH {
        let radius = 0.17 + 0.10 * feature.random;
        let from_middle = (feature.distance.powi(2) - depth * depth).max(0.0).sqrt();
        let halo = 1.0 - smoothstep(radius + 0.06, radius + 0.15, from_middle);
        let rim = 1.0 - smoothstep(0.035, 0.085, (from_middle - radius).abs());
        colour = mix(colour, BROWN, 0.9 * halo);
        colour = mix(colour, BLUE, rim);
    }

    if let Some(arm) = arm {
        let under = underside(arm) * arm_share;
        let below =
            sucker_profile(arm).map_or(CREAM, |(r, _)| mix(PINK, CREAM, smoothstep(0.2, 0.6, r)));
        colour = mix(colour, below, under);
    }
    finish(colour)
}

/// Linear RGB of the right eye, seen along a direction from its middle.
pub(super) fn eye_colour(direction: DVec3) -> [f32; 3] {
    let axis = DVec3::new(0.62, 0.12, 0.78).normalize_or_zero();
    let right = axis.cross(DVec3::Y).normalize_or_zero();
    let up = right.cross(axis);
    let (x, y) = (direction.dot(right), direction.dot(up));
    let facing = direction.dot(axis);
    let iris = smoothstep(0.70, 0.76, facing);
    let pupil = 1.0 - smoothstep(0.9, 1.1, (x / 0.46).hypot(y / 0.17));
    let gold = mix(
        [0.55, 0.22, 0.02],
        [0.95, 0.62, 0.10],
        smoothstep(0.78, 1.0, facing),
    );
    let white = [0.86, 0.82, 0.74];
    let mut colour = mix(white, gold, iris);
    colour = mix(
        colour,
        [0.01, 0.008, 0.01],
        pupil * smoothstep(0.3, 0.5, facing),
    );
    let glint = (x + 0.14).hypot(y - 0.22);
    finish(mix(colour, [1.0; 3], 1.0 - smoothstep(0.07, 0.11, glint)))
}
