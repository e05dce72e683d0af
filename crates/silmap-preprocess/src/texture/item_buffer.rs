//! Which face is seen at each pixel, and how far away: the nearest of all faces.

use glam::{DVec2, DVec3};
use silmap_geometry::raster::{ImageTriangle, ImageVertex};
use silmap_geometry::{Camera, TriangleMesh};

/// Stands for "no face".
pub(super) const NOTHING: u32 = u32::MAX;

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
}
