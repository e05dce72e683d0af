//! The models in `data/` are what the generator makes today, byte for byte.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use silmap_geometry::TriangleMesh;
use silmap_geometry::lighting::srgb_from_linear;
use silmap_models::{self as models, ModelKind};

/// Faces of each model in `data/`; `data/README.md` says the same.
const FACES: [(ModelKind, usize); 4] = [
    (ModelKind::Torus, 2_048),
    (ModelKind::TrefoilKnot, 3_072),
    (ModelKind::ThreeHoledTorus, 3_000),
    (ModelKind::Organic, 4_000),
];

/// Largest file: `data/` lives in the repository for ever.
const LARGEST_BYTES: usize = 200 * 1024;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A model as OBJ text: positions to a hundred-thousandth of a unit, vertex colours in sRGB where there are some.
fn obj_text(kind: ModelKind, mesh: &TriangleMesh) -> String {
    let mut colours = vec![None; mesh.positions.len()];
    for (face, corners) in mesh.faces.iter().zip(&mesh.appearance.corner_colours) {
        for k in 0..3 {
            colours[face[k] as usize] = Some(corners[k]);
        }
    }
    let mut text = format!("# silmap model {kind}, {} faces\n", mesh.faces.len());
    let mut line = |arguments: std::fmt::Arguments<'_>| {
        text.write_fmt(arguments).expect("a string takes any text");
    };
    for (p, colour) in mesh.positions.iter().zip(&colours) {
        line(format_args!("v {:.5} {:.5} {:.5}", p.x, p.y, p.z));
        if let Some(colour) = colour {
            let [r, g, b] = colour.map(srgb_from_linear);
            line(format_args!(" {r:.3} {g:.3} {b:.3}"));
        }
        line(format_args!("\n"));
    }
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| v + 1);
        line(format_args!("f {a} {b} {c}\n"));
    }
    text
}

#[test]
fn generating_again_gives_the_same_bytes() {
    let made_in = repository().join("target/generated-data");
    let mut differing = Vec::new();
    for (kind, faces) in FACES {
        let mesh = models::generate(kind, faces);
        assert_eq!(mesh.faces.len(), faces, "{kind}");
        let text = obj_text(kind, &mesh);
        assert!(text.len() <= LARGEST_BYTES, "{kind}: {} bytes", text.len());
        let name = format!("{kind}.obj");
        let kept = fs::read_to_string(repository().join("data").join(&name));
        if kept.ok().as_deref() != Some(&text) {
            fs::create_dir_all(&made_in).expect("the target folder can be written");
            fs::write(made_in.join(&name), text).expect("the target folder can be written");
            differing.push(name);
        }
    }
    assert!(
        differing.is_empty(),
        "{differing:?} in data/ are missing or not what the generator makes; if the change is meant: cp {}/*.obj data/",
        made_in.display()
    );
}

#[test]
fn a_changed_digit_is_noticed() {
    let mut mesh = models::torus(200);
    let before = obj_text(ModelKind::Torus, &mesh);
    mesh.positions[7].x += 2e-5;
    assert_ne!(before, obj_text(ModelKind::Torus, &mesh));
}
