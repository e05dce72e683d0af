//! A camera as calibration gives it: unequal focal lengths, a principal point anywhere, skew.
//!
//! Source: R. Hartley, A. Zisserman. Multiple View Geometry in Computer Vision, 2nd edition, 2004, section 6.2.4 (camera from
//! its matrix).

use glam::{DMat3, DVec2, DVec3};
use silmap_geometry::camera::MAX_SIDE_PX;
use thiserror::Error;

/// Rows of a 3×4 matrix.
pub type Matrix34 = [[f64; 4]; 3];

/// Rows of a 3×3 matrix.
pub(crate) type Matrix33 = [[f64; 3]; 3];

/// A row of a matrix that is this small beside what it is orthogonalised against has no direction of its own.
const RANK_TOLERANCE: f64 = 1e-9;

/// How far axes of a rotation may be from unit length and right angles.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// What is wrong with a camera's numbers.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PinholeFault {
    /// NaN or infinite.
    #[error("a number of its camera is not finite")]
    NotFinite,
    /// The left 3×3 block of the matrix is singular.
    #[error(
        "its matrix has no centre: the left 3×3 block has rank {rank}, and that of a camera has rank 3"
    )]
    Rank {
        /// Of the left 3×3 block.
        rank: u32,
    },
    /// Axes that are not orthonormal.
    #[error(
        "its rotation is none: the axes are off unit length or right angles by {deviation:.2e}"
    )]
    NoRotation {
        /// Largest element of R·Rᵀ − 1.
        deviation: f64,
    },
    /// A focal length that is not positive.
    #[error("its focal length is {value}, and must be positive")]
    Focal {
        /// The length, pixels.
        value: f64,
    },
    /// An image without pixels or with too many.
    #[error("its image has {width} × {height} pixels: each side must have 1 to {MAX_SIDE_PX}")]
    ImageSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// A pinhole camera with full intrinsics.
///
/// A point at (x, y, z) along `axes` from the eye falls on (fx·x/z + s·y/z + cx, fy·y/z + cy), in pixels from the image's
/// top-left *corner*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Centre of projection, object space.
    pub eye: DVec3,
    /// Unit vectors right, down and forward.
    pub axes: [DVec3; 3],
    /// Focal lengths along the columns and rows, pixels. Negative along the rows' direction where the picture is mirrored.
    pub focal: DVec2,
    /// Skew, pixels.
    pub skew: f64,
    /// Principal point, pixels from the top-left corner.
    pub principal: DVec2,
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
}

impl Pinhole {
    /// The camera of a matrix P = s·K·[R t] with s > 0, whose last row is positive in front. `shift` is added to the image
    /// coordinates that it gives.
    ///
    /// # Errors
    /// When a number is not finite, the matrix has no centre, or the image no pixels.
    pub fn from_matrix(
        p: &Matrix34,
        shift: f64,
        (width, height): (u32, u32),
    ) -> Result<Self, PinholeFault> {
        if !p.iter().flatten().all(|v| v.is_finite()) {
            return Err(PinholeFault::NotFinite);
        }
        // A unit of its own, so that products of small numbers are no zeros.
        let largest = p.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        let row = |r: usize| DVec3::new(p[r][0], p[r][1], p[r][2]) / largest.max(f64::MIN_POSITIVE);
        let rank = rank_of([row(0), row(1), row(2)]);
        if rank < 3 {
            return Err(PinholeFault::Rank { rank });
        }
        let scale = row(2).length();
        let rows = [row(0) / scale, row(1) / scale, row(2) / scale];
        let forward = rows[2];
        let cy = rows[1].dot(forward);
        let below = rows[1] - cy * forward;
        let fy = below.length();
        let down = below / fy;
        let (skew, cx) = (rows[0].dot(down), rows[0].dot(forward));
        let aside = rows[0] - skew * down - cx * forward;
        let mut fx = aside.length();
        let mut right = aside / fx;
        if right.cross(down).dot(forward) < 0.0 {
            (fx, right) = (-fx, -right);
        }
        let block = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let last = DVec3::new(p[0][3], p[1][3], p[2][3]) / (largest * scale);
        Self {
            eye: -(block.inverse() * last),
            axes: [right, down, forward],
            focal: DVec2::new(fx, fy),
            skew,
            principal: DVec2::new(cx + shift, cy + shift),
            width,
            height,
        }
        .checked()
    }

    /// The camera of K·\[R t\], as [`Self::from_matrix`] has it.
    ///
    /// # Errors
    /// As [`Self::from_matrix`], and when R is no rotation.
    pub(crate) fn from_parts(
        parts: (&Matrix33, &Matrix33, DVec3),
        shift: f64,
        size: (u32, u32),
    ) -> Result<Self, PinholeFault> {
        let deviation = rotation_deviation(parts.1.map(DVec3::from));
        if deviation > ROTATION_TOLERANCE {
            return Err(PinholeFault::NoRotation { deviation });
        }
        Self::from_matrix(&product(parts), shift, size)
    }

    /// The camera of a pose: its centre and the axes right, down and forward in object space.
    ///
    /// # Errors
    /// When a number is not finite, the axes are not orthonormal, a focal length is not positive, or the image has no pixels.
    pub fn from_pose(
        eye: DVec3,
        axes: [DVec3; 3],
        (focal, principal): (DVec2, DVec2),
        (width, height): (u32, u32),
    ) -> Result<Self, PinholeFault> {
        let deviation = rotation_deviation(axes);
        if deviation > ROTATION_TOLERANCE {
            return Err(PinholeFault::NoRotation { deviation });
        }
        if let Some(&value) = [focal.x, focal.y]
            .iter()
            .find(|v| v.is_finite() && **v <= 0.0)
        {
            return Err(PinholeFault::Focal { value });
        }
        let forward = axes[2].normalize_or_zero();
        let down = (axes[1] - axes[1].dot(forward) * forward).normalize_or_zero();
        // Left-handed axes are a mirrored picture.
        let (right, fx) = match axes[0].dot(down.cross(forward)) > 0.0 {
            true => (down.cross(forward), focal.x),
            false => (down.cross(forward), -focal.x),
        };
        Self {
            eye,
            axes: [right, down, forward],
            focal: DVec2::new(fx, focal.y),
            skew: 0.0,
            principal,
            width,
            height,
        }
        .checked()
    }

    fn checked(self) -> Result<Self, PinholeFault> {
        let numbers = [
            self.eye,
            self.axes[0],
            self.axes[1],
            self.axes[2],
            self.focal.extend(self.skew),
            self.principal.extend(0.0),
        ];
        if !numbers.iter().all(|v| v.is_finite()) {
            return Err(PinholeFault::NotFinite);
        }
        let (width, height) = (self.width, self.height);
        let is_size = |side| (1..=MAX_SIDE_PX).contains(&side);
        if !(is_size(width) && is_size(height)) {
            return Err(PinholeFault::ImageSize { width, height });
        }
        Ok(self)
    }

    /// A point along the axes from the eye: right, down, forward.
    #[must_use]
    pub fn camera_from_object(&self, point: DVec3) -> DVec3 {
        let offset = point - self.eye;
        DVec3::from_array(self.axes.map(|axis| offset.dot(axis)))
    }

    /// Where a point falls in the image, in pixels from the top-left corner, and its depth; `None` when it is not in front.
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<(DVec2, f64)> {
        let p = self.camera_from_object(point);
        if p.z <= 0.0 {
            return None;
        }
        Some((self.image(DVec2::new(p.x / p.z, p.y / p.z)), p.z))
    }

    /// Direction of the ray through an image point, with a forward part of one.
    #[must_use]
    pub fn direction(&self, image: DVec2) -> DVec3 {
        let DVec2 { x, y } = self.tangent(image);
        self.axes[0] * x + self.axes[1] * y + self.axes[2]
    }

    /// The direction (x, y, 1) of an image point, right, down and forward.
    #[must_use]
    pub fn tangent(&self, image: DVec2) -> DVec2 {
        let offset = image - self.principal;
        let y = offset.y / self.focal.y;
        DVec2::new((offset.x - self.skew * y) / self.focal.x, y)
    }

    /// The image point of the direction (x, y, 1).
    #[must_use]
    pub fn image(&self, tangent: DVec2) -> DVec2 {
        let DVec2 { x, y } = tangent;
        self.principal + DVec2::new(self.focal.x * x + self.skew * y, self.focal.y * y)
    }

    /// Takes an image point with a 1 appended to what [`Pinhole::direction`] has for it.
    #[must_use]
    pub fn ray_from_image(&self) -> DMat3 {
        let [origin, right, down] =
            [DVec2::ZERO, DVec2::X, DVec2::Y].map(|image| self.direction(image));
        DMat3::from_cols(right - origin, down - origin, origin)
    }

    /// Whether an image point lies in the picture.
    #[must_use]
    pub fn shows(&self, image: DVec2) -> bool {
        image.x >= 0.0
            && image.y >= 0.0
            && image.x <= f64::from(self.width)
            && image.y <= f64::from(self.height)
    }

    /// Pixels that a unit of length covers at a depth of one, about.
    #[must_use]
    pub fn pixels_per_tangent(&self) -> f64 {
        (self.focal.x * self.focal.y).abs().sqrt()
    }

    /// The matrix K·[R t] for image coordinates from the top-left corner.
    #[must_use]
    pub fn to_matrix(&self) -> Matrix34 {
        let rows = [
            self.axes[0] * self.focal.x
                + self.axes[1] * self.skew
                + self.axes[2] * self.principal.x,
            self.axes[1] * self.focal.y + self.axes[2] * self.principal.y,
            self.axes[2],
        ];
        rows.map(|r| [r.x, r.y, r.z, -r.dot(self.eye)])
    }

    /// The same camera, moved.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        Self {
            eye: self.eye + by,
            ..*self
        }
    }
}

/// Largest element of A·Aᵀ − 1, infinite where a number is not finite.
fn rotation_deviation(axes: [DVec3; 3]) -> f64 {
    let mut largest = 0.0_f64;
    for (i, a) in axes.iter().enumerate() {
        for (j, b) in axes.iter().enumerate() {
            let off = (a.dot(*b) - f64::from(u8::from(i == j))).abs();
            largest = if off.is_finite() {
                largest.max(off)
            } else {
                f64::INFINITY
            };
        }
    }
    largest
}

/// A matrix of its rows.
pub(crate) fn of_rows(m: &Matrix33) -> DMat3 {
    DMat3::from_cols_array_2d(m).transpose()
}

/// K·[R t].
pub(crate) fn product((k, r, t): (&Matrix33, &Matrix33, DVec3)) -> Matrix34 {
    let (block, last) = ((of_rows(k) * of_rows(r)).transpose(), of_rows(k) * t);
    let rows = block.to_cols_array_2d();
    std::array::from_fn(|i| [rows[i][0], rows[i][1], rows[i][2], last[i]])
}

/// The rank of three rows, by taking out of the later ones what lies along the earlier.
fn rank_of(rows: [DVec3; 3]) -> u32 {
    let mut basis: Vec<DVec3> = Vec::new();
    for row in rows {
        let mut rest = row;
        // Twice, as the first time leaves rounding of the row's own size.
        for _ in 0..2 {
            for b in &basis {
                rest -= rest.dot(*b) * *b;
            }
        }
        if rest.length() > RANK_TOLERANCE * row.length() && row.length() > 0.0 {
            basis.push(rest.normalize_or_zero());
        }
    }
    basis.len() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Pinhole {
        let axes = [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z];
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 0.7);
        Pinhole {
            skew: 3.5,
            ..Pinhole::from_pose(
                DVec3::new(1.0, -2.0, 9.0),
                axes.map(|a| turn * a),
                (DVec2::new(800.0, 790.0), DVec2::new(300.0, 260.0)),
                (640, 480),
            )
            .unwrap()
        }
    }

    #[test]
    fn a_camera_comes_back_from_its_matrix_whatever_its_scale() {
        for scale in [1.0, 1e-6, 1e9] {
            let matrix = camera().to_matrix().map(|row| row.map(|v| v * scale));
            let back = Pinhole::from_matrix(&matrix, 0.0, (640, 480)).unwrap();
            assert!(back.eye.distance(camera().eye) < 1e-9);
            assert!((back.skew - 3.5).abs() < 1e-8);
            assert!(back.focal.distance(camera().focal) < 1e-8);
            for (a, b) in back.axes.iter().zip(camera().axes) {
                assert!(a.distance(b) < 1e-10);
            }
        }
        let shifted = Pinhole::from_matrix(&camera().to_matrix(), 0.5, (640, 480)).unwrap();
        let expected = camera().principal + DVec2::splat(0.5);
        assert!(shifted.principal.distance(expected) < 1e-8);
    }

    #[test]
    fn ray_and_projection_are_inverse_and_agree_with_the_matrix() {
        let (camera, image) = (camera(), DVec2::new(123.0, 45.0));
        let point = camera.eye + camera.direction(image) * 4.0;
        let (found, depth) = camera.project(point).unwrap();
        assert!(found.distance(image) < 1e-9 && (depth - 4.0).abs() < 1e-12);
        let [a, b, w] = camera
            .to_matrix()
            .map(|r| DVec3::new(r[0], r[1], r[2]).dot(point) + r[3]);
        assert!(DVec2::new(a / w, b / w).distance(image) < 1e-8 && w > 0.0);
        assert_eq!(camera.project(camera.eye - camera.axes[2]), None);
    }

    #[test]
    fn a_mirrored_picture_has_a_negative_focal_length() {
        let mut matrix = camera().to_matrix();
        // Columns counted from the right.
        matrix[0] = std::array::from_fn(|k| 640.0 * matrix[2][k] - matrix[0][k]);
        let mirrored = Pinhole::from_matrix(&matrix, 0.0, (640, 480)).unwrap();
        assert!((mirrored.focal.x + 800.0).abs() < 1e-8);
        let point = camera().eye + camera().direction(DVec2::new(100.0, 50.0));
        let (found, _) = mirrored.project(point).unwrap();
        assert!(found.distance(DVec2::new(540.0, 50.0)) < 1e-8);
    }

    #[test]
    fn matrices_without_a_centre_are_refused_with_their_rank() {
        let rank = |p: Matrix34| Pinhole::from_matrix(&p, 0.0, (8, 8)).unwrap_err();
        assert_eq!(rank([[0.0; 4]; 3]), PinholeFault::Rank { rank: 0 });
        let mut two = camera().to_matrix();
        two[1] = std::array::from_fn(|k| two[0][k] * 0.5 - two[2][k]);
        assert_eq!(rank(two), PinholeFault::Rank { rank: 2 });
        let mut nan = camera().to_matrix();
        nan[1][3] = f64::NAN;
        assert_eq!(rank(nan), PinholeFault::NotFinite);
    }
}
