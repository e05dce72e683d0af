//! Files that are not what their name says.

use super::*;

#[test]
fn meshes_under_a_wrong_name_are_read_as_what_they_are() {
    for (written, bytes) in PYRAMID_FILES.iter() {
        for called in ["obj", "ply", "stl", "off"] {
            let raw = read(bytes, called).unwrap();
            assert_eq!(raw.mesh.faces.len(), 6, "{written} called {called}");
            let warnings: Vec<String> = raw.warnings.iter().map(ToString::to_string).collect();
            let is_told = warnings.iter().any(|w| w.contains("its content is"));
            assert_eq!(
                is_told,
                *written != called,
                "{written} called {called}: {warnings:?}"
            );
        }
    }
}

#[test]
fn other_files_are_named_with_a_way_out() {
    let said = |bytes: &[u8]| {
        let all = EXTENSIONS.map(|extension| read(bytes, extension).unwrap_err().to_string());
        assert!(all.iter().all(|s| *s == all[0]), "{all:?}");
        all[0].clone()
    };
    assert_eq!(
        said(b"\xFF\xD8\xFF\xE0\0\x10JFIF\0"),
        "this is a JPEG picture: a mesh is needed"
    );
    assert_eq!(
        said(b"\x1f\x8b\x08\0"),
        "this is a gzip archive: unpack it first"
    );
    for (bytes, what) in [
        (&b"\x89PNG\r\n\x1a\n\0\0"[..], "a PNG picture"),
        (b"RIFF\x10\0\0\0WEBPVP8 ", "a WebP picture"),
        (b"PK\x03\x04\x14\0\0\0\0\0[Content_Types].xml", "a 3MF file"),
        (b"PK\x03\x04\x14\0\0\0\0\0model.usdc", "a USDZ file"),
        (b"PK\x03\x04\x14\0\0\0\0\0bunny.obj", "a zip archive"),
        (b"\n<!DOCTYPE html><html>", "HTML"),
        (
            b"\xEF\xBB\xBF<?xml version='1.0'?>\n<COLLADA xmlns",
            "a COLLADA file",
        ),
        (b"Kaydara FBX Binary  \0", "an FBX file"),
        (b"; FBX 7.3.0 project file", "an FBX file"),
        (b"ISO-10303-21;\nHEADER;", "a STEP file"),
        (b"PXR-USDC\0", "a USD file"),
        (b"#usda 1.0\n", "a USD file"),
        (b"BLENDER-v300", "a Blender file"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid",
            "a pointer of Git LFS",
        ),
    ] {
        assert!(said(bytes).contains(what), "{what}: {}", said(bytes));
    }
    // A binary STL file may begin with anything.
    let mut stl = PYRAMID_FILES
        .iter()
        .find(|(e, _)| *e == "stl")
        .unwrap()
        .1
        .clone();
    stl[..5].copy_from_slice(b"<html");
    assert_eq!(read(&stl, "stl").unwrap().mesh.faces.len(), 6);
}

#[test]
fn sizes_beyond_single_precision_are_refused_for_that_reason() {
    let close_at = |scale: f64| {
        let mut text = "OFF\n5 5 0\n".to_owned();
        for p in pyramid().positions {
            writeln!(
                text,
                "{:e} {:e} {:e}",
                p.x * scale,
                p.y * scale,
                p.z * scale
            )
            .unwrap();
        }
        text += "4 0 3 2 1\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
        close(
            read(text.as_bytes(), "off").unwrap(),
            &LoadOptions::default(),
        )
    };
    for scale in [1e-29, 1.0, 0.9e30 / 1.1] {
        assert!(close_at(scale).is_ok(), "{scale}");
    }
    for (scale, size) in [
        (1e-150, "1.1e-150"),
        (1e150, "1.1e150"),
        (1e-300, "1.1e-300"),
        (1.6e308, "1.8e308"),
    ] {
        let said = close_at(scale).unwrap_err().to_string();
        assert!(
            said.contains(size) && said.contains("single precision"),
            "{said}"
        );
    }
}
