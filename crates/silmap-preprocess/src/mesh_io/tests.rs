//! Readers and writers against each other, on small files made here, and on nonsense.

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
fn off_takes_the_colours_that_the_keyword_announces() {
    let body = |more: [&str; 4]| {
        format!(
            "4 4 0\n0 0 0{}\n1 0 0{}\n0 1 0{}\n0 0 1{}\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
            more[0], more[1], more[2], more[3]
        )
    };
    let bytes = [
        " 255 0 0 255",
        " 0 255 0 255",
        " 0 0 255 255",
        " 255 255 255 255",
    ];
    let fractions = [" 1.0 0 0 1", " 0 1.0 0 1", " 0 0 1.0 1", " 1 1 1 1"];
    let wanted = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    for (keyword, more) in [("COFF\n", bytes), ("COFF ", fractions)] {
        let raw = read((keyword.to_owned() + &body(more)).as_bytes(), "off").unwrap();
        assert_eq!(raw.mesh.appearance.corner_colours[0], wanted, "{keyword}");
    }
    let normals = fractions.map(|c| format!(" 0 0 1{c}"));
    let text = "CNOFF\n".to_owned() + &body(normals.each_ref().map(String::as_str));
    let raw = read(text.as_bytes(), "off").unwrap();
    assert_eq!(raw.mesh.appearance.corner_colours[0], wanted);
    // A face's own colour counts where its vertices have none.
    let cornered = body([""; 4]).replace("\n3 0 3 2\n", "\n3 0 3 2 0 0 0\n");
    let text = "COFF\n".to_owned() + &body(bytes).replace("\n3 0 3 2\n", "\n3 0 3 2 0 0 0\n");
    let raw = read(text.as_bytes(), "off").unwrap();
    assert_eq!(raw.mesh.appearance.corner_colours[0], wanted);
    let raw = read(("COFF\n".to_owned() + &cornered).as_bytes(), "off").unwrap();
    assert_eq!(raw.mesh.appearance.corner_colours[3], [[0.0; 3]; 3]);
    // Nothing is announced, or nothing is there.
    for text in [
        "OFF\n".to_owned() + &body(bytes),
        "COFF\n".to_owned() + &body([""; 4]),
    ] {
        let raw = read(text.as_bytes(), "off").unwrap();
        assert!(raw.mesh.appearance.is_plain(), "{text}");
    }
}

#[test]
fn off_takes_the_colours_behind_faces() {
    // A pyramid on a square; the last face has a number that would pick from a colour map.
    let text = |red: &str, blue: &str| {
        format!(
            "OFF\n5 5 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n\
             4 0 3 2 1 {red}\n3 0 1 4 {blue} # front\n3 1 2 4\n3 2 3 4 1 # no\n3 3 0 4 7\n"
        )
    };
    let (red, blue, white) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]);
    for text in [
        text("255 0 0", "0 0 255 128"),
        text("1.0 0 0 0.75", "0 0 1"),
    ] {
        let raw = read(text.as_bytes(), "off").unwrap();
        let wanted = [red, red, blue, white, white, white].map(|c| [c; 3]);
        assert_eq!(raw.mesh.appearance.corner_colours, wanted, "{text}");
    }
    for plain in [text("", ""), text("nan 0 0", "3 4"), text("-1 0 0", "")] {
        let raw = read(plain.as_bytes(), "off").unwrap();
        assert!(raw.mesh.appearance.is_plain(), "{plain}");
    }
}

#[test]
fn binary_stl_has_face_colours_in_two_ways() {
    let plain = PYRAMID_FILES
        .iter()
        .find(|(e, _)| *e == "stl")
        .unwrap()
        .1
        .clone();
    assert!(read(&plain, "stl").unwrap().mesh.appearance.is_plain());
    let with = |header: &[u8], fields: [u16; 2]| {
        let mut bytes = plain.clone();
        bytes[..80].fill(b' ');
        bytes[..header.len()].copy_from_slice(header);
        for (face, field) in fields.into_iter().enumerate() {
            let at = 84 + 50 * (face + 1) - 2;
            bytes[at..at + 2].copy_from_slice(&field.to_le_bytes());
        }
        let look = read(&bytes, "stl").unwrap().mesh.appearance;
        [0, 1, 2].map(|f| look.corner_colours[f][0])
    };
    let (red, blue, white) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]);
    assert_eq!(
        with(b"", [0x8000 | 31 << 10, 31 << 10]),
        [red, white, white]
    );
    let whole = b"made by hand COLOR=\xFF\xFF\xFF\xFF,MATERIAL=";
    assert_eq!(with(whole, [31, 31 << 10])[..2], [red, blue]);
    assert_eq!(with(whole, [0x8000, 31])[..2], [white, red]);
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
fn obj_lines_may_be_continued_and_polygons_concave() {
    let text = b"v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 2 0\nv 1 1 0\nv 0 1 0\nl 1 2 3\nf 1 2 3 \\\n 4 5 -1 # an L\n";
    let raw = read(text, "obj").unwrap();
    assert_eq!(raw.mesh.faces.len(), 4);
    let area: f64 = (0..4).map(|f| 0.5 * raw.mesh.face_cross(f).z).sum();
    let least = (0..4).map(|f| raw.mesh.face_cross(f).z).fold(1.0, f64::min);
    assert!((area - 3.0).abs() < 1e-12 && least > 0.0);
}

#[test]
fn obj_materials_and_colours_arrive_at_the_corners() {
    let folder = tempfile::tempdir().unwrap();
    let picture = image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 0, 0, 255]));
    picture.save(folder.path().join("red skin.png")).unwrap();
    std::fs::write(
        folder.path().join("looks.mtl"),
        "newmtl skin\nKd 1\nKd 0.5 1 1\nmap_Kd red skin.png\nnewmtl bare\nmap_Kd gone.png\nKd 0 0 1\n",
    )
    .unwrap();
    let text = "mtllib looks.mtl\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nv 0 0 1 nan 0 0\n\
                vt 0.25 0.75\nvt 0.5 0.5\nf 1 3 2\nusemtl skin\nf 1/1 2/2 4/1\nusemtl bare\nf 2 3 4\nusemtl gone\nf 1 4 3\n";
    let raw = read_bytes(text.as_bytes(), "obj", folder.path()).unwrap();
    let look = &raw.mesh.appearance;
    assert_eq!(look.corner_uvs[1], [[0.25, 0.25], [0.5, 0.5], [0.25, 0.25]]);
    assert_eq!(look.face_materials, [2, 0, 1, 2]);
    assert_eq!(look.materials.len(), 3);
    assert_eq!(look.materials[0].base_colour, [0.5, 1.0, 1.0]);
    assert_eq!(look.albedo(1, [1.0, 0.0, 0.0]), [0.5, 0.0, 0.0]);
    assert_eq!(look.albedo(2, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]);
    let warnings: Vec<String> = raw.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("gone.png") && warnings[1].contains("`gone`"));
    // The fourth vertex has no readable colour and stays white.
    assert_eq!(look.corner_colours[1][2], [1.0; 3]);
}

#[test]
fn ply_reads_the_same_in_all_encodings() {
    let header = |encoding: &str| {
        format!(
            "ply\r\nformat {encoding} 1.0\r\ncomment a box\r\nelement extra 1\r\nproperty list uchar short junk\r\n\
             element vertex 4\r\nproperty uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\n\
             property float32 x\r\nproperty float64 y\r\nproperty float z\r\n\
             element face 4\r\nproperty list uint8 int32 vertex_index\r\nend_header\r\n"
        )
    };
    let vertices = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let faces = [[0_i32, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut ascii = header("ascii") + "2 7 8\n\n";
    let mut little = header("binary_little_endian").into_bytes();
    let mut big = header("binary_big_endian").into_bytes();
    for (bytes, swap) in [(&mut little, false), (&mut big, true)] {
        let mut put = |mut field: Vec<u8>| {
            if swap {
                field.reverse();
            }
            bytes.extend(field);
        };
        put(vec![2]);
        put(7_i16.to_le_bytes().to_vec());
        put(8_i16.to_le_bytes().to_vec());
        for v in vertices {
            (0..3).for_each(|_| put(vec![255]));
            put((v[0] as f32).to_le_bytes().to_vec());
            put(f64::to_le_bytes(v[1]).to_vec());
            put((v[2] as f32).to_le_bytes().to_vec());
        }
        for face in faces {
            put(vec![3]);
            face.iter().for_each(|v| put(v.to_le_bytes().to_vec()));
        }
    }
    for v in vertices {
        writeln!(ascii, "255 255 255 {} {} {}", v[0], v[1], v[2]).unwrap();
    }
    for f in faces {
        writeln!(ascii, " 3 {} {} {} ", f[0], f[1], f[2]).unwrap();
    }
    let [a, b, c] = [ascii.as_bytes(), &little, &big].map(|bytes| read(bytes, "ply").unwrap().mesh);
    assert_eq!(a, b);
    assert_eq!(a, c);
    assert_eq!(a.positions[2].y, 0.1);
    assert_eq!(a.appearance.corner_colours[3], [[1.0; 3]; 3]);
    // Any cut is told of, with the element at which it happens.
    for cut in 0..little.len() {
        assert!(read(&little[..cut], "ply").is_err(), "{cut}");
    }
    let fault = read(&little[..little.len() - 1], "ply").unwrap_err();
    assert_eq!(fault.to_string(), "the file ends inside face 4 of 4");
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
