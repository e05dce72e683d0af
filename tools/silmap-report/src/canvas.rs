//! A CPU canvas with a depth buffer: shaded triangles and lines.
//!
//! Everything is drawn at [`SAMPLES`] times the size and averaged, in linear light. Good for some dozen pictures in a page,
//! and the same on every machine.

use glam::{DVec2, DVec3};
use silmap_geometry::lighting::{irradiance, linear_from_srgb, srgb_from_linear};
use silmap_geometry::raster::{ImageTriangle, ImageVertex};
use silmap_geometry::{Camera, ColourImage, TriangleMesh};

use crate::palette::Rgb;

/// Samples along each side of a pixel.
const SAMPLES: u32 = 2;

/// Linear red, green, blue, and opacity; the colours are not multiplied by it.
pub(crate) type Linear = [f32; 4];

/// A picture in the making, seen through one camera.
#[derive(Clone, Debug)]
pub(crate) struct Canvas {
    camera: Camera,
    colours: Vec<Linear>,
    /// One over the depth along the viewing direction, 0 where there is nothing: what is linear across a face's picture.
    nearness: Vec<f64>,
}

/// How lines look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke {
    pub(crate) colour: Rgb,
    /// Width in pixels of the finished picture.
    pub(crate) width_px: f64,
    /// Opacity where nothing is in front.
    pub(crate) opacity: f32,
    /// Opacity where something is.
    pub(crate) hidden_opacity: f32,
}

/// Lines lie on surfaces: they are hidden by what is nearer by more than this share of the depth.
const HIDING_REL: f64 = 0.004;

impl Canvas {
    /// An empty picture that looks like the camera's.
    pub(crate) fn new(camera: &Camera) -> Self {
        let camera = camera.resized((camera.width_px * SAMPLES, camera.height_px * SAMPLES));
        let count = camera.width_px as usize * camera.height_px as usize;
        Self {
            camera,
            colours: vec![[0.0; 4]; count],
            nearness: vec![0.0; count],
        }
    }

    /// Draws a model in its colours under the studio light.
    pub(crate) fn draw_model(&mut self, model: &TriangleMesh) {
        let normals = model.vertex_normals();
        let shade = |face: usize, weights: [f64; 3]| {
            let corners = model.faces[face];
            let normal: DVec3 = (0..3)
                .map(|k| normals[corners[k] as usize] * weights[k])
                .sum();
            let light = irradiance(normal.normalize_or_zero().as_vec3().to_array());
            let [r, g, b] = model
                .appearance
                .albedo(face, weights.map(|w| w as f32))
                .map(|c| (c * light).min(1.0));
            [r, g, b, 1.0]
        };
        self.draw_faces(&model.positions, &model.faces, shade);
    }

    /// Draws those faces that look towards the eye, with a colour for each face and weights of its corners.
    pub(crate) fn draw_faces(
        &mut self,
        positions: &[DVec3],
        faces: &[[u32; 3]],
        shade: impl Fn(usize, [f64; 3]) -> Linear,
    ) {
        let seen = positions
            .iter()
            .map(|&p| ImageVertex::project(&self.camera, p));
        let seen: Vec<ImageVertex> = seen.collect();
        for (f, face) in faces.iter().enumerate() {
            let corners = face.map(|v| seen[v as usize]);
            if let Some(triangle) = ImageTriangle::of_vertices(corners) {
                triangle.visit(&self.camera, |sample| {
                    let nearness = &mut self.nearness[sample.pixel];
                    if sample.inverse_depth > *nearness {
                        *nearness = sample.inverse_depth;
                        let weights = triangle.object_weights(sample.image_weights);
                        self.colours[sample.pixel] = shade(f, weights);
                    }
                });
            }
        }
    }

    /// Draws lines between pairs of points. Lines of one call do not darken each other where they overlap.
    pub(crate) fn draw_lines(&mut self, lines: &[(DVec3, DVec3)], stroke: &Stroke) {
        let mut cover = vec![0.0_f32; self.colours.len()];
        let radius = 0.5 * stroke.width_px * f64::from(SAMPLES);
        for &(from, to) in lines {
            let (p, q) = (self.seen(from), self.seen(to));
            if p.1 <= 0.0 || q.1 <= 0.0 || !(p.0.is_finite() && q.0.is_finite()) {
                continue;
            }
            // Half a sample a step leaves no gaps; what is far off the picture is not worth its steps.
            const MOST_STEPS: f64 = 20_000.0;
            let steps = (2.0 * p.0.distance(q.0)).ceil().clamp(1.0, MOST_STEPS);
            for k in 0..=steps as u32 {
                let part = f64::from(k) / steps;
                let (point, nearness) = (p.0.lerp(q.0, part), p.1 + (q.1 - p.1) * part);
                self.stamp(&mut cover, (point, nearness), radius, stroke);
            }
        }
        self.blend(&cover, stroke.colour);
    }

    /// Draws dots of `stroke.width_px` across.
    pub(crate) fn draw_dots(&mut self, points: &[DVec3], stroke: &Stroke) {
        let mut cover = vec![0.0_f32; self.colours.len()];
        let radius = 0.5 * stroke.width_px * f64::from(SAMPLES);
        for &point in points {
            let (at, nearness) = self.seen(point);
            if nearness > 0.0 {
                self.stamp(&mut cover, (at, nearness), radius, stroke);
            }
        }
        self.blend(&cover, stroke.colour);
    }

    /// Lays another picture through the same camera over this one, with a factor on its opacity; depths become the other's
    /// where it has any.
    pub(crate) fn lay_over(&mut self, other: &Self, opacity: f32) {
        for (at, over) in other.colours.iter().enumerate() {
            self.colours[at] = blended(
                self.colours[at],
                [over[0], over[1], over[2], over[3] * opacity],
            );
            if other.nearness[at] > 0.0 {
                self.nearness[at] = other.nearness[at];
            }
        }
    }

    /// The picture, its background transparent.
    pub(crate) fn finish(self) -> ColourImage {
        let (width, height) = (
            self.camera.width_px / SAMPLES,
            self.camera.height_px / SAMPLES,
        );
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0_f32; 4];
                for j in 0..SAMPLES {
                    for i in 0..SAMPLES {
                        let [r, g, b, a] =
                            self.colours[self.index(x * SAMPLES + i, y * SAMPLES + j)];
                        for (s, c) in sum.iter_mut().zip([r * a, g * a, b * a, a]) {
                            *s += c;
                        }
                    }
                }
                let [r, g, b, a] = sum;
                let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
                let colour = |c: f32| {
                    if a > 0.0 {
                        byte(srgb_from_linear(c / a))
                    } else {
                        0
                    }
                };
                rgba.extend([colour(r), colour(g), colour(b)]);
                rgba.push(byte(a / (SAMPLES * SAMPLES) as f32));
            }
        }
        ColourImage {
            width,
            height,
            rgba,
        }
    }

    fn seen(&self, point: DVec3) -> (DVec2, f64) {
        (
            self.camera.image_from_object(point),
            1.0 / self.camera.depth(point),
        )
    }

    fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.camera.width_px as usize + x as usize
    }

    fn stamp(&self, cover: &mut [f32], at: (DVec2, f64), radius: f64, stroke: &Stroke) {
        let (point, nearness) = at;
        let reach = radius.max(0.5);
        for y in pixels_between(point.y - reach, point.y + reach, self.camera.height_px) {
            for x in pixels_between(point.x - reach, point.x + reach, self.camera.width_px) {
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                if centre.distance(point) > reach + 0.25 {
                    continue;
                }
                let index = self.index(x, y);
                let is_hidden = nearness * (1.0 + HIDING_REL) < self.nearness[index];
                let opacity = if is_hidden {
                    stroke.hidden_opacity
                } else {
                    stroke.opacity
                };
                cover[index] = cover[index].max(opacity);
            }
        }
    }

    fn blend(&mut self, cover: &[f32], colour: Rgb) {
        let [r, g, b] = linear(colour);
        for (below, &opacity) in self.colours.iter_mut().zip(cover) {
            if opacity > 0.0 {
                *below = blended(*below, [r, g, b, opacity]);
            }
        }
    }
}

/// The linear colour of an sRGB one.
pub(crate) fn linear(colour: Rgb) -> [f32; 3] {
    colour.map(|c| linear_from_srgb(f32::from(c) / 255.0))
}

/// One colour over another.
fn blended(below: Linear, over: Linear) -> Linear {
    let opacity = over[3] + below[3] * (1.0 - over[3]);
    if opacity <= 0.0 {
        return [0.0; 4];
    }
    let mix = |k: usize| (over[k] * over[3] + below[k] * below[3] * (1.0 - over[3])) / opacity;
    [mix(0), mix(1), mix(2), opacity]
}

/// The columns (or rows) whose centres can lie between two coordinates.
fn pixels_between(low: f64, high: f64, count: u32) -> std::ops::Range<u32> {
    let from = (low - 0.5).ceil().clamp(0.0, f64::from(count)) as u32;
    let to = ((high - 0.5).floor() + 1.0).clamp(f64::from(from), f64::from(count)) as u32;
    from..to
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::fit_sphere(DVec3::Z * 4.0, DVec3::ZERO, 1.0, None, (40, 40)).unwrap()
    }

    /// A square at z = 0 that looks towards +z.
    fn square(half: f64) -> TriangleMesh {
        let at = |x: f64, y: f64| DVec3::new(x * half, y * half, 0.0);
        TriangleMesh {
            positions: vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    fn alpha(picture: &ColourImage, x: u32, y: u32) -> u8 {
        picture.rgba[((y * picture.width + x) * 4 + 3) as usize]
    }

    #[test]
    fn a_square_covers_its_middle_and_not_the_corner() {
        let mut canvas = Canvas::new(&camera());
        canvas.draw_model(&square(0.5));
        let picture = canvas.finish();
        assert_eq!((picture.width, picture.height), (40, 40));
        assert_eq!((alpha(&picture, 20, 20), alpha(&picture, 1, 1)), (255, 0));
        let mut away = Canvas::new(&camera());
        let mut turned = square(0.5);
        turned.faces.iter_mut().for_each(|f| f.swap(0, 1));
        away.draw_model(&turned);
        assert_eq!(alpha(&away.finish(), 20, 20), 0);
    }

    #[test]
    fn what_is_behind_is_hidden() {
        let stroke = Stroke {
            colour: [255, 0, 0],
            width_px: 2.0,
            opacity: 1.0,
            hidden_opacity: 0.0,
        };
        let red_with_line_at = |z: f64| {
            let mut canvas = Canvas::new(&camera());
            canvas.draw_model(&square(0.5));
            let (from, to) = (DVec3::new(-0.3, 0.0, z), DVec3::new(0.3, 0.0, z));
            canvas.draw_lines(&[(from, to)], &stroke);
            canvas.draw_dots(&[from], &stroke);
            let picture = canvas.finish();
            picture
                .rgba
                .chunks(4)
                .filter(|p| p[0] > 200 && p[1] < 50)
                .count()
        };
        assert!(red_with_line_at(0.5) > 10 && red_with_line_at(0.0) > 10);
        assert_eq!(red_with_line_at(-0.5), 0);
    }
}
