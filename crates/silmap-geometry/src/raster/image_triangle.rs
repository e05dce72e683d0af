//! A triangle as a camera sees it, its pixel centres tested in `f64`.
//!
//! A centre on an edge belongs to both faces; the caller lets the nearer one win, or of two equally near ones the one drawn first.
//! Depth is returned as its reciprocal, which is linear in the image.

use glam::{DVec2, DVec3};

use super::rows::{centres_between, visit_rows};
use crate::Camera;

/// Faces whose doubled image area is below this many square pixels cover no centre worth having.
const MIN_DOUBLE_AREA_PX2: f64 = 1e-9;

/// A triangle in the image, ready to be walked over.
#[derive(Clone, Copy, Debug)]
pub struct ImageTriangle {
    corners: [DVec2; 3],
    inverse_depths: [f64; 3],
    double_area: f64,
}

/// One pixel centre in an [`ImageTriangle`].
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Row-major index of the pixel.
    pub pixel: usize,
    /// Reciprocal of the depth along the camera's `forward`.
    pub inverse_depth: f64,
    /// Weights of the corners *in the image*, with sum one.
    pub image_weights: [f64; 3],
}

/// A vertex in the image.
#[derive(Clone, Copy, Debug)]
pub struct ImageVertex {
    /// Where it is seen, pixels.
    pub place: DVec2,
    /// Reciprocal of its depth along the camera's `forward`; zero or less behind the eye.
    pub inverse_depth: f64,
}

impl ImageVertex {
    /// Projects a point.
    #[must_use]
    pub fn project(camera: &Camera, p: DVec3) -> Self {
        Self {
            place: camera.image_from_object(p),
            inverse_depth: camera.depth(p).recip(),
        }
    }
}

impl ImageTriangle {
    /// Projects a triangle; `None` when it faces away, is seen edge-on, or reaches behind the eye.
    #[must_use]
    pub fn project(camera: &Camera, corners: [DVec3; 3]) -> Option<Self> {
        Self::of_vertices(corners.map(|p| ImageVertex::project(camera, p)))
    }

    /// The triangle between projected vertices, under the same conditions.
    #[must_use]
    pub fn of_vertices(vertices: [ImageVertex; 3]) -> Option<Self> {
        // The comparison is false for NaN, too.
        if !vertices.iter().all(|v| v.inverse_depth > 0.0) {
            return None;
        }
        let image = vertices.map(|v| v.place);
        // Image y runs down, so counter-clockwise faces have negative area here; swap its sign.
        let double_area = -(image[1] - image[0]).perp_dot(image[2] - image[0]);
        (double_area > MIN_DOUBLE_AREA_PX2).then_some(Self {
            corners: image,
            inverse_depths: vertices.map(|v| v.inverse_depth),
            double_area,
        })
    }

    /// Calls `visit` for every pixel centre inside, row by row.
    pub fn visit(&self, camera: &Camera, mut visit: impl FnMut(Sample)) {
        let [a, b, c] = self.corners;
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        let rows = centres_between(low.y, high.y, camera.height_px);
        let columns = centres_between(low.x, high.x, camera.width_px);
        visit_rows(self.corners, rows, columns, |y, columns| {
            for x in columns {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let weights = [
                    -(c - b).perp_dot(p - b),
                    -(a - c).perp_dot(p - c),
                    -(b - a).perp_dot(p - a),
                ];
                if weights.iter().all(|&w| w >= 0.0) {
                    let image_weights = weights.map(|w| w / self.double_area);
                    visit(Sample {
                        pixel: y as usize * camera.width_px as usize + x as usize,
                        inverse_depth: dot(image_weights, self.inverse_depths),
                        image_weights,
                    });
                }
            }
        });
    }

    /// Weights of the corners in space from those in the image.
    #[must_use]
    pub fn object_weights(&self, image_weights: [f64; 3]) -> [f64; 3] {
        let scaled: [f64; 3] = std::array::from_fn(|k| image_weights[k] * self.inverse_depths[k]);
        let sum: f64 = scaled.iter().sum();
        scaled.map(|w| w / sum)
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::fit_sphere(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 1.0, None, (64, 64)).unwrap()
    }

    #[test]
    fn weights_lead_back_to_the_point_seen() {
        let corners = [
            DVec3::new(-0.6, -0.5, 0.6),
            DVec3::new(0.7, -0.4, -0.5),
            DVec3::new(0.0, 0.6, 0.1),
        ];
        let camera = camera();
        let triangle = ImageTriangle::project(&camera, corners).unwrap();
        let mut count = 0;
        triangle.visit(&camera, |sample| {
            let weights = triangle.object_weights(sample.image_weights);
            let point: DVec3 = (0..3).map(|k| corners[k] * weights[k]).sum();
            let x = (sample.pixel % 64) as f64 + 0.5;
            let y = (sample.pixel / 64) as f64 + 0.5;
            assert!(camera.image_from_object(point).distance(DVec2::new(x, y)) < 1e-9);
            assert!((1.0 / sample.inverse_depth - camera.depth(point)).abs() < 1e-9);
            count += 1;
        });
        assert!(count > 100, "{count} samples");
    }

    proptest::proptest! {
        #[test]
        fn rows_lose_no_pixel(
            at in proptest::array::uniform6(-300.0..400.0_f64),
            // Also with corners on pixel centres, and with edges along rows or columns.
            step in proptest::sample::select(vec![1e-9, 0.5, 64.0]),
        ) {
            let at = at.map(|c| (c / step).round() * step);
            let corners = [[at[0], at[1]], [at[2], at[3]], [at[4], at[5]]].map(DVec2::from);
            let vertices = corners.map(|place| ImageVertex { place, inverse_depth: 1.0 });
            let Some(triangle) = ImageTriangle::of_vertices(vertices) else { return Ok(()) };
            let camera = camera();
            let mut found = Vec::new();
            triangle.visit(&camera, |sample| found.push(sample.pixel));
            let [a, b, c] = corners;
            let expected: Vec<usize> = (0..64 * 64)
                .filter(|k| {
                    let p = DVec2::new((k % 64) as f64 + 0.5, (k / 64) as f64 + 0.5);
                    [(b, c), (c, a), (a, b)].into_iter().all(|(s, t)| -(t - s).perp_dot(p - s) >= 0.0)
                })
                .collect();
            proptest::prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn what_reaches_behind_the_eye_or_is_not_finite_is_left_out() {
        let behind = [DVec3::new(0.0, 0.0, 6.0), DVec3::X, DVec3::Y];
        let nan = [DVec3::NAN, DVec3::X, DVec3::Y];
        for corners in [behind, nan] {
            assert!(ImageTriangle::project(&camera(), corners).is_none());
        }
    }
}
