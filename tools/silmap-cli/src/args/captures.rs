//! Options of `build` for captures, and of commands that compare with a capture's masks.

use std::path::PathBuf;

use clap::Args;
use silmap_capture::{MaskOptions, MaskRule};

/// What masks are compared with, where a camera of a capture is looked through: as `build` has it.
#[derive(Clone, Debug, Args)]
pub(crate) struct MaskArgs {
    /// Black is the object in mask files, and white the background
    #[arg(long, requires = "camera")]
    pub(crate) mask_inverted: bool,
    /// Make masks of photographs that have none and a plain background, by a rule as of `build`
    #[arg(long, value_name = "RULE", requires = "camera")]
    pub(crate) mask_rule: Option<MaskRule>,
}

impl MaskArgs {
    /// As the library has them.
    pub(crate) fn options(&self) -> MaskOptions {
        MaskOptions {
            is_inverted: self.mask_inverted,
            rule: self.mask_rule,
        }
    }
}

/// How a capture is carved.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub(crate) struct CarveArgs {
    /// Print what was understood of a capture and how well its masks agree with each other, and build nothing
    #[arg(long, help_heading = "Captures", conflicts_with_all = ["from", "manifest", "params_from", "out", "uniform_curve"])]
    pub(crate) check: bool,
    /// Voxels along the longest side of the object; the surface lies between them to a part of a voxel [default: 160]
    #[arg(long, help_heading = "Captures", value_name = "N", conflicts_with_all = ["from", "manifest"], value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub(crate) voxels: Option<u32>,
    /// So many views may see a point beside their mask, and it is kept all the same [default: as many as the masks need, at most a
    /// twelfth of the views, none of fewer than 12]
    #[arg(long, help_heading = "Captures", value_name = "N", conflicts_with_all = ["from", "manifest"])]
    pub(crate) outvoted: Option<u32>,
    /// Take no colours from the photographs: the hull is lit instead
    #[arg(long, help_heading = "Captures", conflicts_with_all = ["from", "manifest"])]
    pub(crate) no_photographs: bool,
    /// Black is the object in mask files, and white the background
    #[arg(long, help_heading = "Captures", conflicts_with_all = ["from", "manifest"])]
    pub(crate) mask_inverted: bool,
    /// Make masks of photographs that have none and a plain background: the object's brightest channel is above T (`lighter:T`), its
    /// darkest below (`darker:T`), its colour farther than T from one (`unlike:R,G,B:T`), or it is unlike the colour along the border
    /// (`auto`); values from 0 to 255. Small pieces are left out, small holes filled
    #[arg(long, help_heading = "Captures", value_name = "RULE", conflicts_with_all = ["from", "manifest"])]
    pub(crate) mask_rule: Option<MaskRule>,
    /// Write a page (HTML, all in one file): the cameras around the hull, what was understood, and the hull beside each mask, worst first.
    /// With `--check` or without; it is written as soon as the hull is carved
    #[arg(long, help_heading = "Captures", value_name = "PAGE.html", conflicts_with_all = ["from", "manifest"])]
    pub(crate) page: Option<PathBuf>,
    /// Write the carved hull itself as a mesh (.ply, .obj, .off, .stl or .glb), in the frame of the cameras: `report`, `evaluate`, `hull`
    /// and `simplify` take it as they take other meshes. Coloured by the photographs; with `--check` without colours
    #[arg(long, help_heading = "Captures", value_name = "MESH", conflicts_with_all = ["from", "manifest"])]
    pub(crate) carved: Option<PathBuf>,
}

impl CarveArgs {
    /// How masks are read.
    pub(crate) fn masks(&self) -> MaskOptions {
        MaskOptions {
            is_inverted: self.mask_inverted,
            rule: self.mask_rule,
        }
    }
}
