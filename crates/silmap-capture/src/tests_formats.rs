//! Camera files of Metashape, PMVS and plain matrices, written from known cameras, and read.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

use crate::lens::Distortion;
use crate::tests::{SIZE, assert_alike, cameras, capture, save};
use crate::tests_lens::photographed;
use crate::{CameraFormat, Capture, CaptureWarning, Matrix34, Pinhole, read};

fn words(numbers: impl IntoIterator<Item = f64>) -> String {
    let words: Vec<String> = numbers.into_iter().map(|v| format!("{v:?}")).collect();
    words.join(" ")
}

/// P for a first pixel whose centre is at zero.
fn matrix(camera: &Pinhole) -> Matrix34 {
    Pinhole {
        principal: camera.principal - DVec2::splat(0.5),
        ..*camera
    }
    .to_matrix()
}

fn rows(matrix: &Matrix34) -> String {
    let rows: Vec<String> = matrix
        .iter()
        .map(|row| words(row.iter().copied()))
        .collect();
    rows.join("\n") + "\n"
}

fn write_masks(folder: &Path, name: impl Fn(usize) -> String) {
    fs::create_dir_all(folder.join("masks")).unwrap();
    for (k, view) in capture(4).views.iter().enumerate() {
        save(&view.mask, &folder.join("masks").join(name(k)));
    }
}

fn assert_as_made(found: &Capture, format: CameraFormat, name: impl Fn(usize) -> String) {
    assert_eq!((found.format, found.views.len()), (format, 4), "{found:?}");
    for (k, (view, made)) in found.views.iter().zip(&capture(4).views).enumerate() {
        assert_eq!((&view.name, &view.mask), (&name(k), &made.mask));
        assert_alike(&view.camera, &made.camera);
    }
}

#[test]
fn matrices_of_pmvs_are_read_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let name = |k: usize| format!("{k:08}");
    write_masks(folder.path(), |k| name(k) + ".png");
    fs::create_dir(folder.path().join("txt")).unwrap();
    for (k, camera) in cameras(4).iter().enumerate() {
        // Whatever the sign of the matrix.
        let matrix = matrix(camera).map(|row| row.map(|v| if k % 2 == 0 { v } else { -v }));
        let path = folder.path().join(format!("txt/{}.txt", name(k)));
        fs::write(path, format!("CONTOUR\n{}", rows(&matrix))).unwrap();
    }
    assert_as_made(&read(folder.path()).unwrap(), CameraFormat::Pmvs, name);
    let file = folder.path().join("txt/00000002.txt");
    assert_as_made(&read(&file).unwrap(), CameraFormat::Pmvs, name);
    for (text, expected) in [
        ("CONTOUR\n1 2 3 4\n", "after 1 of 3 rows"),
        ("CONTOUR2\n1 2 3 4 5 6\n", "CONTOUR2"),
        ("CONTOUR\n1 0 0 0\n2 0 0 0\n0 0 1 0\n", "rank 2"),
        ("CONTOUR\n1 0 0 nan\n0 1 0 0\n0 0 1 0\n", "not finite"),
    ] {
        fs::write(&file, text).unwrap();
        let message = read(folder.path()).unwrap_err().to_string();
        assert!(
            message.contains("00000002.txt") && message.contains(expected),
            "{message}"
        );
    }
}

#[test]
fn plain_matrices_are_read_as_written() {
    let name = |k: usize| format!("photo_{k}");
    // A file for each view, named as the photograph.
    let folder = tempfile::tempdir().unwrap();
    write_masks(folder.path(), |k| name(k) + ".png");
    fs::write(folder.path().join("README.txt"), "What these files are.\n").unwrap();
    for (k, camera) in cameras(4).iter().enumerate() {
        let path = folder.path().join(format!("{}.txt", name(k)));
        fs::write(path, rows(&matrix(camera))).unwrap();
    }
    assert_as_made(&read(folder.path()).unwrap(), CameraFormat::Matrices, name);

    fs::write(folder.path().join("photo_2.txt"), "1 2 3 4\n").unwrap();
    let message = read(folder.path()).unwrap_err().to_string();
    assert!(message.contains("photo_2.txt: line 1"), "{message}");

    // One file, a line for each view; the photographs' names have their extension.
    let folder = tempfile::tempdir().unwrap();
    write_masks(folder.path(), |k| name(k) + ".jpg.png");
    let mut text = "# name and matrix\n".to_owned();
    for (k, camera) in cameras(4).iter().enumerate() {
        let numbers = words(matrix(camera).into_iter().flatten());
        writeln!(text, "{}.jpg {numbers}", name(k)).unwrap();
    }
    let with_extension = |k| name(k) + ".jpg";
    // A name that a file of COLMAP's has too.
    for file in ["matrices.txt", "cameras.txt"].map(|name| folder.path().join(name)) {
        fs::write(&file, &text).unwrap();
        for path in [folder.path(), &file] {
            let found = read(path).unwrap();
            assert_as_made(&found, CameraFormat::Matrices, with_extension);
        }
        fs::remove_file(file).unwrap();
    }

    // OpenCV's, whose names are no photograph's: these are taken in order.
    let folder = tempfile::tempdir().unwrap();
    write_masks(folder.path(), |k| format!("image_{}.png", 8 + k));
    fs::create_dir(folder.path().join("photos")).unwrap();
    let mut text = "<?xml version=\"1.0\"?>\n<opencv_storage>\n".to_owned();
    for (k, camera) in cameras(4).iter().enumerate() {
        let numbers = words(matrix(camera).into_iter().flatten());
        writeln!(
            text,
            "<viff{k:03}_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>4</cols><dt>d</dt><data>\n{numbers}</data></viff{k:03}_matrix>"
        )
        .unwrap();
        image::RgbImage::new(SIZE.0, SIZE.1)
            .save(folder.path().join(format!("photos/image_{}.png", 8 + k)))
            .unwrap();
    }
    text += "</opencv_storage>\n";
    fs::write(folder.path().join("viff.xml"), &text).unwrap();
    let found = read(folder.path()).unwrap();
    assert_eq!(found.warnings, [CaptureWarning::InOrder { count: 4 }]);
    assert_as_made(&found, CameraFormat::Matrices, |k| format!("viff{k:03}"));
}

/// A chunk whose frame is turned, moved and scaled against the world.
struct Chunk {
    rotation: DMat3,
    translation: DVec3,
    scale: f64,
}

impl Chunk {
    fn xml(&self) -> String {
        format!(
            "<transform><rotation locked=\"true\">{}</rotation><translation>{}</translation><scale>{:?}</scale></transform>",
            words(self.rotation.transpose().to_cols_array()),
            words(self.translation.to_array()),
            self.scale
        )
    }

    /// A camera's transform: from its frame, x right, y down, z forward, to that of the chunk.
    fn camera(&self, camera: &Pinhole) -> String {
        let back = self.rotation.transpose();
        let eye = back * (camera.eye - self.translation) / self.scale;
        let [x, y, z] = camera.axes.map(|axis| back * axis);
        let row = |k: usize| [x[k], y[k], z[k], eye[k]];
        words(
            [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
                .into_iter()
                .flatten(),
        )
    }
}

const K: [f64; 4] = [-0.1, 0.02, -0.003, 0.001];
const P: [f64; 2] = [0.002, -0.004];

fn write_metashape(folder: &Path, is_on_component: bool) {
    let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.4, 1.2, -2.0);
    let chunk = Chunk {
        rotation: turn,
        translation: DVec3::new(-2.5e3, 4.0e3, 7.0),
        scale: 12.5,
    };
    let plain = Chunk {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        scale: 1.0,
    };
    let far = |camera: &Pinhole| camera.moved(chunk.translation);
    let views = cameras(4);
    let Pinhole {
        focal, principal, ..
    } = views[0];
    let middle = 0.5 * DVec2::new(SIZE.0.into(), SIZE.1.into());
    let offset = principal - middle;
    // f is that of the rows; b1 what the columns' is longer.
    let terms = format!(
        "<k1>{:?}</k1><k2>{:?}</k2><k3>{:?}</k3><k4>{:?}</k4><p1>{:?}</p1><p2>{:?}</p2>",
        K[0], K[1], K[2], K[3], P[0], P[1]
    );
    let resolution = format!("<resolution width=\"{}\" height=\"{}\"/>", SIZE.0, SIZE.1);
    let calibration = |class: &str, f: f64| {
        format!(
            "<calibration type=\"frame\" class=\"{class}\">{resolution}<f>{f:?}</f><cx>{:?}</cx><cy>{:?}</cy><b1>{:?}</b1><b2>1.25</b2>{terms}</calibration>",
            offset.x,
            offset.y,
            focal.x - focal.y
        )
    };
    let mut list = String::new();
    for (k, camera) in views.iter().enumerate() {
        let within = if is_on_component { &chunk } else { &plain };
        let transform = within.camera(&far(camera));
        let label = ["DSC_0", "C:\\photos\\DSC_1.JPG", "DSC_3.v3", "DSC_3.v2"][k];
        // Cameras may be in groups.
        if k == 2 {
            list += "<group id=\"0\" label=\"Group 1\">";
        }
        writeln!(list, "<camera id=\"{k}\" sensor_id=\"3\" component_id=\"0\" label=\"{label}\"><transform>{transform}</transform></camera>").unwrap();
    }
    list += "</group><camera id=\"8\" sensor_id=\"3\" label=\"lost\"/>\
        <camera id=\"9\" sensor_id=\"3\" label=\"off\" enabled=\"false\"><transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>";
    let component = if is_on_component {
        chunk.xml()
    } else {
        String::new()
    };
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\"><chunk label=\"Chunk 1\" enabled=\"true\">\
         <sensors next_id=\"4\"><sensor id=\"3\" label=\"unknown\" type=\"frame\">{resolution}{}{}</sensor></sensors>\
         <components><component id=\"0\">{component}</component></components><cameras>{list}</cameras></chunk></document>",
        calibration("initial", 99.0),
        calibration("adjusted", focal.y),
    );
    fs::write(folder.join("cameras.xml"), text).unwrap();
    fs::create_dir_all(folder.join("masks")).unwrap();
    for (k, camera) in views.iter().enumerate() {
        let bent = Pinhole {
            skew: 1.25,
            ..*camera
        };
        let name = ["DSC_0.png", "DSC_1.JPG.png", "DSC_3.v3.png", "DSC_3.v2.png"][k];
        save(
            &photographed(&bent, lens()),
            &folder.join("masks").join(name),
        );
    }
}

/// In OpenCV's order.
fn lens() -> Distortion {
    Distortion {
        numerator: K,
        tangential: [P[1], P[0]],
        ..Distortion::default()
    }
}

#[test]
fn cameras_of_metashape_are_read_as_written() {
    for is_on_component in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        write_metashape(folder.path(), is_on_component);
        let found = read(folder.path()).unwrap();
        assert_eq!(
            (found.format, found.views.len()),
            (CameraFormat::Metashape, 4)
        );
        let names: Vec<&str> = found.views.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["DSC_0", "DSC_1", "DSC_3.v3", "DSC_3.v2"]);
        for (view, camera) in found.views.iter().zip(cameras(4)) {
            assert_eq!(view.lens.unwrap().distortion, lens());
            let shift = view.camera.principal - camera.principal;
            let expected = Pinhole {
                skew: 1.25,
                principal: camera.principal + shift.round(),
                ..camera
            };
            let found = view.camera.moved(-DVec3::new(-2.5e3, 4.0e3, 7.0));
            assert_alike(&found, &expected);
        }
        let told = found.warnings.iter().take(2).map(ToString::to_string);
        let told: Vec<String> = told.collect();
        assert_eq!(
            told,
            [
                "view lost is not used: it is not aligned",
                "view off is not used: it is turned off in Metashape"
            ]
        );
    }
}

#[test]
fn damaged_xml_is_said() {
    let folder = tempfile::tempdir().unwrap();
    write_metashape(folder.path(), true);
    let path = folder.path().join("cameras.xml");
    let text = fs::read_to_string(&path).unwrap();
    let told = |from: &str, to: &str| {
        assert!(text.contains(from));
        fs::write(&path, text.replace(from, to)).unwrap();
        let message = read(folder.path()).unwrap_err().to_string();
        assert!(
            message.contains("cameras.xml") && !message.contains('\n'),
            "{message}"
        );
        message
    };
    for (from, to, expected) in [
        ("</document>", "", "damaged"),
        ("document", "other", "its root is \"other\""),
        (
            "type=\"frame\"",
            "type=\"spherical\"",
            "the model \"spherical\"",
        ),
        ("<f>", "<f>no", "view DSC_0: <f> must hold one number"),
        ("<k1>", "<k1>NaN", "<k1> must hold one number"),
        ("<p1>", "<p3>1</p3><p1>", "of Metashape with p3"),
        (" 0.0 0.0 0.0 1.0<", "<", "<transform> must hold 16 numbers"),
        ("<scale>12.5", "<scale>-1", "must be positive"),
        ("width=\"220\"", "", "no resolution"),
        ("<camera ", "<other ", "damaged"),
        (
            "sensor_id=\"3\"",
            "sensor_id=\"4\"",
            "none of its views can be used: view DSC_0: its sensor has no calibration",
        ),
    ] {
        let message = told(from, to);
        assert!(message.contains(expected), "{message}");
    }
    // Entities that would grow without end are no part of such a file.
    let bomb = "<!DOCTYPE document [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;\">]>";
    assert!(told("<document", &format!("{bomb}<document")).contains("damaged"));
}
