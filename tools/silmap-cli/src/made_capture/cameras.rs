//! Where the photographs are taken from: rings as on a turntable, and a few that are scattered.

use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3};
use silmap_capture::Pinhole;
use silmap_geometry::mesh::Bounds;

use super::noise::even;

/// Size of the photographs, pixels.
const SIZE: (u32, u32) = (640, 480);

/// Focal lengths, pixels: not quite square, as lenses are.
const FOCAL: DVec2 = DVec2::new(905.0, 902.0);

/// Principal point, beside the middle.
const PRINCIPAL: DVec2 = DVec2::new(323.5, 236.0);

/// Rings: height above the horizon in degrees, and photographs.
const RINGS: [(f64, usize); 3] = [(12.0, 16), (42.0, 14), (-22.0, 8)];

/// Photographs from anywhere.
const SCATTERED: usize = 6;

/// Distance of the rings from the middle, bounding radii.
const DISTANCE_RADII: f64 = 4.4;

/// How far a camera strays from its place on a ring and from looking at the middle, radians and bounding radii.
const STRAY: f64 = 0.04;

/// Stands for the seeds of this module.
const SEED: i64 = 11;

/// The cameras, which all hold the bounding sphere.
pub(super) fn around(bounds: &Bounds) -> Vec<Pinhole> {
    let rings = (RINGS.iter().enumerate()).flat_map(|(ring, &(height, count))| {
        (0..count).map(move |k| {
            let turn = TAU * (k as f64 + 0.4 * ring as f64) / count as f64;
            (direction(height.to_radians(), turn), DISTANCE_RADII, 0.0)
        })
    });
    // A spiral over the whole sphere, each with another distance and roll.
    let scattered = (0..SCATTERED).map(|k| {
        let height = (1.6 * (k as f64 + 0.5) / SCATTERED as f64 - 0.8).asin();
        let away = DISTANCE_RADII * (1.15 + 0.15 * even(&[SEED, 1, k as i64]));
        (
            direction(height, 2.5 * k as f64),
            away,
            0.8 * even(&[SEED, 2, k as i64]),
        )
    });
    let places = rings.chain(scattered).enumerate();
    places
        .filter_map(|(v, (towards, away, roll))| {
            let stray = |n: i64| {
                DVec3::from_array([0, 1, 2].map(|c| STRAY * even(&[SEED, n, v as i64, c])))
            };
            let towards = (towards + stray(3)).normalize_or_zero();
            let eye = bounds.center + away * bounds.radius * towards;
            let target = bounds.center + bounds.radius * stray(4);
            camera(eye, target, roll)
        })
        .collect()
}

/// Directions to eyes between those of the capture: half-way on the rings and between them.
pub(crate) fn between(count: usize) -> Vec<DVec3> {
    let heights = [27.0_f64, -5.0, 12.0];
    (0..count)
        .map(|k| {
            // Half-way between two photographs of the first ring, and on from there.
            let step = RINGS[0].1 * k / count;
            let turn = TAU * (step as f64 + 0.5) / RINGS[0].1 as f64;
            direction(heights[k % heights.len()].to_radians(), turn)
        })
        .collect()
}

fn direction(height: f64, turn: f64) -> DVec3 {
    DVec3::new(
        height.cos() * turn.sin(),
        height.sin(),
        height.cos() * turn.cos(),
    )
}

/// A camera with this capture's lens; `None` where there is no direction to look in.
fn camera(eye: DVec3, target: DVec3, roll: f64) -> Option<Pinhole> {
    let forward = (target - eye).try_normalize()?;
    let right = forward.cross(DVec3::Y).try_normalize()?;
    let turn = DQuat::from_axis_angle(forward, roll);
    let axes = [turn * right, turn * forward.cross(right), forward];
    Pinhole::from_pose(eye, axes, (FOCAL, PRINCIPAL), SIZE).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_camera_holds_the_bounding_sphere() {
        let bounds = Bounds {
            center: DVec3::new(0.3, -2.0, 1.0),
            radius: 2.5,
            ..Bounds::of_points([DVec3::ZERO].into_iter())
        };
        let cameras = around(&bounds);
        assert_eq!(cameras.len(), 44);
        for camera in &cameras {
            for k in 0..200 {
                let (height, turn) = (f64::from(k) / 100.0 - 1.0, 2.4 * f64::from(k));
                let point = bounds.center + bounds.radius * direction(height.asin(), turn);
                let (image, _) = camera.project(point).unwrap();
                assert!(camera.shows(image), "{image}");
            }
        }
        // No two alike, and those in between are none of them.
        let towards = |c: &Pinhole| (c.eye - bounds.center).normalize_or_zero();
        for (k, a) in cameras.iter().enumerate() {
            assert!(
                cameras[..k]
                    .iter()
                    .all(|b| towards(a).angle_between(towards(b)) > 0.05)
            );
        }
        for d in between(12) {
            assert!(cameras.iter().all(|c| towards(c).angle_between(d) > 0.05));
        }
    }
}
