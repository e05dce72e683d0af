//! Meshes with all that they look like: what is written is read back.

use std::fs;

use silmap_geometry::{Appearance, Material};

use super::*;
use crate::{LoadOptions, encode, load};

/// A tetrahedron with a texture on three faces, a plain material on the fourth, and a seam.
fn painted(has_colours: bool) -> TriangleMesh {
    let texture = ColourImage {
        width: 2,
        height: 2,
        rgba: (0..16)
            .map(|k| if k % 4 == 3 { 255 } else { k * 15 })
            .collect(),
    };
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let colour = |v: u32| [v as f32 / 3.0, 1.0, 0.0];
    TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        appearance: Appearance {
            corner_uvs: vec![
                [[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]],
                [[0.25, 0.0], [0.5, 1.0], [0.75, 0.5]],
                [[0.5, 1.0], [1.0, 0.25], [0.75, 0.5]],
                [[1.0, 0.25], [0.0, 0.0], [0.75, 0.5]],
            ],
            corner_colours: if has_colours {
                faces.iter().map(|f: &[u32; 3]| f.map(colour)).collect()
            } else {
                Vec::new()
            },
            face_materials: vec![0, 0, 1, 0],
            materials: vec![
                Material {
                    base_colour: [1.0; 3],
                    texture: Some(texture),
                    ..Material::default()
                },
                Material {
                    base_colour: [0.5, 0.25, 0.125],
                    ..Material::default()
                },
            ],
        },
        faces,
    }
}

/// What a face looks like in a few places, by where they are.
fn looks(mesh: &TriangleMesh) -> Vec<([i32; 3], [u8; 3])> {
    let mut looks: Vec<_> = (0..mesh.faces.len())
        .flat_map(|f| {
            [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]].map(|w: [f32; 3]| {
                let corners = mesh.corners(f);
                let at: DVec3 = (0..3).map(|k| corners[k] * f64::from(w[k])).sum();
                let colour = mesh
                    .appearance
                    .albedo(f, w)
                    .map(|c| (c * 200.0).round() as u8);
                ((at * 1e4).round().to_array().map(|x| x as i32), colour)
            })
        })
        .collect();
    looks.sort_unstable();
    looks
}

#[test]
fn what_a_mesh_looks_like_comes_back_from_glb_and_obj() {
    for (extension, has_colours) in [("glb", false), ("glb", true), ("obj", false)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("mesh.{extension}"));
        let mesh = painted(has_colours);
        let files = encode_painted(&path, &mesh, DVec3::ZERO).unwrap();
        assert!(files.left_out.is_empty());
        fs::write(&path, &files.bytes).unwrap();
        for (beside, bytes) in &files.beside {
            fs::write(beside, bytes).unwrap();
        }
        let back = load(&path, &LoadOptions::default()).unwrap();
        assert!(back.warnings.is_empty(), "{:?}", back.warnings);
        assert_eq!(looks(back.mesh.mesh()), looks(&mesh), "{extension}");
        // What was written here may be replaced.
        assert_eq!(encode_painted(&path, &mesh, DVec3::ZERO).unwrap(), files);
    }
}

#[test]
fn ply_has_one_texture_and_says_what_it_has_no_place_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let mut mesh = painted(true);
    assert_eq!(
        encode_painted(&path, &mesh, DVec3::ZERO).unwrap().left_out,
        ["materials"]
    );
    mesh.appearance.materials.truncate(1);
    mesh.appearance.face_materials = vec![0; 4];
    let files = encode_painted(&path, &mesh, DVec3::ZERO).unwrap();
    assert!(files.left_out.is_empty());
    fs::write(&path, &files.bytes).unwrap();
    let [(beside, bytes)] = &files.beside[..] else {
        panic!("{} files", files.beside.len());
    };
    fs::write(beside, bytes).unwrap();
    let back = load(&path, &LoadOptions::default()).unwrap();
    assert!(back.warnings.is_empty(), "{:?}", back.warnings);
    let paint = &back.mesh.mesh().appearance;
    assert_eq!(paint.corner_uvs, mesh.appearance.corner_uvs);
    assert_eq!(paint.materials, mesh.appearance.materials);
}

#[test]
fn other_formats_name_what_is_left_out() {
    let mesh = painted(true);
    let left_out = |name: &str| {
        encode_painted(Path::new(name), &mesh, DVec3::ZERO)
            .unwrap()
            .left_out
    };
    assert_eq!(left_out("a.off"), ["texture coordinates", "materials"]);
    assert_eq!(
        left_out("a.STL"),
        ["vertex colours", "texture coordinates", "materials"]
    );
    let plain = TriangleMesh {
        appearance: Appearance::default(),
        ..mesh.clone()
    };
    for name in ["a.stl", "a.glb", "a.obj"] {
        let files = encode_painted(Path::new(name), &plain, DVec3::ZERO).unwrap();
        assert_eq!(files.bytes, encode(Path::new(name), &plain).unwrap());
        assert!(files.left_out.is_empty() && files.beside.is_empty());
    }
}

#[test]
fn a_library_of_another_program_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("mesh.mtl"), "newmtl skin\n").unwrap();
    let path = folder.path().join("mesh.obj");
    let error = encode_painted(&path, &painted(false), DVec3::ZERO).unwrap_err();
    assert!(error.to_string().contains("mesh.mtl"), "{error}");
}
