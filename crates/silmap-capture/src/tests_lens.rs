//! Captures whose photographs have a lens: made from a model whose truth is known.

use std::fs;
use std::path::Path;

use glam::DVec2;
use image::{Rgb, RgbImage};
use serde_json::{Value, json};
use silmap_geometry::{Mask, Watch};

use crate::lens::{Distortion, Lens, Projection};
use crate::tests::{SIZE, assert_alike, cameras, capture, carved, model, nerf_pose, save};
use crate::{CaptureFault, CaptureView, Pinhole, median, paint, read, silhouette};

/// Views of each capture.
const VIEWS: usize = 14;

/// Of pixels in a row of the photograph, so many are looked at for one of its own.
const FINER: f64 = 4.0;

fn lens_of(camera: &Pinhole, distortion: Distortion) -> Lens {
    let intrinsics = (camera.focal, camera.skew, camera.principal);
    Lens::new(distortion, intrinsics, (camera.width, camera.height)).unwrap()
}

/// The mask of a photograph taken through a lens: each pixel's centre is looked up in a finer and larger picture of the model.
pub(crate) fn photographed(camera: &Pinhole, distortion: Distortion) -> Mask {
    let wide = Pinhole {
        focal: camera.focal * FINER,
        principal: (camera.principal + DVec2::new(SIZE.0.into(), SIZE.1.into())) * FINER,
        width: camera.width * 3 * FINER as u32,
        height: camera.height * 3 * FINER as u32,
        ..*camera
    };
    let seen = silhouette(&model(), &wide).unwrap();
    let lens = lens_of(camera, distortion);
    let mut mask = Mask::new(camera.width, camera.height);
    for (x, y) in (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))) {
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        if let Some(tangent) = lens.tangent_from_photo(centre) {
            let place = wide.image(tangent);
            mask.set(
                x,
                y,
                seen.get(place.x.floor() as i64, place.y.floor() as i64),
            );
        }
    }
    mask
}

fn brown(numerator: [f64; 4], tangential: [f64; 2]) -> Distortion {
    Distortion {
        numerator,
        tangential,
        ..Distortion::default()
    }
}

/// Writes `transforms.json`, with the lens's fields for the file or in each frame, and masks as photographed.
fn write(folder: &Path, lens: &Value, is_per_frame: bool, distortion: Distortion) {
    fs::create_dir_all(folder.join("masks")).unwrap();
    let mut frames = Vec::new();
    let views = cameras(VIEWS);
    for (k, camera) in views.iter().enumerate() {
        let mask = photographed(camera, distortion);
        save(&mask, &folder.join(format!("masks/{k:02}.png")));
        let mut frame =
            json!({"file_path": format!("photos/{k:02}"), "transform_matrix": nerf_pose(camera)});
        if is_per_frame {
            frame
                .as_object_mut()
                .unwrap()
                .extend(lens.as_object().unwrap().clone());
        }
        frames.push(frame);
    }
    let camera = &views[0];
    let mut file = json!({"w": SIZE.0, "h": SIZE.1, "fl_x": camera.focal.x, "fl_y": camera.focal.y,
        "cx": camera.principal.x, "cy": camera.principal.y, "frames": frames});
    if !is_per_frame {
        file.as_object_mut()
            .unwrap()
            .extend(lens.as_object().unwrap().clone());
    }
    fs::write(folder.join("transforms.json"), file.to_string()).unwrap();
}

/// The overlap of a view's mask with what its camera would see, unknown pixels ignored.
fn agreement(view: &CaptureView) -> f64 {
    let mut truth = silhouette(&model(), &view.camera).unwrap();
    if let Some(known) = &view.known {
        truth.intersect(known);
    }
    let both = (truth.count() - truth.count_missing_in(&view.mask)) as f64;
    both / (both + truth.count_different(&view.mask) as f64)
}

#[test]
fn lenses_of_transforms_are_taken_out() {
    let plain = carved(&capture(VIEWS), Some(0)).unwrap();
    let of_plain = median(plain.residuals.iter().flatten().map(|r| r.overlap)).unwrap();
    let fisheye = |numerator| Distortion {
        projection: Projection::Equidistant,
        ..brown(numerator, [0.0; 2])
    };
    let rational = Distortion {
        denominator: [0.3, 0.1, 0.05],
        ..brown([-0.2, 0.05, 0.01, 0.0], [0.002, -0.003])
    };
    let cases = [
        (
            json!({"camera_model": "OPENCV", "k1": -0.6, "k2": 0.9, "k3": 0.1, "k4": 0.2, "p1": 0.01, "p2": -0.02}),
            brown([-0.6, 0.9, 0.1, 0.2], [0.01, -0.02]),
            false,
        ),
        (
            json!({"k1": 0.5, "k2": -0.1}),
            brown([0.5, -0.1, 0.0, 0.0], [0.0; 2]),
            true,
        ),
        (
            json!({"camera_model": "OPENCV", "k1": -0.2, "k2": 0.05, "k3": 0.01, "k4": 0.3, "k5": 0.1, "k6": 0.05,
                "p1": 0.002, "p2": -0.003}),
            rational,
            false,
        ),
        (
            json!({"camera_model": "OPENCV_FISHEYE", "k1": -0.1, "k2": 0.06, "k3": -0.02, "k4": 0.01}),
            fisheye([-0.1, 0.06, -0.02, 0.01]),
            true,
        ),
    ];
    for (k, (fields, distortion, is_per_frame)) in cases.into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &fields, is_per_frame, distortion);
        let found = read(folder.path()).unwrap();
        for (view, camera) in found.views.iter().zip(cameras(VIEWS)) {
            let lens = view.lens.unwrap();
            assert_eq!(lens.distortion, distortion);
            assert_eq!(view.photo_size(), SIZE);
            assert!(view.camera.eye.distance(camera.eye) < 1e-12);
            let agreement = agreement(view);
            assert!(agreement > 0.98, "{fields} {}: {agreement}", view.name);
            // Outline and mask are of one shape.
            let area: f64 = view.outline.iter().map(|l| area(l)).sum();
            let pixels = view.mask.count() as f64;
            assert!((area / pixels - 1.0).abs() < 0.01, "{area} {pixels}");
        }
        let hull = carved(&found, Some(0)).unwrap();
        let overlap = median(hull.residuals.iter().flatten().map(|r| r.overlap)).unwrap();
        assert!(overlap > of_plain - 0.01, "{fields}: {overlap} {of_plain}");
        let ratio = hull.mesh.mesh().volume() / plain.mesh.mesh().volume();
        assert!((ratio - 1.0).abs() < 0.02, "{fields}: {ratio}");
        if k > 0 {
            continue;
        }
        // Left in, the lens spoils the hull.
        let mut left_in = found.clone();
        for (view, camera) in left_in.views.iter_mut().zip(cameras(VIEWS)) {
            view.mask = photographed(&camera, distortion);
            (view.camera, view.known) = (camera, None);
            (view.lens, view.taken) = (None, None);
        }
        let spoiled = carved(&left_in, Some(0)).map(|hull| hull.mesh.mesh().volume());
        let ratio = spoiled.map_or(0.0, |volume| volume / plain.mesh.mesh().volume());
        assert!((ratio - 1.0).abs() > 0.02, "{fields}: {ratio}");
    }
}

fn area(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    0.5 * points
        .iter()
        .zip(next)
        .map(|(a, b)| a.perp_dot(*b))
        .sum::<f64>()
}

#[test]
fn photographs_are_sampled_where_the_lens_shows_them() {
    let folder = tempfile::tempdir().unwrap();
    let distortion = brown([-0.6, 0.9, 0.1, 0.2], [0.01, -0.02]);
    let fields = json!({"camera_model": "OPENCV", "k1": -0.6, "k2": 0.9, "k3": 0.1, "k4": 0.2, "p1": 0.01, "p2": -0.02});
    write(folder.path(), &fields, false, distortion);
    fs::create_dir_all(folder.path().join("photos")).unwrap();
    // Red by the undistorted column, green by the row.
    let cameras = cameras(VIEWS);
    for (k, camera) in cameras.iter().enumerate() {
        let lens = lens_of(camera, distortion);
        RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let image = lens.tangent_from_photo(centre).map(|t| camera.image(t));
            image.map_or(Rgb([0; 3]), |p| Rgb([p.x as u8, p.y as u8, 90]))
        })
        .save(folder.path().join(format!("photos/{k:02}.png")))
        .unwrap();
    }
    let found = read(folder.path()).unwrap();
    let mut compared = 0;
    for (view, camera) in found.views.iter().zip(&cameras).take(3) {
        let photograph = view.photograph().unwrap().unwrap();
        let (width, height) = photograph.dimensions();
        assert_eq!((width, height), (view.camera.width, view.camera.height));
        let shift = view.camera.principal - camera.principal;
        for (x, y) in (0..height)
            .step_by(7)
            .flat_map(|y| (0..width).step_by(7).map(move |x| (x, y)))
        {
            let image = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let pixel = photograph.get_pixel(x, y).0;
            assert_eq!(pixel[3] == 0, !view.is_known(image), "{image}");
            let place = image - shift;
            let is_inside = place.x > 3.0 && place.y > 3.0 && place.x < 217.0 && place.y < 177.0;
            // Away from the border of the photograph, where samples are not mixed.
            let photo = view
                .photo_from_image(image)
                .filter(|p| p.cmpgt(DVec2::ONE).all() && p.x < 219.0 && p.y < 179.0);
            if let Some(photo) = photo.filter(|_| is_inside) {
                let found = DVec2::new(pixel[0].into(), pixel[1].into());
                assert!(found.distance(place) < 2.0, "{place} is {found}");
                let tangent = view.lens.unwrap().tangent_from_photo(photo).unwrap();
                assert!(view.camera.image(tangent).distance(image) < 1e-6);
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "{compared}");
    let hull = carved(&found, Some(0)).unwrap();
    let (how, watch) = ((hull.mesh.origin(), 512), Watch::silent());
    let photographs = crate::photographs(&found, how, &mut Vec::new(), &watch).unwrap();
    let (_, painted) = paint(hull.mesh, &photographs, &watch).unwrap();
    assert!(painted.photographs == VIEWS && painted.seen > 0.7);
}

/// A left-handed pose is that of a mirrored photograph, whose lens is mirrored too.
#[test]
fn lenses_of_left_handed_poses_are_mirrored() {
    let camera = cameras(1)[0];
    let as_taken = Distortion {
        prism: [0.03, -0.02],
        ..brown([-0.3, 0.1, 0.0, 0.0], [0.01, -0.02])
    };
    let of_mirrored = Distortion {
        tangential: [0.01, 0.02],
        prism: [-0.03, -0.02],
        ..as_taken
    };
    let [right, down, forward] = camera.axes;
    let middle = DVec2::new(f64::from(SIZE.0) - camera.principal.x, camera.principal.y);
    let intrinsics = (camera.focal, middle);
    let mirrored = Pinhole::from_pose(camera.eye, [-right, down, forward], intrinsics, SIZE);
    let mirrored = mirrored.unwrap();
    assert!(mirrored.focal.x < 0.0);
    let lens = |distortion, camera| Lens::of_view("a", distortion, camera).unwrap().unwrap();
    let lenses = [lens(as_taken, &camera), lens(of_mirrored, &mirrored)];
    for tangent in [[0.1, 0.2], [-0.3, 0.1], [0.2, -0.25]].map(DVec2::from) {
        let [taken, back] = lenses.map(|lens| lens.photo_from_tangent(tangent).unwrap());
        assert!(
            (taken.x + back.x - f64::from(SIZE.0)).abs() < 1e-9 && (taken.y - back.y).abs() < 1e-9
        );
    }
}

/// nerfstudio's `applied_transform` is already in the poses: it changes nothing.
#[test]
fn the_transform_that_was_applied_is_not_applied_again() {
    let folder = tempfile::tempdir().unwrap();
    let (path, none) = (folder.path().join("transforms.json"), Distortion::default());
    write(folder.path(), &json!({}), false, none);
    let plain = read(&path).unwrap();
    let fields = json!({"applied_transform": [[0, 1, 0, 3], [1, 0, 0, 4], [0, 0, -1, 5]], "applied_scale": 0.25});
    write(folder.path(), &fields, false, none);
    for (a, b) in plain.views.iter().zip(&read(&path).unwrap().views) {
        assert_alike(&a.camera, &b.camera);
    }
}

#[test]
fn lenses_that_are_not_known_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let message = |fields: Value| {
        write(folder.path(), &fields, false, Distortion::default());
        read(folder.path()).unwrap_err()
    };
    for model in ["EQUIRECTANGULAR", "FISHEYE624"] {
        let error = message(json!({"camera_model": model}));
        assert!(matches!(*error.fault, CaptureFault::LensModel { .. }));
        assert!(error.to_string().contains(model), "{error}");
    }
    let folded = message(json!({"k1": -1e9}));
    assert!(folded.to_string().contains("folds"), "{folded}");
}

/// The corners of a fisheye picture lie far outside of the straight one; what is cut off there is unknown.
#[test]
fn what_a_wide_lens_does_not_show_is_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let fields = json!({"camera_model": "OPENCV_FISHEYE", "fl_x": 70.0, "fl_y": 70.0, "cx": 110.0, "cy": 90.0});
    let wide: Vec<Pinhole> = (cameras(VIEWS).into_iter())
        .map(|camera| Pinhole {
            focal: DVec2::splat(70.0),
            principal: DVec2::new(110.0, 90.0),
            ..camera
        })
        .collect();
    let fisheye = Distortion {
        projection: Projection::Equidistant,
        ..Distortion::default()
    };
    write(folder.path(), &fields, false, fisheye);
    for (k, camera) in wide.iter().enumerate() {
        let mask = photographed(camera, fisheye);
        save(&mask, &folder.path().join(format!("masks/{k:02}.png")));
    }
    let found = read(folder.path()).unwrap();
    for view in &found.views {
        // 110 pixels aside are 90 degrees: infinitely far.
        assert!(view.camera.width <= 2 * SIZE.0 && view.camera.height <= 2 * SIZE.1);
        assert!(agreement(view) > 0.93, "{}", agreement(view));
        let known = view.known.as_ref().map_or(1.0, |k| {
            k.count() as f64 / f64::from(view.camera.width * view.camera.height)
        });
        assert!(known > 0.5);
    }
}
