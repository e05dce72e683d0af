//! The params of a build.

use serde::{Deserialize, Serialize};
use silmap_hull::{HullParams, Tightening};
use silmap_mesh_io::LoadOptions;

use crate::capture::CaptureParams;
use crate::parts::PartParams;
use crate::simplify_contour::SimplifyContourParams;
use crate::simplify_map::SimplifyMapParams;
use crate::texture::TextureParams;

/// How an asset is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildParams {
    /// How the mesh was read and mended before; the build itself only notes it in the asset.
    pub load: LoadOptions,
    /// The height on the screen that the params were chosen for, pixels, where they were; see [`BuildParams::for_height`]. The build only
    /// notes it in the asset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub for_height_px: Option<u32>,
    /// Views captured around the model; the paper's thousand, evenly spread.
    pub views: u32,
    /// Radius of the view sphere as a multiple of the bounding sphere's.
    pub view_radius_rel: f64,
    /// Side of the square capture images, pixels.
    pub resolution_px: u32,
    /// Which backend draws the captured views, and which pixels they count as covered.
    pub capture: CaptureParams,
    /// How far a contour may move when it is simplified, pixels.
    pub tolerance_px: f64,
    /// The parts that silhouettes are interpolated by.
    // Recipes of earlier versions leave models whole.
    #[serde(default = "PartParams::whole")]
    pub parts: PartParams,
    /// Which views are kept.
    pub map: SimplifyMapParams,
    /// Whether parts that no eye outside can see are captured and enclosed like the others, rather than left out.
    pub keep_cavities: bool,
    /// The coarse hull.
    pub hull: HullParams,
    /// How much work goes into making it tighter than its collapses leave it.
    pub tightening: Tightening,
    /// What it is painted with.
    pub textures: TextureParams,
}

impl Default for BuildParams {
    fn default() -> Self {
        Self {
            load: LoadOptions::default(),
            for_height_px: None,
            views: 1024,
            view_radius_rel: 3.0,
            resolution_px: 512,
            capture: CaptureParams::default(),
            tolerance_px: SimplifyContourParams::default().tolerance_px,
            parts: PartParams::default(),
            map: SimplifyMapParams::default(),
            keep_cavities: false,
            hull: HullParams::default(),
            tightening: Tightening::Fast,
            textures: TextureParams::default(),
        }
    }
}
