//! `silmap render`: one picture of an asset, or of a model alone; or many, of a turn around it.

mod drawer;
mod orbit;

use std::path::Path;

use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_capture::MaskOptions;
use silmap_exact::FanReport;
use silmap_study::{Antialias, Background, EdgeStyle, Mode, Paint};

use crate::args::{AntialiasArg, ModeArg, PaintArg, RenderArgs, usage_error};
use crate::camera::PictureCamera;
use crate::captured_camera;
use crate::names::PictureKind;
use crate::output::{self, OutputFile};
use crate::photograph::{Photograph, Shown};
use crate::pictures::encode_picture;
use crate::values::Backdrop;

use drawer::{Drawer, Inputs};

#[derive(Serialize)]
struct Rendered<'a> {
    out: &'a Path,
    width: u32,
    height: u32,
    /// The graphics adapter and the interface it is driven through.
    adapter: String,
    /// In mode `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    fans: Option<FansJson>,
    /// The view of the capture that it is drawn for.
    #[serde(skip_serializing_if = "Option::is_none")]
    view: Option<&'a str>,
    /// Of what is drawn with the view's mask: intersection over union. With --photograph, where there is a mask.
    #[serde(skip_serializing_if = "Option::is_none")]
    overlap: Option<f64>,
}

/// What the stencil was filled with.
#[derive(Clone, Copy, Debug, Serialize)]
struct FansJson {
    loops: usize,
    loops_decomposed: usize,
    /// Pixels that fans about the loops' centroids pass over, before and after long loops were cut.
    fan_area: f64,
    fan_area_decomposed: f64,
}

impl From<&FanReport> for FansJson {
    fn from(fans: &FanReport) -> Self {
        Self {
            loops: fans.loops_before,
            loops_decomposed: fans.loops_after,
            fan_area: fans.area_before_px,
            fan_area_decomposed: fans.area_after_px,
        }
    }
}

impl ModeArg {
    /// Whether the picture depends on the full mesh.
    fn needs_model(self) -> bool {
        self == Self::Exact || Mode::from(self).needs_model()
    }

    /// Whether it depends on the asset.
    fn needs_asset(self) -> bool {
        !matches!(Mode::from(self), Mode::Original | Mode::Edges(_))
    }
}

/// Ends the program when options do not go together.
fn check_usage(args: &RenderArgs) {
    if args.mode.needs_model() && args.model.is_none() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "this --mode needs the full mesh: add --model MODEL",
        );
    }
    if args.mode.needs_asset() && args.asset.is_none() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "this --mode shows an asset: name one, or choose original or edges-*",
        );
    }
    if args.shadow.is_some() && !Mode::from(args.mode).casts_shadow() {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--shadow is for the modes coarse, textured and clipped",
        );
    }
    if let Some(light) = args.light {
        check_light(light, args.mode);
    }
    if args.photograph.is_some() && args.camera.captured.camera.is_none() {
        captured_camera::without_camera("--photograph <WHERE>");
    }
    if args.photograph.is_none() && args.masks.options() != MaskOptions::default() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "'--mask-inverted' and '--mask-rule <RULE>' are of use with '--photograph <WHERE>' only",
        );
    }
    if args.shadow.is_none() {
        captured_camera::refuse_up(&args.camera);
    }
    if args.soup && !matches!(Mode::from(args.mode), Mode::Edges(_)) {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--soup is for the modes edges-*",
        );
    }
}

/// Ends the program when a light is no direction, or nothing is lit.
fn check_light(light: DVec3, mode: ModeArg) {
    if !light.is_finite() || light == DVec3::ZERO {
        usage_error(
            ErrorKind::ValueValidation,
            "--light is the direction to a light: three finite numbers, not all zero",
        );
    }
    let mode = Mode::from(mode);
    if !mode.shows_hull() && mode != Mode::Original {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--light is for the modes original, coarse, textured, clipped and exact",
        );
    }
}

/// Refuses what a kind of file cannot have behind the model.
fn check_backdrop(args: &RenderArgs, kind: PictureKind) -> anyhow::Result<()> {
    anyhow::ensure!(
        kind != PictureKind::Jpeg || args.background != Backdrop::Transparent,
        "{}: a JPEG file has no transparency: write a .png or .webp file, or choose a colour as --background",
        args.out.display()
    );
    Ok(())
}

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    check_usage(args);
    if let Some(frames) = args.turn.orbit {
        return orbit::run(args, frames);
    }
    let kind = PictureKind::of(&args.out)?;
    check_backdrop(args, kind)?;
    let file = OutputFile::check(&args.out)?;
    for input in [&args.asset, &args.model].into_iter().flatten() {
        file.refuse_to_replace(input);
    }
    // Before the device, which is not needed to say what is wrong with them.
    let inputs = Inputs::read(args)?;
    let seen = PictureCamera::from_args(&args.camera, &inputs.scene()?)?;
    if let Some(captured) = &seen.captured {
        captured.refuse_to_be_replaced_by(&file);
    }
    let photograph = match (args.photograph, &seen.captured) {
        (Some(place), Some(captured)) => {
            Some((place, Photograph::read(captured, args.masks.options())?))
        }
        _ => None,
    };
    let background = match &photograph {
        // What is behind comes later.
        Some(_) => Background::Transparent,
        None => args.background.into(),
    };
    let mut drawer = Drawer::open(&inputs)?;
    let (picture, fans) = drawer.draw(seen.camera, background)?;
    let background = match args.background.rgb().filter(|_| photograph.is_none()) {
        Some([r, g, b]) => [r, g, b, 255],
        None => [0; 4],
    };
    let picture = seen.picture(picture, background);
    let Shown { picture, overlap } = match &photograph {
        Some((place, photograph)) => photograph.with(&picture, *place, args.background.rgb())?,
        None => Shown {
            picture,
            overlap: None,
        },
    };
    file.write(&encode_picture(&picture, kind)?)?;
    if args.output.json {
        return output::print_json(&Rendered {
            out: &args.out,
            width: picture.width,
            height: picture.height,
            adapter: drawer.adapter_name(),
            fans,
            view: seen.captured.as_ref().map(|c| c.view.name.as_str()),
            overlap,
        });
    }
    let overlap = overlap.map_or_else(String::new, |o| format!(", overlaps the mask by {o:.4}"));
    output::say(&format!(
        "{}: drawn by {}{overlap}",
        args.out.display(),
        drawer.adapter_name()
    ));
    Ok(())
}

impl From<ModeArg> for Mode {
    fn from(mode: ModeArg) -> Self {
        match mode {
            ModeArg::Original => Self::Original,
            ModeArg::Coarse => Self::Coarse,
            ModeArg::Textured => Self::Textured,
            ModeArg::Clipped => Self::Clipped,
            ModeArg::Exact => Self::Exact,
            ModeArg::Silhouette => Self::Silhouette,
            ModeArg::Difference => Self::Difference,
            ModeArg::EdgesEqual => Self::Edges(EdgeStyle::Equal),
            ModeArg::EdgesWireframe => Self::Edges(EdgeStyle::Wireframe),
            ModeArg::EdgesTranslate => Self::Edges(EdgeStyle::Translate),
            ModeArg::EdgesFatten => Self::Edges(EdgeStyle::Fatten),
            ModeArg::EdgesCharcoal => Self::Edges(EdgeStyle::Charcoal),
        }
    }
}

impl From<PaintArg> for Paint {
    fn from(paint: PaintArg) -> Self {
        match paint {
            PaintArg::Relief => Self::Relief,
            PaintArg::Blended => Self::Blended,
            PaintArg::Nearest => Self::Nearest,
            PaintArg::Views => Self::Views,
            PaintArg::Tiles => Self::Tiles,
        }
    }
}

impl From<AntialiasArg> for Antialias {
    fn from(antialias: AntialiasArg) -> Self {
        match antialias {
            AntialiasArg::None => Self::None,
            AntialiasArg::Soft => Self::Soft,
            AntialiasArg::Msaa => Self::Msaa,
        }
    }
}

impl Backdrop {
    /// Its colour, if it has one.
    fn rgb(self) -> Option<[u8; 3]> {
        match self {
            Self::Transparent => None,
            Self::Colour(rgb) => Some(rgb),
        }
    }
}

impl From<Backdrop> for Background {
    fn from(backdrop: Backdrop) -> Self {
        match backdrop {
            Backdrop::Transparent => Self::Transparent,
            Backdrop::Colour(rgb) => Self::Colour(rgb),
        }
    }
}
