//! Which extensions are read, which may be left out, and what else a user can do.

use super::super::error::GltfFault;
use super::super::raw::RawMesh;
use super::document::Document;

/// What becomes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reading {
    /// Read, or of no consequence for a shape and its colours: not worth a word.
    Whole,
    /// Left out even where it is required: it changes neither the shape nor the base colour.
    Shading,
    /// Left out where it is optional.
    None,
}

fn reading(name: &str) -> Reading {
    match name {
        "KHR_mesh_quantization"
        | "KHR_texture_transform"
        | "KHR_draco_mesh_compression"
        | "EXT_mesh_gpu_instancing"
        | "EXT_meshopt_compression"
        | "KHR_meshopt_compression"
        | "EXT_texture_webp"
        | "KHR_materials_pbrSpecularGlossiness"
        | "KHR_node_visibility" => Reading::Whole,
        // What the file is about, who made it, what its features are called.
        "KHR_xmp"
        | "KHR_xmp_json_ld"
        | "EXT_mesh_features"
        | "EXT_instance_features"
        | "EXT_feature_metadata"
        | "EXT_structural_metadata"
        | "FB_ngon_encoding"
        | "AGI_stk_metadata"
        | "KHR_node_selectability"
        | "KHR_node_hoverability" => Reading::Whole,
        "EXT_lights_ies"
        | "EXT_lights_image_based"
        | "KHR_lights_punctual"
        | "KHR_animation_pointer"
        | "CESIUM_primitive_outline" => Reading::Shading,
        _ if name.starts_with("KHR_materials_") || name.starts_with("EXT_materials_") => {
            Reading::Shading
        }
        _ => Reading::None,
    }
}

/// How a public tool takes an extension out of a file, as the end of a sentence.
fn way_out(name: &str) -> &'static str {
    match name {
        "KHR_texture_basisu" => {
            " (where Khronos' KTX-Software is installed, `npx @gltf-transform/cli@4 ktxdecompress IN.glb OUT.glb` turns its textures into PNG)"
        }
        _ => "",
    }
}

/// Refuses a document that needs what is not read here, and names what else is left out, each once.
pub(super) fn check(document: &Document, raw: &mut RawMesh) -> Result<(), GltfFault> {
    for name in &document.extensions_required {
        if reading(name) == Reading::None {
            return Err(GltfFault::NeedsExtension {
                name: name.clone(),
                way_out: way_out(name),
            });
        }
    }
    let required = document.extensions_required.iter();
    for name in document.extensions_used.iter().chain(required) {
        match reading(name) {
            Reading::Whole => (),
            Reading::Shading => raw.ignore(format!(
                "extension {} was left out: it changes shading, not the shape or its base colour",
                super::super::error::excerpt(name)
            )),
            Reading::None => raw.ignore(format!(
                "extension {} is not read here and was left out",
                super::super::error::excerpt(name)
            )),
        }
    }
    Ok(())
}
