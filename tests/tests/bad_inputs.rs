//! Real and nasty mesh files: what is read, what is refused, and in which words.
//!
//! The files lie outside the repository, in `../shared/bad-inputs` and `../shared/models`; where that folder is missing,
//! these tests say so and check nothing. The tables below follow the README files there.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;
use std::time::Instant;

use silmap_mesh_io::{AlphaUse, LoadOptions, Loaded, MeshIoError, load, read_triangles};
use silmap_tests::outside::shared;

const PLAIN: LoadOptions = LoadOptions {
    close_holes: false,
    repair: false,
    alpha: AlphaUse::Opaque,
    weld: None,
};
const CLOSE: LoadOptions = LoadOptions {
    close_holes: true,
    repair: false,
    alpha: AlphaUse::Opaque,
    weld: None,
};
const REPAIR: LoadOptions = LoadOptions {
    close_holes: false,
    repair: true,
    alpha: AlphaUse::Opaque,
    weld: None,
};
const BOTH: LoadOptions = LoadOptions {
    close_holes: true,
    repair: true,
    alpha: AlphaUse::Opaque,
    weld: None,
};

fn counts(loaded: &Result<Loaded, MeshIoError>) -> Option<(usize, usize)> {
    let mesh = loaded.as_ref().ok()?.mesh.mesh();
    Some((mesh.positions.len(), mesh.faces.len()))
}

/// Checks that the names in a table are the files in a folder, all of them.
fn assert_all_listed(folder: &Path, listed: &[&str], others: &[&str]) {
    let mut found: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !others.contains(&name.as_str()))
        .collect();
    found.sort();
    let mut listed: Vec<&str> = listed.to_vec();
    listed.sort_unstable();
    assert_eq!(found, listed, "{}", folder.display());
}

/// One sentence that names the file and says all of `parts`.
fn assert_says(path: &Path, options: &LoadOptions, parts: &[&str]) {
    let said = match load(path, options) {
        Ok(_) => panic!("{} was read", path.display()),
        Err(error) => error.to_string(),
    };
    let name = path.file_name().unwrap().to_str().unwrap();
    assert!(said.contains(name), "{said}");
    assert!(!said.contains('\n'), "{said}");
    for part in parts {
        assert!(said.contains(part), "{name}: `{part}` is not in `{said}`");
    }
}

const REFUSED: [(&str, &str); 22] = [
    ("empty.obj", "empty"),
    ("empty.ply", "empty"),
    ("points-only.obj", "no faces"),
    ("header-only.ply", "no vertex element"),
    ("zero-elements.ply", "no vertices"),
    ("empty-solid.stl", "no faces"),
    ("zero-triangles.stl", "no faces"),
    (
        "index-out-of-range.obj",
        "line 23: vertex 12, but there are only 8",
    ),
    ("index-zero.obj", "line 16: vertex index 0"),
    ("too-few-corners.obj", "line 15: a face with 1 corner"),
    ("nan-and-infinity.obj", "line 1: vertex 1 is not finite"),
    (
        "huge-vertex-count.off",
        "says 353535235358 vertices, but has 14 data lines",
    ),
    ("too-short.off", "line 6: face 1 is not of the form"),
    ("header-with-junk.ply", "no `end_header`"),
    (
        "repeated-vertex-element.ply",
        "element `vertex` appears twice",
    ),
    ("utf16.obj", "not UTF-8 text"),
    ("truncated-ascii.ply", "face 5 of 6 is missing"),
    ("truncated-binary.ply", "ends inside face 9 of 12"),
    ("truncated.stl", "says 12 triangles, but has 7"),
    (
        "huge-triangle-count.stl",
        "says 4294967295 triangles, but has 12",
    ),
    ("negative-index.ply", "face 3: vertex -1"),
    ("nan-in-closed-mesh.off", "vertex 250 is not finite"),
];

#[test]
fn files_without_a_mesh_are_refused_in_one_sentence() {
    let Some(folder) = shared("bad-inputs/reject") else {
        return;
    };
    assert_all_listed(&folder, &REFUSED.map(|(name, _)| name), &[]);
    for (name, part) in REFUSED {
        for options in [PLAIN, BOTH] {
            assert_says(&folder.join(name), &options, &[part]);
        }
    }
}

const GLTF_REFUSED: [(&str, &str); 9] = [
    (
        "index-out-of-range.gltf",
        "mesh 0, primitive 0: index 255 out of range",
    ),
    ("missing-buffer.gltf", "`BoxTextured0.bin` not found"),
    ("truncated-chunk.glb", "truncated"),
    ("bad-magic.glb", "not a binary glTF"),
    ("length-mismatch.glb", "length in the header is wrong"),
    ("bad-json.glb", "JSON chunk cannot be read"),
    // Its positions have no buffer view either, which the standard allows.
    (
        "index-out-of-bounds.gltf",
        "mesh 0, primitive 0: index 5 out of range, past the last vertex of 4",
    ),
    ("node-loop.gltf", "node loop"),
    ("no-mesh.glb", "no mesh"),
];

#[test]
fn broken_gltf_is_refused_in_one_sentence() {
    let Some(folder) = shared("bad-inputs/gltf") else {
        return;
    };
    let buffers = ["IndexOutOfRange.bin", "index_buffer_oob.bin"];
    assert_all_listed(&folder, &GLTF_REFUSED.map(|(name, _)| name), &buffers);
    for (name, part) in GLTF_REFUSED {
        assert_says(&folder.join(name), &PLAIN, &[part]);
    }
}

/// What is said without options, and vertices and faces with the option that makes it usable.
type NotClosed = (
    &'static str,
    &'static [&'static str],
    Option<(LoadOptions, usize, usize)>,
);

const NOT_CLOSED: [NotClosed; 13] = [
    (
        "edge-with-four-faces.obj",
        &["edge (1, 2) has 4 faces", "8 boundary edges"],
        Some((BOTH, 12, 16)),
    ),
    (
        "repeated-corner.obj",
        &["face 4 uses vertex 1 twice", "--repair"],
        Some((BOTH, 5, 6)),
    ),
    ("zero-area-triangle.obj", &["no area"], None),
    (
        "inconsistent-orientation.stl",
        &["inconsistent orientation", "--repair"],
        Some((REPAIR, 8, 12)),
    ),
    (
        "missing-face.stl",
        &["3 boundary edges", "--close-holes"],
        Some((CLOSE, 8, 12)),
    ),
    ("crack.stl", &["4 boundary edges"], Some((CLOSE, 9, 14))),
    (
        "joined-tetrahedra.obj",
        &["has 4 faces", "same vertices", "--repair"],
        Some((REPAIR, 5, 6)),
    ),
    ("triangle-soup.stl", &["300 boundary edges"], None),
    (
        "two-bodies-one-flipped.stl",
        &["inconsistent orientation"],
        Some((REPAIR, 20, 32)),
    ),
    (
        "pinched-vertices.off",
        &["13 boundary edges", "non-manifold vertex"],
        Some((BOTH, 73, 142)),
    ),
    ("folded-faces.off", &["open: 3 boundary edges"], None),
    (
        "cad-soup.obj",
        &["non-manifold edge", "50 boundary edges"],
        Some((BOTH, 1332, 2772)),
    ),
    (
        "bunny-res2-broken.ply",
        &[
            "non-manifold edge",
            "149 more",
            "123 boundary edges",
            "same vertices",
        ],
        Some((BOTH, 8129, 16_254)),
    ),
];

#[test]
fn open_and_tangled_meshes_are_told_of_and_mended_on_request() {
    let Some(folder) = shared("bad-inputs/not-closed") else {
        return;
    };
    assert_all_listed(&folder, &NOT_CLOSED.map(|(name, ..)| name), &["inward.off"]);
    for (name, parts, mended) in NOT_CLOSED {
        let path = folder.join(name);
        assert_says(&path, &PLAIN, parts);
        match mended {
            Some((options, vertices, faces)) => {
                let loaded = load(&path, &options);
                assert_eq!(
                    counts(&loaded),
                    Some((vertices, faces)),
                    "{name}: {loaded:?}"
                );
                assert!(!loaded.unwrap().warnings.is_empty(), "{name}");
            }
            None => assert_says(&path, &BOTH, &[]),
        }
    }
}

#[test]
fn an_inward_mesh_is_turned_outward_and_said_so() {
    let Some(folder) = shared("bad-inputs/not-closed") else {
        return;
    };
    let loaded = load(&folder.join("inward.off"), &PLAIN).unwrap();
    assert!(loaded.mesh.mesh().volume() > 0.0);
    let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        warnings,
        ["1000 faces of parts that faced inward: turned outward"]
    );
}

/// Vertices and triangles after welding, and whether that is closed.
const TRICKY: [(&str, usize, usize, bool); 18] = [
    ("negative-indices.obj", 8, 12, true),
    ("no-final-newline.obj", 8, 12, true),
    ("mixed-corners.obj", 8, 12, true),
    ("nan-colours-crlf.obj", 8, 12, true),
    ("upper-case.OBJ", 8, 12, true),
    ("far-from-origin.obj", 16, 28, true),
    ("vertex-w.obj", 8, 12, true),
    ("concave-hexagon.off", 6, 4, false),
    ("star-32-gon.obj", 32, 30, false),
    ("comments-and-face-colours.off", 8, 12, true),
    ("keyword-and-counts-on-one-line.off", 8, 12, true),
    ("crlf-header.ply", 8, 12, true),
    ("data-starts-with-newline.ply", 8, 12, true),
    ("extra-properties.ply", 8, 12, true),
    ("type-aliases.ply", 8, 12, true),
    ("two-solids.stl", 16, 24, true),
    ("exponents.obj", 3, 1, false),
    ("binary-with-solid-header.stl", 8, 12, true),
];

#[test]
fn valid_files_are_read_however_odd() {
    let Some(folder) = shared("bad-inputs/valid-but-tricky") else {
        return;
    };
    let scattered = "cr-only-header.ply";
    assert_all_listed(&folder, &TRICKY.map(|(name, ..)| name), &[scattered]);
    // 24 vertices as stored, at nine places, of which two differ by rounding.
    let mesh = read_triangles(&folder.join(scattered)).unwrap().mesh;
    assert_eq!((mesh.positions.len(), mesh.faces.len()), (9, 12));
    assert_eq!(
        counts(&load(&folder.join(scattered), &PLAIN)),
        Some((8, 12))
    );
    for (name, vertices, faces, is_closed) in TRICKY {
        let path = folder.join(name);
        let mesh = read_triangles(&path).unwrap().mesh;
        assert_eq!(
            (mesh.positions.len(), mesh.faces.len()),
            (vertices, faces),
            "{name}"
        );
        if is_closed {
            assert_eq!(
                counts(&load(&path, &PLAIN)),
                Some((vertices, faces)),
                "{name}"
            );
        } else {
            assert_says(&path, &PLAIN, &["open: "]);
        }
    }
    let hexagon = read_triangles(&folder.join("concave-hexagon.off"))
        .unwrap()
        .mesh;
    let area = |f: usize| 0.5 * hexagon.face_cross(f).z;
    assert!((0..4).all(|f| area(f) > 0.0));
    assert!(((0..4).map(area).sum::<f64>() - 3.0).abs() < 1e-12);
}

/// A model, the options it needs, and vertices and faces with them.
const MODELS: [(&str, LoadOptions, usize, usize); 24] = [
    ("stanford-bunny.ply", CLOSE, 34_834, 69_664),
    ("stanford-bunny-closed.off", PLAIN, 34_835, 69_666),
    ("stanford-dragon-100k.obj", PLAIN, 50_000, 100_000),
    ("stanford-dragon-res2.ply", REPAIR, 99_893, 199_718),
    ("armadillo.obj", PLAIN, 43_243, 86_482),
    ("turbine-blade.ply", PLAIN, 99_519, 199_034),
    ("spot/spot_triangulated.obj", PLAIN, 2_930, 5_856),
    ("spot/spot_quadrangulated.obj", PLAIN, 2_930, 5_856),
    ("spot/spot_control_mesh.obj", PLAIN, 188, 372),
    ("feline/feline.obj", PLAIN, 20_531, 41_066),
    ("fuze/fuze.obj", PLAIN, 502, 1_000),
    ("cow.obj", REPAIR, 2_904, 5_804),
    // A closed bust and two stray triangles.
    ("beethoven.ply", REPAIR, 2_515, 5_026),
    ("teapot.obj", CLOSE, 3_242, 6_468),
    ("suzanne.obj", BOTH, 507, 1_002),
    ("cheburashka.off", PLAIN, 6_669, 13_334),
    ("fertility.off", PLAIN, 4_494, 9_000),
    ("elephant.off", PLAIN, 20_007, 40_022),
    ("three-hole-torus.off", PLAIN, 3_596, 7_200),
    ("knot-quads.obj", PLAIN, 1_440, 2_880),
    ("torus.stl", PLAIN, 4_350, 8_700),
    ("decimated-knight.off", PLAIN, 502, 1_000),
    ("lion.off", CLOSE, 8_356, 16_708),
    ("duck.glb", PLAIN, 2_108, 4_212),
];

#[test]
fn models_load_closed_with_the_options_they_need() {
    let Some(folder) = shared("models") else {
        return;
    };
    for (name, options, vertices, faces) in MODELS {
        let path = folder.join(name);
        let start = Instant::now();
        let loaded = load(&path, &options);
        println!("{name}: {:.3} s", start.elapsed().as_secs_f64());
        assert_eq!(
            counts(&loaded),
            Some((vertices, faces)),
            "{name}: {:?}",
            loaded.err()
        );
        if options != PLAIN {
            let helps = if options.repair {
                "--repair"
            } else {
                "--close-holes"
            };
            let refused = load(&path, &PLAIN).unwrap_err().to_string();
            let is_hinted = refused.contains(helps) || name == "beethoven.ply";
            assert!(is_hinted, "{refused}");
        }
    }
    for options in [PLAIN, BOTH] {
        assert_says(&folder.join("alligator.obj"), &options, &["no volume"]);
    }
}

#[test]
fn models_bring_their_colours() {
    let Some(folder) = shared("models") else {
        return;
    };
    for (name, width) in [
        ("feline/feline.obj", 0),
        ("fuze/fuze.obj", 0),
        ("duck.glb", 512),
    ] {
        let loaded = load(&folder.join(name), &PLAIN).unwrap();
        let look = &loaded.mesh.mesh().appearance;
        let texture = look.materials[0].texture.as_ref().unwrap();
        assert!(
            texture.width == width || width == 0 && texture.width > 0,
            "{name}"
        );
        assert_eq!(look.corner_uvs.len(), loaded.mesh.mesh().faces.len());
        assert_eq!(loaded.warnings, [], "{name}");
    }
}
