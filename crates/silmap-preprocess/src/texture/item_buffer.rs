//! An item buffer: the visible face and its depth at each pixel, rasterised on the CPU.
//!
//! Pixels are sampled at their centres; a centre on an edge belongs to both faces, and the nearer one wins, or of two
//! equally near ones the one drawn first. Depth is kept as its reciprocal, which is linear in the image.

use std::ops::Range;

use glam::{DVec2, DVec3};
use silmap_geometry::{Camera, TriangleMesh};

/// Stands for "no face".
pub(super) const NOTHING: u32 = u32::MAX;

/// Up to this distance from the image's corner, pixels, rounding moves an edge's place in a row by far less than a pixel.
const MOST_SURE_PX: f64 = 1e9;

/// More than rounding moves an edge's place in a row.
const ROUNDING_PX: f64 = 0.01;

/// Faces whose doubled image area is below this many square pixels cover no centre worth having.
const MIN_DOUBLE_AREA_PX2: f64 = 1e-9;

/// A triangle in the image, ready to be walked over.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageTriangle {
    corners: [DVec2; 3],
    inverse_depths: [f64; 3],
    double_area: f64,
}

/// An edge of an [`ImageTriangle`] as a column that depends on the row.
#[derive(Clone, Copy, Debug)]
struct EdgeByRow {
    start: DVec2,
    /// Columns per row; infinite or not a number for an edge along a row, which then bounds nothing.
    slope: f64,
    /// Positive where the triangle is to the right of the edge.
    rise: f64,
}

/// The columns of a row whose centres may be in the triangle with these edges: without it, a needle across the image would cost as
/// many pixels as its box.
fn columns_between(edges: &[EdgeByRow; 3], y: f64, columns: Range<usize>) -> Range<usize> {
    let (mut from, mut to) = (columns.start as f64, columns.end as f64);
    for edge in edges {
        // The column of the pixel whose centre is where the edge crosses the row.
        let crossing = edge.start.x + edge.slope * (y - edge.start.y) - 0.5;
        if !crossing.is_finite() {
            continue;
        }
        if edge.rise > 0.0 {
            from = from.max(crossing - ROUNDING_PX);
        } else {
            to = to.min(crossing + ROUNDING_PX);
        }
    }
    // Casts cut off: one more where something was cut off, and the end comes after the last column.
    let first = from as usize;
    let first = first + usize::from((first as f64) < from);
    let end = if to < 0.0 {
        0
    } else {
        (to as usize + 1).min(columns.end)
    };
    first..end.max(first)
}

/// One pixel centre in an [`ImageTriangle`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Row-major index of the pixel.
    pub(super) pixel: usize,
    /// Reciprocal of the depth along the camera's `forward`.
    pub(super) inverse_depth: f64,
    /// Weights of the corners *in the image*, with sum one.
    pub(super) image_weights: [f64; 3],
}

/// A vertex in the image.
#[derive(Clone, Copy, Debug)]
struct ImageVertex {
    place: DVec2,
    /// Zero or less behind the eye.
    inverse_depth: f64,
}

impl ImageVertex {
    fn project(camera: &Camera, p: DVec3) -> Self {
        Self {
            place: camera.image_from_object(p),
            inverse_depth: camera.depth(p).recip(),
        }
    }
}

impl ImageTriangle {
    /// Projects a triangle; `None` when it faces away, is seen edge-on, or reaches behind the eye.
    pub(super) fn project(camera: &Camera, corners: [DVec3; 3]) -> Option<Self> {
        Self::of_vertices(corners.map(|p| ImageVertex::project(camera, p)))
    }

    /// The triangle between projected vertices, under the same conditions.
    fn of_vertices(vertices: [ImageVertex; 3]) -> Option<Self> {
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
    pub(super) fn visit(&self, camera: &Camera, mut visit: impl FnMut(Sample)) {
        let [a, b, c] = self.corners;
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        let (width, height) = (camera.width_px as usize, camera.height_px as usize);
        // Casts of floats saturate, so a triangle far outside gives an empty range.
        let first = |x: f64| (x - 0.5).ceil().max(0.0) as usize;
        let end = |x: f64, size: usize| ((x - 0.5).floor() + 1.0).clamp(0.0, size as f64) as usize;
        let columns = first(low.x)..end(high.x, width);
        let edges = self.has_sure_columns().then(|| self.edges_by_row());
        for y in first(low.y)..end(high.y, height) {
            let columns = match &edges {
                Some(edges) => columns_between(edges, y as f64 + 0.5, columns.clone()),
                None => columns.clone(),
            };
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
                        pixel: y * width + x,
                        inverse_depth: dot(image_weights, self.inverse_depths),
                        image_weights,
                    });
                }
            }
        }
    }

    /// Whether places of edges in rows are known to far less than a pixel.
    fn has_sure_columns(&self) -> bool {
        let largest = |p: &DVec2| p.abs().max_element();
        self.corners.iter().all(|p| largest(p) < MOST_SURE_PX)
    }

    /// The edges, ready to be asked where they cross a row.
    fn edges_by_row(&self) -> [EdgeByRow; 3] {
        std::array::from_fn(|k| {
            let (p, q) = (self.corners[k], self.corners[(k + 1) % 3]);
            let along = q - p;
            EdgeByRow {
                start: p,
                slope: along.x / along.y,
                rise: along.y,
            }
        })
    }

    /// Weights of the corners in space from those in the image.
    pub(super) fn object_weights(&self, image_weights: [f64; 3]) -> [f64; 3] {
        let scaled: [f64; 3] = std::array::from_fn(|k| image_weights[k] * self.inverse_depths[k]);
        let sum: f64 = scaled.iter().sum();
        scaled.map(|w| w / sum)
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The nearest face at each pixel of a camera.
#[derive(Clone, Debug)]
pub(super) struct ItemBuffer {
    camera: Camera,
    faces: Vec<u32>,
    inverse_depths: Vec<f64>,
    image_weights: Vec<[f32; 2]>,
}

impl ItemBuffer {
    /// Draws the faces that look towards the eye. `corners` gives the corners of a face.
    pub(super) fn draw(
        camera: &Camera,
        face_count: usize,
        corners: impl Fn(usize) -> [DVec3; 3],
    ) -> Self {
        let mut buffer = Self::empty(camera);
        for face in 0..face_count {
            if let Some(triangle) = ImageTriangle::project(camera, corners(face)) {
                buffer.draw_face(face, &triangle);
            }
        }
        buffer
    }

    /// Draws the faces of a mesh that look towards the eye; each vertex is projected once.
    pub(super) fn draw_mesh(camera: &Camera, mesh: &TriangleMesh) -> Self {
        let project = |&p: &DVec3| ImageVertex::project(camera, p);
        let vertices: Vec<ImageVertex> = mesh.positions.iter().map(project).collect();
        let mut buffer = Self::empty(camera);
        for (face, corners) in mesh.faces.iter().enumerate() {
            let corners = corners.map(|v| vertices[v as usize]);
            if let Some(triangle) = ImageTriangle::of_vertices(corners) {
                buffer.draw_face(face, &triangle);
            }
        }
        buffer
    }

    fn empty(camera: &Camera) -> Self {
        let pixel_count = camera.width_px as usize * camera.height_px as usize;
        Self {
            camera: *camera,
            faces: vec![NOTHING; pixel_count],
            inverse_depths: vec![0.0; pixel_count],
            image_weights: vec![[0.0; 2]; pixel_count],
        }
    }

    fn draw_face(&mut self, face: usize, triangle: &ImageTriangle) {
        let camera = self.camera;
        triangle.visit(&camera, |sample| {
            let nearest = &mut self.inverse_depths[sample.pixel];
            if sample.inverse_depth > *nearest {
                *nearest = sample.inverse_depth;
                self.faces[sample.pixel] = face as u32;
                let [a, b, _] = sample.image_weights;
                self.image_weights[sample.pixel] = [a as f32, b as f32];
            }
        });
    }

    /// The face at a pixel and the weights of its corners in the image, if there is one.
    pub(super) fn face_at(&self, pixel: usize) -> Option<(usize, [f64; 3])> {
        let face = self.faces[pixel];
        let [a, b] = self.image_weights[pixel].map(f64::from);
        (face != NOTHING).then_some((face as usize, [a, b, 1.0 - a - b]))
    }

    /// Reciprocal of the depth at a pixel; zero where there is nothing.
    pub(super) fn inverse_depth(&self, pixel: usize) -> f64 {
        self.inverse_depths[pixel]
    }

    /// The *largest* depth in the three by three pixels around an image point, infinite where there is nothing or the
    /// point is outside: what something at that point must lie behind to be hidden for certain.
    pub(super) fn farthest_around(&self, p: DVec2) -> f64 {
        let (width, height) = (self.camera.width_px as i64, self.camera.height_px as i64);
        let (x, y) = (p.x.floor() as i64, p.y.floor() as i64);
        let mut smallest = f64::INFINITY;
        for j in y.saturating_sub(1)..=y.saturating_add(1) {
            for i in x.saturating_sub(1)..=x.saturating_add(1) {
                if !(0..width).contains(&i) || !(0..height).contains(&j) {
                    return f64::INFINITY;
                }
                smallest = smallest.min(self.inverse_depths[(j * width + i) as usize]);
            }
        }
        1.0 / smallest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::fit_sphere(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 1.0, None, (64, 64)).unwrap()
    }

    fn facing(z: f64, size: f64) -> [DVec3; 3] {
        [
            DVec3::new(-size, -size, z),
            DVec3::new(size, -size, z),
            DVec3::new(0.0, size, z),
        ]
    }

    #[test]
    fn the_nearer_face_wins_in_either_order() {
        let (near, far) = (facing(0.5, 0.3), facing(-0.5, 0.8));
        for faces in [[near, far], [far, near]] {
            let buffer = ItemBuffer::draw(&camera(), 2, |f| faces[f]);
            let nearer = faces.iter().position(|f| *f == near).unwrap();
            let middle = 32 * 64 + 32;
            assert_eq!(buffer.face_at(middle).unwrap().0, nearer);
            assert!((1.0 / buffer.inverse_depth(middle) - 4.5).abs() < 1e-12);
            let seen: Vec<_> = (0..64 * 64).filter_map(|p| buffer.face_at(p)).collect();
            assert!(seen.iter().any(|s| s.0 == 0) && seen.iter().any(|s| s.0 == 1));
        }
    }

    #[test]
    fn a_face_that_looks_away_is_not_drawn() {
        let [a, b, c] = facing(0.0, 0.5);
        let buffer = ItemBuffer::draw(&camera(), 1, |_| [a, c, b]);
        assert!((0..64 * 64).all(|p| buffer.face_at(p).is_none()));
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
    fn a_needle_costs_its_rows_and_not_its_box() {
        let needle = ImageTriangle {
            corners: [[1.0, 1.0], [1000.0, 1001.0], [1000.0, 1000.0]].map(DVec2::from),
            inverse_depths: [1.0; 3],
            double_area: 999.0,
        };
        assert!(needle.has_sure_columns());
        let edges = needle.edges_by_row();
        let columns = |y: i32| columns_between(&edges, f64::from(y) + 0.5, 1..1000).len();
        assert!((1..1000).map(columns).sum::<usize>() < 1200);
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
