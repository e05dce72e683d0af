//! OFF as tools write it.

use super::*;

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

/// A unit cube as OFF with a keyword, something after each vertex's coordinates, and what each of them must have become.
fn cube(keyword: &str, more: impl Fn(usize) -> String) -> RawMesh {
    let mut text = format!("{keyword}\n8 6 0\n");
    for v in 0..8 {
        let [x, y, z] = [4, 2, 1].map(|bit| usize::from(v & bit != 0));
        writeln!(text, "{x} {y} {z} {}", more(v)).unwrap();
    }
    text += "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n";
    read(text.as_bytes(), "off").unwrap()
}

#[test]
fn off_letters_stand_in_any_order() {
    let red_green = |v: usize| ["255 0 0", "0 255 0"][v % 2];
    let is_right = |raw: &RawMesh, what: &str| {
        assert!((raw.mesh.volume() - 1.0).abs() < 1e-12, "{what}");
        let look = &raw.mesh.appearance;
        assert_eq!(look.corner_colours.len(), 12, "{what}");
        for (face, colours) in raw.mesh.faces.iter().zip(&look.corner_colours) {
            let wanted = face.map(|v| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][v as usize % 2]);
            assert_eq!(*colours, wanted, "{what}");
        }
    };
    // Normals first, as Geomview has it, and colours first, as MeshLab writes `NC`; whatever the letters.
    for keyword in [
        "NCOFF", "CNOFF", "STNCOFF", "CSTNOFF", "NSTCOFF", "cnoff", "ncoff",
    ] {
        let uvs = if keyword.contains("ST") {
            " 0.5 0.25"
        } else {
            ""
        };
        for opacity in ["", " 255"] {
            let first = cube(keyword, |v| {
                format!("0 0.6 0.8 {}{opacity}{uvs}", red_green(v))
            });
            is_right(&first, keyword);
            let last = cube(keyword, |v| {
                format!("{}{opacity} 0 -0.6 0.8{uvs}", red_green(v))
            });
            is_right(&last, keyword);
        }
    }
    for keyword in ["COFF", "STCOFF", "CSTOFF"] {
        is_right(&cube(keyword, |v| red_green(v).to_owned()), keyword);
    }
    // Where the numbers are ambiguous, the letters decide.
    let sides = |keyword: &str| {
        cube(keyword, |_| "0 0 1 1 0 0".to_owned())
            .mesh
            .appearance
            .corner_colours[0][0]
    };
    assert_eq!(sides("NCOFF"), [1.0, 0.0, 0.0]);
    assert_eq!(sides("CNOFF"), [0.0, 0.0, 1.0]);
}

#[test]
fn off_may_have_a_divisor_or_a_dimension() {
    let text = |keyword: &str, scale: f64, fourth: &str| {
        let vertex = |v: [f64; 3]| {
            let [x, y, z] = v.map(|x| x * scale);
            format!("{x} {y} {z}{fourth}\n")
        };
        let vertices: String = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(vertex)
            .concat();
        format!("{keyword}\n4 4 6\n{vertices}3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n")
    };
    for (keyword, scale, fourth) in [
        ("4OFF", 2.0, " 2"),
        ("nOFF\n3", 1.0, ""),
        ("nOFF 3", 1.0, ""),
        ("4nOFF 3", -3.0, " -3"),
        ("n4OFF 3", 1.0, " 1"),
        ("off", 1.0, ""),
    ] {
        let raw = read(text(keyword, scale, fourth).as_bytes(), "off").unwrap();
        assert!((raw.mesh.volume() - 1.0 / 6.0).abs() < 1e-15, "{keyword}");
    }
    let fault = |keyword: &str, fourth: &str| {
        read(text(keyword, 1.0, fourth).as_bytes(), "off")
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        fault("nOFF 4", " 0"),
        "header: OFF in other than three dimensions is not supported"
    );
    assert_eq!(fault("4OFF", " 0"), "line 3: vertex 0 is not finite");
    assert_eq!(
        fault("4OFF", ""),
        "line 3: vertex 0 does not have three numbers as coordinates"
    );
    assert_eq!(
        fault("OFF BINARY", ""),
        "header: the binary variant of OFF is not supported"
    );
    for keyword in ["XOFF", "CCOFF", "SOFF", "TSOFF"] {
        assert_eq!(fault(keyword, ""), "header: does not begin with `OFF`");
    }
}
