//! Hull levels side by side in one picture, ray cast on the CPU, as in plates 1 and 2 of the papers.

use anyhow::Context;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::lighting::{DEFAULT_ALBEDO, irradiance, srgb_from_linear};
use silmap_geometry::{Bvh, Camera, ColourImage, TriangleMesh};

use crate::pictures::beside;

/// Side of one level's picture, pixels.
const SIDE_PX: u32 = 320;
/// Where a pixel is looked through.
const SAMPLES: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
/// Direction from the model to the eye.
const TOWARDS_EYE: DVec3 = DVec3::new(0.45, 0.35, 1.0);
/// How far away the eye is, in radii of the coarsest level.
const EYE_RADII: f64 = 4.0;

/// Face counts between a model's and a hull's, each about the same share of the one before; the model's first, the hull's
/// left out.
pub(crate) fn face_counts(model: usize, hull: usize, count: u32) -> Vec<usize> {
    let ratio = hull as f64 / model.max(1) as f64;
    let mut faces: Vec<usize> = (0..count)
        .map(|k| (model as f64 * ratio.powf(f64::from(k) / f64::from(count))).round() as usize)
        .collect();
    faces.dedup();
    faces
}

/// The meshes in a row, all seen by one camera.
///
/// # Errors
/// When the last mesh has no extent that a camera could look at.
pub(crate) fn draw(meshes: &[TriangleMesh]) -> anyhow::Result<ColourImage> {
    // The model and a hull around it differ in size: the largest must fit.
    let bounds = (meshes.iter().map(TriangleMesh::bounds))
        .max_by(|a, b| a.radius.total_cmp(&b.radius))
        .context("there is no level to draw")?;
    let towards = TOWARDS_EYE.normalize_or_zero();
    let eye = bounds.center + towards * (EYE_RADII * bounds.radius);
    let size = (SIDE_PX, SIDE_PX);
    let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, size)
        .context("the levels cannot be drawn")?;
    let pictures: Vec<ColourImage> = meshes.iter().map(|m| picture(m, &camera)).collect();
    Ok(beside(&pictures.iter().collect::<Vec<_>>()))
}

fn picture(mesh: &TriangleMesh, camera: &Camera) -> ColourImage {
    let tree = Bvh::new(mesh);
    let shades: Vec<f32> = (0..mesh.faces.len())
        .map(|f| irradiance(mesh.face_cross(f).normalize_or_zero().as_vec3().to_array()))
        .collect();
    let colour_at = |x: u32, y: u32| {
        let mut sum = [0.0_f32; 3];
        for [dx, dy] in SAMPLES {
            let at = DVec2::new(f64::from(x) + dx, f64::from(y) + dy);
            let ray = camera.direction_from_image(at);
            let hit = tree.first_hit(camera.eye, ray, 0.0, f64::INFINITY);
            for (k, sum) in sum.iter_mut().enumerate() {
                *sum += hit.map_or(1.0, |h| DEFAULT_ALBEDO[k] * shades[h.face as usize]);
            }
        }
        let encoded = sum.map(|s| (srgb_from_linear(s / SAMPLES.len() as f32) * 255.0).round());
        [encoded[0] as u8, encoded[1] as u8, encoded[2] as u8, 255]
    };
    let rows: Vec<Vec<u8>> = (0..SIDE_PX)
        .into_par_iter()
        .map(|y| (0..SIDE_PX).flat_map(|x| colour_at(x, y)).collect())
        .collect();
    ColourImage {
        width: SIDE_PX,
        height: SIDE_PX,
        rgba: rows.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_fall_evenly_from_the_model_on() {
        assert_eq!(face_counts(10_000, 100, 2), [10_000, 1000]);
        assert_eq!(face_counts(500, 500, 4), [500]);
    }

    #[test]
    fn every_level_is_seen_on_white() {
        let mesh = silmap_models::torus(200);
        let mut larger = mesh.clone();
        for p in &mut larger.positions {
            *p *= 1.5;
        }
        let strip = draw(&[mesh, larger]).unwrap();
        assert!(strip.width > 2 * SIDE_PX && strip.height == SIDE_PX);
        let covered = |from: u32| {
            let dark = |x: u32, y: u32| strip.rgba[((y * strip.width + x) * 4) as usize] < 250;
            (0..SIDE_PX)
                .flat_map(|y| (from..from + SIDE_PX).map(move |x| (x, y)))
                .filter(|&(x, y)| dark(x, y))
                .count()
        };
        let (small, large) = (covered(0), covered(strip.width - SIDE_PX));
        assert!(small > 1000 && large > small * 2, "{small}, {large}");
        assert!(large < (SIDE_PX * SIDE_PX) as usize);
    }
}
