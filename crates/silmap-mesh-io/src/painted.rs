//! Meshes into files with all that they look like: texture coordinates, textures and materials too, where the format has a place.
//!
//! | format | vertex colours | texture coordinates | textures and materials |
//! |---|---|---|---|
//! | GLB | yes | yes | in the file |
//! | OBJ | yes | yes | a material library and PNG pictures beside the file |
//! | PLY | yes | of each face's corners | one PNG picture beside the file, without colour factors |
//! | OFF | yes | no | no |
//! | STL | no | no | no |
//!
//! What finds no place is named, for a warning.

use std::fmt::Write as _;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use glam::DVec3;
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};
use silmap_geometry::lighting::srgb_from_linear;
use silmap_geometry::{Appearance, ColourImage, Material, TextureWrap, TriangleMesh};

use super::at;
use super::error::{MeshFault, MeshIoError};
use super::write::{
    encode_about, placed, ply_colour_properties, push_ply_vertices, vertex_colours,
};
use crate::warning::MeshWarning;

/// How a material library begins that was written here, and may be replaced.
const LIBRARY_HEAD: &str = "# written by silmap\n";

/// A mesh as files.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintedFiles {
    /// Of the file itself.
    pub bytes: Vec<u8>,
    /// Files that it names, which lie beside it.
    pub beside: Vec<(PathBuf, Vec<u8>)>,
    /// What the format has no place for.
    pub left_out: Vec<&'static str>,
    /// Set when the format cannot hold positions so far from zero.
    pub rounding: Option<MeshWarning>,
}

/// The files of a mesh in coordinates about `origin`, in the format that the extension of `path` names: in the files it stands there.
///
/// # Errors
/// As [`super::encode`]; when a material library of another program lies where one is to be written.
pub fn encode_painted(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> Result<PaintedFiles, MeshIoError> {
    let paint = &mesh.appearance;
    let has_uvs = !paint.corner_uvs.is_empty();
    let has_materials = !paint.face_materials.is_empty() && !paint.materials.is_empty();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_painted = has_uvs || has_materials;
    let result = match extension.as_deref() {
        Some("glb") if is_painted => glb(mesh, origin).map(|bytes| PaintedFiles {
            bytes,
            beside: Vec::new(),
            left_out: Vec::new(),
            rounding: None,
        }),
        Some("obj") if is_painted => obj(path, mesh, origin),
        Some("ply") if is_painted => ply(path, mesh, origin),
        other => {
            let mut left_out = Vec::new();
            if other == Some("stl") && !paint.corner_colours.is_empty() {
                left_out.push("vertex colours");
            }
            if has_uvs {
                left_out.push("texture coordinates");
            }
            if has_materials {
                left_out.push("materials");
            }
            let (bytes, rounding) = encode_about(path, mesh, origin)?;
            return Ok(PaintedFiles {
                bytes,
                beside: Vec::new(),
                left_out,
                rounding,
            });
        }
    };
    result
        .map(|mut files| {
            files.left_out.dedup();
            files
        })
        .map_err(|fault| at(path, fault))
}

/// A name beside `path`: its own, with `ending` for the extension.
fn named_after(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// A path's last part as text.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn png(picture: &ColourImage) -> Result<Vec<u8>, MeshFault> {
    let cannot = |source| MeshFault::Unwritable { source };
    let rgba = picture.rgba.clone();
    let image = RgbaImage::from_raw(picture.width, picture.height, rgba).ok_or_else(|| {
        cannot(std::io::Error::other(
            "a texture has fewer pixels than its size says",
        ))
    })?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|e| cannot(std::io::Error::other(e)))?;
    Ok(bytes.into_inner())
}

/// Numbers of equal things, in the order in which they come first; and one of each.
fn numbered<T: Clone, K: Ord>(all: &[T], key: impl Fn(&T) -> K) -> (Vec<u32>, Vec<T>) {
    let mut known = std::collections::BTreeMap::new();
    let mut first = Vec::new();
    let numbers = (all.iter())
        .map(|item| {
            *known.entry(key(item)).or_insert_with(|| {
                first.push(item.clone());
                first.len() as u32 - 1
            })
        })
        .collect();
    (numbers, first)
}

/// Faces in runs of one material; those without one come under the number after the last.
fn by_material(mesh: &TriangleMesh) -> Vec<(usize, Vec<usize>)> {
    let paint = &mesh.appearance;
    let mut groups = vec![Vec::new(); paint.materials.len() + 1];
    for f in 0..mesh.faces.len() {
        let material = paint
            .face_materials
            .get(f)
            .map_or(usize::MAX, |&m| m.into());
        groups[material.min(paint.materials.len())].push(f);
    }
    let groups = groups.into_iter().enumerate();
    groups.filter(|(_, faces)| !faces.is_empty()).collect()
}

/// The mesh's vertices with their colours, texture coordinates by number, and faces by material.
fn obj(path: &Path, mesh: &TriangleMesh, origin: DVec3) -> Result<PaintedFiles, MeshFault> {
    let paint = &mesh.appearance;
    let (library, mut beside) = (named_after(path, ".mtl"), Vec::new());
    let mut left_out = Vec::new();
    let mut text = String::new();
    // Writing into a string cannot fail, here and below.
    if !paint.materials.is_empty() {
        let _ = writeln!(text, "mtllib {}", name_of(&library));
    }
    let colours = vertex_colours(mesh);
    for (v, p) in placed(mesh, origin).enumerate() {
        let _ = write!(text, "v {} {} {}", p.x, p.y, p.z);
        if let Some(colours) = &colours {
            let [r, g, b] = colours[v].map(|c| srgb_from_linear(c).min(1.0));
            let _ = write!(text, " {r:.5} {g:.5} {b:.5}");
        }
        text.push('\n');
    }
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

/// Texture coordinates stand with the faces, as MeshLab writes them.
fn ply(path: &Path, mesh: &TriangleMesh, origin: DVec3) -> Result<PaintedFiles, MeshFault> {
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

/// The plain file, with vertices apart where looks differ, and texture coordinates, pictures and materials put into it.
fn glb(mesh: &TriangleMesh, origin: DVec3) -> Result<Vec<u8>, MeshFault> {
    const FLOAT: u32 = 5126;
    const UNSIGNED_INT: u32 = 5125;
    const VERTICES: u32 = 34962;
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
    let (plain, _) = encode_about(Path::new("mesh.glb"), &apart, origin).map_err(|e| e.fault)?;
    let (mut json, mut data) = chunks(&plain)?;
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

/// Adds to a list, which begins where there is none; gives the item's place.
fn push(list: &mut Value, item: Value) -> usize {
    if !list.is_array() {
        *list = json!([]);
    }
    let Some(items) = list.as_array_mut() else {
        return 0;
    };
    items.push(item);
    items.len() - 1
}

/// Adds bytes to the data, with a view of them; gives the view's place.
fn push_view(json: &mut Value, data: &mut Vec<u8>, bytes: &[u8], target: Option<u32>) -> usize {
    data.resize(data.len().next_multiple_of(4), 0);
    let mut view = json!({"buffer": 0, "byteOffset": data.len(), "byteLength": bytes.len()});
    if let Some(target) = target {
        view["target"] = json!(target);
    }
    data.extend_from_slice(bytes);
    push(&mut json["bufferViews"], view)
}

/// The JSON and the data of a file that was just written.
fn chunks(glb: &[u8]) -> Result<(Value, Vec<u8>), MeshFault> {
    let parsed = (|| {
        let length = |at: usize| {
            let bytes = glb.get(at..at + 4)?.try_into().ok()?;
            Some(u32::from_le_bytes(bytes) as usize)
        };
        let json_length = length(12)?;
        let json = serde_json::from_slice(glb.get(20..20 + json_length)?).ok()?;
        let data_start = 20 + json_length + 8;
        Some((json, glb.get(data_start..)?.to_vec()))
    })();
    parsed.ok_or_else(|| MeshFault::Unwritable {
        source: std::io::Error::other("the binary glTF has no two chunks"),
    })
}

fn assemble(json: &Value, mut data: Vec<u8>) -> Result<Vec<u8>, MeshFault> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| MeshFault::Unwritable {
            source: std::io::Error::other("a binary glTF file holds at most 4 GiB"),
        })
    };
    let total = length(12 + 8 + json.len() + 8 + data.len())?;
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(total.to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        bytes.extend(length(chunk.len())?.to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::{LoadOptions, encode, load};
    use super::*;

    /// A tetrahedron with a texture on three faces, a plain material on the fourth, and a seam.
    fn painted(has_colours: bool) -> TriangleMesh {
        let texture = ColourImage {
            width: 2,
            height: 2,
            rgba: (0..16)
                .map(|k| if k % 4 == 3 { 255 } else { k * 15 })
                .collect(),
        };
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let colour = |v: u32| [v as f32 / 3.0, 1.0, 0.0];
        TriangleMesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            appearance: Appearance {
                corner_uvs: vec![
                    [[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]],
                    [[0.25, 0.0], [0.5, 1.0], [0.75, 0.5]],
                    [[0.5, 1.0], [1.0, 0.25], [0.75, 0.5]],
                    [[1.0, 0.25], [0.0, 0.0], [0.75, 0.5]],
                ],
                corner_colours: if has_colours {
                    faces.iter().map(|f: &[u32; 3]| f.map(colour)).collect()
                } else {
                    Vec::new()
                },
                face_materials: vec![0, 0, 1, 0],
                materials: vec![
                    Material {
                        base_colour: [1.0; 3],
                        texture: Some(texture),
                        ..Material::default()
                    },
                    Material {
                        base_colour: [0.5, 0.25, 0.125],
                        ..Material::default()
                    },
                ],
            },
            faces,
        }
    }

    /// What a face looks like in a few places, by where they are.
    fn looks(mesh: &TriangleMesh) -> Vec<([i32; 3], [u8; 3])> {
        let mut looks: Vec<_> = (0..mesh.faces.len())
            .flat_map(|f| {
                [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]].map(|w: [f32; 3]| {
                    let corners = mesh.corners(f);
                    let at: DVec3 = (0..3).map(|k| corners[k] * f64::from(w[k])).sum();
                    let colour = mesh
                        .appearance
                        .albedo(f, w)
                        .map(|c| (c * 200.0).round() as u8);
                    ((at * 1e4).round().to_array().map(|x| x as i32), colour)
                })
            })
            .collect();
        looks.sort_unstable();
        looks
    }

    #[test]
    fn what_a_mesh_looks_like_comes_back_from_glb_and_obj() {
        for (extension, has_colours) in [("glb", false), ("glb", true), ("obj", false)] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(format!("mesh.{extension}"));
            let mesh = painted(has_colours);
            let files = encode_painted(&path, &mesh, DVec3::ZERO).unwrap();
            assert!(files.left_out.is_empty());
            fs::write(&path, &files.bytes).unwrap();
            for (beside, bytes) in &files.beside {
                fs::write(beside, bytes).unwrap();
            }
            let back = load(&path, &LoadOptions::default()).unwrap();
            assert!(back.warnings.is_empty(), "{:?}", back.warnings);
            assert_eq!(looks(back.mesh.mesh()), looks(&mesh), "{extension}");
            // What was written here may be replaced.
            assert_eq!(encode_painted(&path, &mesh, DVec3::ZERO).unwrap(), files);
        }
    }

    #[test]
    fn ply_has_one_texture_and_says_what_it_has_no_place_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        let mut mesh = painted(true);
        assert_eq!(
            encode_painted(&path, &mesh, DVec3::ZERO).unwrap().left_out,
            ["materials"]
        );
        mesh.appearance.materials.truncate(1);
        mesh.appearance.face_materials = vec![0; 4];
        let files = encode_painted(&path, &mesh, DVec3::ZERO).unwrap();
        assert!(files.left_out.is_empty());
        fs::write(&path, &files.bytes).unwrap();
        let [(beside, bytes)] = &files.beside[..] else {
            panic!("{} files", files.beside.len());
        };
        fs::write(beside, bytes).unwrap();
        let back = load(&path, &LoadOptions::default()).unwrap();
        assert!(back.warnings.is_empty(), "{:?}", back.warnings);
        let paint = &back.mesh.mesh().appearance;
        assert_eq!(paint.corner_uvs, mesh.appearance.corner_uvs);
        assert_eq!(paint.materials, mesh.appearance.materials);
    }

    #[test]
    fn other_formats_name_what_is_left_out() {
        let mesh = painted(true);
        let left_out = |name: &str| {
            encode_painted(Path::new(name), &mesh, DVec3::ZERO)
                .unwrap()
                .left_out
        };
        assert_eq!(left_out("a.off"), ["texture coordinates", "materials"]);
        assert_eq!(
            left_out("a.STL"),
            ["vertex colours", "texture coordinates", "materials"]
        );
        let plain = TriangleMesh {
            appearance: Appearance::default(),
            ..mesh.clone()
        };
        for name in ["a.stl", "a.glb", "a.obj"] {
            let files = encode_painted(Path::new(name), &plain, DVec3::ZERO).unwrap();
            assert_eq!(files.bytes, encode(Path::new(name), &plain).unwrap());
            assert!(files.left_out.is_empty() && files.beside.is_empty());
        }
    }

    #[test]
    fn a_library_of_another_program_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("mesh.mtl"), "newmtl skin\n").unwrap();
        let path = folder.path().join("mesh.obj");
        let error = encode_painted(&path, &painted(false), DVec3::ZERO).unwrap_err();
        assert!(error.to_string().contains("mesh.mtl"), "{error}");
    }
}
