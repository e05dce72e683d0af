//! PLY as tools write it.

use super::*;

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
    // Any cut is reported, with the element at which it happens.
    for cut in 0..little.len() {
        assert!(read(&little[..cut], "ply").is_err(), "{cut}");
    }
    let fault = read(&little[..little.len() - 1], "ply").unwrap_err();
    assert_eq!(fault.to_string(), "the file ends inside face 4 of 4");
}

const SIDES: [[usize; 4]; 6] = [
    [0, 1, 3, 2],
    [4, 6, 7, 5],
    [0, 4, 5, 1],
    [2, 3, 7, 6],
    [0, 2, 6, 4],
    [1, 5, 7, 3],
];

/// A unit cube as ASCII PLY: names of further properties of vertices, what each has there, further header lines and data.
fn cube(
    vertex_properties: &str,
    more: impl Fn(usize) -> String,
    elements: &str,
    data: &str,
) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nobj_info made here\nelement vertex 8\nproperty float x\nproperty float y\nproperty double z\n\
         {vertex_properties}{elements}end_header\n"
    );
    for v in 0..8 {
        let [x, y, z] = [4, 2, 1].map(|bit| u8::from(v & bit != 0));
        writeln!(text, "{x} {y} {z} {}", more(v)).unwrap();
    }
    text + data
}

fn quads(more: impl Fn(usize) -> String) -> String {
    let line = |(f, q): (usize, &[usize; 4])| {
        format!("4 {} {} {} {} {}\n", q[0], q[1], q[2], q[3], more(f))
    };
    SIDES.iter().enumerate().map(line).collect()
}

fn assert_is_cube(raw: &RawMesh, what: &str) {
    assert_eq!(raw.mesh.faces.len(), 12, "{what}");
    assert!((raw.mesh.volume() - 1.0).abs() < 1e-12, "{what}");
}

#[test]
fn ply_takes_the_colours_of_faces() {
    let rgb = [
        [255, 0, 0],
        [0, 255, 0],
        [0, 0, 255],
        [255, 255, 0],
        [255, 0, 255],
        [0, 255, 255],
    ];
    let faces = "element face 6\nproperty list uchar int vertex_indices\n";
    let spell = |kind: &str, names: [&str; 3], scale: f64, opacity: &str| {
        let mut elements = faces.to_owned();
        for name in names {
            writeln!(elements, "property {kind} {name}").unwrap();
        }
        if !opacity.is_empty() {
            writeln!(elements, "property {kind} alpha").unwrap();
        }
        let data = quads(|f| {
            let [r, g, b] = rgb[f].map(|c| f64::from(c) * scale);
            format!("{r} {g} {b} {opacity}")
        });
        (elements, data)
    };
    let is_right = |text: &str| {
        let raw = read(text.as_bytes(), "ply").unwrap();
        assert_is_cube(&raw, text);
        for (&face, colours) in raw.face_of.iter().zip(&raw.mesh.appearance.corner_colours) {
            let wanted = rgb[face as usize].map(|c| c as f32 / 255.0);
            assert_eq!(*colours, [wanted; 3], "{text}");
        }
        assert_eq!(raw.mesh.appearance.corner_colours.len(), 12, "{text}");
    };
    let plain = ["red", "green", "blue"];
    let diffuse = ["diffuse_red", "diffuse_green", "diffuse_blue"];
    let none = |_: usize| String::new();
    for (kind, names, scale, opacity) in [
        ("uchar", plain, 1.0, ""),
        ("uint8", plain, 1.0, "255"),
        ("float", plain, 1.0 / 255.0, ""),
        ("float", plain, 1.0, "255"),
        ("double", diffuse, 1.0 / 255.0, "1"),
        ("uchar", diffuse, 1.0, "128"),
        ("ushort", plain, 257.0, ""),
    ] {
        let (elements, data) = spell(kind, names, scale, opacity);
        is_right(&cube("", none, &elements, &data));
    }
    // Vertices that are all alike do not hide them; others do.
    let (elements, data) = spell("uchar", plain, 1.0, "");
    let properties =
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    is_right(&cube(
        properties,
        |_| "255 255 255 255".to_owned(),
        &elements,
        &data,
    ));
    let both = cube(
        properties,
        |v| format!("{} 0 0 255", 255 * (v % 2)),
        &elements,
        &data,
    );
    let look = read(both.as_bytes(), "ply").unwrap().mesh.appearance;
    assert!(look.corner_colours.as_flattened().contains(&[0.0; 3]));
    // Colours of corners, as MeshLab writes them.
    let elements = faces.to_owned() + "property list uchar float color\n";
    let data = quads(|f| {
        format!(
            "12{}",
            rgb[f].map(|c| format!(" {}", c / 255)).concat().repeat(4)
        )
    });
    is_right(&cube("", none, &elements, &data));
}

#[test]
fn ply_strips_turn_and_begin_again() {
    let none = |_: usize| String::new();
    let strips: Vec<i32> = SIDES
        .iter()
        .flat_map(|q| [q[0] as i32, q[1] as i32, q[3] as i32, q[2] as i32, -1])
        .collect();
    let words: Vec<String> = strips.iter().map(ToString::to_string).collect();
    let count = words.len();
    for property in [
        "property list int int vertex_indices\n",
        "property list uchar short vertex_index\n",
    ] {
        let elements = format!("element tristrips 1\n{property}");
        for data in [
            format!("{count} {}\n", words.join(" ")),
            format!("{count}\n{}\n", words.join("\n")),
        ] {
            let text = cube("", none, &elements, &data);
            assert_is_cube(&read(text.as_bytes(), "ply").unwrap(), &text);
        }
    }
    // Four sides in one strip, joined by naming vertices twice, and two faces.
    let elements = "element tristrips 1\nproperty list int int vertex_indices\n\
                    element face 2\nproperty list uchar int vertex_indices\n";
    let mut joined: Vec<usize> = Vec::new();
    for q in &SIDES[..4] {
        joined.extend(joined.last().copied());
        if !joined.is_empty() {
            joined.push(q[0]);
        }
        joined.extend([q[0], q[1], q[3], q[2]]);
    }
    let words: Vec<String> = joined.iter().map(ToString::to_string).collect();
    let data = format!(
        "{} {}\n4 0 2 6 4\n4 1 5 7 3\n",
        words.len(),
        words.join(" ")
    );
    let text = cube("", none, elements, &data);
    assert_is_cube(&read(text.as_bytes(), "ply").unwrap(), &text);
    let fault = |data: &str| {
        let elements = "element tristrips 1\nproperty list int int vertex_indices\n";
        read(cube("", none, elements, data).as_bytes(), "ply")
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        fault("3 0 1 8\n"),
        "face 1: vertex 8, but the file has 8 vertices"
    );
    assert_eq!(
        fault("3 0 -2 1\n"),
        "face 1: vertex -2, but the file has 8 vertices"
    );
    assert_eq!(fault("3 0 -1 1\n"), "no faces");
    assert_eq!(
        fault(""),
        "strip 1 of 1 is missing: the file ends before it"
    );
}

#[test]
fn ply_strips_are_the_same_in_binary() {
    for (format, is_big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex 8\nproperty float32 x\nproperty float32 y\nproperty float32 z\n\
             element tristrips 1\nproperty list int32 int32 vertex_indices\nelement user 1\nproperty list ushort double weights\nend_header\n"
        )
        .into_bytes();
        let mut put = |mut field: Vec<u8>| {
            if is_big {
                field.reverse();
            }
            bytes.extend(field);
        };
        for v in 0..8 {
            for bit in [4, 2, 1] {
                put(f32::from(u8::from(v & bit != 0)).to_le_bytes().to_vec());
            }
        }
        put(30_i32.to_le_bytes().to_vec());
        for q in SIDES {
            for v in [q[0] as i32, q[1] as i32, q[3] as i32, q[2] as i32, -1] {
                put(v.to_le_bytes().to_vec());
            }
        }
        put(1_u16.to_le_bytes().to_vec());
        put(0.5_f64.to_le_bytes().to_vec());
        assert_is_cube(&read(&bytes, "ply").unwrap(), format);
    }
}

#[test]
fn ply_faces_choose_among_several_textures() {
    let folder = tempfile::tempdir().unwrap();
    for (name, colour) in [
        ("first one.png", [255, 0, 0, 255]),
        ("Second.PNG", [0, 0, 255, 255]),
    ] {
        let picture = image::RgbaImage::from_pixel(2, 2, image::Rgba(colour));
        picture
            .save_with_format(folder.path().join(name), image::ImageFormat::Png)
            .unwrap();
    }
    let elements = "comment TextureFile first one.png\ncomment TextureFile C:\\work\\second.png\nelement face 6\n\
                    property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n";
    let data = quads(|f| format!("8 0 0 1 0 1 1 0 1 {}", f % 2));
    let text = cube("", |_| String::new(), elements, &data);
    let raw = read_bytes(text.as_bytes(), "ply", folder.path()).unwrap();
    assert_is_cube(&raw, &text);
    assert_eq!(raw.warnings, []);
    for (face, &of) in raw.face_of.iter().enumerate() {
        let wanted = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]][of as usize % 2];
        assert_eq!(raw.mesh.appearance.albedo(face, [0.3, 0.3, 0.4]), wanted);
    }
}

#[test]
fn points_alone_are_told_with_the_way_out() {
    let header = "ply\nformat ascii 1.0\ncomment KIND\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    let data = "end_header\n0 0 0\n1 0 0\n";
    let no_face = "element face 0\nproperty list uchar int vertex_indices\n";
    let fault = |text: &str, extension| {
        let fault = read(text.as_bytes(), extension).unwrap_err();
        assert!(matches!(fault, MeshFault::PointsOnly { vertices: 2, .. }));
        fault.to_string()
    };
    for said in [
        fault(&[header, data].concat(), "ply"),
        fault(&[header, no_face, data].concat(), "ply"),
        fault("v 0 0 0\nv 1 0 0\np 1 2\n", "obj"),
        fault("OFF\n2 0 0\n0 0 0\n1 0 0\n", "off"),
    ] {
        assert!(
            said.starts_with("no faces, only 2 vertices: points have no surface"),
            "{said}"
        );
    }
    // Its writer keeps a strip's vertices and nothing else of it.
    let of_vtk = header.replace("KIND", "VTK generated PLY File");
    let said = fault(&[of_vtk.as_str(), no_face, data].concat(), "ply");
    assert!(said.contains("vtkTriangleFilter"), "{said}");
    // Another list may be faces of another name.
    let polygons = no_face.replace("face", "polygon");
    let fault = read([header, &polygons, data].concat().as_bytes(), "ply").unwrap_err();
    assert_eq!(fault.to_string(), "header: no face element");
}
