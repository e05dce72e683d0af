//! Readers and writers against each other, on small files made here, and on nonsense.

mod content;
mod obj;
mod off;
mod ply;
mod seams;
mod stl;

use std::fmt::Write as _;
use std::sync::LazyLock;

use glam::DVec3;
use proptest::prelude::*;
use silmap_geometry::Material;
use silmap_geometry::lighting::linear_from_srgb;

use super::*;

const EXTENSIONS: [&str; 7] = ["obj", "ply", "stl", "off", "gltf", "glb", "unknown"];

/// A square pyramid whose coordinates have no exact single-precision form, save the first.
fn pyramid() -> TriangleMesh {
    TriangleMesh {
        positions: [
            [0.0, 0.0, 0.0],
            [1.1, 0.0, 0.0],
            [1.1, 1.1, 0.0],
            [0.0, 1.1, 0.0],
            [0.55, 0.55, 0.7],
        ]
        .map(DVec3::from)
        .to_vec(),
        faces: vec![
            [0, 2, 1],
            [0, 3, 2],
            [0, 1, 4],
            [1, 2, 4],
            [2, 3, 4],
            [3, 0, 4],
        ],
        ..TriangleMesh::default()
    }
}

fn read(text: &[u8], extension: &str) -> Result<RawMesh, MeshFault> {
    read_bytes(text, extension, Path::new("no such folder"))
}

/// The pyramid in every format, as bytes.
static PYRAMID_FILES: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    ["obj", "ply", "stl", "off", "glb"]
        .into_iter()
        .map(|extension| {
            let path = folder.path().join(format!("pyramid.{extension}"));
            write(&path, &pyramid()).unwrap();
            (extension, std::fs::read(path).unwrap())
        })
        .collect()
});

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["obj", "ply", "off", "OFF", "stl", "glb"] {
        let path = folder.path().join(format!("pyramid.{extension}"));
        write(&path, &pyramid()).unwrap();
        let loaded = load(&path, &LoadOptions::default()).unwrap();
        assert_eq!(loaded.name, "pyramid");
        assert_eq!(loaded.warnings, [], "{extension}");
        let mesh = loaded.mesh.mesh();
        if ["stl", "glb"].contains(&extension) {
            assert_eq!((mesh.positions.len(), mesh.faces.len()), (5, 6));
            assert!(
                (mesh.volume() - pyramid().volume()).abs() < 1e-7,
                "{extension}"
            );
        } else {
            assert_eq!(mesh, &pyramid(), "{extension}");
        }
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 6, "no part files are left");
}

#[test]
fn vertex_colours_are_written_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    // Bytes of sRGB, which every format can hold.
    let srgb = |v: u32| [v * 50, 255 - v * 30, 7].map(|c| c as f32 / 255.0);
    let mut painted = pyramid();
    painted.appearance.corner_colours = painted
        .faces
        .iter()
        .map(|f| f.map(|v| srgb(v).map(linear_from_srgb)))
        .collect();
    for extension in ["obj", "ply", "off", "glb"] {
        let path = folder.path().join(format!("painted.{extension}"));
        write(&path, &painted).unwrap();
        let loaded = load(&path, &LoadOptions::default()).unwrap();
        let read = &loaded.mesh.mesh().appearance;
        assert_eq!(read.corner_colours.len(), 6, "{extension}");
        let off = read.corner_colours.as_flattened().as_flattened().iter();
        let wanted = painted
            .appearance
            .corner_colours
            .as_flattened()
            .as_flattened();
        let off = off
            .zip(wanted)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(off < 2e-5, "{extension}: {off}");
    }
}

#[test]
fn corners_of_different_colours_are_written_as_their_mean() {
    let mut painted = pyramid();
    painted.appearance.corner_colours = vec![[[0.25; 3]; 3]; 6];
    painted.appearance.corner_colours[5][2] = [1.0; 3];
    let colours = write::vertex_colours(&painted).unwrap();
    assert_eq!(colours[3], [0.25; 3]);
    assert_eq!(colours[4], [0.4375; 3]);
    assert_eq!(write::vertex_colours(&pyramid()), None);
}

#[test]
fn faces_on_a_line_are_named_and_removed_on_request() {
    // A tetrahedron with a vertex on an edge, and a face that joins it to that edge.
    let text = "OFF\n5 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.5 0.5 0\n\
                3 0 2 1\n3 0 1 3\n3 1 4 3\n3 4 2 3\n3 0 3 2\n3 1 2 4\n";
    let close_with = |text: &str, repair, close_holes| {
        let options = LoadOptions {
            close_holes,
            repair,
            ..LoadOptions::default()
        };
        close(read(text.as_bytes(), "off").unwrap(), &options)
    };
    let fault = close_with(text, false, false).unwrap_err().to_string();
    assert_eq!(
        fault,
        "face 6 has no area: its corners lie on one line (--repair may help)"
    );
    let (mesh, warnings) = close_with(text, true, false).unwrap();
    assert_eq!(mesh.mesh().faces.len(), 6);
    assert!((mesh.mesh().volume() - 1.0 / 6.0).abs() < 1e-15);
    assert_eq!(
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["1 face without area: removed by turning an edge"]
    );
    // Without that face there is a slit, which closing fills with one like it.
    let slit = text.replace("5 6 0", "5 5 0").replace("3 1 2 4\n", "");
    let (mesh, _) = close_with(&slit, false, true).unwrap();
    assert!((mesh.mesh().volume() - 1.0 / 6.0).abs() < 1e-15);
}

#[test]
fn unwritable_files_leave_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let fault = |name: &str| {
        write(&folder.path().join(name), &pyramid())
            .unwrap_err()
            .fault
    };
    assert!(matches!(
        fault("missing/pyramid.obj"),
        MeshFault::Unwritable { .. }
    ));
    assert!(matches!(
        fault("pyramid.xyz"),
        MeshFault::UnknownOutput { .. }
    ));
    std::fs::create_dir(folder.path().join("taken.obj")).unwrap();
    assert!(matches!(fault("taken.obj"), MeshFault::Unwritable { .. }));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn formats_are_told_by_content_where_the_name_does_not() {
    for (_, bytes) in PYRAMID_FILES.iter().filter(|(e, _)| *e != "stl") {
        assert_eq!(read(bytes, "dat").unwrap().mesh.faces.len(), 6);
    }
    assert!(matches!(
        read(b"what is this", "dat"),
        Err(MeshFault::UnknownFormat { .. })
    ));
}

#[test]
fn claimed_sizes_are_not_allocated() {
    let vertex =
        "element vertex 99999999999999\nproperty double x\nproperty double y\nproperty double z\n";
    let list = "element face 9999999999\nproperty list uint int vertex_indices\nend_header\n";
    for format in ["ascii", "binary_little_endian"] {
        let text = format!("ply\nformat {format} 1.0\n{vertex}{list}1 2 3\n\u{7f}\u{7f}");
        assert!(read(text.as_bytes(), "ply").is_err());
        let many = format!(
            "ply\nformat {format} 1.0\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\n{list}"
        );
        let mut bytes = many.into_bytes();
        bytes.extend(b"1 2 3\n4000000000 1 2\n");
        bytes.extend([0xFF; 40]);
        assert!(read(&bytes, "ply").is_err());
    }
    assert!(
        read(
            b"OFF\n3 99999999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
            "off"
        )
        .is_err()
    );
    assert!(
        read(
            b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
            "off"
        )
        .is_err()
    );
}

/// A glTF document with one triangle strip that is a tetrahedron, on a child node with the given transform.
fn gltf_text(transform: &str, more: &str) -> String {
    use base64::Engine as _;
    let mut data = Vec::new();
    for x in [
        0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0,
    ] {
        data.extend(x.to_le_bytes());
    }
    data.extend([0, 2, 1, 3, 0, 2]);
    let data = base64::engine::general_purpose::STANDARD.encode(data);
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [1]}}],
        "nodes": [{{"mesh": 0, {transform}}}, {{"children": [0], "translation": [5, 0, 0]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "mode": 5, "material": 0}}]}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.25, 1, 1]}}}}],
        "buffers": [{{"byteLength": 54, "uri": "data:application/octet-stream;base64,{data}"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 6}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0,0,0], "max": [1,1,1]}},
                      {{"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}}]{more}}}"#
    )
}

#[test]
fn gltf_nodes_move_turn_and_mirror() {
    for (transform, volume) in [
        (r#""scale": [1, 2, 3]"#, 1.0),
        (r#""scale": [1, 1, -1]"#, 1.0 / 6.0),
        (
            r#""matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 0,0,7,1]"#,
            1.0 / 6.0,
        ),
    ] {
        let raw = read(gltf_text(transform, "").as_bytes(), "gltf").unwrap();
        assert_eq!(raw.mesh.faces.len(), 4);
        assert!((raw.mesh.volume() - volume).abs() < 1e-12, "{transform}");
        assert!(raw.mesh.positions.iter().all(|p| p.x >= 4.0));
        let look = &raw.mesh.appearance;
        assert_eq!(
            look.materials,
            [Material {
                base_colour: [0.5, 0.25, 1.0],
                ..Material::default()
            }]
        );
        assert_eq!(look.face_materials, [0; 4]);
    }
}

#[test]
fn gltf_faults_are_named() {
    let fault = |text: &str| match read(text.as_bytes(), "gltf") {
        Err(MeshFault::Gltf(fault)) => fault,
        other => panic!("{other:?}"),
    };
    let good = gltf_text(r#""scale": [1, 1, 1]"#, "");
    assert!(read(good.as_bytes(), "gltf").is_ok());
    let long = good.replace(r#""count": 4"#, r#""count": 5"#);
    assert_eq!(fault(&long), GltfFault::AccessorRange { accessor: 0 });
    let far = good.replace(
        r#""byteOffset": 48, "byteLength": 6"#,
        r#""byteOffset": 47, "byteLength": 6"#,
    );
    assert!(matches!(fault(&far), GltfFault::IndexOutOfRange { .. }));
    let short = good.replace(r#""byteLength": 54"#, r#""byteLength": 55"#);
    assert_eq!(
        fault(&short),
        GltfFault::ShortBuffer {
            buffer: 0,
            claimed: 55,
            found: 54
        }
    );
    let library = good.replace(r#""scene": 0, "scenes": [{"nodes": [1]}],"#, "").replace(
        r#""nodes": [{"mesh": 0, "scale": [1, 1, 1]}, {"children": [0], "translation": [5, 0, 0]}],"#,
        "",
    );
    assert_eq!(
        read(library.as_bytes(), "gltf").unwrap().mesh.faces.len(),
        4
    );
    // Positions without data, and indices past their number or not.
    let blank = library.replace(
        r#"{"bufferView": 0, "componentType""#,
        r#"{"componentType""#,
    );
    assert!(matches!(
        fault(&blank),
        GltfFault::AccessorKind { accessor: 0, .. }
    ));
    let far = blank.replace(r#""count": 4"#, r#""count": 2"#);
    assert_eq!(
        fault(&far).to_string(),
        "mesh 0, primitive 0: index 2 out of range, past the last vertex of 2"
    );
    let stray = good.replace(r#""indices": 1"#, r#""indices": 7"#);
    assert_eq!(
        fault(&stray).to_string(),
        "meshes[0].primitives[0].indices is 7: there is no such element"
    );
    let looped = good.replace(r#""scale": [1, 1, 1]"#, r#""children": [1]"#);
    assert!(matches!(fault(&looped), GltfFault::NodeLoop { .. }));
    let needy = gltf_text(
        "\"scale\": [1, 1, 1]",
        r#", "extensionsRequired": ["ACME_thing"]"#,
    );
    assert!(matches!(fault(&needy), GltfFault::NeedsExtension { .. }));
    let empty = good.replace(
        r#""scenes": [{"nodes": [1]}]"#,
        r#""scenes": [{"nodes": []}]"#,
    );
    assert!(matches!(
        fault(&empty),
        GltfFault::NoMesh | GltfFault::Json { .. }
    ));
}

#[test]
fn vertices_the_file_keeps_apart_are_merged_only_if_that_helps() {
    let mut two = pyramid();
    let first = two.positions.len() as u32;
    // A second pyramid that stands on the first one's tip with its own.
    two.positions.extend(pyramid().positions.iter().map(|&p| {
        let tip = pyramid().positions[4];
        tip + (tip - p)
    }));
    two.faces.extend(
        pyramid()
            .faces
            .iter()
            .map(|f| [f[0], f[2], f[1]].map(|v| v + first)),
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.ply");
    write(&path, &two).unwrap();
    let loaded = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!(loaded.mesh.mesh().positions.len(), 10);
    assert_eq!(loaded.warnings.len(), 1);
    // Without that knowledge, the same shape is refused.
    let path = folder.path().join("two.stl");
    write(&path, &two).unwrap();
    let refused = load(&path, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("non-manifold vertex") && refused.contains("--repair"),
        "{refused}"
    );
    let repair = LoadOptions {
        repair: true,
        ..LoadOptions::default()
    };
    assert_eq!(
        load(&path, &repair).unwrap().mesh.mesh().positions.len(),
        10
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nonsense_is_no_mesh_and_no_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for extension in EXTENSIONS {
            let _ = read(&bytes, extension);
        }
    }

    #[test]
    fn damaged_files_end_in_a_sentence_or_a_mesh(
        which in 0_usize..6,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        words in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(
            vec!["nan", "-1", "0", "4294967295", "99999999999", "1e400", "\\", "\n", "#", "f", "{", "]"]
        )), 0..3),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut files = PYRAMID_FILES.clone();
        files.push(("gltf", gltf_text(r#""scale": [1, 1, 1]"#, "").into_bytes()));
        let (extension, mut bytes) = files.swap_remove(which);
        for (place, value) in &changes {
            let at = place.index(bytes.len());
            bytes[at] = *value;
        }
        for (place, word) in &words {
            let at = place.index(bytes.len());
            bytes.splice(at..at, word.bytes());
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(raw) = read(&bytes, extension) {
            let both = LoadOptions { close_holes: true, repair: true, ..LoadOptions::default() };
            if let Err(fault) = close(raw, &both) {
                prop_assert!(!fault.to_string().contains('\n'));
            }
        }
    }
}
