//! Materials: base colours, textures, and how texture coordinates reach them.

use std::collections::BTreeMap;

use serde::Deserialize;
use silmap_geometry::{Appearance, ColourImage, Material, TextureWrap};

use super::super::error::MeshFault;
use super::super::mtl::decode_image;
use super::super::raw::{MOST_MATERIALS, RawMesh};
use super::alpha::{AlphaMaps, Shows, whole_face};
use super::buffers::read_resource;
use super::document::{self, TextureInfo, Whole, find};
use super::scene::Scene;

/// What a primitive's faces look like.
#[derive(Clone, Debug, Default)]
pub(super) struct Look {
    /// The mesh's material.
    pub(super) material: Option<u16>,
    pub(super) mapping: Option<Mapping>,
    cut: Option<Cut>,
}

/// How a set of texture coordinates becomes coordinates of a texture.
#[derive(Clone, Debug)]
pub(super) struct Mapping {
    pub(super) set: usize,
    transform: TextureTransform,
}

/// The object of KHR_texture_transform.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct TextureTransform {
    offset: Option<[f64; 2]>,
    rotation: f64,
    scale: Option<[f64; 2]>,
    tex_coord: Option<Whole>,
}

/// Where alpha is smaller, nothing is drawn.
#[derive(Clone, Copy, Debug)]
struct Cut {
    least: f64,
    /// What the texture's alpha is multiplied by.
    factor: f64,
}

/// The object of KHR_materials_pbrSpecularGlossiness.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct SpecularGlossiness {
    diffuse_factor: Option<[f64; 4]>,
    diffuse_texture: Option<TextureInfo>,
}

/// What the object of an extension for pictures names.
#[derive(Clone, Debug, Deserialize)]
struct TextureSource {
    source: Whole,
}

/// What distinguishes two materials: picture, bits of the colour, wrapping.
type Identity = (Option<usize>, [u32; 3], [u8; 2]);

/// The materials met so far.
pub(super) struct Materials {
    looks: Vec<Option<Look>>,
    known: BTreeMap<Identity, u16>,
    alpha: AlphaMaps,
}

/// What the corners of a primitive's triangles look like; nothing, or something for each triangle.
#[derive(Default)]
pub(super) struct CornerLooks {
    /// How many triangles there are.
    pub(super) triangles: usize,
    pub(super) uvs: Vec<[[f32; 2]; 3]>,
    pub(super) colours: Vec<[[f32; 3]; 3]>,
    pub(super) alphas: Vec<[f32; 3]>,
}

impl Mapping {
    /// KHR_texture_transform: scaled, turned against the clock about the origin (v goes down), moved.
    pub(super) fn uv(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let transform = &self.transform;
        let [su, sv] = transform.scale.unwrap_or([1.0; 2]);
        let [ou, ov] = transform.offset.unwrap_or([0.0; 2]);
        let (sin, cos) = if transform.rotation == 0.0 {
            (0.0, 1.0)
        } else {
            transform.rotation.sin_cos()
        };
        let (u, v) = (u * su, v * sv);
        [cos * u + sin * v + ou, cos * v - sin * u + ov]
    }
}

impl Look {
    /// Whether it matters how opaque vertex colours are.
    pub(super) fn has_alpha(&self) -> bool {
        self.cut.is_some()
    }

    /// How much of each triangle shows; empty where all do, wholly.
    pub(super) fn what_shows(
        &self,
        materials: &mut Materials,
        appearance: &Appearance,
        corners: &CornerLooks,
    ) -> Vec<Shows> {
        let Some(cut) = self.cut else {
            return Vec::new();
        };
        let material = self.material.map(usize::from);
        let material = material.and_then(|m| appearance.materials.get(m));
        let texture = material.and_then(|m| Some((m.texture.as_ref()?, m.wrap)));
        let shows = (0..corners.triangles).map(|t| {
            let alphas = corners.alphas.get(t).copied().unwrap_or([1.0; 3]);
            let alphas = alphas.map(|alpha| f64::from(alpha) * cut.factor);
            match (texture, corners.uvs.get(t), self.material) {
                (Some((image, wrap)), Some(uvs), Some(material)) => {
                    materials
                        .alpha
                        .face((material, image, wrap), uvs, alphas, cut.least)
                }
                _ => whole_face(alphas, cut.least),
            }
        });
        let shows: Vec<Shows> = shows.collect();
        if shows.iter().all(|&s| s == Shows::Whole) {
            Vec::new()
        } else {
            shows
        }
    }
}

impl Materials {
    pub(super) fn new(count: usize) -> Self {
        Self {
            looks: vec![None; count],
            known: BTreeMap::new(),
            alpha: AlphaMaps::default(),
        }
    }

    /// The look of faces with one of the document's materials.
    pub(super) fn look(
        &mut self,
        scene: &Scene<'_>,
        index: Option<Whole>,
        raw: &mut RawMesh,
    ) -> Result<Look, MeshFault> {
        let Some(index) = index else {
            return Ok(Look::default());
        };
        let path = || "a primitive's material".to_owned();
        let material = find(&scene.document.materials, index, path).map_err(MeshFault::Gltf)?;
        if let Some(known) = &self.looks[index.0] {
            return Ok(known.clone());
        }
        let look = self.read(scene, index, material, raw)?;
        self.looks[index.0] = Some(look.clone());
        Ok(look)
    }

    fn read(
        &mut self,
        scene: &Scene<'_>,
        index: Whole,
        material: &document::Material,
        raw: &mut RawMesh,
    ) -> Result<Look, MeshFault> {
        let surface = &material.pbr_metallic_roughness;
        let older: Option<SpecularGlossiness> = material
            .extensions
            .get("KHR_materials_pbrSpecularGlossiness")
            .map_err(MeshFault::Gltf)?;
        let (factor, info) = match older {
            Some(older) => (older.diffuse_factor, older.diffuse_texture),
            None => (
                surface.base_color_factor,
                surface.base_color_texture.clone(),
            ),
        };
        let factor = factor.unwrap_or([1.0; 4]).map(|c| {
            if c.is_finite() {
                c.clamp(0.0, 1.0)
            } else {
                1.0
            }
        });
        let mapping = info.as_ref().map(mapping).transpose()?;
        let (source, wrap) = match &info {
            Some(info) => source(scene, index, info, raw)?,
            None => (None, Default::default()),
        };
        let base_colour = [factor[0], factor[1], factor[2]].map(|c| c as f32);
        let identity = (
            source.map(|s| s.0),
            base_colour.map(f32::to_bits),
            wrap.map(|w: TextureWrap| w as u8),
        );
        let found = match self.known.get(&identity) {
            Some(&known) => Some(known),
            None if raw.mesh.appearance.materials.len() >= MOST_MATERIALS => None,
            None => {
                let texture = match source {
                    Some(source) => image(scene, source, raw)?,
                    None => None,
                };
                let materials = &mut raw.mesh.appearance.materials;
                let added = materials.len() as u16;
                materials.push(Material {
                    base_colour,
                    texture,
                    wrap,
                });
                self.known.insert(identity, added);
                Some(added)
            }
        };
        let cut = match material.alpha_mode.as_deref() {
            Some("MASK") => Some(Cut {
                least: material.alpha_cutoff.unwrap_or(0.5),
                factor: factor[3],
            }),
            Some("BLEND") => {
                let materials = &raw.mesh.appearance.materials;
                let texture = found.and_then(|m| materials[usize::from(m)].texture.as_ref());
                let is_clear = |image: &ColourImage| image.rgba.chunks_exact(4).any(|p| p[3] < 255);
                if factor[3] < 1.0 || texture.is_some_and(is_clear) {
                    raw.ignore(
                        "transparent materials (alphaMode BLEND) are drawn opaque".to_owned(),
                    );
                }
                None
            }
            _ => None,
        };
        Ok(Look {
            material: found,
            mapping,
            cut,
        })
    }
}

fn mapping(info: &TextureInfo) -> Result<Mapping, MeshFault> {
    let transform: Option<TextureTransform> = info
        .extensions
        .get("KHR_texture_transform")
        .map_err(MeshFault::Gltf)?;
    let transform = transform.unwrap_or_default();
    Ok(Mapping {
        set: transform.tex_coord.unwrap_or(info.tex_coord).0,
        transform,
    })
}

/// The picture of a texture, and what is around it.
fn source(
    scene: &Scene<'_>,
    material: Whole,
    info: &TextureInfo,
    raw: &mut RawMesh,
) -> Result<(Option<Whole>, [TextureWrap; 2]), MeshFault> {
    let document = scene.document;
    let path = || format!("materials[{}]'s base colour texture", material.0);
    let texture = find(&document.textures, info.index, path).map_err(MeshFault::Gltf)?;
    let webp: Option<TextureSource> =
        (texture.extensions.get("EXT_texture_webp")).map_err(MeshFault::Gltf)?;
    let source = webp.map(|webp| webp.source).or(texture.source);
    if source.is_none() {
        raw.ignore(format!(
            "texture {} names no image that is read here",
            info.index.0
        ));
    }
    let wrap = match texture.sampler {
        None => Default::default(),
        Some(index) => {
            let path = || format!("textures[{}].sampler", info.index.0);
            let sampler = find(&document.samplers, index, path).map_err(MeshFault::Gltf)?;
            [sampler.wrap_s, sampler.wrap_t].map(|code| match code {
                Some(Whole(33_071)) => TextureWrap::ClampToEdge,
                Some(Whole(33_648)) => TextureWrap::MirroredRepeat,
                _ => TextureWrap::Repeat,
            })
        }
    };
    Ok((source, wrap))
}

/// An image; one that cannot be read costs its colour only.
fn image(
    scene: &Scene<'_>,
    index: Whole,
    raw: &mut RawMesh,
) -> Result<Option<ColourImage>, MeshFault> {
    let path = || "a texture's image".to_owned();
    let image = find(&scene.document.images, index, path).map_err(MeshFault::Gltf)?;
    let found = match (image.buffer_view, &image.uri) {
        (Some(view), _) => scene
            .buffers
            .view(view, || format!("images[{}].bufferView", index.0))
            .map(|view| view.bytes.to_vec())
            .map_err(|fault| fault.to_string()),
        (None, Some(uri)) => read_resource(uri, scene.folder),
        (None, None) => Err("it names no data".to_owned()),
    };
    match found.and_then(|bytes| decode_image(&bytes)) {
        Ok(image) => Ok(Some(image)),
        Err(reason) => {
            raw.ignore(format!(
                "texture image {} cannot be read: {reason}",
                index.0
            ));
            Ok(None)
        }
    }
}
