//! Rectifying two views so that corresponding points share a scanline (section 5.2).
//!
//! Source: Silhouette Mapping, section 5.2, "Epipolar decomposition".

use glam::{DMat3, DVec2, DVec3};
use silmap_geometry::Camera;

/// Smallest share of a ray along the frame's forward axis (its cosine) that a rectified image can hold.
pub const MIN_FORWARD_COSINE: f64 = 0.02;

/// The shared frame of a pair of viewpoints (and of every viewpoint on the line through them).
///
/// In it a ray d is (x, y) = (d·b, d·u)/(d·f): equal y is the same epipolar plane, and a point that does not move has an x
/// that is linear in the viewpoint's place on the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpipolarFrame {
    /// Unit vector from the first viewpoint to the second.
    pub b: DVec3,
    /// Unit vector across the scanlines.
    pub u: DVec3,
    /// Unit viewing direction, orthogonal to `b`.
    pub f: DVec3,
}

impl EpipolarFrame {
    /// The frame of viewpoints `p1` and `p2` that looks at `center`; `None` when the three are in line.
    #[must_use]
    pub fn new(p1: DVec3, p2: DVec3, center: DVec3) -> Option<Self> {
        let b = (p2 - p1).try_normalize()?;
        let towards = center - (p1 + p2) * 0.5;
        let across = towards - b * towards.dot(b);
        // A shorter part across the line than this share leaves no digits in the frame.
        const MIN_ACROSS: f64 = 1e-9;
        if across.length() <= MIN_ACROSS * towards.length() {
            return None;
        }
        let f = across.try_normalize()?;
        Some(Self {
            b,
            u: f.cross(b),
            f,
        })
    }

    /// The matrix from homogeneous rays in object space to homogeneous rectified coordinates.
    #[must_use]
    pub fn epipolar_from_object(&self) -> DMat3 {
        DMat3::from_cols(self.b, self.u, self.f).transpose()
    }

    /// The matrix from pixels of `camera` (with a 1 appended) to homogeneous rectified coordinates.
    #[must_use]
    pub fn epipolar_from_image(&self, camera: &Camera) -> DMat3 {
        self.epipolar_from_object() * object_from_image(camera)
    }

    /// The object-space direction of a rectified point.
    #[must_use]
    pub fn direction(&self, point: DVec2) -> DVec3 {
        self.b * point.x + self.u * point.y + self.f
    }
}

/// The matrix from pixels (with a 1 appended) to rays in object space.
#[must_use]
pub fn object_from_image(camera: &Camera) -> DMat3 {
    let step_x = camera.right * (2.0 * camera.half_tangent.x / f64::from(camera.width_px));
    let step_y = camera.up * (-2.0 * camera.half_tangent.y / f64::from(camera.height_px));
    // From the middle of the image to its corner, and from there to where the camera looks.
    let (tangent, off) = (camera.half_tangent, camera.center_offset);
    let corner = camera.forward - camera.right * (tangent.x * (1.0 + off.x))
        + camera.up * (tangent.y * (1.0 - off.y));
    DMat3::from_cols(step_x, step_y, corner)
}

/// The matrix from rays in object space to homogeneous pixels.
#[must_use]
pub fn image_from_object(camera: &Camera) -> DMat3 {
    let (half, axis) = (camera.size() * 0.5, camera.principal_px());
    let x = camera.right * (half.x / camera.half_tangent.x) + camera.forward * axis.x;
    let y = camera.up * (-half.y / camera.half_tangent.y) + camera.forward * axis.y;
    DMat3::from_cols(x, y, camera.forward).transpose()
}

/// The place of a homogeneous point; `None` where it lies behind or almost beside the frame.
#[must_use]
pub fn project(q: DVec3) -> Option<DVec2> {
    let is_ahead =
        q.z > 0.0 && q.z * q.z > MIN_FORWARD_COSINE * MIN_FORWARD_COSINE * q.length_squared();
    is_ahead.then(|| DVec2::new(q.x / q.z, q.y / q.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = f64> {
        -1.0..1.0_f64
    }

    proptest! {
        /// A fixed point keeps its scanline, and its x is linear between the viewpoints.
        #[test]
        fn parallax_is_horizontal_and_linear(
            x in unit(), y in unit(), z in unit(), turn in 0.05..1.0_f64, alpha in 0.0..1.0_f64,
        ) {
            let point = DVec3::new(x, y, z) * 0.5;
            let p1 = DVec3::new(0.0, 0.4, 3.0);
            let p2 = DVec3::new(3.0 * turn.sin(), -0.2, 3.0 * turn.cos());
            let frame = EpipolarFrame::new(p1, p2, DVec3::ZERO).unwrap();
            let seen = |eye: DVec3| {
                let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (512, 512)).unwrap();
                project(frame.epipolar_from_image(&camera) * camera.image_from_object(point).extend(1.0)).unwrap()
            };
            let (s1, s2, se) = (seen(p1), seen(p2), seen(p1.lerp(p2, alpha)));
            prop_assert!((s1.y - s2.y).abs() < 1e-12);
            prop_assert!(se.distance(s1.lerp(s2, alpha)) < 1e-12);
        }
    }

    #[test]
    fn image_matrices_are_inverse_and_agree_with_the_camera() {
        let camera = Camera::fit_sphere(
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::ZERO,
            1.0,
            None,
            (640, 480),
        )
        .unwrap();
        let camera = Camera {
            center_offset: DVec2::new(0.3, -1.4),
            ..camera
        };
        let pixel = DVec2::new(100.25, 400.5);
        let ray = object_from_image(&camera) * pixel.extend(1.0);
        assert!(ray.distance(camera.direction_from_image(pixel)) < 1e-12);
        let back =
            project(image_from_object(&camera) * DVec3::new(ray.x / ray.z, ray.y / ray.z, 1.0));
        let direct = image_from_object(&camera) * ray;
        assert!(DVec2::new(direct.x / direct.z, direct.y / direct.z).distance(pixel) < 1e-9);
        assert!(back.is_some() || ray.z < 0.0);
    }
}
