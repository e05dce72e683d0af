//! What an asset records of how it was built.

use silmap_geometry::{CoverageRule, TriangleMesh};
use silmap_map::BuildRecord;
use silmap_mesh_io::{AlphaUse, LoadOptions};

use crate::build_params::BuildParams;
use crate::capture::Backend;
use crate::recipe::Recipe;
use crate::simplify_map::SimplifyMapReport;
use crate::texture::TextureParams;

pub(crate) fn record(
    model: &TriangleMesh,
    name: &str,
    (params, views): (&BuildParams, u32),
    map: &SimplifyMapReport,
) -> BuildRecord {
    BuildRecord {
        name: name.to_owned(),
        model_faces: model.faces.len() as u64,
        model_vertices: model.positions.len() as u64,
        model_crc32: model_crc32(model),
        captured_views: views,
        error_curve: map.curve.clone(),
        uniform_curve: Vec::new(),
        order: Some(map.order.clone()),
        generator: concat!("silmap ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: options_text(params),
        params: Recipe::of(params).to_value(),
    }
}

/// The options as they would be typed.
pub(crate) fn options_text(params: &BuildParams) -> String {
    let goal = match params.map.max_error {
        Some(share) => format!("--max-error {}%", 100.0 * share),
        None => format!("--keep {}", params.map.keep),
    };
    let coverage = match params.capture.coverage {
        CoverageRule::Center => "center",
        CoverageRule::Any => "any",
    };
    let cavities = match params.keep_cavities {
        true => " --keep-cavities",
        false => "",
    };
    // What it stands for is told too, and wins.
    let height =
        (params.for_height_px).map_or_else(String::new, |px| format!(" --for-height {px}"));
    format!(
        "--views {} {goal} --method {} --resolution {} --tolerance {} --parts {} --coverage {coverage} --radius {}R --faces {} \
         --texture-views {} --texture-size {} {} --backend {}{}{cavities}{height}",
        params.views,
        params.map.method.name(),
        params.resolution_px,
        params.tolerance_px,
        params.parts.most,
        params.view_radius_rel,
        params.hull.target_faces,
        params.textures.views,
        params.textures.size_px,
        picture_options(&params.textures),
        match Recipe::of(params).build.capture.backend {
            Backend::Gpu => "gpu",
            Backend::Auto | Backend::Cpu => "cpu",
        },
        mending_options(&params.load),
    )
}

fn mending_options(load: &LoadOptions) -> String {
    let options = [
        (load.close_holes, " --close-holes"),
        (load.repair, " --repair"),
    ];
    let given = options.iter().filter(|(is_given, _)| *is_given);
    let mut text: String = given.map(|&(_, option)| option).collect();
    if load.alpha == AlphaUse::Mask {
        text.push_str(" --alpha mask");
    }
    if let Some(distance) = load.weld {
        text.push_str(&format!(" --weld {distance}"));
    }
    text
}

fn picture_options(textures: &TextureParams) -> String {
    let mut text = format!(
        "--texture-format {} --texture-quality {} --atlas-size {} --tiles {} --parametrisation {}",
        textures.format.name(),
        textures.quality,
        textures.atlas_px,
        textures.tiles.name(),
        textures.parametrisation.name(),
    );
    if let Some(bytes) = textures.budget_bytes {
        text.push_str(&format!(" --texture-bytes {bytes}"));
    }
    if !textures.normals {
        text.push_str(" --no-normals");
    }
    // Assets without are told as they were before there was relief.
    if textures.relief_px > 0 {
        let (side, bits) = (textures.relief_px, textures.relief_bits);
        text.push_str(&format!(" --relief {side} --relief-bits {bits}"));
    }
    text
}

/// CRC-32 of a mesh's vertex positions and faces, little-endian: whether an asset was made from this mesh.
#[must_use]
pub fn model_crc32(mesh: &TriangleMesh) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for position in &mesh.positions {
        for coordinate in position.to_array() {
            hasher.update(&coordinate.to_le_bytes());
        }
    }
    for face in &mesh.faces {
        for vertex in face {
            hasher.update(&vertex.to_le_bytes());
        }
    }
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use silmap_models as models;

    #[test]
    fn the_checksum_sees_positions_and_faces() {
        let mesh = models::torus(600);
        let (mut moved, mut turned) = (mesh.clone(), mesh.clone());
        moved.positions[7].x += 1e-9;
        turned.faces[3].rotate_left(1);
        let all = [&mesh, &moved, &turned].map(model_crc32);
        assert!(all[0] != all[1] && all[0] != all[2] && all[1] != all[2]);
    }
}
