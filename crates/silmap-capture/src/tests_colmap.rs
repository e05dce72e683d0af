//! COLMAP models written from known cameras, and read.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};

use crate::lens::Distortion;
use crate::tests::{SIZE, assert_alike, cameras, capture, carved, save};
use crate::tests_lens::photographed;
use crate::{CameraFormat, Capture, CaptureWarning, Pinhole, read};

/// Rotation and translation from world to camera, as COLMAP has them: w, x, y, z, and t.
fn pose(camera: &Pinhole) -> [f64; 7] {
    // Columns of the transposed matrix are rows of R: right, down, forward.
    let [right, down, forward] = camera.axes;
    let r = DMat3::from_cols(right, down, forward).transpose();
    let q = DQuat::from_mat3(&r);
    let t = -(r * camera.eye);
    [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
}

fn name(k: usize) -> String {
    // Folders, blanks, and names that are different by their folder alone.
    match k % 2 {
        0 => format!("left hand/photo {k:02}.jpg"),
        _ => format!("right/photo {:02}.jpg", k - 1),
    }
}

fn words(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(|v| format!("{v:?}")).collect();
    words.join(" ")
}

/// The cameras of a model: one for even images, one for odd ones.
fn params(camera: &Pinhole) -> [Vec<f64>; 2] {
    let (f, c) = (camera.focal, camera.principal);
    [
        vec![f.x, f.y, c.x, c.y],
        vec![f.x, f.y, c.x, c.y, -0.1, 0.02, 0.001, -0.002],
    ]
}

fn lens_of(k: usize) -> Distortion {
    match k % 2 {
        0 => Distortion::default(),
        _ => Distortion {
            numerator: [-0.1, 0.02, 0.0, 0.0],
            tangential: [0.001, -0.002],
            ..Distortion::default()
        },
    }
}

fn write_text(views: &[Pinhole], folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    let [plain, bent] = params(&views[0]);
    let (w, h) = SIZE;
    let cameras = format!(
        "# Camera list\n7 PINHOLE {w} {h} {}\n9 OPENCV {w} {h} {}\n",
        words(&plain),
        words(&bent)
    );
    fs::write(folder.join("cameras.txt"), cameras).unwrap();
    let mut images = "# Image list\n# with two lines\n".to_owned();
    for (k, camera) in views.iter().enumerate().rev() {
        let id = 7 + 2 * (k % 2);
        writeln!(
            images,
            "{} {} {id} {}",
            k + 1,
            words(&pose(camera)),
            name(k)
        )
        .unwrap();
        // No points, no points but blanks, some points.
        images += ["\n", "  \n", "10.5 20.25 -1 3.0 4 17\n"][k % 3];
    }
    fs::write(folder.join("images.txt"), images).unwrap();
    fs::write(folder.join("points3D.txt"), "# none\n").unwrap();
}

/// The same as binary files.
pub(crate) fn write_binary(views: &[Pinhole], folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    let mut bytes = 2_u64.to_le_bytes().to_vec();
    for (id, model, params) in
        [(7_u32, 1_i32, 0), (9, 4, 1)].map(|(id, m, p)| (id, m, params(&views[0])[p].clone()))
    {
        bytes.extend(id.to_le_bytes());
        bytes.extend(model.to_le_bytes());
        bytes.extend(u64::from(SIZE.0).to_le_bytes());
        bytes.extend(u64::from(SIZE.1).to_le_bytes());
        bytes.extend(params.iter().flat_map(|v| v.to_le_bytes()));
    }
    fs::write(folder.join("cameras.bin"), bytes).unwrap();
    let mut bytes = (views.len() as u64).to_le_bytes().to_vec();
    for (k, camera) in views.iter().enumerate() {
        image_record(&mut bytes, k, pose(camera));
    }
    fs::write(folder.join("images.bin"), bytes).unwrap();
}

fn image_record(bytes: &mut Vec<u8>, k: usize, pose: [f64; 7]) {
    bytes.extend((k as u32 + 1).to_le_bytes());
    bytes.extend(pose.iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend((7 + 2 * (k as u32 % 2)).to_le_bytes());
    bytes.extend(name(k).bytes());
    bytes.push(0);
    let points = k as u64 % 3;
    bytes.extend(points.to_le_bytes());
    bytes.extend(vec![0x41; 24 * points as usize]);
}

fn write_masks(views: &[Pinhole], folder: &Path) {
    for (k, camera) in views.iter().enumerate() {
        let path = folder.join("masks").join(format!("{}.png", name(k)));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        save(&photographed(camera, lens_of(k)), &path);
    }
}

/// The views that were found, in the order in which they were made.
fn assert_as_made(found: &Capture, made: &[Pinhole]) {
    assert_eq!(
        (found.format, found.views.len()),
        (CameraFormat::Colmap, made.len())
    );
    for (k, camera) in made.iter().enumerate() {
        let wanted = name(k).replace(".jpg", "");
        let view = found.views.iter().find(|v| v.name == wanted).unwrap();
        let lens = view.lens.map_or_else(Distortion::default, |l| l.distortion);
        assert_eq!(lens, lens_of(k));
        // The image of a lens may begin elsewhere.
        let shift = view.camera.principal - camera.principal;
        assert!(shift.round() == shift && (k % 2 == 1 || shift.length() == 0.0));
        let at_photo = Pinhole {
            principal: camera.principal + shift,
            ..*camera
        };
        assert_alike(&view.camera, &at_photo);
    }
}

#[test]
fn models_of_colmap_are_read_as_written() {
    let made = cameras(16);
    let expected = carved(&capture(16), Some(0)).unwrap().mesh.mesh().volume();
    for place in ["", "sparse", "sparse/0", "colmap/sparse/0"] {
        let folder = tempfile::tempdir().unwrap();
        write_masks(&made, folder.path());
        let model = folder.path().join(place);
        write_text(&made, &model);
        let by_text = read(folder.path()).unwrap();
        assert_as_made(&by_text, &made);
        write_binary(&made, &model);
        let by_bytes = read(folder.path()).unwrap();
        // The binary files win, and a file of the model stands for it.
        assert!(
            by_bytes.path.ends_with("cameras.bin"),
            "{:?}",
            by_bytes.path
        );
        assert_as_made(&by_bytes, &made);
        let by_file = read(&model.join("images.txt")).unwrap();
        for (a, b) in by_text.views.iter().zip(&by_file.views) {
            assert_eq!((&a.name, &a.mask, a.camera), (&b.name, &b.mask, b.camera));
        }
        if place == "sparse/0" {
            let volume = carved(&by_bytes, Some(0)).unwrap().mesh.mesh().volume();
            assert!(
                (volume / expected - 1.0).abs() < 0.01,
                "{volume} {expected}"
            );
        }
    }
}

/// Poses that are on frames alone: lines without one, and binary records whose rotation is none.
#[test]
fn poses_are_taken_from_rigs_and_frames_where_images_have_none() {
    let made = cameras(6);
    let folder = tempfile::tempdir().unwrap();
    write_masks(&made, folder.path());
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.2, -0.4, 0.1);
    let shift = DVec3::new(0.3, -0.2, 0.1);
    // The second camera of the rig: camera = turn·rig + shift, so that rig = turn⁻¹·(camera − shift).
    let rig_pose = |k: usize| {
        let [w, x, y, z, a, b, c] = pose(&made[k]);
        let (q, t) = (DQuat::from_xyzw(x, y, z, w), DVec3::new(a, b, c));
        let (q, t) = match k % 2 {
            0 => (q, t),
            _ => (turn.conjugate() * q, turn.conjugate() * (t - shift)),
        };
        [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
    };
    let sensor = [turn.w, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    write_text(&made, folder.path());
    let rigs = format!("# Rigs\n3 2 CAMERA 7 CAMERA 9 1 {}\n", words(&sensor));
    fs::write(folder.path().join("rigs.txt"), rigs).unwrap();
    let (mut images, mut frames) = (String::new(), String::new());
    for k in 0..made.len() {
        let id = 7 + 2 * (k % 2);
        writeln!(images, "{} {id} {}\n", k + 1, name(k)).unwrap();
        writeln!(
            frames,
            "{k} 3 {} 1 CAMERA {id} {}",
            words(&rig_pose(k)),
            k + 1
        )
        .unwrap();
    }
    fs::write(folder.path().join("images.txt"), images).unwrap();
    fs::write(folder.path().join("frames.txt"), &frames).unwrap();
    assert_as_made(&read(folder.path()).unwrap(), &made);

    write_binary(&made, folder.path());
    let mut bytes = 6_u64.to_le_bytes().to_vec();
    for k in 0..6 {
        image_record(&mut bytes, k, [0.0; 7]);
    }
    fs::write(folder.path().join("images.bin"), bytes).unwrap();
    let mut bytes = 1_u64.to_le_bytes().to_vec();
    bytes.extend([3_u32, 2, 0, 7, 0, 9].iter().flat_map(|v| v.to_le_bytes()));
    bytes.push(1);
    bytes.extend(sensor.iter().flat_map(|v| v.to_le_bytes()));
    fs::write(folder.path().join("rigs.bin"), bytes).unwrap();
    let mut bytes = 6_u64.to_le_bytes().to_vec();
    for k in 0..6_u32 {
        bytes.extend([k, 3].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(rig_pose(k as usize).iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([1, 0, 7 + 2 * (k % 2)].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(u64::from(k + 1).to_le_bytes());
    }
    fs::write(folder.path().join("frames.bin"), bytes).unwrap();
    assert_as_made(&read(folder.path()).unwrap(), &made);

    // Without its frame an image has no pose.
    for stem in ["cameras", "images", "rigs", "frames"] {
        fs::remove_file(folder.path().join(stem).with_extension("bin")).unwrap();
    }
    let without: Vec<&str> = frames.lines().skip(1).collect();
    fs::write(folder.path().join("frames.txt"), without.join("\n")).unwrap();
    let found = read(folder.path()).unwrap();
    let expected = CaptureWarning::Unused {
        view: "left hand/photo 00".to_owned(),
        reason: "it has no pose".to_owned(),
    };
    assert_eq!((found.listed, found.views.len()), (6, 5));
    // The photographs are not there, which is said too.
    assert_eq!(found.warnings[0], expected);
}

#[test]
fn damaged_models_are_said() {
    let made = cameras(4);
    let folder = tempfile::tempdir().unwrap();
    write_masks(&made, folder.path());
    write_text(&made, folder.path());
    let told = |file: &str, from: &str, to: &str| {
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let message = read(folder.path()).map(|c| c.views.len());
        fs::write(&path, text).unwrap();
        let message = message.unwrap_err().to_string();
        assert!(message.contains(file), "{message}");
        message
    };
    let cases = [
        (
            "cameras.txt",
            "OPENCV",
            "LENS",
            "line 3: no camera model is called \"LENS\"",
        ),
        (
            "cameras.txt",
            "OPENCV",
            "FULL_OPENCV",
            "FULL_OPENCV has 12 parameters, and 8 are given",
        ),
        (
            "cameras.txt",
            "330.0",
            "NaN",
            "line 2: a parameter of the camera cannot be \"NaN\"",
        ),
        (
            "cameras.txt",
            "9 OPENCV",
            "7 OPENCV",
            "camera 7 is there twice",
        ),
        (
            "images.txt",
            " 9 right",
            " 11 right",
            "its camera 11 is not in cameras.txt",
        ),
        ("images.txt", "right/photo 02.jpg", "", "name is missing"),
        ("images.txt", "\n\n", "\n", "an empty line at least"),
    ];
    for (file, from, to, expected) in cases {
        let message = told(file, from, to);
        assert!(message.contains(expected), "{message}");
    }
    let other = "EQUIRECTANGULAR 220 180 220 180\n#";
    let message = {
        let path = folder.path().join("cameras.txt");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("OPENCV", other)).unwrap();
        let message = read(folder.path()).unwrap_err().to_string();
        fs::write(&path, text).unwrap();
        message
    };
    assert!(message.contains("model EQUIRECTANGULAR"), "{message}");
    // Without its other file it is of COLMAP still.
    let alone = tempfile::tempdir().unwrap();
    let path = alone.path().join("cameras.txt");
    fs::copy(folder.path().join("cameras.txt"), &path).unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("images.txt"), "{message}");

    write_binary(&made, folder.path());
    for file in ["cameras.bin", "images.bin"] {
        let path = folder.path().join(file);
        let whole = fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            let message = read(folder.path()).unwrap_err().to_string();
            assert!(
                message.contains(file) && message.contains("it ends"),
                "{message}"
            );
        }
        // A count that lies.
        let mut lying = whole.clone();
        lying[..8].fill(0xff);
        fs::write(&path, &lying).unwrap();
        let message = read(folder.path()).unwrap_err().to_string();
        assert!(message.contains("of 18446744073709551615"), "{message}");
        fs::write(&path, &whole).unwrap();
    }
    assert_as_made(&read(folder.path()).unwrap(), &made);
}
