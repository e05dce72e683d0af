//! OBJ with texture coordinates by number, faces by material, and a material library and pictures beside it.

use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use silmap_geometry::{TextureWrap, TriangleMesh};

use super::{PaintedFiles, by_material, name_of, named_after, numbered, png};
use crate::error::MeshFault;
use crate::write::push_obj_vertices;

/// How a material library begins that was written here, and may be replaced.
const LIBRARY_HEAD: &str = "# written by silmap\n";

/// The mesh's vertices with their colours, texture coordinates by number, and faces by material.
pub(super) fn encode(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> Result<PaintedFiles, MeshFault> {
    let paint = &mesh.appearance;
    let (library, mut beside) = (named_after(path, ".mtl"), Vec::new());
    let mut left_out = Vec::new();
    let mut text = String::new();
    // Writing into a string cannot fail, here and below.
    if !paint.materials.is_empty() {
        let _ = writeln!(text, "mtllib {}", name_of(&library));
    }
    push_obj_vertices(&mut text, mesh, origin);
    let (numbers, uvs) = numbered(paint.corner_uvs.as_flattened(), |uv| uv.map(f32::to_bits));
    for [u, v] in uvs {
        let _ = writeln!(text, "vt {u} {}", 1.0 - v);
    }
    for (material, faces) in by_material(mesh) {
        if material < paint.materials.len() {
            let _ = writeln!(text, "usemtl material_{material}");
        }
        for f in faces {
            text.push('f');
            for (k, v) in mesh.faces[f].iter().enumerate() {
                match numbers.get(3 * f + k) {
                    Some(uv) => _ = write!(text, " {}/{}", v + 1, uv + 1),
                    None => _ = write!(text, " {}", v + 1),
                }
            }
            text.push('\n');
        }
    }
    if !paint.materials.is_empty() {
        let mut library_text = LIBRARY_HEAD.to_owned();
        for (m, material) in paint.materials.iter().enumerate() {
            let [r, g, b] = material.base_colour;
            let _ = write!(library_text, "newmtl material_{m}\nKd {r} {g} {b}\n");
            if let Some(texture) = &material.texture {
                let picture = named_after(path, &format!("-texture-{m}.png"));
                let is_clamped = material.wrap == [TextureWrap::ClampToEdge; 2];
                let clamp = if is_clamped { "-clamp on " } else { "" };
                if clamp.is_empty() && material.wrap != [TextureWrap::Repeat; 2] {
                    left_out.push("ways to wrap textures");
                }
                let _ = writeln!(library_text, "map_Kd {clamp}{}", name_of(&picture));
                beside.push((picture, png(texture)?));
            }
        }
        check_replaceable(&library)?;
        beside.push((library, library_text.into_bytes()));
    }
    Ok(PaintedFiles {
        bytes: text.into_bytes(),
        beside,
        left_out,
        rounding: None,
    })
}

/// Refuses to replace a material library that was not written here: the model may be read from it.
fn check_replaceable(library: &Path) -> Result<(), MeshFault> {
    use std::io::Read;
    let mut head = vec![0; LIBRARY_HEAD.len()];
    let Ok(mut file) = std::fs::File::open(library) else {
        return Ok(());
    };
    if file.read_exact(&mut head).is_ok() && head == LIBRARY_HEAD.as_bytes() {
        return Ok(());
    }
    let sentence = format!(
        "the material library {} of another program would be replaced: choose another name",
        library.display()
    );
    Err(MeshFault::Unwritable {
        source: std::io::Error::new(std::io::ErrorKind::AlreadyExists, sentence),
    })
}
