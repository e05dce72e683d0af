//! Whole captures made from a model whose truth is known: written, read, carved.

use std::fs;
use std::path::Path;

use glam::{DQuat, DVec2, DVec3};
use image::{GrayImage, Luma, Rgb, RgbImage};
use serde_json::{Value, json};
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Bvh, Mask, TriangleMesh, Watch};

use crate::{
    CameraFormat, Capture, CaptureFault, CaptureView, CaptureWarning, CarveError, CarveParams,
    Carved, Pinhole, carve, median, read, silhouette,
};

pub(crate) const SIZE: (u32, u32) = (220, 180);

/// Cameras on a spiral around the origin, with unequal focal lengths and a principal point off the middle.
pub(crate) fn cameras(count: usize) -> Vec<Pinhole> {
    (0..count)
        .map(|k| {
            let turn = 2.4 * k as f64;
            let height = -0.8 + 1.6 * (k as f64 + 0.5) / count as f64;
            let ring = (1.0 - height * height).sqrt();
            let eye = 6.0 * DVec3::new(ring * turn.cos(), ring * turn.sin(), height);
            let forward = -eye.normalize_or_zero();
            let right = forward.cross(DVec3::Z).normalize_or_zero();
            let down = forward.cross(right);
            let roll = DQuat::from_axis_angle(forward, 0.3 * k as f64);
            let axes = [right, down, forward].map(|a| roll * a);
            let lens = (DVec2::new(330.0, 320.0), DVec2::new(104.3, 93.7));
            Pinhole::from_pose(eye, axes, lens, SIZE).unwrap()
        })
        .collect()
}

pub(crate) fn model() -> TriangleMesh {
    silmap_models::torus(1500)
}

pub(crate) fn capture(count: usize) -> Capture {
    let views = cameras(count).into_iter().enumerate().map(|(k, camera)| {
        let mask = silhouette(&model(), &camera).unwrap();
        CaptureView {
            name: format!("view_{k:02}"),
            camera,
            outline: trace_contours(&mask),
            mask,
            photo: None,
            lens: None,
            taken: None,
            known: None,
        }
    });
    Capture {
        name: "torus".to_owned(),
        path: "cameras.json".into(),
        format: CameraFormat::CamerasJson,
        pixel_centre: 0.5,
        object_bounds: None,
        views: views.collect(),
        listed: count,
        warnings: Vec::new(),
    }
}

pub(crate) fn carved(capture: &Capture, outvoted: Option<u32>) -> Result<Carved, CarveError> {
    let params = CarveParams {
        voxels: 64,
        outvoted,
    };
    carve(capture, &params, &Watch::silent())
}

pub(crate) fn save(mask: &Mask, path: &Path) {
    let value = |x: u32, y: u32| Luma([255 * u8::from(mask.get(x.into(), y.into()))]);
    GrayImage::from_fn(mask.width(), mask.height(), value)
        .save(path)
        .unwrap();
}

/// Camera to world, x right, y up, z backward.
pub(crate) fn nerf_pose(camera: &Pinhole) -> Value {
    let [right, down, forward] = camera.axes;
    let columns = [right, -down, -forward, camera.eye];
    let row = |r: usize| Value::from(columns.map(|c| c[r]).to_vec());
    json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}

/// Writes both camera files, and the masks.
fn write(capture: &Capture, folder: &Path, pixel_centre: f64) {
    fs::create_dir_all(folder.join("masks")).unwrap();
    let (mut views, mut frames) = (Vec::new(), Vec::new());
    for view in &capture.views {
        save(&view.mask, &folder.join(format!("masks/{}.png", view.name)));
        let camera = Pinhole {
            principal: view.camera.principal - DVec2::splat(0.5 - pixel_centre),
            ..view.camera
        };
        let mask = format!("masks/{}.png", view.name);
        views
            .push(json!({"name": view.name, "mask": mask, "photo": null, "P": camera.to_matrix()}));
        frames.push(json!({
            "file_path": format!("photos/{}.jpg", view.name),
            "transform_matrix": nerf_pose(&view.camera),
        }));
    }
    let camera = &capture.views[0].camera;
    let matrices = json!({"name": "torus", "width": SIZE.0, "height": SIZE.1, "pixel_centre": pixel_centre,
        "metric": true, "views": views});
    let poses = json!({"w": SIZE.0, "h": SIZE.1, "fl_x": camera.focal.x, "fl_y": camera.focal.y,
        "cx": camera.principal.x, "cy": camera.principal.y, "camera_model": "OPENCV", "k1": 0.0,
        "frames": frames});
    fs::write(folder.join("cameras.json"), matrices.to_string()).unwrap();
    fs::write(folder.join("transforms.json"), poses.to_string()).unwrap();
}

pub(crate) fn assert_alike(a: &Pinhole, b: &Pinhole) {
    for k in 0..20 {
        let at = |step: f64| (step * f64::from(k)).sin();
        let point = DVec3::new(at(1.1), at(2.3), at(3.7));
        let (p, q) = (a.project(point).unwrap().0, b.project(point).unwrap().0);
        assert!(p.distance(q) < 1e-8, "{p} is not {q}");
    }
}

#[test]
fn matrices_are_read_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let made = capture(3);
    for pixel_centre in [0.0, 0.5] {
        write(&made, folder.path(), pixel_centre);
        // The folder, and the file: the first that is known is taken.
        for path in [folder.path().to_owned(), folder.path().join("cameras.json")] {
            let found = read(&path).unwrap();
            assert_eq!((found.views.len(), found.pixel_centre), (3, pixel_centre));
            for (a, b) in found.views.iter().zip(&made.views) {
                assert_alike(&a.camera, &b.camera);
                assert_eq!(a.mask, b.mask);
            }
        }
    }
}

#[test]
fn poses_of_nerf_are_read_as_written() {
    let folder = tempfile::tempdir().unwrap();
    // At (1, 2, 3), looking along −z, which is forward there, with y up.
    let file = json!({"camera_angle_x": 2.0 * (0.5_f64).atan(), "w": 40, "h": 30, "frames": [
        {"file_path": "./a", "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]},
        {"file_path": "b.png", "fl_x": 20.0, "fl_y": 10.0, "cx": 1.0, "cy": 2.0,
         "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]});
    fs::write(folder.path().join("transforms.json"), file.to_string()).unwrap();
    fs::create_dir(folder.path().join("masks")).unwrap();
    let mut mask = Mask::new(40, 30);
    mask.set_span(4, 3, 9);
    save(&mask, &folder.path().join("masks/a.png"));
    save(&mask, &folder.path().join("masks/b.png.png"));
    let found = read(folder.path()).unwrap();
    let point = DVec3::new(1.5, 2.25, 2.0);
    // u = cx + fl_x·x/(−z), v = cy − fl_y·y/(−z), from the corner.
    let first = found.views[0].camera.project(point).unwrap();
    assert!(
        first
            .0
            .distance(DVec2::new(20.0 + 40.0 * 0.5, 15.0 - 40.0 * 0.25))
            < 1e-9
    );
    let second = found.views[1].camera.project(point).unwrap();
    assert!(
        second
            .0
            .distance(DVec2::new(1.0 + 20.0 * 0.5, 2.0 - 10.0 * 0.25))
            < 1e-9
    );
    assert_eq!(found.views[1].name, "b");
    assert_eq!(found.views[1].mask, mask);

    // Names that folders alone tell apart; the size is that of masks where nothing else has it.
    let mut file = file;
    for (frame, path) in file["frames"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .zip(["a/1.jpg", "b/1.jpg"])
    {
        frame["file_path"] = path.into();
        let path = folder.path().join("masks").join(path);
        fs::create_dir(path.parent().unwrap()).unwrap();
        save(&mask, &path.with_extension("png"));
    }
    for side in ["w", "h"] {
        file.as_object_mut().unwrap().remove(side);
    }
    save(&mask, &folder.path().join("masks/1.jpg.png"));
    fs::write(folder.path().join("transforms.json"), file.to_string()).unwrap();
    let found = read(folder.path()).unwrap();
    let names: Vec<&str> = found.views.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["a/1", "b/1"]);
    assert_eq!(found.views[0].camera.width, 40);
}

#[test]
fn both_files_of_one_capture_agree() {
    let folder = tempfile::tempdir().unwrap();
    write(&capture(4), folder.path(), 0.0);
    let matrices = read(&folder.path().join("cameras.json")).unwrap();
    let poses = read(&folder.path().join("transforms.json")).unwrap();
    for (a, b) in matrices.views.iter().zip(&poses.views) {
        assert_eq!((&a.name, &a.mask), (&b.name, &b.mask));
        assert_alike(&a.camera, &b.camera);
    }
}

#[test]
fn lines_of_middlebury_are_read_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let made = capture(3);
    write(&made, folder.path(), 0.5);
    let mut text = "3\n".to_owned();
    for view in &made.views {
        let camera = &view.camera;
        // The first pixel's centre is at zero.
        let (f, c) = (camera.focal, camera.principal - DVec2::splat(0.5));
        let mut numbers = vec![f.x, 0.0, c.x, 0.0, f.y, c.y, 0.0, 0.0, 1.0];
        numbers.extend(camera.axes.iter().flat_map(|axis| axis.to_array()));
        numbers.extend(camera.axes.map(|axis| -axis.dot(camera.eye)));
        let words: Vec<String> = numbers.iter().map(|v| format!("{v:?}")).collect();
        text += &format!("{}.png {}\n", view.name, words.join(" "));
    }
    let path = folder.path().join("torus_par.txt");
    fs::write(&path, &text).unwrap();
    let found = read(&path).unwrap();
    assert_eq!(found.format, CameraFormat::Middlebury);
    for (a, b) in found.views.iter().zip(&made.views) {
        assert_eq!((&a.name, &a.mask), (&b.name, &b.mask));
        assert_alike(&a.camera, &b.camera);
    }
    let told = |text: &str| {
        fs::write(&path, text).unwrap();
        read(&path).unwrap_err().to_string()
    };
    assert!(told(&text.replacen('3', "4", 1)).contains("says 4 images, and 3 follow"));
    assert!(told(&text.replacen("1.0 ", "", 1)).contains("line 2: a name and 21 numbers"));
    assert!(told(&text.replacen("1.0 ", "one ", 1)).contains("line 2: \"one\" is no number"));
    assert!(told(&text.replacen("1.0 ", "NaN ", 1)).contains("not finite"));
    assert!(told("").contains("no views"));
}

#[test]
fn the_hull_holds_the_model_and_agrees_with_every_mask() {
    let found = carved(&capture(20), Some(0)).unwrap();
    let tree = Bvh::new(found.mesh.mesh());
    // A mask's pixel is 0.02 at the model; the surface lies between voxels, and may cut a ridge by a part of one.
    let allowed = 0.02 + 0.5 * found.voxel;
    for &p in &model().positions {
        let is_inside = tree.winding_number(p) == 1;
        assert!(
            is_inside || tree.closest_point(p).0.distance(p) < allowed,
            "{p}"
        );
    }
    let overlaps: Vec<f64> = found.residuals.iter().map(|r| r.unwrap().overlap).collect();
    assert!(overlaps.iter().all(|&o| o > 0.97), "{overlaps:?}");
    assert!(found.mesh.mesh().volume() > model().volume());
    // The hole of the torus is there.
    assert_eq!(tree.winding_number(DVec3::ZERO), 0);
}

#[test]
fn one_spoiled_mask_is_left_out_and_named() {
    let mut capture = capture(24);
    let clean = carved(&capture, None).unwrap();
    assert_eq!(clean.outvoted, 0);
    assert!(clean.warnings.is_empty(), "{:?}", clean.warnings);
    // A third of the object is gone.
    let mask = &mut capture.views[5].mask;
    for y in 105..SIZE.1 {
        mask.row_mut(y).fill(0);
    }
    let found = carved(&capture, None).unwrap();
    assert_eq!(found.outvoted, 0);
    let left_out = CaptureWarning::LeftOut {
        view: "view_05".to_owned(),
    };
    assert!(found.warnings.contains(&left_out), "{:?}", found.warnings);
    let is_named = |w: &CaptureWarning| matches!(w, CaptureWarning::Disagrees { view, .. } if view == "view_05");
    let named = found.warnings.iter().filter(|w| is_named(w)).count();
    let all = found
        .warnings
        .iter()
        .filter(|w| matches!(w, CaptureWarning::Disagrees { .. }))
        .count();
    assert_eq!((named, all), (1, 1), "{:?}", found.warnings);
    let usual = median(found.residuals.iter().flatten().map(|r| r.overlap)).unwrap();
    assert!(usual > 0.95, "{usual}");
    // Believed, it takes a large part of the object away.
    let believed = carved(&capture, Some(0)).unwrap();
    assert!(believed.mesh.mesh().volume() < 0.85 * clean.mesh.mesh().volume());
}

#[test]
fn more_votes_never_carve_more_and_threads_change_nothing() {
    let capture = capture(20);
    let volumes: Vec<f64> = (0..3)
        .map(|k| carved(&capture, Some(k)).unwrap().mesh.mesh().volume())
        .collect();
    assert!(volumes.windows(2).all(|w| w[0] < w[1]), "{volumes:?}");
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| carved(&capture, None).unwrap().mesh)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn what_lies_outside_of_an_image_is_unknown() {
    // All images cut off on the right, through the object: the rest of the views still bound it.
    let whole = capture(20);
    let mut cut = whole.clone();
    for view in cut.views.iter_mut().step_by(2) {
        view.camera.width = 110;
        let mut mask = Mask::new(110, SIZE.1);
        for y in 0..SIZE.1 {
            for x in 0..110 {
                mask.set(x, y, view.mask.get(x.into(), y.into()));
            }
        }
        view.mask = mask;
    }
    let (whole, cut) = (
        carved(&whole, Some(0)).unwrap(),
        carved(&cut, Some(0)).unwrap(),
    );
    let ratio = cut.mesh.mesh().volume() / whole.mesh.mesh().volume();
    assert!((1.0..1.2).contains(&ratio), "{ratio}");
}

#[test]
fn a_capture_far_from_the_origin_is_carved_alike() {
    let near = capture(12);
    let mut far = near.clone();
    let shift = DVec3::new(5e5, 4.1e6, 100.0);
    for view in &mut far.views {
        view.camera = view.camera.moved(shift);
    }
    let (near, far) = (carved(&near, None).unwrap(), carved(&far, None).unwrap());
    assert_ne!(far.mesh.origin(), DVec3::ZERO);
    let ratio = far.mesh.mesh().volume() / near.mesh.mesh().volume();
    assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
    let middle = far.mesh.bounds().center + far.mesh.origin() - shift;
    assert!(middle.length() < 0.1, "{middle}");
}

#[test]
fn what_cannot_be_carved_is_said() {
    let message = |capture: &Capture| match carved(capture, None) {
        Ok(found) => format!("carved with {:?}", found.residuals),
        Err(error) => error.to_string(),
    };
    let mut same = capture(3);
    for k in 1..3 {
        same.views[k] = same.views[0].clone();
    }
    assert!(
        message(&same).contains("same direction"),
        "{}",
        message(&same)
    );
    // World to camera taken for camera to world.
    let mut turned = capture(12);
    for view in &mut turned.views {
        let [a, b, c] = view.camera.axes;
        let column = |k: usize| DVec3::new(a[k], b[k], c[k]);
        view.camera.axes = [column(0), column(1), column(2)];
    }
    assert!(
        message(&turned).contains("a convention that is not theirs"),
        "{}",
        message(&turned)
    );
    // A camera in the tube, which sees itself surrounded.
    let mut inside = capture(12);
    let view = &mut inside.views[3];
    view.camera.eye = DVec3::X;
    view.camera.width = 4;
    view.camera.height = 4;
    view.mask = Mask::new(4, 4);
    view.mask.set_span(1, 0, 3);
    let told = message(&inside);
    assert!(told.contains("view_03: its camera is inside"), "{told}");
    let outvoted = carved(&capture(4), Some(3)).unwrap_err();
    assert!(matches!(
        outvoted,
        CarveError::Outvoted { value: 3, views: 4 }
    ));
}

#[test]
fn cameras_that_are_off_are_said() {
    // Y up for y down; and a principal point that is off by a tenth of the image.
    let off: [fn(&mut Pinhole); 2] = [
        |camera| camera.axes[1] = -camera.axes[1],
        |camera| camera.principal.x += 22.0,
    ];
    for spoil in off {
        let mut capture = capture(16);
        for view in &mut capture.views {
            spoil(&mut view.camera);
        }
        let is_said = match carved(&capture, None) {
            Ok(found) => {
                (found.warnings.iter()).any(|w| matches!(w, CaptureWarning::PoorOverlap { .. }))
            }
            Err(error) => error
                .to_string()
                .contains("a convention that is not theirs"),
        };
        assert!(is_said);
    }
}

#[test]
fn broken_files_end_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let made = capture(3);
    write(&made, folder.path(), 0.5);
    let path = folder.path().join("cameras.json");
    let good = fs::read_to_string(&path).unwrap();
    let after = |change: &dyn Fn(&mut Value)| {
        let mut value: Value = serde_json::from_str(&good).unwrap();
        change(&mut value);
        fs::write(&path, value.to_string()).unwrap();
        read(&path).unwrap_err().to_string()
    };
    let told = after(&|v| v["views"][1]["P"][2] = v["views"][1]["P"][0].clone());
    assert!(
        told.contains("view_01") && told.contains("rank 2"),
        "{told}"
    );
    let told = after(&|v| v["views"][1]["mask"] = "masks/none.png".into());
    assert!(
        told.contains("view_01") && told.contains("none.png"),
        "{told}"
    );
    let told = after(&|v| v["width"] = 219.into());
    assert!(
        told.contains("has 220 × 180 pixels, not 219 × 180"),
        "{told}"
    );
    let told = after(&|v| {
        v["views"][0]["mask"] = Value::Null;
        v["views"][2]["mask"] = Value::Null;
    });
    assert!(told.contains("1 of 3 views has a mask"), "{told}");
    let told = after(&|v| v["metric"] = false.into());
    assert!(told.contains("projective"), "{told}");
    for word in ["NaN", "Infinity", "1e999"] {
        fs::write(&path, good.replacen("180", word, 1)).unwrap();
        let told = read(&path).unwrap_err();
        assert!(
            matches!(*told.fault, CaptureFault::NotFinite { .. }),
            "{told}"
        );
    }
    fs::write(&path, "[]").unwrap();
    assert!(
        read(&path)
            .unwrap_err()
            .to_string()
            .contains("no camera file")
    );
    fs::remove_file(&path).unwrap();
    fs::remove_file(folder.path().join("transforms.json")).unwrap();
    let told = read(folder.path()).unwrap_err().to_string();
    assert!(told.contains("cameras.json, transforms.json"), "{told}");
}

#[test]
fn the_surface_has_the_colours_of_the_photographs() {
    let folder = tempfile::tempdir().unwrap();
    let mut made = capture(12);
    for view in &mut made.views {
        let path = folder.path().join(format!("{}.png", view.name));
        // What is beside the object must not come in.
        let colour = |x: u32, y: u32| match view.mask.get(x.into(), y.into()) {
            true => Rgb([200, 100, 50]),
            false => Rgb([0, 0, 255]),
        };
        RgbImage::from_fn(SIZE.0, SIZE.1, colour)
            .save(&path)
            .unwrap();
        view.photo = Some(path);
    }
    made.views[0].photo = Some(folder.path().join("missing.png"));
    let mesh = carved(&made, None).unwrap().mesh;
    let mut warnings = Vec::new();
    let watch = Watch::silent();
    let how = (mesh.origin(), 512);
    let photographs = crate::photographs(&made, how, &mut warnings, &watch).unwrap();
    let (painted, found) = crate::paint(mesh, &photographs, &watch).unwrap();
    assert_eq!((found.photographs, warnings.len()), (11, 1));
    assert!(found.seen > 0.8, "{}", found.seen);
    let expected =
        [200, 100, 50].map(|v| silmap_geometry::lighting::linear_from_srgb(v as f32 / 255.0));
    let (mesh, normals) = (painted.mesh(), painted.mesh().vertex_normals());
    let mut right = 0;
    for (face, corners) in mesh.faces.iter().zip(&mesh.appearance.corner_colours) {
        let light =
            silmap_geometry::lighting::irradiance(normals[face[0] as usize].as_vec3().to_array());
        let off = (0..3).map(|c| (corners[0][c] * light - expected[c]).abs());
        right += usize::from(off.fold(0.0, f32::max) < 0.02);
    }
    assert!(
        right as f64 > 0.8 * mesh.faces.len() as f64,
        "{right} of {}",
        mesh.faces.len()
    );
}

/// Photographs of a torus with a pattern, each exposed by factors of its own.
fn photographed(folder: &Path, exposures: &[[f32; 3]]) -> Capture {
    let mut made = capture(exposures.len());
    let tree = Bvh::new(&model());
    for (view, exposure) in made.views.iter_mut().zip(exposures) {
        let path = folder.join(format!("{}.png", view.name));
        let picture = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
            let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (eye, ray) = (view.camera.eye, view.camera.direction(at));
            let hit = tree.first_hit(eye, ray, 0.0, f64::INFINITY);
            let point = hit.map_or(DVec3::splat(1e3), |h| eye + ray * h.t);
            let wave = (3.0 * point)
                .to_array()
                .map(|v| 0.25 + 0.08 * v.sin() as f32);
            let value = |c: usize| {
                let linear = if hit.is_some() {
                    wave[c] * exposure[c]
                } else {
                    0.0
                };
                (255.0 * silmap_geometry::lighting::srgb_from_linear(linear)).round() as u8
            };
            Rgb([value(0), value(1), value(2)])
        });
        picture.save(&path).unwrap();
        view.photo = Some(path);
    }
    made
}

#[test]
fn made_exposures_are_evened_out_and_even_ones_left() {
    let made = |k: usize, c: usize| 1.0 + 0.4 * (1.7 * k as f32 + 2.0 * c as f32).sin();
    for is_even in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let exposures: Vec<[f32; 3]> = (0..16)
            .map(|k| std::array::from_fn(|c| if is_even { 1.0 } else { made(k, c) }))
            .collect();
        let capture = photographed(folder.path(), &exposures);
        let surface = carved(&capture, None).unwrap().mesh;
        let (mut warnings, watch) = (Vec::new(), Watch::silent());
        let how = (surface.origin(), 512);
        let mut photographs = crate::photographs(&capture, how, &mut warnings, &watch).unwrap();
        let about = (&surface, &capture);
        let range = crate::even_out(&mut photographs, about, &mut warnings, &watch).unwrap();
        let mean: [f32; 3] = std::array::from_fn(|c| {
            exposures.iter().map(|e| e[c].ln()).sum::<f32>() / exposures.len() as f32
        });
        for (found, exposure) in photographs.iter().zip(&exposures) {
            for c in 0..3 {
                let off = found.photograph.gain[c].ln() + exposure[c].ln() - mean[c];
                assert!(off.abs() < 0.03, "view {} channel {c}: {off}", found.view);
            }
        }
        let is_warned = warnings
            .iter()
            .any(|w| matches!(w, CaptureWarning::Exposure { .. }));
        assert_eq!(is_warned, !is_even, "{warnings:?}");
        assert_eq!(range.largest > 1.3, !is_even, "{range:?}");
    }
}
