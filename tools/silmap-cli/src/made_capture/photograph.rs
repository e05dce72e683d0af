//! Photographs of a mesh: its colours with a pattern, light from one side and from the sky, a little gloss, exposure and noise.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_capture::Pinhole;
use silmap_geometry::lighting::srgb_from_linear;
use silmap_geometry::{Bvh, ColourImage, TriangleMesh};

use super::noise::{even, smooth};

/// Where a pixel is looked through.
const SAMPLES: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];

/// Direction to the lamp, and how much light comes from it, from above and from below.
const LAMP: DVec3 = DVec3::new(0.4, 0.75, 0.5);
const LAMP_LIGHT: f64 = 0.75;
const SKY_LIGHT: f64 = 0.4;
const GROUND_LIGHT: f64 = 0.18;

/// Gloss, and how narrow it is.
const GLOSS: f64 = 0.06;
const GLOSS_POWER: i32 = 30;

/// Sizes of the pattern on the surface, bounding radii, and how much darker it is there.
const PATTERN: [(f64, f64); 2] = [(0.11, 0.3), (0.03, 0.22)];

/// The backdrop's linear colour.
const BACKDROP: [f64; 3] = [0.10, 0.13, 0.19];

/// How far apart exposures are, as logarithms, and the tints of red and blue.
const EXPOSURES: f64 = 0.22;
const TINTS: f64 = 0.05;

/// Noise of a sensor, of 255 stored values.
const GRAIN: f64 = 2.0;

/// Stands for the seeds of this module.
const SEED: i64 = 23;

/// What a camera makes of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exposure {
    /// Factors on linear red, green and blue.
    factors: [f64; 3],
    /// Seed of the noise; none where there is no noise.
    grain: Option<i64>,
}

impl Exposure {
    /// That of a view of the capture: each is another one.
    pub(super) fn of_view(view: usize) -> Self {
        let random = |n: i64| even(&[SEED, n, view as i64]);
        let bright = (EXPOSURES * random(1)).exp();
        let [red, blue] = [2, 3].map(|n| bright * (TINTS * random(n)).exp());
        Self {
            factors: [red, bright, blue],
            grain: Some(view as i64),
        }
    }

    /// As it is.
    pub(crate) fn plain() -> Self {
        Self {
            factors: [1.0; 3],
            grain: None,
        }
    }
}

/// Takes photographs of a mesh.
#[derive(Debug)]
pub(crate) struct Photographer<'a> {
    model: &'a TriangleMesh,
    tree: &'a Bvh,
    normals: Vec<DVec3>,
    radius: f64,
}

impl<'a> Photographer<'a> {
    /// `tree` is over the model's faces.
    pub(crate) fn new(model: &'a TriangleMesh, tree: &'a Bvh) -> Self {
        Self {
            model,
            tree,
            normals: model.vertex_normals(),
            radius: model.bounds().radius,
        }
    }

    /// A photograph.
    pub(crate) fn photograph(&self, camera: &Pinhole, exposure: &Exposure) -> ColourImage {
        let rows: Vec<Vec<u8>> = (0..camera.height)
            .into_par_iter()
            .map(|y| {
                let pixel = |x| self.pixel(camera, exposure, (x, y));
                (0..camera.width).flat_map(pixel).collect()
            })
            .collect();
        ColourImage {
            width: camera.width,
            height: camera.height,
            rgba: rows.concat(),
        }
    }

    fn pixel(&self, camera: &Pinhole, exposure: &Exposure, (x, y): (u32, u32)) -> [u8; 4] {
        let mut sum = [0.0; 3];
        for [dx, dy] in SAMPLES {
            let at = DVec2::new(f64::from(x) + dx, f64::from(y) + dy);
            let light = self.light(camera, at);
            for (s, l) in sum.iter_mut().zip(light) {
                *s += l / SAMPLES.len() as f64;
            }
        }
        let stored = |c: usize| {
            let grain = exposure.grain.map_or(0.0, |seed| {
                // The sum of two even numbers is nearer to the middle.
                let random = |n| even(&[SEED, 9, seed, n, x.into(), y.into(), c as i64]);
                GRAIN * (random(0) + random(1))
            });
            let linear = sum[c] * exposure.factors[c];
            let byte = 255.0 * f64::from(srgb_from_linear(linear as f32)) + grain;
            byte.round().clamp(0.0, 255.0) as u8
        };
        [stored(0), stored(1), stored(2), 255]
    }

    /// Linear light along the ray through an image point.
    fn light(&self, camera: &Pinhole, at: DVec2) -> [f64; 3] {
        let ray = camera.direction(at);
        let Some(hit) = self.tree.first_hit(camera.eye, ray, 0.0, f64::INFINITY) else {
            let above = 1.2 - 0.5 * at.y / f64::from(camera.height);
            return BACKDROP.map(|c| c * above);
        };
        let (face, weights) = (hit.face as usize, hit.barycentric);
        let corners = self.model.faces[face];
        let normal: DVec3 = (0..3)
            .map(|k| self.normals[corners[k] as usize] * weights[k])
            .sum();
        let normal = normal.normalize_or_zero();
        let point = (camera.eye + ray * hit.t) / self.radius;
        let pattern: f64 = (PATTERN.iter().enumerate())
            .map(|(k, &(size, depth))| {
                let noise = smooth((point / size).to_array(), SEED + k as i64);
                1.0 - depth * (0.5 + 1.5 * noise).clamp(0.0, 1.0)
            })
            .product();
        let lamp = LAMP.normalize_or_zero();
        let above = 0.5 + 0.5 * normal.y;
        let light = LAMP_LIGHT * normal.dot(lamp).max(0.0)
            + SKY_LIGHT * above
            + GROUND_LIGHT * (1.0 - above);
        let half = (lamp - ray.normalize_or_zero()).normalize_or_zero();
        let gloss = GLOSS * normal.dot(half).max(0.0).powi(GLOSS_POWER);
        let albedo = (self.model.appearance).albedo(face, weights.map(|w| w as f32));
        albedo.map(|c| f64::from(c) * pattern * light + gloss)
    }
}

#[cfg(test)]
mod tests {
    use silmap_geometry::lighting::linear_from_srgb;

    use super::*;

    #[test]
    fn exposures_are_factors_on_what_is_seen() {
        let model = silmap_models::torus(400);
        let tree = Bvh::new(&model);
        let photographer = Photographer::new(&model, &tree);
        let axes = [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z];
        let lens = (DVec2::splat(80.0), DVec2::splat(20.0));
        let eye = DVec3::new(0.0, 0.0, 6.0);
        let camera = Pinhole::from_pose(eye, axes, lens, (40, 40)).unwrap();
        let plain = photographer.photograph(&camera, &Exposure::plain());
        let exposed = photographer.photograph(&camera, &Exposure::of_view(3));
        let factors = Exposure::of_view(3).factors;
        assert!(factors.iter().all(|f| (0.7..1.4).contains(f)));
        let mut off = 0.0;
        for (a, b) in plain
            .rgba
            .iter()
            .zip(&exposed.rgba)
            .enumerate()
            .filter_map(|(k, p)| (k % 4 == 1).then_some(p))
        {
            let expected = f64::from(linear_from_srgb(f32::from(*a) / 255.0)) * factors[1];
            let stored = 255.0 * f64::from(srgb_from_linear(expected as f32));
            off += (stored - f64::from(*b)).abs() / 1600.0;
        }
        assert!(off < GRAIN, "{off}");
        // The hole of the torus shows the backdrop.
        let middle = 4 * (20 * 40 + 20);
        assert!(plain.rgba[middle + 2] > plain.rgba[middle]);
    }
}
