//! OBJ and MTL as tools write them.

use super::*;

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

/// A unit cube about the origin, `body` before its faces and a texture coordinate at every corner.
fn cube(body: &str) -> String {
    let mut text = String::new();
    for v in 0..8 {
        let [x, y, z] = [4, 2, 1].map(|bit| if v & bit != 0 { 0.5 } else { -0.5 });
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    text += body;
    for side in [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ] {
        let corners = side.iter().zip(1..).map(|(v, k)| format!(" {}/{k}", v + 1));
        writeln!(text, "f{}", corners.collect::<String>()).unwrap();
    }
    text
}

#[test]
fn options_of_a_texture_move_and_scale_it() {
    let folder = tempfile::tempdir().unwrap();
    // Red and green over blue and yellow.
    let quarters = image::RgbaImage::from_fn(32, 32, |x, y| {
        image::Rgba(match (x < 16, y < 16) {
            (true, true) => [255, 0, 0, 255],
            (false, true) => [0, 255, 0, 255],
            (true, false) => [0, 0, 255, 255],
            (false, false) => [255, 255, 0, 255],
        })
    });
    quarters.save(folder.path().join("four.png")).unwrap();
    // The colours seen at the middle of each quarter of a side: upper left and right, lower left and right.
    let seen = |options: &str| {
        let library = format!("newmtl m\nKd 1 1 1\nmap_Kd {options}four.png\n");
        std::fs::write(folder.path().join("a.mtl"), library).unwrap();
        let text = "mtllib a.mtl\n".to_owned() + &cube("usemtl m\n");
        let raw = read_bytes(text.as_bytes(), "obj", folder.path()).unwrap();
        // At a point (u, v up) of the last side, whose texture coordinates go around from (0, 0).
        let at = |u: f32, v: f32| {
            let look = &raw.mesh.appearance;
            let found = (10..12).find_map(|face| {
                let quad = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
                let side = [1, 5, 7, 3];
                let [a, b, c] =
                    raw.mesh.faces[face].map(|v| quad[side.iter().position(|&s| s == v).unwrap()]);
                let cross = |p: [f32; 2], q: [f32; 2], r: [f32; 2]| {
                    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
                };
                let p = [u, v];
                let weights = [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
                weights
                    .iter()
                    .all(|&w| w > 0.0)
                    .then(|| look.albedo(face, weights))
            });
            match found.unwrap().map(|c| c > 0.5) {
                [true, false, false] => 'r',
                [false, true, false] => 'g',
                [false, false, true] => 'b',
                [true, true, false] => 'y',
                _ => '?',
            }
        };
        let colours: String = [(0.3, 0.8), (0.7, 0.8), (0.3, 0.2), (0.8, 0.2)]
            .map(|(u, v)| at(u, v))
            .iter()
            .collect();
        (colours, raw.warnings.len())
    };
    assert_eq!(seen(""), ("rgby".to_owned(), 0));
    assert_eq!(seen("-o 0.5 0.5 0 "), ("ybgr".to_owned(), 0));
    assert_eq!(seen("-o 0.5 "), ("gryb".to_owned(), 0));
    assert_eq!(seen("-s 0.5 0.5 1 "), ("bbbb".to_owned(), 0));
    assert_eq!(seen("-s 0.5 0.5 1 -o 0.5 0.5 "), ("gggg".to_owned(), 0));
    assert_eq!(seen("-clamp on -bm 1 -texres 64 "), ("rgby".to_owned(), 0));
    assert_eq!(seen("-clamp on -s 2 2 "), ("ggyy".to_owned(), 0));
    assert_eq!(seen("-mm 0.5 1 "), ("rgby".to_owned(), 1));
}

#[test]
fn numbers_behind_the_coordinates_are_told_apart() {
    let read_colours = |vertices: [&str; 3]| {
        let text = format!(
            "v 0 0 0 {}\nv 1 0 0 {}\nv 0 1 0 {}\nf 1 2 3\n",
            vertices[0], vertices[1], vertices[2]
        );
        let look = read(text.as_bytes(), "obj").unwrap().mesh.appearance;
        look.corner_colours.first().copied()
    };
    let (red, green, blue) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let wanted = Some([red, green, blue]);
    assert_eq!(read_colours(["1 0 0", "0 1 0", "0 0 1"]), wanted);
    assert_eq!(read_colours(["255 0 0", "0 255 0", "0 0 255"]), wanted);
    assert_eq!(read_colours(["1 1 0 0", "1 0 1 0", "1 0 0 1"]), wanted);
    assert_eq!(read_colours(["1 0 0 1", "0 1 0 1", "0 0 1 1"]), wanted);
    assert_eq!(
        read_colours(["255 0 0 255", "0 255 0 255", "0 0 255 255"]),
        wanted
    );
    assert_eq!(
        read_colours(["1 0 0 0.5", "0 1 0 0.5", "0 0 1 0.5"]),
        wanted
    );
    assert_eq!(
        read_colours(["1 1 0 0 1", "1 0 1 0 1", "1 0 0 1 1"]),
        wanted
    );
    assert_eq!(read_colours(["1", "1", "1"]), None);
    assert_eq!(read_colours(["", "", ""]), None);
}
