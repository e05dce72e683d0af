//! `silmap render`: one picture of an asset.

use std::path::Path;

use anyhow::Context;
use clap::error::ErrorKind;
use serde::Serialize;
use silmap_runtime::{Antialias, Background, FrameParams, Mode, Paint, Renderer, RendererOptions};

use crate::args::{AntialiasArg, MethodArg, ModeArg, PaintArg, RenderArgs, usage_error};
use crate::camera::camera_from_args;
use crate::commands::open_gpu;
use crate::files::{load_model_of, read_asset};
use crate::output::{self, OutputFile};
use crate::pictures::encode_png;
use crate::values::Backdrop;

#[derive(Serialize)]
struct Rendered<'a> {
    out: &'a Path,
    width: u32,
    height: u32,
    /// The graphics adapter and the interface it is driven through.
    adapter: String,
}

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let mode = Mode::from(args.mode);
    if mode.needs_model() && args.model.is_none() {
        usage_error(
            ErrorKind::MissingRequiredArgument,
            "this --mode shows the full mesh: add --model MODEL",
        );
    }
    let file = OutputFile::check(&args.out)?;
    let (asset, _) = read_asset(&args.asset)?;
    let camera = camera_from_args(&args.camera, asset.map.center, asset.map.radius)?;
    // Before the device, which is not needed to say what is wrong with it.
    let model = match args.model.as_deref().filter(|_| mode.needs_model()) {
        Some(path) => Some((path, load_model_of(&asset, path, args.mending)?)),
        None => None,
    };
    let gpu = open_gpu()?;
    let named = || args.asset.display().to_string();
    let mut renderer = Renderer::new(&gpu, RendererOptions::default());
    renderer.load_asset(&gpu, &asset).with_context(named)?;
    if let Some((path, model)) = model {
        renderer
            .load_model(&gpu, model.mesh.mesh())
            .with_context(|| path.display().to_string())?;
    }
    let picture = renderer
        .render(
            &gpu,
            &FrameParams {
                camera,
                mode,
                method: MethodArg::resolve(args.method, &asset.map),
                paint: args.paint.into(),
                antialias: args.antialias.into(),
                background: args.background.into(),
            },
        )
        .with_context(named)?;
    file.write(&encode_png(&picture)?)?;
    if args.output.json {
        return output::print_json(&Rendered {
            out: &args.out,
            width: picture.width,
            height: picture.height,
            adapter: gpu.adapter_name(),
        });
    }
    output::say(&format!(
        "{}: drawn by {}",
        args.out.display(),
        gpu.adapter_name()
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
            ModeArg::Silhouette => Self::Silhouette,
            ModeArg::Difference => Self::Difference,
        }
    }
}

impl From<PaintArg> for Paint {
    fn from(paint: PaintArg) -> Self {
        match paint {
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

impl From<Backdrop> for Background {
    fn from(backdrop: Backdrop) -> Self {
        match backdrop {
            Backdrop::Transparent => Self::Transparent,
            Backdrop::Colour(rgb) => Self::Colour(rgb),
        }
    }
}
