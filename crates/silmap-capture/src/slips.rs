//! Camera files with one slip in all cameras, written as people write them: each is noticed, and named.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use serde_json::{Value, json};
use silmap_geometry::{Mask, Watch};

use crate::tests::{SIZE, capture, save};
use crate::{
    Capture, CaptureWarning, CarveParams, Pinhole, Reading, ShiftKind, carve, disagreeing,
    image_shift, misread, read, silhouette,
};

/// How a file is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Slip {
    None,
    Mirrored,
    Transposed,
    OtherDirection,
    YUp,
}

const SLIPS: [Slip; 4] = [
    Slip::Mirrored,
    Slip::Transposed,
    Slip::OtherDirection,
    Slip::YUp,
];

/// From the camera's axes (right, down, forward) to the world.
fn turn(camera: &Pinhole) -> DMat3 {
    DMat3::from_cols(camera.axes[0], camera.axes[1], camera.axes[2])
}

fn rows(m: DMat3, last: DVec3) -> Value {
    let row = |r: usize| json!([m.col(0)[r], m.col(1)[r], m.col(2)[r], last[r]]);
    json!([row(0), row(1), row(2)])
}

fn mirrored(mask: &Mask) -> Mask {
    let mut other = Mask::new(mask.width(), mask.height());
    for (x, y) in (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| (x, y))) {
        other.set(mask.width() - 1 - x, y, mask.get(x.into(), y.into()));
    }
    other
}

/// Writes the cameras of a capture with a slip, as matrices and as poses; and the masks.
fn write(capture: &Capture, slip: Slip, folder: &Path) -> [PathBuf; 2] {
    fs::create_dir_all(folder.join("masks")).unwrap();
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let (mut views, mut frames) = (Vec::new(), Vec::new());
    for view in &capture.views {
        let name = format!("masks/{}.png", view.name);
        let mask = match slip {
            Slip::Mirrored => mirrored(&view.mask),
            _ => view.mask.clone(),
        };
        save(&mask, &folder.join(&name));
        let camera = &view.camera;
        let (f, c) = (camera.focal, camera.principal);
        let k = [[f.x, camera.skew, c.x], [0.0, f.y, c.y], [0.0, 0.0, 1.0]];
        // What the two kinds of file must hold, and what they hold.
        let (to_camera, to_world) = (turn(camera).transpose(), turn(camera) * flip);
        let t = -(to_camera * camera.eye);
        let (r, t) = match slip {
            Slip::Transposed => (to_camera.transpose(), t),
            Slip::OtherDirection => (turn(camera), camera.eye),
            Slip::YUp => (flip * to_camera, flip * t),
            Slip::None | Slip::Mirrored => (to_camera, t),
        };
        let matrix = rows(DMat3::from_cols_array_2d(&k).transpose() * r, {
            DMat3::from_cols_array_2d(&k).transpose() * t
        });
        views.push(json!({"name": view.name, "mask": name, "photo": null, "P": matrix}));
        let (m, eye) = match slip {
            Slip::Transposed => (to_world.transpose(), camera.eye),
            Slip::OtherDirection => (to_world.transpose(), -(to_world.transpose() * camera.eye)),
            Slip::YUp => (turn(camera), camera.eye),
            Slip::None | Slip::Mirrored => (to_world, camera.eye),
        };
        frames.push(
            json!({"file_path": view.name, "mask_path": name, "transform_matrix": rows(m, eye),
            "fl_x": f.x, "fl_y": f.y, "cx": c.x, "cy": c.y}),
        );
    }
    let camera = &capture.views[0].camera;
    let (width, height) = (camera.width, camera.height);
    let matrices = json!({"width": width, "height": height, "pixel_centre": 0.5, "views": views});
    let poses = json!({"w": width, "h": height, "frames": frames});
    let files = ["cameras.json", "transforms.json"].map(|name| folder.join(name));
    fs::write(&files[0], matrices.to_string()).unwrap();
    fs::write(&files[1], poses.to_string()).unwrap();
    files
}

/// What must be named for a slip, in files of matrices and of poses.
fn expected(slip: Slip, is_poses: bool) -> Option<Reading> {
    match (slip, is_poses) {
        (Slip::None, _) => None,
        (Slip::Mirrored, _) => Some(Reading::MirroredPictures),
        (Slip::Transposed, false) => Some(Reading::TransposedBeforeTranslation),
        (Slip::Transposed, true) => Some(Reading::TransposedAboutEye),
        (Slip::OtherDirection, _) => Some(Reading::OtherDirection),
        (Slip::YUp, _) => Some(Reading::YUpZBack),
    }
}

/// Reads both files of each slip and looks at what is found.
fn each_slip_is_named(set: &Capture, is_carved: bool) {
    let folder = tempfile::tempdir().unwrap();
    let silent = Watch::silent();
    for slip in [Slip::None].into_iter().chain(SLIPS) {
        for (file, is_poses) in write(set, slip, folder.path()).iter().zip([false, true]) {
            let read = read(file).unwrap();
            let found = misread(&read, &silent).unwrap();
            let wanted = expected(slip, is_poses);
            match (&found, wanted) {
                (None, None) => {}
                (Some(found), Some(wanted)) if found.likely.contains(&wanted) => {
                    // Nothing else is as likely.
                    assert_eq!(found.likely.len(), 1, "{slip:?} {is_poses}: {found:?}");
                }
                _ => panic!("{slip:?} {is_poses}: {found:?}, not {wanted:?}"),
            }
            // What is carved, or not, says the same.
            if !is_carved {
                continue;
            }
            let params = CarveParams {
                voxels: 48,
                outvoted: None,
            };
            let told = match carve(&read, &params, &silent) {
                Ok(carved) => (carved.warnings.iter())
                    .filter(|w| matches!(w, CaptureWarning::Misread(_)))
                    .map(ToString::to_string)
                    .collect(),
                Err(error) => error.to_string(),
            };
            let name = wanted.map_or("", Reading::name);
            assert!(told.contains(name), "{slip:?} {is_poses}: {told}");
            assert_eq!(
                told.contains("likely cause"),
                wanted.is_some(),
                "{slip:?} {is_poses}: {told}"
            );
        }
    }
}

#[test]
fn slips_in_all_cameras_are_named() {
    each_slip_is_named(&capture(14), true);
}

#[test]
fn slips_in_a_real_set_are_named() {
    let squirrel = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/captures/squirrel");
    let Ok(mut set) = read(&squirrel) else {
        eprintln!("skipped: {} is not there", squirrel.display());
        return;
    };
    // Every third view is enough.
    let mut number = 0;
    set.views.retain(|_| {
        number += 1;
        number % 3 == 1
    });
    each_slip_is_named(&set, false);
}

/// Around an axis of symmetry mirrored pictures and those that are right are the same: nothing is said then, and nothing is wrong.
#[test]
fn what_masks_cannot_tell_is_not_said() {
    let upright = |k: usize| {
        let turn = 0.45 * k as f64;
        let eye = 6.0 * DVec3::new(turn.cos(), turn.sin(), 0.3);
        let forward = -eye.normalize_or_zero();
        let right = forward.cross(DVec3::Z).normalize_or_zero();
        let axes = [right, forward.cross(right), forward];
        let lens = (DVec2::splat(300.0), DVec2::new(110.0, 90.0));
        Pinhole::from_pose(eye, axes, lens, SIZE).unwrap()
    };
    let mut round = capture(14);
    for (k, view) in round.views.iter_mut().enumerate() {
        view.camera = upright(k);
        view.mask = silhouette(&silmap_models::torus(1500), &view.camera).unwrap();
    }
    for is_mirrored in [false, true] {
        if is_mirrored {
            for view in &mut round.views {
                view.mask = mirrored(&view.mask);
            }
        }
        assert_eq!(
            misread(&round, &Watch::silent()).unwrap(),
            None,
            "{is_mirrored}"
        );
    }
}

/// A step of all image coordinates is measured to a twentieth of a pixel where masks are exact, and half a pixel is named.
#[test]
fn half_a_pixel_is_noticed() {
    for (step, expected) in [
        (0.0, ShiftKind::None),
        (0.5, ShiftKind::HalfPixel { is_forward: false }),
        (-0.5, ShiftKind::HalfPixel { is_forward: true }),
        (2.0, ShiftKind::Principal),
    ] {
        let mut set = capture(16);
        for view in &mut set.views {
            view.camera.principal += DVec2::splat(step);
        }
        let found = image_shift(&set).unwrap();
        assert!(
            (found.by + DVec2::splat(step)).abs().max_element() < 0.05,
            "{step}: {found:?}"
        );
        assert!(found.deviation.max_element() < 0.03, "{found:?}");
        assert_eq!(found.kind(), expected, "{step}: {found:?}");
    }
}

/// On real sets the same step is measured, beside what their calibration is off by anyway.
#[test]
fn half_a_pixel_is_measured_in_real_sets() {
    // Axes that can be told.
    let sets = [
        ("squirrel", [true, false]),
        ("plaster-dinosaur/ring", [false, true]),
        ("plaster-dinosaur/hemisphere", [true, true]),
    ];
    for (name, is_known) in sets {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../shared/captures")
            .join(name);
        let Ok(mut set) = read(&folder) else {
            eprintln!("skipped: {} is not there", folder.display());
            continue;
        };
        let before = image_shift(&set).unwrap();
        for view in &mut set.views {
            view.camera.principal += DVec2::splat(0.5);
        }
        let after = image_shift(&set).unwrap();
        assert_eq!(before.is_known(), is_known, "{name}: {before:?}");
        for (axis, is_known) in is_known.into_iter().enumerate() {
            let step = before.by[axis] - after.by[axis];
            assert!(
                !is_known || (step - 0.5).abs() < 0.05,
                "{name}: {before:?} {after:?}"
            );
        }
        // As they are, none is taken for half a pixel.
        assert!(
            !matches!(before.kind(), ShiftKind::HalfPixel { .. }),
            "{name}: {before:?}"
        );
    }
}

/// Adds a disc to a mask, or takes it away.
fn spoil(mask: &mut Mask, middle: DVec2, radius: f64, is_added: bool) {
    let (width, height) = (mask.width(), mask.height());
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if DVec2::new(x.into(), y.into()).distance(middle) < radius {
            mask.set(x, y, is_added);
        }
    }
}

/// Where a mask reaches farthest to the right.
fn rightmost(mask: &Mask) -> DVec2 {
    let pixels = (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| (x, y)));
    let found = pixels.filter(|&(x, y)| mask.get(x.into(), y.into())).max();
    found.map_or(DVec2::ZERO, |(x, y)| DVec2::new(x.into(), y.into()))
}

/// One mask of 36 with a bite out; of 100 one with a bite out and one with a blob: the hull survives, and they are named.
#[test]
fn slips_of_masks_are_named_and_do_no_harm() {
    for (count, bitten, blotted) in [(36, 11, None), (36, 3, Some(20)), (100, 41, Some(78))] {
        let clean = capture(count);
        let mut spoiled = clean.clone();
        let at = rightmost(&spoiled.views[bitten].mask);
        spoil(&mut spoiled.views[bitten].mask, at, 22.0, false);
        let mut expected = vec![bitten];
        if let Some(view) = blotted {
            let at = rightmost(&spoiled.views[view].mask) + DVec2::new(8.0, 0.0);
            spoil(&mut spoiled.views[view].mask, at, 16.0, true);
            expected.push(view);
        }
        let params = CarveParams {
            voxels: 64,
            outvoted: None,
        };
        let silent = Watch::silent();
        let (good, bad) = (
            carve(&clean, &params, &silent).unwrap(),
            carve(&spoiled, &params, &silent).unwrap(),
        );
        assert!(good.warnings.is_empty(), "{count}: {:?}", good.warnings);
        let ratio = bad.mesh.mesh().volume() / good.mesh.mesh().volume();
        assert!((ratio - 1.0).abs() < 0.01, "{count}: {ratio}");
        let mut named = disagreeing(&bad.residuals);
        named.sort_unstable();
        expected.sort_unstable();
        assert_eq!(named, expected, "{count}: {:?}", bad.warnings);
    }
}
