//! PLY with texture coordinates and one picture beside it.

use std::path::Path;

use glam::DVec3;
use silmap_geometry::{ColourImage, Material, TextureWrap, TriangleMesh};

use super::{PaintedFiles, name_of, named_after, png};
use crate::error::MeshFault;
use crate::write::{ply_colour_properties, push_ply_vertices, vertex_colours};

/// Texture coordinates stand with the faces, as MeshLab writes them.
pub(super) fn encode(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> Result<PaintedFiles, MeshFault> {
    let paint = &mesh.appearance;
    let mut left_out = Vec::new();
    let textures: Vec<&ColourImage> = (paint.materials.iter())
        .filter_map(|m| m.texture.as_ref())
        .collect();
    let is_plain = |m: &Material| m.base_colour == [1.0; 3] && m.texture.is_some();
    if (paint.materials.iter()).any(|m| m.texture.is_some() && m.wrap != [TextureWrap::Repeat; 2]) {
        left_out.push("ways to wrap textures");
    }
    if !paint.materials.iter().all(is_plain) || paint.materials.len() > 1 {
        left_out.push("materials");
    }
    let picture = named_after(path, "-texture-0.png");
    let mut beside = Vec::new();
    let mut comment = String::new();
    if let &[texture] = &textures[..] {
        comment = format!("comment TextureFile {}\n", name_of(&picture));
        beside.push((picture, png(texture)?));
    }
    let has_uvs = !paint.corner_uvs.is_empty();
    let colours = vertex_colours(mesh);
    let colour_properties = ply_colour_properties(colours.as_deref());
    let uv_property = match has_uvs {
        true => "property list uchar float texcoord\n",
        false => "",
    };
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\n{comment}element vertex {}\nproperty double x\nproperty double y\n\
         property double z\n{colour_properties}element face {}\nproperty list uchar uint vertex_indices\n\
         {uv_property}end_header\n",
        mesh.positions.len(),
        mesh.faces.len()
    )
    .into_bytes();
    push_ply_vertices(&mut bytes, mesh, origin, colours.as_deref());
    for (f, face) in mesh.faces.iter().enumerate() {
        bytes.push(3);
        for v in face {
            bytes.extend(v.to_le_bytes());
        }
        if let Some(uvs) = paint.corner_uvs.get(f) {
            bytes.push(6);
            for [u, v] in uvs {
                bytes.extend(u.to_le_bytes());
                bytes.extend((1.0 - v).to_le_bytes());
            }
        }
    }
    Ok(PaintedFiles {
        bytes,
        beside,
        left_out,
        rounding: None,
    })
}
