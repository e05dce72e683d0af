//! Cameras on a turntable, known up to a projectivity, and made metric.

use std::fs;
use std::path::Path;

use glam::{DMat4, DVec2, DVec3, DVec4};
use serde_json::json;

use crate::tests::{SIZE, carved, model, save};
use crate::{CaptureWarning, Matrix34, Pinhole, read, silhouette};

/// Cameras on a circle about a line, all looking alike.
fn turning(count: usize) -> Vec<Pinhole> {
    let eye = DVec3::new(5.5, 0.0, 2.0);
    let forward = (DVec3::new(0.0, 0.3, 0.1) - eye).normalize_or_zero();
    let right = forward.cross(DVec3::Z).normalize_or_zero();
    let axes = [right, forward.cross(right), forward];
    let lens = (DVec2::splat(330.0), DVec2::new(113.0, 88.0));
    let camera = Pinhole::from_pose(eye, axes, lens, SIZE).unwrap();
    let turned = |k: usize| {
        let turn = glam::DQuat::from_rotation_z(std::f64::consts::TAU * k as f64 / count as f64);
        Pinhole {
            eye: turn * camera.eye,
            axes: camera.axes.map(|axis| turn * axis),
            ..camera
        }
    };
    (0..count).map(turned).collect()
}

/// P·H, of whatever sign.
fn moved(camera: &Pinhole, by: &DMat4, sign: f64) -> Matrix34 {
    let turned = by.transpose();
    camera
        .to_matrix()
        .map(|row| (sign * (turned * DVec4::from_array(row))).to_array())
}

/// Writes the cameras in a frame from which `by` leads to the metric one; masks are those of the true cameras.
fn write(folder: &Path, views: &[Pinhole], by: &DMat4) {
    fs::create_dir_all(folder.join("masks")).unwrap();
    let list: Vec<_> = (views.iter().enumerate())
        .map(|(k, camera)| {
            let mask = format!("masks/{k}.png");
            save(&silhouette(&model(), camera).unwrap(), &folder.join(&mask));
            json!({"name": k.to_string(), "mask": mask, "P": moved(camera, by, 1.0)})
        })
        .collect();
    let back = by.inverse();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &p in &model().positions {
        let place = back.project_point3(p);
        (low, high) = (low.min(place), high.max(place));
    }
    let room = DVec3::splat(0.05);
    let file = json!({"width": SIZE.0, "height": SIZE.1, "pixel_centre": 0.5, "metric": false,
        "object_bounds": [(low - room).to_array(), (high + room).to_array()], "views": list});
    fs::write(folder.join("cameras.json"), file.to_string()).unwrap();
}

#[test]
fn a_turntable_up_to_a_projectivity_is_made_metric() {
    let views = turning(16);
    // (x, y, z) ↦ (x, y, b·z)/(1 + c·z), and a frame that is moved and turned.
    let open = DMat4::from_cols(
        DVec4::X,
        DVec4::Y,
        DVec4::new(0.0, 0.0, 0.7, 0.04),
        DVec4::W,
    );
    let rigid = DMat4::from_rotation_x(0.4) * DMat4::from_translation(DVec3::new(0.2, -0.1, 0.3));
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &views, &(open * rigid));
    let found = read(folder.path()).unwrap();
    let is_said = |w: &CaptureWarning| matches!(w, CaptureWarning::MadeMetric { .. });
    assert!(found.warnings.iter().any(is_said), "{:?}", found.warnings);
    // Up to a similarity: distances of eyes and angles between axes are as they were.
    let scale = found.views[0]
        .camera
        .eye
        .distance(found.views[8].camera.eye)
        / views[0].eye.distance(views[8].eye);
    for (a, b) in found.views.iter().zip(&views) {
        // The principal point is not in the middle, of which the search knows nothing.
        assert!(
            (a.camera.focal.x / b.focal.x - 1.0).abs() < 0.02,
            "{}",
            a.camera.focal
        );
        assert!(
            a.camera.principal.distance(b.principal) < 8.0,
            "{}",
            a.camera.principal
        );
        let first = (&found.views[0].camera, &views[0]);
        let (x, y) = (
            a.camera.eye.distance(first.0.eye),
            b.eye.distance(first.1.eye),
        );
        assert!((x - scale * y).abs() < 1e-3 * x.max(0.1), "{x} {y}");
        let (x, y) = (
            a.camera.axes[2].dot(first.0.axes[2]),
            b.axes[2].dot(first.1.axes[2]),
        );
        assert!((x - y).abs() < 0.02, "{x} {y}");
    }
    let hull = carved(&found, Some(0)).unwrap();
    assert!(hull.residuals.iter().flatten().all(|r| r.overlap > 0.97));
    // As by the true cameras, whose hull has another unit.
    let mut as_made = found.clone();
    as_made.object_bounds = None;
    for (view, camera) in as_made.views.iter_mut().zip(&views) {
        view.camera = *camera;
    }
    let expected = carved(&as_made, Some(0)).unwrap().mesh.mesh().volume();
    let ratio = hull.mesh.mesh().volume() / scale.powi(3) / expected;
    assert!((0.95..1.05).contains(&ratio), "{ratio}");
}

#[test]
fn projective_cameras_that_do_not_turn_about_a_line_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    // A projectivity that bends the circle; and cameras that are on no circle.
    let bend = DMat4::from_cols(
        DVec4::new(1.0, 0.0, 0.0, 0.05),
        DVec4::Y,
        DVec4::Z,
        DVec4::W,
    );
    write(folder.path(), &turning(12), &bend);
    let told = read(folder.path()).unwrap_err().to_string();
    assert!(told.contains("projective only"), "{told}");
    write(folder.path(), &crate::tests::cameras(8), &DMat4::IDENTITY);
    let told = read(folder.path()).unwrap_err().to_string();
    assert!(told.contains("projective only"), "{told}");
}
