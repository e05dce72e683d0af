//! `silmap render`: one picture of an asset, or of a model alone.

use std::path::Path;

use anyhow::Context;
use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_capture::MaskOptions;
use silmap_exact::{FanReport, silhouette_edges};
use silmap_geometry::TriangleMesh;
use silmap_gpu::{Gpu, GpuError};
use silmap_map::{Asset, Method};
use silmap_measure::ExactShape;
use silmap_mesh_io::{self as mesh_io, LoadedTriangles};
use silmap_study::{
    Antialias, Background, EdgeParams, EdgeStyle, FrameParams, Mode, Paint, PictureOptions,
    PictureRenderer, RenderError, ShadowParams,
};

use crate::args::{AntialiasArg, MethodArg, ModeArg, PaintArg, RenderArgs, usage_error};
use crate::camera::PictureCamera;
use crate::captured_camera;
use crate::commands::open_gpu;
use crate::files::{load_model, load_model_of, read_asset};
use crate::interrupt;
use crate::names::PictureKind;
use crate::output::{self, OutputFile};
use crate::photograph::{Photograph, Shown};
use crate::pictures::encode_picture;
use crate::scene::Scene;
use crate::values::Backdrop;

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

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    check_usage(args);
    let kind = PictureKind::of(&args.out)?;
    anyhow::ensure!(
        kind != PictureKind::Jpeg || args.background != Backdrop::Transparent,
        "{}: a JPEG file has no transparency: write a .png or .webp file, or choose a colour as --background",
        args.out.display()
    );
    let file = OutputFile::check(&args.out)?;
    for input in [&args.asset, &args.model].into_iter().flatten() {
        file.refuse_to_replace(input);
    }
    let asset = args.asset.as_deref().map(read_asset).transpose()?;
    let asset = asset.map(|(asset, _)| asset);
    // Before the device, which is not needed to say what is wrong with it.
    let model = match args.model.as_deref().filter(|_| args.mode.needs_model()) {
        Some(path) => Some((path, read_model(args, path, asset.as_ref())?)),
        None => None,
    };
    let seen = camera(
        args,
        asset.as_ref(),
        model.as_ref().map(|(_, placed)| placed),
    )?;
    if let Some(captured) = &seen.captured {
        captured.refuse_to_be_replaced_by(&file);
    }
    let photograph = match (args.photograph, &seen.captured) {
        (Some(place), Some(captured)) => {
            Some((place, Photograph::read(captured, args.masks.options())?))
        }
        _ => None,
    };
    let params = FrameParams {
        camera: seen.camera,
        mode: args.mode.into(),
        method: asset.as_ref().map_or(Method::default(), |asset| {
            MethodArg::resolve(args.interpolation.method, &asset.map)
        }),
        paint: args.paint.into(),
        antialias: args.antialias.into(),
        background: match &photograph {
            // What is behind comes later.
            Some(_) => Background::Transparent,
            None => args.background.into(),
        },
        edges: EdgeParams {
            width_px: args.width as f32,
            by_item_buffer: args.soup,
        },
        light: args.light,
        shadow: args.shadow.map(|to_light| ShadowParams {
            to_light,
            up: args.camera.up.unwrap_or(DVec3::Y),
        }),
    };
    let model = model.map(|(path, (mesh, _))| (path, mesh));
    let exact = match &model {
        Some((path, mesh)) if params.mode == Mode::Exact => {
            Some(exact_shape(mesh, &params).with_context(|| path.display().to_string())?)
        }
        _ => None,
    };
    let gpu = open_gpu()?;
    let mut renderer = PictureRenderer::new(
        &gpu,
        PictureOptions {
            relight: args.light.is_some(),
            ..PictureOptions::default()
        },
    );
    let named = || {
        let input = args.asset.as_deref().or(args.model.as_deref());
        input.unwrap_or(Path::new("")).display().to_string()
    };
    if let Some(asset) = &asset {
        renderer.load_asset(&gpu, asset).with_context(named)?;
    }
    if let Some((path, mesh)) = &model {
        match params.mode {
            Mode::Edges(_) => renderer.load_edge_model(&gpu, mesh),
            mode if mode.needs_model() => renderer.load_model(&gpu, mesh),
            _ => Ok(()),
        }
        .with_context(|| path.display().to_string())?;
    }
    let picture = match &exact {
        Some(shape) => renderer.render_shape(&gpu, &params, &shape.clip_shape()),
        None => renderer.render(&gpu, &params),
    }
    .map_err(|error| name_limit(error, &gpu));
    let picture = picture.map_err(|error| {
        if let Some(RenderError::NotRelit) = error.downcast_ref() {
            return anyhow::anyhow!(
                "{}: --light needs the model's normals and colours in a known light: it was built with --relief off and --no-normals, or its pictures are photographs",
                named()
            );
        }
        let of_light =
            |e: &RenderError| matches!(e, RenderError::Light(_) | RenderError::LightBelowGround);
        let is_of_light = error.downcast_ref().is_some_and(of_light);
        error.context(if is_of_light {
            "--shadow".to_owned()
        } else {
            named()
        })
    })?;
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
            adapter: gpu.adapter_name(),
            fans: exact.as_ref().map(|shape| shape.fans().into()),
            view: seen.captured.as_ref().map(|c| c.view.name.as_str()),
            overlap,
        });
    }
    let overlap = overlap.map_or_else(String::new, |o| format!(", overlaps the mask by {o:.4}"));
    output::say(&format!(
        "{}: drawn by {}{overlap}",
        args.out.display(),
        gpu.adapter_name()
    ));
    Ok(())
}

/// The error, with the limit that an image is over where it cannot be read back.
fn name_limit(error: RenderError, gpu: &Gpu) -> anyhow::Error {
    let RenderError::Gpu(GpuError::NotReadable { width, height, .. }) = error else {
        return error.into();
    };
    let limit = gpu.device.limits().max_buffer_size;
    anyhow::anyhow!(
        "a picture of {width} × {height} pixels has more than the {limit} bytes that this graphics adapter hands over at once: a smaller --size is needed"
    )
}

/// The model that the mode needs, and the origin of its coordinates: closed, or with `--soup` as it is.
fn read_model(
    args: &RenderArgs,
    path: &Path,
    asset: Option<&Asset>,
) -> anyhow::Result<(TriangleMesh, DVec3)> {
    if args.soup {
        let owned = path.to_owned();
        let LoadedTriangles {
            mut mesh,
            mut origin,
            warnings,
        } = interrupt::unless_stopped(move || mesh_io::read_triangles(&owned))??;
        for warning in &warnings {
            output::warn(&format!("{}: {warning}", path.display()));
        }
        anyhow::ensure!(
            !mesh.faces.is_empty(),
            "{}: it has no faces",
            path.display()
        );
        if let Some(asset) = asset {
            let shift = origin - asset.placement.in_model;
            mesh.positions.iter_mut().for_each(|p| *p += shift);
            origin -= shift;
        }
        return Ok((mesh, origin));
    }
    let loaded = match asset {
        Some(asset) => load_model_of(asset, path, args.mending)?,
        None => load_model(path, args.mending)?,
    };
    let origin = loaded.mesh.origin();
    Ok((loaded.mesh.into_mesh(), origin))
}

/// The camera about the asset, or without one about the model.
fn camera(
    args: &RenderArgs,
    asset: Option<&Asset>,
    model: Option<&(TriangleMesh, DVec3)>,
) -> anyhow::Result<PictureCamera> {
    let of_model = || model.map(|(mesh, origin)| Scene::of_mesh(*origin, &mesh.bounds()));
    let scene = (asset.map(Scene::of).or_else(of_model)).context("there is nothing to look at")?;
    PictureCamera::from_args(&args.camera, &scene)
}

/// The exact silhouette of the model in the frame's image.
fn exact_shape(mesh: &TriangleMesh, params: &FrameParams) -> anyhow::Result<ExactShape> {
    let camera = &params.camera;
    let edges = silhouette_edges(mesh, camera.eye);
    let with_outline = params.antialias == Antialias::Soft;
    Ok(ExactShape::new(mesh, &edges, camera, with_outline)?)
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
