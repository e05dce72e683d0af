//! Which eyes share an outline.
//!
//! An outline whose vertices have depths is a curve in space. Seen by another eye nearby it is wrong in two ways. A rim of radius of
//! curvature ρ pixels slides over the surface: it is off by ρ(1 − cos θ) where the rays to it have turned by θ. And where the outline
//! goes from a near rim to a far one, a jump of d pixels in depth, a gap of d sin θ opens or closes. The eyes around an object are
//! divided into cells, by direction, by distance and by size on the screen, so small that what is right for the middle of a cell is off
//! by no more than is allowed anywhere in it. So outlines are the same whatever was drawn before.
//!
//! Source: beyond the papers, which interpolate anew for each picture.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec3, DVec4, Vec4Swizzles};

/// The largest angle that an outline is carried over.
const LARGEST_REACH: f64 = 0.2;

/// Shares of the reach that go to direction (half a cell's diagonal) and to distance (half a step).
const SHARE_OF_DIRECTION: f64 = 0.75;
const SHARE_OF_DISTANCE: f64 = 0.25;

/// No eye of a cell is nearer than this: the sine of the angle between the object's rim and its middle.
const LARGEST_SINE: f64 = 0.9999;

/// None is farther away: rays are parallel, as far as single precision tells.
const SMALLEST_SINE: f64 = 1e-4;

/// Sizes on the screen, powers of the root of two: radius of the bounding sphere in pixels.
const SMALLEST_SIZE: u8 = 4;
const LARGEST_SIZE: u8 = 26;

/// By how much the sizes of a class differ at most.
pub const SIZE_STEP: f64 = std::f64::consts::SQRT_2;

/// Names a cell, or one eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CellKey {
    /// Number of the asset.
    pub asset: u64,
    /// Size on the screen; what power of [`SIZE_STEP`] it is.
    pub size: u8,
    /// Of the cell, or of the eye's coordinates.
    pub place: [u64; 4],
}

/// Where an eye is about an object, as far as outlines go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearing {
    /// Unit direction from the object's middle to the eye.
    pub direction: DVec3,
    /// Angle between the rays to the bounding sphere's rim and to its middle; zero for an eye infinitely far away.
    pub rim_angle: f64,
}

impl Bearing {
    /// The bearing of an eye (with a 1 appended, or of a direction, with a 0); `None` within the sphere.
    #[must_use]
    pub fn new(eye: DVec4, center: DVec3, radius: f64) -> Option<Self> {
        if eye.w == 0.0 {
            return Some(Self {
                direction: eye.xyz(),
                rim_angle: 0.0,
            });
        }
        let arm = eye.xyz() - center;
        let distance = arm.length();
        let sine = radius / distance;
        (sine < 1.0).then(|| Self {
            direction: arm / distance,
            rim_angle: sine.asin(),
        })
    }

    /// An eye with this bearing.
    #[must_use]
    pub fn eye(&self, center: DVec3, radius: f64) -> DVec3 {
        let sine = self.rim_angle.sin().clamp(SMALLEST_SINE, LARGEST_SINE);
        center + self.direction * (radius / sine)
    }

    /// By how much rays to the rim turn from one eye to another, at most.
    #[must_use]
    pub fn angle_to(&self, other: &Self) -> f64 {
        let cosine = self.direction.dot(other.direction);
        let sine = self.direction.cross(other.direction).length();
        sine.atan2(cosine) + (self.rim_angle - other.rim_angle).abs()
    }
}

/// What counts as a jump in depth, in radii. Models have larger ones, but little of a gap shows: by this bound an outline that is used
/// anew is at most 0.6 pixels worse, measured against exact outlines (`tests/tests/reuse.rs`).
const JUMP_REL: f64 = 0.1;

/// What an outline may be off by, in pixels, and what makes it so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReuseError {
    /// The largest error allowed.
    pub allowed_px: f64,
}

impl ReuseError {
    /// How much an outline may be off when rays have turned by an angle and the sphere's radius is so large.
    #[must_use]
    pub fn bound_px(&self, angle: f64, radius_px: f64) -> f64 {
        let sliding = radius_px * (1.0 - angle.cos());
        let opening = JUMP_REL * radius_px * angle.sin();
        sliding.max(opening)
    }

    /// The angle at which the bound is reached.
    #[must_use]
    pub fn reach(&self, radius_px: f64) -> f64 {
        let share = self.allowed_px / radius_px;
        let sliding = (1.0 - share).max(-1.0).acos();
        let opening = (share / JUMP_REL).min(1.0).asin();
        sliding.min(opening).min(LARGEST_REACH)
    }
}

/// A cell of eyes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Its name.
    pub key: CellKey,
    /// The eye in its middle.
    pub middle: Bearing,
    /// The largest size of its pictures.
    pub radius_px: f64,
}

impl Cell {
    /// The cell that an eye is in; at an error of zero a cell of its own.
    #[must_use]
    pub fn of(asset: u64, bearing: Bearing, radius_px: f64, error: &ReuseError) -> Self {
        let size = size_class(radius_px);
        let radius_px = SIZE_STEP.powi(size.into());
        if error.allowed_px <= 0.0 {
            let d = bearing.direction;
            let place = [d.x, d.y, d.z, bearing.rim_angle].map(f64::to_bits);
            return Self {
                key: CellKey { asset, size, place },
                middle: bearing,
                radius_px,
            };
        }
        let reach = error.reach(radius_px);
        let step = 2.0 * SHARE_OF_DISTANCE * reach;
        let shell = (bearing.rim_angle / step).floor().max(0.0);
        let (face, square, direction) =
            direction_cell(bearing.direction, SHARE_OF_DIRECTION * reach);
        Self {
            key: CellKey {
                asset,
                size,
                place: [face, square[0], square[1], shell as u64],
            },
            middle: Bearing {
                direction,
                rim_angle: ((shell + 0.5) * step).min(FRAC_PI_2),
            },
            radius_px,
        }
    }
}

/// The smallest power of [`SIZE_STEP`] that is no less.
fn size_class(radius_px: f64) -> u8 {
    let power = (radius_px.max(1.0).log2() / SIZE_STEP.log2()).ceil();
    // Not more than `LARGEST_SIZE` even where the sphere fills the picture and more.
    (power.min(f64::from(LARGEST_SIZE)) as u8).max(SMALLEST_SIZE)
}

/// Half the diagonal of a small square, sides of it: √(2/3) beside a corner of the cube, where planes at equal angles meet at 120°, and the
/// distances between them are 2√2/3 of the angle. In the middle of a face it is √(1/2).
const LONGEST_HALF_DIAGONAL: f64 = 0.816_496_580_927_726;

/// The face of a cube that a direction passes through, the square of that face, and the direction to that square's middle. Squares
/// are bounded by planes at equal angles, no more than `radius` from their middle to a corner.
#[must_use]
pub fn direction_cell(direction: DVec3, radius: f64) -> (u64, [u64; 2], DVec3) {
    let magnitude = direction.abs();
    let axis = if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
        0
    } else if magnitude.y >= magnitude.z {
        1
    } else {
        2
    };
    let along = direction[axis];
    let count = (FRAC_PI_2 * LONGEST_HALF_DIAGONAL / radius).ceil().max(1.0);
    let side = FRAC_PI_2 / count;
    let mut middle = DVec3::ZERO;
    middle[axis] = along.signum();
    let mut square = [0; 2];
    for (k, place) in square.iter_mut().enumerate() {
        let other = (axis + 1 + k) % 3;
        let angle = (direction[other] / along.abs()).atan() + FRAC_PI_4;
        let at = (angle / side).floor().clamp(0.0, count - 1.0);
        *place = at as u64;
        middle[other] = ((at + 0.5) * side - FRAC_PI_4).tan();
    }
    let face = 2 * axis as u64 + u64::from(along < 0.0);
    (face, square, middle.normalize_or_zero())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bearing() -> impl Strategy<Value = Bearing> {
        let direction = (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64)
            .prop_map(DVec3::from)
            .prop_filter("a direction", |v| v.length() > 0.1)
            .prop_map(DVec3::normalize_or_zero);
        (direction, 0.0..1.5_f64).prop_map(|(direction, rim_angle)| Bearing {
            direction,
            rim_angle,
        })
    }

    proptest! {
        /// Nowhere in a cell the bound is passed, and cells are not needlessly small.
        #[test]
        fn the_middle_serves_the_whole_cell(
            bearing in bearing(), radius_px in 1.0..4000.0_f64, allowed_px in 0.05..1.0_f64,
        ) {
            let error = ReuseError { allowed_px };
            let cell = Cell::of(7, bearing, radius_px, &error);
            prop_assert!(cell.radius_px >= radius_px);
            let angle = cell.middle.angle_to(&bearing);
            let bound = error.bound_px(angle, cell.radius_px);
            prop_assert!(bound <= allowed_px * (1.0 + 1e-9), "{bound} at {angle}");
            // The middle is in its own cell.
            prop_assert_eq!(Cell::of(7, cell.middle, radius_px, &error).key, cell.key);
        }

        /// With no error allowed each eye has its own.
        #[test]
        fn exact_eyes_have_cells_of_their_own(bearing in bearing(), radius_px in 1.0..4000.0_f64) {
            let error = ReuseError { allowed_px: 0.0 };
            let cell = Cell::of(7, bearing, radius_px, &error);
            prop_assert_eq!(cell.middle, bearing);
            let moved = Bearing { rim_angle: bearing.rim_angle + 1e-9, ..bearing };
            prop_assert_ne!(Cell::of(7, moved, radius_px, &error).key, cell.key);
        }

        #[test]
        fn an_eye_has_the_bearing_it_was_made_from(bearing in bearing(), radius in 0.01..50.0_f64) {
            prop_assume!(bearing.rim_angle > 1e-3);
            let center = DVec3::new(3.0, -1.0, 0.5);
            let eye = bearing.eye(center, radius);
            let again = Bearing::new(eye.extend(1.0), center, radius).unwrap();
            prop_assert!(again.angle_to(&bearing) < 1e-6);
        }
    }

    #[test]
    fn squares_reach_no_farther_beside_a_corner_of_the_cube() {
        let radius = 0.03;
        let farthest = |from: DVec3, to: DVec3| {
            let angle = |k: u32, l: u32| {
                let share = |n: u32| f64::from(n) / 300.0;
                let aside = DVec3::new(0.0, 0.2 * share(k), 0.2 * share(l));
                let direction = (from + aside * (to - from)).normalize_or_zero();
                direction_cell(direction, radius).2.angle_between(direction)
            };
            let pairs = (0..300).flat_map(|k| (0..300).map(move |l| (k, l)));
            pairs.map(|(k, l)| angle(k, l)).fold(0.0, f64::max)
        };
        let corner = farthest(DVec3::ONE, DVec3::new(1.0, 0.0, 0.0));
        let middle = farthest(DVec3::X, DVec3::ONE);
        assert!(corner <= radius && corner > 0.9 * radius, "{corner}");
        assert!(middle < corner, "{middle}");
    }

    #[test]
    fn within_the_sphere_there_is_no_bearing() {
        let inside = DVec4::new(0.1, 0.2, 0.0, 1.0);
        assert_eq!(Bearing::new(inside, DVec3::ZERO, 1.0), None);
    }
}
