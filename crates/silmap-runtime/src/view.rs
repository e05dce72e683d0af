//! A camera as a matrix, and what has to be known of it: where its eye is, and what of the picture a sphere can reach.

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Vec4Swizzles};

use crate::{DepthDirection, PrepareError};

/// A camera: any projective map from the world to wgpu's clip space (x and y from −1 to 1, y up, depth from 0 to 1). Jitter, off-centre
/// and orthographic projections, reversed depth and an infinite far plane are in the matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From the world to clip space. In double precision, so that a world may lie far from its origin.
    pub clip_from_world: DMat4,
    /// Size of the viewport in pixels, columns and rows.
    pub size_px: (u32, u32),
}

/// The size of a projection's third row of which the rest must be more than this share, or the projection has no eye.
const PERSPECTIVE_REL: f64 = 1e-13;

/// What a frame needs of a [`View`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    pub(crate) clip_from_world: DMat4,
    rows: [DVec4; 4],
    /// The eye, with a 1 appended; or the unit direction towards it, with a 0, where projection is parallel.
    pub(crate) place: DVec4,
    pub(crate) size_px: DVec2,
    depth: DepthDirection,
}

/// The part of the picture that a sphere can reach, in normalised device coordinates, −1 to 1 in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rect {
    pub(crate) least: DVec2,
    pub(crate) most: DVec2,
}

impl View {
    /// The eye of the view.
    pub(crate) fn eye(&self, depth: DepthDirection) -> Result<Eye, PrepareError> {
        let matrix = self.clip_from_world;
        if !matrix.is_finite() {
            return Err(PrepareError::ViewNotFinite);
        }
        let rows = [0, 1, 2, 3].map(|i| matrix.row(i));
        let [x, y, z, w] = rows;
        let place = if w.xyz().length() <= PERSPECTIVE_REL * w.w.abs() {
            let across = x.xyz().cross(y.xyz()).try_normalize();
            let across = across.ok_or(PrepareError::ViewDegenerate)?;
            let deeper = z.xyz().dot(across);
            let is_away = match depth {
                DepthDirection::Forward => deeper > 0.0,
                DepthDirection::Reversed => deeper < 0.0,
            };
            (if is_away { -across } else { across }).extend(0.0)
        } else {
            // Where x, y and w are zero.
            let cross = [
                y.xyz().cross(w.xyz()),
                w.xyz().cross(x.xyz()),
                x.xyz().cross(y.xyz()),
            ];
            let determinant = x.xyz().dot(cross[0]);
            let eye = DMat3::from_cols(cross[0], cross[1], cross[2]) * DVec3::new(-x.w, -y.w, -w.w)
                / determinant;
            if !eye.is_finite() {
                return Err(PrepareError::ViewDegenerate);
            }
            eye.extend(1.0)
        };
        Ok(Eye {
            clip_from_world: matrix,
            rows,
            place,
            size_px: DVec2::new(self.size_px.0.into(), self.size_px.1.into()),
            depth,
        })
    }
}

impl Eye {
    /// What a sphere can reach of the picture; `None` where that is nothing.
    pub(crate) fn rect(&self, center: DVec3, radius: f64) -> Option<Rect> {
        let center = center.extend(1.0);
        let [x, y, z, w] = self.rows;
        let is_beyond = |plane: DVec4| plane.dot(center) < -radius * plane.xyz().length();
        let (near, far) = match self.depth {
            DepthDirection::Forward => (z, w - z),
            DepthDirection::Reversed => (w - z, z),
        };
        if is_beyond(near) || is_beyond(far) || is_beyond(w) {
            return None;
        }
        let across = bounds(x, w, center, radius);
        let along = bounds(y, w, center, radius);
        let is_seen = |(least, most): (f64, f64)| least <= 1.0 && most >= -1.0;
        (is_seen(across) && is_seen(along)).then_some(Rect {
            least: DVec2::new(across.0, along.0),
            most: DVec2::new(across.1, along.1),
        })
    }

    /// How far a point is from the eye, in units in which clip coordinates grow: to sort by.
    pub(crate) fn depth_of(&self, point: DVec3) -> f64 {
        if self.place.w > 0.0 {
            self.rows[3].dot(point.extend(1.0))
        } else {
            -self.place.xyz().dot(point)
        }
    }
}

/// Between which values of x/w a sphere is seen: where planes x − t·w touch it. Everything where the eye's plane cuts it.
fn bounds(x: DVec4, w: DVec4, center: DVec4, radius: f64) -> (f64, f64) {
    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
    let (a, b) = (x.dot(center), w.dot(center));
    let square = radius * radius;
    let (xx, xw, ww) = (
        x.xyz().length_squared(),
        x.xyz().dot(w.xyz()),
        w.xyz().length_squared(),
    );
    let second = b * b - square * ww;
    if b <= 0.0 || second <= 0.0 {
        return ALL;
    }
    let half = a * b - square * xw;
    let room = half * half - second * (a * a - square * xx);
    let root = room.max(0.0).sqrt();
    let (least, most) = ((half - root) / second, (half + root) / second);
    if least.is_finite() && most.is_finite() {
        (least, most)
    } else {
        ALL
    }
}

/// The largest radius of a sphere, over the side of the picture, that counts.
const MOST_PICTURES: f64 = 4.0;

impl Rect {
    /// Half the larger side, in pixels, whether in the picture or not; at most so many pictures.
    pub(crate) fn radius_px(&self, size_px: DVec2) -> f64 {
        let radius = ((self.most - self.least) * 0.25 * size_px).max_element();
        radius.min(MOST_PICTURES * size_px.max_element())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dcamera::rh::proj::directx::{
        orthographic, perspective, perspective_infinite_reverse,
    };
    use glam::dcamera::rh::view::look_at_mat4;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64)
            .prop_map(DVec3::from)
            .prop_filter("a direction", |v| v.length() > 0.2)
            .prop_map(DVec3::normalize_or_zero)
    }

    fn look(eye: DVec3, towards: DVec3) -> DMat4 {
        let target = eye + towards;
        look_at_mat4(eye, target, towards.any_orthonormal_vector())
    }

    proptest! {
        /// The eye is found in any perspective projection, jittered, reversed and infinite ones too.
        #[test]
        fn the_eye_is_found(
            towards in unit(), x in -1e6..1e6_f64, fov in 0.1..2.5_f64, jitter in -0.3..0.3_f64,
        ) {
            let eye = DVec3::new(x, -0.3 * x, 2.0);
            let jitter = DMat4::from_translation(DVec3::new(jitter, -jitter, 0.0));
            for (projection, depth) in [
                (perspective(fov, 1.4, 0.1, 100.0), DepthDirection::Forward),
                (perspective_infinite_reverse(fov, 1.4, 0.1), DepthDirection::Reversed),
            ] {
                let view = View { clip_from_world: jitter * projection * look(eye, towards), size_px: (64, 48) };
                let found = view.eye(depth).unwrap().place;
                prop_assert_eq!(found.w, 1.0);
                prop_assert!(found.xyz().distance(eye) < 1e-9 * (1.0 + x.abs()), "{found} is not {eye}");
            }
        }

        #[test]
        fn a_parallel_projection_has_a_direction(towards in unit(), x in -100.0..100.0_f64) {
            for (projection, depth) in [
                (orthographic(-2.0, 3.0, -1.0, 2.0, -5.0, 9.0), DepthDirection::Forward),
                (orthographic(-2.0, 3.0, -1.0, 2.0, 9.0, -5.0), DepthDirection::Reversed),
            ] {
                let view = View { clip_from_world: projection * look(DVec3::splat(x), towards), size_px: (64, 48) };
                let found = view.eye(depth).unwrap().place;
                prop_assert_eq!(found.w, 0.0);
                prop_assert!(found.xyz().distance(-towards) < 1e-9);
            }
        }

        /// No point of a sphere is seen outside of its rectangle, and the rectangle is no larger than it must be.
        #[test]
        fn a_sphere_stays_in_its_rectangle(
            middle in (-3.0..3.0_f64, -3.0..3.0_f64, -12.0..-1.5_f64), radius in 0.1..1.0_f64, towards in unit(),
        ) {
            let view = View {
                clip_from_world: perspective(1.0, 1.0, 0.1, 100.0),
                size_px: (100, 100),
            };
            let eye = view.eye(DepthDirection::Forward).unwrap();
            let center = DVec3::from(middle);
            let point = center + towards * radius;
            let seen = view.clip_from_world.project_point3(point);
            let is_in_picture = seen.x.abs() <= 1.0 && seen.y.abs() <= 1.0 && point.z < -0.1;
            match eye.rect(center, radius) {
                Some(rect) if point.z < 0.0 => {
                    prop_assert!((rect.least.cmple(seen.truncate() + 1e-9)).all());
                    prop_assert!((rect.most.cmpge(seen.truncate() - 1e-9)).all());
                }
                Some(_) => {}
                None => prop_assert!(!is_in_picture),
            }
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let mut view = View {
            clip_from_world: perspective(1.0, 1.0, 0.1, 100.0),
            size_px: (100, 100),
        };
        view.clip_from_world.x_axis.y = f64::NAN;
        assert!(matches!(
            view.eye(DepthDirection::Forward),
            Err(PrepareError::ViewNotFinite)
        ));
        view.clip_from_world = DMat4::ZERO;
        assert!(matches!(
            view.eye(DepthDirection::Forward),
            Err(PrepareError::ViewDegenerate)
        ));
    }
}
