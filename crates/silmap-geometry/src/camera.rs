//! Pinhole cameras: the one projection that capture, interpolation, textures and rendering share.

use glam::{DMat4, DVec2, DVec3, DVec4};
use thiserror::Error;

/// Margin left around the bounding sphere when a camera is fitted to it, as a factor on the half-tangent.
pub const FIT_MARGIN: f64 = 1.02;

/// Within this angle (radians, 18°) of the ±Y axis a camera takes +Z for up instead of +Y.
pub const POLE_ANGLE_RAD: f64 = std::f64::consts::PI / 10.0;

/// Which pixels count as covered by a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CoverageRule {
    /// A pixel is covered when its centre is.
    #[default]
    Center,
    /// A pixel is covered when any point of it is: the rule that conservative statements are made for.
    Any,
}

/// Why a camera cannot be made.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CameraError {
    /// The eye lies in the bounding sphere, so no image holds the whole model.
    #[error(
        "the eye is {} from the center, inside the bounding sphere of radius {}: move it farther out",
        in_short(*.distance),
        in_short(*.radius)
    )]
    EyeInsideBounds {
        /// Distance from the eye to the center, model units.
        distance: f64,
        /// Radius of the bounding sphere, model units.
        radius: f64,
    },
    /// Eye and target coincide, so there is no direction to look in.
    #[error("the eye and the target are the same point: there is no direction to look in")]
    NoDirection,
    /// So far from the target that the numbers overflow.
    #[error(
        "the eye is too far from what it looks at: the square of that distance is no number any more"
    )]
    TooFar,
    /// A number is NaN or infinite.
    #[error("a camera number is not finite")]
    NotFinite,
    /// The up vector is parallel to the viewing direction.
    #[error("the up vector is zero or parallel to the viewing direction")]
    UpAlongView,
    /// The field of view is not in (0°, 180°).
    #[error("the field of view must lie between 0 and 180 degrees, not {}", in_short(*.degrees))]
    FieldOfView {
        /// The offending angle.
        degrees: f64,
    },
    /// The image has no pixels or too many.
    #[error(
        "an image of {width} × {height} pixels cannot be made: each side has 1 to {MAX_SIDE_PX}"
    )]
    ImageSize {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
    },
}

/// A number for a sentence, with four significant digits and no more.
#[must_use]
pub fn in_short(value: f64) -> String {
    let digits = 3.0 - value.abs().log10().floor();
    if value == 0.0 || (0.0..=8.0).contains(&digits) {
        let text = format!("{value:.*}", if value == 0.0 { 0 } else { digits as usize });
        return match text.trim_end_matches('0') {
            short if text.contains('.') => short.trim_end_matches('.').to_owned(),
            _ => text,
        };
    }
    if (-5.0..0.0).contains(&digits) {
        let unit = 10.0_f64.powi(-digits as i32);
        return format!("{:.0}", (value / unit).round() * unit);
    }
    format!("{value:.3e}")
}

/// A vector's direction, however long it is.
fn direction_of(vector: DVec3) -> Option<DVec3> {
    vector.try_normalize().or_else(|| {
        // The square of its length is no number, or nothing.
        let largest = vector.abs().max_element();
        (largest > 0.0).then(|| (vector / largest).normalize_or_zero())
    })
}

/// Largest image side in pixels that a camera may have.
pub const MAX_SIDE_PX: u32 = 16_384;

/// A pinhole camera with an orthonormal frame and a rectangular image.
///
/// A point at `forward` distance z > 0 with lateral offsets (x, y) along (`right`, `up`) falls on image coordinates
/// `(width/2 · (1 + o_x + x/(z·tan_x)), height/2 · (1 − o_y − y/(z·tan_y)))`, where o is `center_offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection, object space.
    pub eye: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit viewing direction.
    pub forward: DVec3,
    /// Tangents of half the horizontal and vertical fields of view, of an image whose middle is where `forward` points.
    pub half_tangent: DVec2,
    /// Where `forward` meets the image, from its middle and in half image sizes: x right, y *up*. Zero for cameras of
    /// [`Self::look_at`] and [`Self::fit_sphere`]; those of photographs, and parts of a larger image, have their principal point elsewhere.
    pub center_offset: DVec2,
    /// Columns of the image.
    pub width_px: u32,
    /// Rows of the image.
    pub height_px: u32,
}

impl Camera {
    /// A camera at `eye` that looks at `target`.
    ///
    /// `up_hint` defaults to [`default_up`]; `fov_y_rad` is the whole vertical angle; pixels are square.
    ///
    /// # Errors
    /// When a number is not finite, eye and target coincide, the angle is out of range, the up vector is parallel to the
    /// viewing direction, or the image size is zero or over [`MAX_SIDE_PX`].
    pub fn look_at(
        eye: DVec3,
        target: DVec3,
        up_hint: Option<DVec3>,
        fov_y_rad: f64,
        size_px: (u32, u32),
    ) -> Result<Self, CameraError> {
        if !(0.0 < fov_y_rad && fov_y_rad < std::f64::consts::PI) {
            return Err(CameraError::FieldOfView {
                degrees: fov_y_rad.to_degrees(),
            });
        }
        Self::with_half_tangent(eye, target, up_hint, (fov_y_rad / 2.0).tan(), size_px)
    }

    /// The camera at `eye` that looks at `center` and whose image just holds the sphere of `radius` about it, with
    /// [`FIT_MARGIN`]: half-tangent 1.02·R/√(|p−c|²−R²) for the shorter side of the image.
    ///
    /// # Errors
    /// When the eye lies in the sphere, and as [`Camera::look_at`].
    pub fn fit_sphere(
        eye: DVec3,
        center: DVec3,
        radius: f64,
        up_hint: Option<DVec3>,
        size_px: (u32, u32),
    ) -> Result<Self, CameraError> {
        let distance = eye.distance(center);
        let room = distance * distance - radius * radius;
        if !(eye.is_finite() && center.is_finite() && radius.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        let tangent = FIT_MARGIN * radius / room.max(0.0).sqrt();
        if room <= 0.0 || !tangent.is_finite() {
            return Err(CameraError::EyeInsideBounds { distance, radius });
        }
        let (width, height) = size_px;
        let tangent_y = if width < height {
            tangent * f64::from(height) / f64::from(width.max(1))
        } else {
            tangent
        };
        Self::with_half_tangent(eye, center, up_hint, tangent_y, size_px)
    }

    /// A camera with the tangent of half its vertical field of view given.
    ///
    /// # Errors
    /// As [`Camera::look_at`].
    pub fn with_half_tangent(
        eye: DVec3,
        target: DVec3,
        up_hint: Option<DVec3>,
        half_tangent_y: f64,
        (width_px, height_px): (u32, u32),
    ) -> Result<Self, CameraError> {
        if !(eye.is_finite()
            && target.is_finite()
            && half_tangent_y.is_finite()
            && up_hint.is_none_or(DVec3::is_finite))
        {
            return Err(CameraError::NotFinite);
        }
        if !(1..=MAX_SIDE_PX).contains(&width_px) || !(1..=MAX_SIDE_PX).contains(&height_px) {
            return Err(CameraError::ImageSize {
                width: width_px,
                height: height_px,
            });
        }
        if !(target - eye).length_squared().is_finite() {
            return Err(CameraError::TooFar);
        }
        let forward = direction_of(target - eye).ok_or(CameraError::NoDirection)?;
        let hint = match up_hint {
            Some(up) => direction_of(up).ok_or(CameraError::UpAlongView)?,
            None => default_up(forward),
        };
        // A sine below this leaves no digits in the frame.
        const PARALLEL_SINE: f64 = 1e-9;
        let side = forward.cross(hint);
        if side.length() < PARALLEL_SINE {
            return Err(CameraError::UpAlongView);
        }
        let right = side.normalize_or_zero();
        let half_tangent = DVec2::new(
            half_tangent_y * f64::from(width_px) / f64::from(height_px),
            half_tangent_y,
        );
        Ok(Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            half_tangent,
            center_offset: DVec2::ZERO,
            width_px,
            height_px,
        })
    }

    /// The same camera, moved.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        Self {
            eye: self.eye + by,
            ..*self
        }
    }

    /// Image size in pixels, as floats.
    #[must_use]
    pub fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width_px), f64::from(self.height_px))
    }

    /// Distance of `point` along the viewing direction; positive in front of the eye.
    #[must_use]
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.eye).dot(self.forward)
    }

    /// Where `point` falls in the image, pixels. The point must lie in front of the eye.
    #[must_use]
    pub fn image_from_object(&self, point: DVec3) -> DVec2 {
        self.image_from_direction(point - self.eye)
    }

    /// Where the ray from the eye along `direction` (any length, forward part positive) meets the image, pixels.
    #[must_use]
    pub fn image_from_direction(&self, direction: DVec3) -> DVec2 {
        let z = direction.dot(self.forward);
        let x = direction.dot(self.right) / (z * self.half_tangent.x);
        let y = direction.dot(self.up) / (z * self.half_tangent.y);
        DVec2::new(
            f64::from(self.width_px) * 0.5 * (1.0 + self.center_offset.x + x),
            f64::from(self.height_px) * 0.5 * (1.0 - self.center_offset.y - y),
        )
    }

    /// Direction of the ray through an image point; its component along `forward` is 1.
    #[must_use]
    pub fn direction_from_image(&self, point_px: DVec2) -> DVec3 {
        let off = self.center_offset;
        let x = (2.0 * point_px.x / f64::from(self.width_px) - 1.0 - off.x) * self.half_tangent.x;
        let y = (1.0 - 2.0 * point_px.y / f64::from(self.height_px) - off.y) * self.half_tangent.y;
        self.forward + self.right * x + self.up * y
    }

    /// The point of object space at an image point and a depth along `forward`.
    #[must_use]
    pub fn object_from_image(&self, point_px: DVec2, depth: f64) -> DVec3 {
        self.eye + self.direction_from_image(point_px) * depth
    }

    /// Vertical field of view, radians; of an image whose middle is where the camera looks.
    #[must_use]
    pub fn fov_y_rad(&self) -> f64 {
        2.0 * self.half_tangent.y.atan()
    }

    /// The same view with another image size; the vertical field of view stays, pixels stay square.
    #[must_use]
    pub fn resized(&self, (width_px, height_px): (u32, u32)) -> Self {
        let tangent_y = self.half_tangent.y;
        let half_tangent = DVec2::new(
            tangent_y * f64::from(width_px) / f64::from(height_px),
            tangent_y,
        );
        Self {
            half_tangent,
            width_px,
            height_px,
            ..*self
        }
    }

    /// The camera whose image is a part of this one's, or reaches beyond it: `corner_px` is where its top-left corner is in this image.
    #[must_use]
    pub fn cropped(&self, corner_px: DVec2, (width_px, height_px): (u32, u32)) -> Self {
        let size = DVec2::new(f64::from(width_px), f64::from(height_px));
        // From the middle of the part, pixels, y down.
        let axis = self.principal_px() - corner_px - 0.5 * size;
        Self {
            half_tangent: self.half_tangent * (size / self.size()),
            center_offset: axis * DVec2::new(2.0, -2.0) / size,
            width_px,
            height_px,
            ..*self
        }
    }

    /// Pixels that a unit of lateral offset at unit depth covers, along columns and rows: the focal lengths.
    #[must_use]
    pub fn focal_px(&self) -> DVec2 {
        self.size() / (2.0 * self.half_tangent)
    }

    /// Where the viewing direction meets the image, pixels: the principal point.
    #[must_use]
    pub fn principal_px(&self) -> DVec2 {
        0.5 * self.size() * (1.0 + self.center_offset * DVec2::new(1.0, -1.0))
    }

    /// Object space to clip space with depth in [0, 1] (the convention of wgpu).
    #[must_use]
    pub fn clip_from_object(&self, near: f64, far: f64) -> DMat4 {
        let row = |axis: DVec3, scale: f64| {
            DVec4::new(axis.x, axis.y, axis.z, -axis.dot(self.eye)) * scale
        };
        let forward = row(self.forward, 1.0);
        let depth = forward * (far / (far - near)) - DVec4::W * (far * near / (far - near));
        DMat4::from_cols(
            row(self.right, 1.0 / self.half_tangent.x) + forward * self.center_offset.x,
            row(self.up, 1.0 / self.half_tangent.y) + forward * self.center_offset.y,
            depth,
            forward,
        )
        .transpose()
    }
}

/// The up direction used everywhere when none is given: +Y, and +Z within 18° of the poles.
#[must_use]
pub fn default_up(forward: DVec3) -> DVec3 {
    if forward.normalize_or_zero().y.abs() > POLE_ANGLE_RAD.cos() {
        DVec3::Z
    } else {
        DVec3::Y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Any camera with its axis anywhere in or beside the image and pixels that are not square.
    fn any_camera() -> impl Strategy<Value = Camera> {
        let tangents = (0.01..2.0_f64, 0.01..2.0_f64).prop_map(DVec2::from);
        let offset = (-3.0..3.0_f64, -3.0..3.0_f64).prop_map(DVec2::from);
        (tangents, offset).prop_map(|(half_tangent, center_offset)| Camera {
            half_tangent,
            center_offset,
            ..camera()
        })
    }

    proptest! {
        #[test]
        fn projection_and_ray_are_inverse_wherever_the_axis_is(
            camera in any_camera(), x in -200.0..900.0_f64, y in -200.0..900.0_f64, depth in 0.1..9.0_f64,
        ) {
            let image = DVec2::new(x, y);
            let point = camera.object_from_image(image, depth);
            prop_assert!((camera.depth(point) - depth).abs() < 1e-12);
            prop_assert!(camera.image_from_object(point).distance(image) < 1e-7);
            let clip = camera.clip_from_object(0.05, 20.0) * point.extend(1.0);
            let ndc = clip.truncate() / clip.w;
            let by_matrix = DVec2::new((ndc.x + 1.0) * 320.0, (1.0 - ndc.y) * 240.0);
            prop_assert!(by_matrix.distance(image) < 1e-7);
            let offset = camera.focal_px() * DVec2::new(
                (point - camera.eye).dot(camera.right), -(point - camera.eye).dot(camera.up)) / depth;
            prop_assert!((camera.principal_px() + offset).distance(image) < 1e-7);
        }

        /// A part of an image shows what the image shows there, and a part of a part is a part.
        #[test]
        fn parts_of_an_image_show_the_same(
            camera in any_camera(), x in 0.0..640.0_f64, y in 0.0..480.0_f64, left in -90_i32..600, top in -90_i32..400, side in 1_u32..300,
        ) {
            let corner = DVec2::new(left.into(), top.into());
            let part = camera.cropped(corner, (side, 2 * side));
            let ray = camera.direction_from_image(DVec2::new(x, y));
            prop_assert!((part.image_from_direction(ray) + corner).distance(DVec2::new(x, y)) < 1e-7);
            let again = part.cropped(-corner, (640, 480));
            prop_assert!(again.half_tangent.distance(camera.half_tangent) < 1e-12);
            prop_assert!(again.center_offset.distance(camera.center_offset) < 1e-9);
        }
    }

    fn camera() -> Camera {
        Camera::fit_sphere(
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(0.1, 0.2, -0.1),
            1.0,
            None,
            (640, 480),
        )
        .unwrap()
    }

    #[test]
    fn projection_and_ray_are_inverse() {
        let camera = camera();
        let point = DVec3::new(0.3, -0.2, 0.4);
        let image = camera.image_from_object(point);
        let back = camera.object_from_image(image, camera.depth(point));
        assert!(back.distance(point) < 1e-12, "{back} is not {point}");
    }

    #[test]
    fn clip_space_agrees_with_the_image() {
        let camera = camera();
        let point = DVec3::new(0.3, -0.2, 0.4);
        let clip = camera.clip_from_object(0.1, 10.0) * point.extend(1.0);
        let ndc = clip.truncate() / clip.w;
        let image = DVec2::new((ndc.x + 1.0) * 320.0, (1.0 - ndc.y) * 240.0);
        assert!(image.distance(camera.image_from_object(point)) < 1e-9);
        assert!(ndc.z > 0.0 && ndc.z < 1.0);
    }

    #[test]
    fn fitted_camera_holds_the_sphere_in_both_orientations() {
        for size in [(640, 480), (480, 640), (512, 512)] {
            let camera =
                Camera::fit_sphere(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 1.0, None, size)
                    .unwrap();
            for k in 0..64 {
                let angle = f64::from(k) * 0.1;
                // The sphere's outline from the eye: a circle in the plane z = 1/3.
                let rim = DVec3::new(angle.cos(), angle.sin(), 0.0) * (8.0_f64 / 9.0).sqrt()
                    + DVec3::Z / 3.0;
                let p = camera.image_from_object(rim);
                assert!(p.x > 0.0 && p.y > 0.0 && p.x < camera.size().x && p.y < camera.size().y);
            }
        }
    }

    #[test]
    fn an_eye_in_the_model_is_refused() {
        for eye in [
            DVec3::ZERO,
            DVec3::new(0.5, 0.0, 0.0),
            DVec3::new(1.0, 0.0, 0.0),
        ] {
            let made = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 64));
            assert!(
                matches!(made, Err(CameraError::EyeInsideBounds { .. })),
                "{made:?}"
            );
        }
    }

    #[test]
    fn numbers_in_sentences_are_short() {
        let all = [
            0.0,
            1.0,
            0.123_456_789,
            12.345_678,
            -3.0,
            123_456.789,
            1e-20,
            2e30,
            0.000_123_456,
            9.999_96,
        ];
        assert_eq!(
            all.map(in_short),
            [
                "0",
                "1",
                "0.1235",
                "12.35",
                "-3",
                "123500",
                "1.000e-20",
                "2.000e30",
                "0.0001235",
                "10"
            ]
        );
        assert_eq!(in_short(f64::NAN), "NaN");
        let error = CameraError::EyeInsideBounds {
            distance: 1.0 / 3.0,
            radius: 2.0_f64.sqrt(),
        };
        assert_eq!(
            error.to_string(),
            "the eye is 0.3333 from the center, inside the bounding sphere of radius 1.414: move it farther out"
        );
    }
}
