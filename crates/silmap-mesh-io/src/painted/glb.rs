//! Binary glTF with texture coordinates, pictures and materials.

use glam::DVec3;
use serde_json::{Value, json};
use silmap_geometry::{Appearance, TextureWrap, TriangleMesh};

use super::{by_material, numbered, png};
use crate::error::MeshFault;
use crate::write::glb::{FLOAT, UNSIGNED_INT, VERTICES, assemble, parts, push, push_view};

/// The plain file, with vertices apart where looks differ, and texture coordinates, pictures and materials put into it.
pub(super) fn encode(mesh: &TriangleMesh, origin: DVec3) -> Result<Vec<u8>, MeshFault> {
    let paint = &mesh.appearance;
    let groups = by_material(mesh);
    // A corner for each look of each vertex.
    let corners: Vec<(u32, usize, usize)> = (groups.iter().flat_map(|(_, faces)| faces))
        .flat_map(|&f| [0, 1, 2].map(|k| (mesh.faces[f][k], f, k)))
        .collect();
    let uv = |f: usize, k: usize| paint.corner_uvs.get(f).map(|uvs| uvs[k]);
    let colour = |f: usize, k: usize| paint.corner_colours.get(f).map(|colours| colours[k]);
    let (numbers, firsts) = numbered(&corners, |&(v, f, k)| {
        let uv = uv(f, k).map(|uv| uv.map(f32::to_bits));
        let colour = colour(f, k).map(|c| c.map(f32::to_bits));
        (v, uv, colour)
    });
    let faces: Vec<[u32; 3]> = (numbers.chunks_exact(3))
        .map(|c| [c[0], c[1], c[2]])
        .collect();
    let corner_colours = match paint.corner_colours.is_empty() {
        true => Vec::new(),
        false => (corners.chunks_exact(3))
            .filter_map(|c| {
                let of = |&(_, f, k): &(u32, usize, usize)| colour(f, k);
                Some([of(&c[0])?, of(&c[1])?, of(&c[2])?])
            })
            .collect(),
    };
    let apart = TriangleMesh {
        positions: firsts
            .iter()
            .map(|&(v, ..)| mesh.positions[v as usize])
            .collect(),
        faces,
        appearance: Appearance {
            corner_colours,
            ..Appearance::default()
        },
    };
    let (mut json, mut data) = parts(&apart, origin);
    // Shading runs on across seams.
    let normals = mesh.vertex_normals();
    let first_primitive = json["meshes"][0]["primitives"][0].clone();
    let normal_accessor = index(&first_primitive["attributes"]["NORMAL"]);
    let normal_view = index(&json["accessors"][normal_accessor]["bufferView"]);
    let start = index(&json["bufferViews"][normal_view]["byteOffset"]);
    for (n, &(v, ..)) in firsts.iter().enumerate() {
        let normal = normals[v as usize].as_vec3();
        let normal = if normal == glam::Vec3::ZERO {
            glam::Vec3::Z
        } else {
            normal
        };
        let place = start + 12 * n;
        if let Some(place) = data.get_mut(place..place + 12) {
            place.copy_from_slice(bytemuck::cast_slice(&normal.to_array()));
        }
    }
    let mut attributes = first_primitive["attributes"].clone();
    if !paint.corner_uvs.is_empty() {
        let uvs: Vec<[f32; 2]> = (firsts.iter())
            .map(|&(_, f, k)| uv(f, k).unwrap_or_default())
            .collect();
        let view = push_view(
            &mut json,
            &mut data,
            bytemuck::cast_slice(&uvs),
            Some(VERTICES),
        );
        let accessor = push(
            &mut json["accessors"],
            json!({"bufferView": view, "componentType": FLOAT, "count": uvs.len(), "type": "VEC2"}),
        );
        attributes["TEXCOORD_0"] = json!(accessor);
    }
    let mut materials = Vec::new();
    for material in &paint.materials {
        let [r, g, b] = material.base_colour;
        let mut look = json!({"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0});
        if let Some(texture) = &material.texture {
            let view = push_view(&mut json, &mut data, &png(texture)?, None);
            let image = push(
                &mut json["images"],
                json!({"bufferView": view, "mimeType": "image/png"}),
            );
            let mut texture = json!({"source": image});
            if material.wrap != [TextureWrap::Repeat; 2] {
                let [wrap_s, wrap_t] = material.wrap.map(|wrap| match wrap {
                    TextureWrap::Repeat => 10497,
                    TextureWrap::MirroredRepeat => 33648,
                    TextureWrap::ClampToEdge => 33071,
                });
                let sampler = json!({"wrapS": wrap_s, "wrapT": wrap_t});
                texture["sampler"] = json!(push(&mut json["samplers"], sampler));
            }
            let texture = push(&mut json["textures"], texture);
            look["baseColorTexture"] = json!({"index": texture});
        }
        materials.push(json!({"pbrMetallicRoughness": look}));
    }
    let plain_material = json["materials"][0].clone();
    materials.push(plain_material);
    json["materials"] = json!(materials);
    let index_accessor = index(&first_primitive["indices"]);
    let index_view = json["accessors"][index_accessor]["bufferView"].clone();
    let mut primitives = Vec::new();
    let mut first_face = 0;
    for (material, faces) in &groups {
        let accessor = push(
            &mut json["accessors"],
            json!({"bufferView": index_view, "byteOffset": 12 * first_face, "componentType": UNSIGNED_INT,
                "count": 3 * faces.len(), "type": "SCALAR"}),
        );
        first_face += faces.len();
        let mut primitive = first_primitive.clone();
        primitive["attributes"] = attributes.clone();
        primitive["indices"] = json!(accessor);
        primitive["material"] = json!(material);
        primitives.push(primitive);
    }
    json["meshes"][0]["primitives"] = json!(primitives);
    json["buffers"][0]["byteLength"] = json!(data.len());
    assemble(&json, data)
}

fn index(value: &Value) -> usize {
    value.as_u64().unwrap_or(0) as usize
}
