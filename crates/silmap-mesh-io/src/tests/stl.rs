//! STL as tools write it.

use super::*;

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

/// The words of a tetrahedron as ASCII STL, one facet after another.
fn facets(facet: impl Fn([[u8; 3]; 3]) -> String) -> String {
    let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
    [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
        .map(|f: [usize; 3]| facet(f.map(|v| corners[v])))
        .concat()
}

fn facet_of(normal: &str, corners: [[u8; 3]; 3]) -> String {
    let vertices = corners.map(|[x, y, z]| format!("vertex {x} {y}.0e+00 {z}\n"));
    format!(
        "facet{normal}\nouter loop\n{}endloop\nendfacet\n",
        vertices.concat()
    )
}

#[test]
fn ascii_stl_is_read_however_it_is_spelled() {
    let plain = facets(|f| facet_of(" normal 0 0 1", f));
    let solid = |body: &str| format!("solid a name\n{body}endsolid a name\n");
    for (what, text) in [
        ("plain", solid(&plain)),
        ("capitals", solid(&plain).to_uppercase()),
        (
            "a mixture",
            solid(&plain)
                .replace("facet", "Facet")
                .replace("vertex", "VERTEX"),
        ),
        (
            "tabs",
            solid(&plain).replace(' ', "\t").replace('\n', "\r\n\t"),
        ),
        ("no name", format!("solid\n{plain}endsolid\n")),
        ("no end", format!("solid x\n{plain}")),
        (
            "end apart",
            solid(&plain)
                .replace("endsolid", "end solid")
                .replace("endloop", "end loop")
                .replace("endfacet", "end facet"),
        ),
        ("one word", solid(&plain).replace("outer loop", "outerloop")),
        ("no normal", solid(&facets(|f| facet_of("", f)))),
        ("half a normal", solid(&facets(|f| facet_of(" normal", f)))),
        (
            "no number as normal",
            solid(&facets(|f| facet_of(" normal nan -nan(ind) 1.#QNAN", f))),
        ),
        (
            "a name of keywords",
            solid(&plain).replace("a name", "facet endsolid vertex"),
        ),
        (
            "a line before",
            format!("; written by hand\n\n{}", solid(&plain)),
        ),
        ("a mark", format!("\u{FEFF}{}", solid(&plain))),
        ("one line", solid(&plain).replace('\n', " ")),
        ("no solid", plain.clone()),
        ("old line ends", solid(&plain).replace('\n', "\r")),
    ] {
        for extension in ["stl", "unknown"] {
            // Without a clear beginning the name has to decide.
            if extension == "unknown" && what == "no normal" {
                continue;
            }
            let raw = read(text.as_bytes(), extension).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert_eq!(raw.mesh.faces.len(), 4, "{what}");
            assert!((raw.mesh.volume() - 1.0 / 6.0).abs() < 1e-15, "{what}");
        }
    }
    // Several solids, and facets with four corners.
    let two = solid(&plain)
        + &solid(
            &plain
                .replace("vertex 0", "vertex 5")
                .replace("vertex 1", "vertex 6"),
        );
    assert_eq!(read(two.as_bytes(), "stl").unwrap().mesh.faces.len(), 8);
    let square = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n";
    assert_eq!(read(square.as_bytes(), "stl").unwrap().mesh.faces.len(), 2);
    let fault = |text: &str| read(text.as_bytes(), "stl").unwrap_err().to_string();
    assert_eq!(
        fault(&solid(&plain).replace("0.0e+00", "0,0")),
        "line 4: vertex 0 does not have three numbers as coordinates"
    );
    assert_eq!(
        fault("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
        "line 4: expected `endloop`, found `the end of the file`"
    );
    assert_eq!(fault("solid a\nendsolid a\n"), "no faces");
}

#[test]
fn binary_stl_of_meshlab_has_its_own_colours_under_a_magics_header() {
    let mut bytes = PYRAMID_FILES
        .iter()
        .find(|(e, _)| *e == "stl")
        .unwrap()
        .1
        .clone();
    bytes[..80].fill(b' ');
    let header = b"COLOR=\x7f\x7f\x7f MATERIAL=\x7f\x7f\x7f \x7f\x7f\x7f \x7f\x7f\x7f ";
    bytes[..header.len()].copy_from_slice(header);
    let mut colours_of = |fields: [u16; 6]| {
        for (face, field) in fields.into_iter().enumerate() {
            let at = 84 + 50 * (face + 1) - 2;
            bytes[at..at + 2].copy_from_slice(&field.to_le_bytes());
        }
        let look = read(&bytes, "stl").unwrap().mesh.appearance;
        look.corner_colours.iter().map(|c| c[0]).collect::<Vec<_>>()
    };
    let set = |red: u16, blue: u16| 1 << 15 | red | blue << 10;
    let (red, blue, black) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]);
    let grey = [linear_from_srgb(127.0 / 255.0); 3];
    // Every face has the bit, and its own colour.
    assert_eq!(
        colours_of([
            set(31, 0),
            set(0, 31),
            set(0, 0),
            set(31, 0),
            set(0, 31),
            set(0, 0)
        ]),
        [red, blue, black, red, blue, black]
    );
    // Some have it not: by Magics, the bit means the colour of the whole.
    assert_eq!(
        colours_of([set(31, 0), 31, 31 << 10, 0, set(0, 0), set(0, 31)]),
        [grey, red, blue, black, grey, grey]
    );
    // Every face has it, and nothing else.
    assert_eq!(colours_of([1 << 15; 6]), [grey; 6]);
    assert_eq!(colours_of([u16::MAX; 6]), [grey; 6]);
}
