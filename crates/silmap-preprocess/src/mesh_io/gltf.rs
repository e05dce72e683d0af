//! glTF 2.0 and binary glTF.
//!
//! The JSON is parsed and checked by the `gltf` crate; the container, the buffers and the accessors are read here, with
//! every range checked, because that crate's own readers trust the ranges. All triangles of the scene are taken, moved by
//! their nodes' transforms, with base colour, its texture, and vertex colours. Skins and morph targets are left out.

use std::path::Path;

use glam::{DMat4, DQuat, DVec3, Quat};
use gltf::json::validation::{Error as RuleError, Validate};
use gltf::mesh::Mode;
use gltf::scene::Transform;
use silmap_geometry::{ColourImage, Material};

use super::error::{GltfFault, MeshFault};
use super::gltf_data::{Accessor, load_buffers, read_resource};
use super::gltf_places::{Place, places};
use super::mtl::decode_image;
use super::raw::{MOST_MATERIALS, PolygonLook, RawMesh};

/// Nodes may show one mesh many times; this many triangles are enough.
const MOST_TRIANGLES: usize = 100_000_000;

const GLB_HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const CHUNK_JSON: &[u8] = b"JSON";
const CHUNK_BIN: &[u8] = b"BIN\0";

/// Reads a `.gltf` or `.glb` file; `folder` is where its buffers and images lie.
pub(super) fn read(bytes: &[u8], is_binary: bool, folder: &Path) -> Result<RawMesh, MeshFault> {
    let (json, blob) = if is_binary {
        split_chunks(bytes).map_err(MeshFault::Gltf)?
    } else {
        (bytes, None)
    };
    let part = if is_binary { "chunk " } else { "" };
    let fault = |reason: String| {
        let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
        let reason = reason.trim_end_matches(';').to_owned();
        MeshFault::Gltf(GltfFault::Json { part, reason })
    };
    let root = gltf::json::Root::from_slice(json).map_err(|e| fault(e.to_string()))?;
    let document = gltf::Document::from_json_without_validation(root);
    check_document(&document, json, fault)?;
    let buffers = load_buffers(&document, blob, folder).map_err(MeshFault::Gltf)?;
    let mut reader = Reader {
        raw: RawMesh::counting_from(0),
        buffers,
        folder,
        material_of: vec![None; document.materials().len()],
        places: places(json),
    };
    reader.read_scene(&document)?;
    if reader.raw.mesh.faces.is_empty() {
        return Err(MeshFault::Gltf(GltfFault::NoMesh));
    }
    Ok(reader.raw.finish())
}

/// Refuses what breaks glTF's rules; `fault` makes a sentence of the reader's words.
///
/// Accessors without data are left to those who need them: the standard has them, filled with zeros.
fn check_document(
    document: &gltf::Document,
    json: &[u8],
    fault: impl Fn(String) -> MeshFault,
) -> Result<(), MeshFault> {
    let mut errors = Vec::new();
    let root = document.as_json();
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        let path = path();
        let is_blank = error == RuleError::Missing
            && path.as_str().starts_with("accessors[")
            && path.as_str().ends_with("].bufferView");
        if !is_blank {
            errors.push((path, error));
        }
    });
    if let Some((path, RuleError::IndexOutOfBounds)) = errors.first() {
        let element = path.as_str().to_owned();
        let place = format!("/{}", element.replace(['.', '['], "/").replace(']', ""));
        let values: Option<serde_json::Value> = serde_json::from_slice(json).ok();
        let index = (values.as_ref()).and_then(|v| v.pointer(&place)?.as_u64());
        if let Some(index) = index {
            return Err(MeshFault::Gltf(GltfFault::NoSuchElement { element, index }));
        }
    }
    if errors.is_empty() {
        return Ok(());
    }
    Err(fault(gltf::Error::Validation(errors).to_string()))
}

/// The JSON chunk of a binary glTF and, if there is one, the binary chunk.
fn split_chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfFault> {
    let word = |at: usize| -> Option<u32> {
        let field = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(field.try_into().ok()?))
    };
    if !bytes.starts_with(b"glTF") {
        return Err(GltfFault::Magic);
    }
    let (Some(version), Some(claimed)) = (word(4), word(8)) else {
        return Err(GltfFault::TruncatedChunk);
    };
    if version != 2 {
        return Err(GltfFault::Version { version });
    }
    let mut chunks = Vec::new();
    let mut at = GLB_HEADER_BYTES;
    while at < bytes.len() && chunks.len() < 2 {
        let length = word(at).ok_or(GltfFault::TruncatedChunk)? as usize;
        let kind = bytes.get(at + 4..at + CHUNK_HEADER_BYTES);
        let start = at + CHUNK_HEADER_BYTES;
        let data = start
            .checked_add(length)
            .and_then(|end| bytes.get(start..end));
        let (Some(kind), Some(data)) = (kind, data) else {
            return Err(GltfFault::TruncatedChunk);
        };
        chunks.push((kind, data));
        at = start + length;
    }
    if u64::from(claimed) != bytes.len() as u64 {
        return Err(GltfFault::Length {
            claimed: claimed.into(),
            found: bytes.len() as u64,
        });
    }
    match chunks[..] {
        [(CHUNK_JSON, json)] => Ok((json, None)),
        [(CHUNK_JSON, json), (kind, data)] => Ok((json, (kind == CHUNK_BIN).then_some(data))),
        _ => Err(GltfFault::Json {
            part: "chunk ",
            reason: "there is none".to_owned(),
        }),
    }
}

struct Reader<'a> {
    raw: RawMesh,
    buffers: Vec<Vec<u8>>,
    folder: &'a Path,
    /// The mesh's material for each of the document's.
    material_of: Vec<Option<u16>>,
    /// Where nodes say that they are, in double precision.
    places: Vec<Place>,
}

impl Reader<'_> {
    /// Walks the default scene, else the first one, else all nodes without a parent. A document without nodes is a library of
    /// meshes: they are taken as they are.
    fn read_scene(&mut self, document: &gltf::Document) -> Result<(), MeshFault> {
        if document.nodes().len() == 0 {
            for mesh in document.meshes() {
                self.read_mesh(&mesh, DMat4::IDENTITY)?;
            }
            return Ok(());
        }
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let roots: Vec<gltf::Node<'_>> = match &scene {
            Some(scene) => scene.nodes().collect(),
            None => {
                let mut has_parent = vec![false; document.nodes().len()];
                for child in document.nodes().flat_map(|n| n.children()) {
                    has_parent[child.index()] = true;
                }
                let roots: Vec<_> = document
                    .nodes()
                    .filter(|n| !has_parent[n.index()])
                    .collect();
                if roots.is_empty() && document.nodes().len() > 0 {
                    return Err(MeshFault::Gltf(GltfFault::NodeLoop { node: 0 }));
                }
                roots
            }
        };
        check_for_loops(document).map_err(MeshFault::Gltf)?;
        let mut is_seen = vec![false; document.nodes().len()];
        let mut open: Vec<(gltf::Node<'_>, DMat4)> = Vec::new();
        open.extend(roots.into_iter().rev().map(|n| (n, DMat4::IDENTITY)));
        while let Some((node, world_from_parent)) = open.pop() {
            if std::mem::replace(&mut is_seen[node.index()], true) {
                let node = node.index();
                return Err(MeshFault::Gltf(GltfFault::NodeLoop { node }));
            }
            let place = self.places.get(node.index()).copied().unwrap_or_default();
            let world_from_node = world_from_parent * place.refine(matrix(&node.transform()));
            if node.skin().is_some() {
                self.raw
                    .ignore("a skin was left out: the mesh is taken in its rest pose".to_owned());
            }
            if let Some(mesh) = node.mesh() {
                self.read_mesh(&mesh, world_from_node)?;
            }
            let children: Vec<gltf::Node<'_>> = node.children().collect();
            open.extend(children.into_iter().rev().map(|n| (n, world_from_node)));
        }
        Ok(())
    }

    fn read_mesh(
        &mut self,
        mesh: &gltf::Mesh<'_>,
        world_from_node: DMat4,
    ) -> Result<(), MeshFault> {
        for primitive in mesh.primitives() {
            if primitive.morph_targets().next().is_some() {
                self.raw.ignore("morph targets were left out".to_owned());
            }
            if matches!(
                primitive.mode(),
                Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
            ) {
                self.read_primitive(mesh.index(), &primitive, world_from_node)?;
            } else {
                self.raw.ignore("points and lines were left out".to_owned());
            }
        }
        Ok(())
    }

    fn read_primitive(
        &mut self,
        mesh: usize,
        primitive: &gltf::Primitive<'_>,
        world_from_node: DMat4,
    ) -> Result<(), MeshFault> {
        let Some(positions) = primitive.get(&gltf::Semantic::Positions) else {
            self.raw
                .ignore("primitives without positions were left out".to_owned());
            return Ok(());
        };
        if positions.view().is_none() && primitive.indices().is_some() {
            // There is nothing to read, but what the indices say may be worse.
            self.read_indices(mesh, primitive, positions.count())?;
        }
        let positions = Accessor::new(&positions, &self.buffers)?.with_width(3..=3)?;
        let first = self.raw.mesh.positions.len();
        let count = positions.count;
        if u32::try_from(first + count).is_err() {
            return Err(MeshFault::TooLarge);
        }
        let mut placed = Vec::with_capacity(count);
        for i in 0..count {
            let [x, y, z, _] = positions.get(i);
            let position = world_from_node.transform_point3(DVec3::new(x, y, z));
            if !position.is_finite() {
                let vertex = (first + i) as u64;
                return Err(MeshFault::NotFinite { vertex });
            }
            placed.push(position);
        }
        let indices = self.read_indices(mesh, primitive, count)?;
        let (material, uv_set) = self.material(&primitive.material())?;
        let uvs = uv_set
            .and_then(|set| primitive.get(&gltf::Semantic::TexCoords(set)))
            .map(|a| Accessor::new(&a, &self.buffers)?.with_width(2..=2))
            .transpose()?
            .map(|a| -> Vec<[f32; 2]> {
                let uv = |i| [0, 1].map(|k| finite_or(a.get(i)[k], 0.0));
                (0..a.count).map(uv).collect()
            })
            .filter(|uvs| uvs.len() >= count);
        let colours = primitive
            .get(&gltf::Semantic::Colors(0))
            .map(|a| Accessor::new(&a, &self.buffers)?.with_width(3..=4))
            .transpose()?
            .map(|a| -> Vec<[f32; 3]> {
                let colour = |i| [0, 1, 2].map(|k| finite_or(a.get(i)[k], 1.0).max(0.0));
                (0..a.count).map(colour).collect()
            })
            .filter(|colours| colours.len() >= count);
        self.raw.mesh.positions.extend(placed);
        // A mirrored node turns its faces over.
        let is_mirrored = world_from_node.determinant() < 0.0;
        for mut corners in triangles(primitive.mode(), &indices) {
            if self.raw.mesh.faces.len() >= MOST_TRIANGLES {
                return Err(MeshFault::TooLarge);
            }
            if is_mirrored {
                corners.swap(1, 2);
            }
            let uvs = uvs.as_ref().map(|all| corners.map(|v| all[v as usize]));
            let colours = colours.as_ref().map(|all| corners.map(|v| all[v as usize]));
            let look = PolygonLook {
                uvs: uvs.as_ref().map(<[_; 3]>::as_slice),
                colours: colours.as_ref().map(<[_; 3]>::as_slice),
                material,
            };
            self.raw
                .push_polygon(&corners.map(|v| v + first as u32), look);
        }
        Ok(())
    }

    /// The vertices of a primitive's faces, all of them below `count`.
    fn read_indices(
        &self,
        mesh: usize,
        primitive: &gltf::Primitive<'_>,
        count: usize,
    ) -> Result<Vec<u32>, MeshFault> {
        let indices: Vec<u32> = match primitive.indices() {
            Some(indices) => {
                let indices = Accessor::new(&indices, &self.buffers)?.with_width(1..=1)?;
                (0..indices.count)
                    .map(|i| indices.get(i)[0] as u32)
                    .collect()
            }
            None => (0..count as u32).collect(),
        };
        match indices.iter().find(|&&v| v as usize >= count) {
            None => Ok(indices),
            Some(&vertex) => Err(MeshFault::Gltf(GltfFault::IndexOutOfRange {
                mesh,
                primitive: primitive.index(),
                vertex,
                count,
            })),
        }
    }

    /// The mesh's material for one of the document's, and the set of texture coordinates it uses.
    fn material(
        &mut self,
        material: &gltf::Material<'_>,
    ) -> Result<(Option<u16>, Option<u32>), MeshFault> {
        let Some(index) = material.index() else {
            return Ok((None, None));
        };
        let surface = material.pbr_metallic_roughness();
        let texture = surface.base_color_texture();
        let uv_set = texture.as_ref().map(gltf::texture::Info::tex_coord);
        if let Some(known) = self.material_of[index] {
            return Ok((Some(known), uv_set));
        }
        if self.raw.mesh.appearance.materials.len() >= MOST_MATERIALS {
            return Ok((None, None));
        }
        let texture = texture.and_then(|info| self.image(&info.texture().source()));
        let [r, g, b, _] = surface.base_color_factor();
        let materials = &mut self.raw.mesh.appearance.materials;
        let added = materials.len() as u16;
        materials.push(Material {
            base_colour: [r, g, b].map(|c| {
                if c.is_finite() {
                    c.clamp(0.0, 1.0)
                } else {
                    1.0
                }
            }),
            texture,
        });
        self.material_of[index] = Some(added);
        Ok((Some(added), uv_set))
    }

    /// An image; one that cannot be read costs its colour only.
    fn image(&mut self, image: &gltf::Image<'_>) -> Option<ColourImage> {
        let found = match image.source() {
            gltf::image::Source::View { view, .. } => view
                .offset()
                .checked_add(view.length())
                .and_then(|end| self.buffers[view.buffer().index()].get(view.offset()..end))
                .map(<[u8]>::to_vec)
                .ok_or_else(|| "its data is not there".to_owned()),
            gltf::image::Source::Uri { uri, .. } => read_resource(uri, self.folder),
        };
        match found.and_then(|bytes| decode_image(&bytes)) {
            Ok(image) => Some(image),
            Err(reason) => {
                self.raw.ignore(format!(
                    "texture image {} cannot be read: {reason}",
                    image.index()
                ));
                None
            }
        }
    }
}

fn finite_or(value: f64, other: f32) -> f32 {
    if value.is_finite() {
        value as f32
    } else {
        other
    }
}

/// Every node has at most one parent, and is not its own descendant, in the scene or not.
fn check_for_loops(document: &gltf::Document) -> Result<(), GltfFault> {
    let count = document.nodes().len();
    let mut parent = vec![usize::MAX; count];
    for node in document.nodes() {
        for child in node.children() {
            let slot = &mut parent[child.index()];
            if *slot != usize::MAX {
                let node = child.index();
                return Err(GltfFault::NodeLoop { node });
            }
            *slot = node.index();
        }
    }
    // With one parent each, whoever is not above itself reaches a root; marks keep the walk linear.
    let mut reaches_root = vec![false; count];
    for start in 0..count {
        let (mut at, mut path) = (start, Vec::new());
        while at != usize::MAX && !reaches_root[at] {
            if path.len() > count {
                return Err(GltfFault::NodeLoop { node: start });
            }
            path.push(at);
            at = parent[at];
        }
        for node in path {
            reaches_root[node] = true;
        }
    }
    Ok(())
}

fn matrix(transform: &Transform) -> DMat4 {
    match transform {
        Transform::Matrix { matrix } => {
            DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
        }
        Transform::Decomposed {
            translation,
            rotation,
            scale,
        } => {
            let rotation: DQuat = Quat::from_array(*rotation).as_dquat();
            // A quaternion of zero length is no rotation at all.
            let length = rotation.length();
            let rotation = if length > 0.0 && length.is_finite() {
                rotation / length
            } else {
                DQuat::IDENTITY
            };
            DMat4::from_translation(DVec3::from(translation.map(f64::from)))
                * DMat4::from_quat(rotation)
                * DMat4::from_scale(DVec3::from(scale.map(f64::from)))
        }
    }
}

/// The triangles of a primitive, as indices into its vertices.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => indices
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            })
            // Strips are continued by repeating vertices.
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect(),
        Mode::TriangleFan => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [indices[0], w[0], w[1]])
            .collect(),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    }
}
