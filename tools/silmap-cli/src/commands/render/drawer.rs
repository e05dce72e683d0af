//! What `render` draws: read once, loaded once, and drawn for one camera after another.

use std::path::Path;

use anyhow::Context;
use glam::DVec3;
use silmap_exact::silhouette_edges;
use silmap_geometry::{Camera, ColourImage, TriangleMesh};
use silmap_gpu::{Gpu, GpuError};
use silmap_map::{Asset, Method};
use silmap_measure::ExactShape;
use silmap_mesh_io::{self as mesh_io, LoadedTriangles};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, PictureOptions, PictureRenderer,
    RenderError, ShadowParams,
};

use super::FansJson;
use crate::args::{MethodArg, RenderArgs};
use crate::commands::open_gpu;
use crate::files::{load_model, load_model_of, read_asset};
use crate::interrupt;
use crate::output;
use crate::scene::Scene;

/// The files that options name.
#[derive(Debug)]
pub(super) struct Inputs<'a> {
    args: &'a RenderArgs,
    asset: Option<Asset>,
    model: Option<Model<'a>>,
}

/// The model that the mode needs: closed, or with `--soup` as it is.
#[derive(Debug)]
struct Model<'a> {
    path: &'a Path,
    mesh: TriangleMesh,
    /// The origin of its coordinates.
    origin: DVec3,
}

impl<'a> Inputs<'a> {
    /// Reads what the mode needs.
    ///
    /// # Errors
    /// One sentence with the file's name.
    pub(super) fn read(args: &'a RenderArgs) -> anyhow::Result<Self> {
        let asset = args.asset.as_deref().map(read_asset).transpose()?;
        let asset = asset.map(|(asset, _)| asset);
        let wanted = args.model.as_deref().filter(|_| args.mode.needs_model());
        let model = wanted.map(|path| Model::read(args, path, asset.as_ref()));
        Ok(Self {
            model: model.transpose()?,
            args,
            asset,
        })
    }

    /// The asset, or without one the model.
    ///
    /// # Errors
    /// When there is neither.
    pub(super) fn scene(&self) -> anyhow::Result<Scene> {
        let of_model = |model: &Model<'_>| Scene::of_mesh(model.origin, &model.mesh.bounds());
        (self.asset.as_ref().map(Scene::of))
            .or_else(|| self.model.as_ref().map(of_model))
            .context("there is nothing to look at")
    }

    /// What the picture is of, as options name it.
    fn name(&self) -> String {
        let input = self.args.asset.as_deref().or(self.args.model.as_deref());
        input.unwrap_or(Path::new("")).display().to_string()
    }
}

impl<'a> Model<'a> {
    fn read(args: &RenderArgs, path: &'a Path, asset: Option<&Asset>) -> anyhow::Result<Self> {
        if args.soup {
            return Self::read_soup(path, asset);
        }
        let loaded = match asset {
            Some(asset) => load_model_of(asset, path, args.mending)?,
            None => load_model(path, args.mending)?,
        };
        Ok(Self {
            path,
            origin: loaded.mesh.origin(),
            mesh: loaded.mesh.into_mesh(),
        })
    }

    fn read_soup(path: &'a Path, asset: Option<&Asset>) -> anyhow::Result<Self> {
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
        Ok(Self { path, mesh, origin })
    }
}

/// The device with everything on it.
pub(super) struct Drawer<'a> {
    inputs: &'a Inputs<'a>,
    gpu: Gpu,
    renderer: PictureRenderer,
}

impl<'a> Drawer<'a> {
    /// Opens the device and loads what was read.
    ///
    /// # Errors
    /// One sentence; without a device in an exit code of its own.
    pub(super) fn open(inputs: &'a Inputs<'a>) -> anyhow::Result<Self> {
        let gpu = open_gpu()?;
        let args = inputs.args;
        let options = PictureOptions {
            relight: args.light.is_some(),
            ..PictureOptions::default()
        };
        let mut renderer = PictureRenderer::new(&gpu, options);
        if let Some(asset) = &inputs.asset {
            let loaded = renderer.load_asset(&gpu, asset);
            loaded.with_context(|| inputs.name())?;
        }
        if let Some(Model { path, mesh, .. }) = &inputs.model {
            match args.mode.into() {
                Mode::Edges(_) => renderer.load_edge_model(&gpu, mesh),
                mode if mode.needs_model() => renderer.load_model(&gpu, mesh),
                _ => Ok(()),
            }
            .with_context(|| path.display().to_string())?;
        }
        Ok(Self {
            inputs,
            gpu,
            renderer,
        })
    }

    /// The graphics adapter and the interface it is driven through.
    pub(super) fn adapter_name(&self) -> String {
        self.gpu.adapter_name()
    }

    /// Draws the picture of a camera, and says what the stencil was filled with in mode `exact`.
    ///
    /// # Errors
    /// One sentence with the file's name.
    pub(super) fn draw(
        &mut self,
        camera: Camera,
        background: Background,
    ) -> anyhow::Result<(ColourImage, Option<FansJson>)> {
        let params = self.params(camera, background);
        let exact = match &self.inputs.model {
            Some(Model { path, mesh, .. }) if params.mode == Mode::Exact => {
                let made = exact_shape(mesh, &params);
                Some(made.with_context(|| path.display().to_string())?)
            }
            _ => None,
        };
        let drawn = match &exact {
            Some(shape) => self
                .renderer
                .render_shape(&self.gpu, &params, &shape.clip_shape()),
            None => self.renderer.render(&self.gpu, &params),
        };
        let picture = drawn.map_err(|error| self.explained(error))?;
        Ok((picture, exact.as_ref().map(|shape| shape.fans().into())))
    }

    fn params(&self, camera: Camera, background: Background) -> FrameParams {
        let args = self.inputs.args;
        let asset = self.inputs.asset.as_ref();
        FrameParams {
            camera,
            mode: args.mode.into(),
            method: asset.map_or(Method::default(), |asset| {
                MethodArg::resolve(args.interpolation.method, &asset.map)
            }),
            paint: args.paint.into(),
            antialias: args.antialias.into(),
            background,
            edges: EdgeParams {
                width_px: args.width as f32,
                by_item_buffer: args.soup,
            },
            light: args.light,
            shadow: args.shadow.map(|to_light| ShadowParams {
                to_light,
                up: args.camera.up.unwrap_or(DVec3::Y),
            }),
        }
    }

    /// The error in a sentence that says what it is about.
    fn explained(&self, error: RenderError) -> anyhow::Error {
        let name = self.inputs.name();
        match error {
            RenderError::NotRelit => anyhow::anyhow!(
                "{name}: --light needs the model's normals and colours in a known light: it was built with --relief off and --no-normals, or its pictures are photographs"
            ),
            RenderError::Gpu(GpuError::NotReadable { width, height, .. }) => {
                let limit = self.gpu.device.limits().max_buffer_size;
                anyhow::anyhow!(
                    "a picture of {width} × {height} pixels has more than the {limit} bytes that this graphics adapter hands over at once: a smaller --size is needed"
                )
                .context(name)
            }
            RenderError::Light(_) | RenderError::LightBelowGround => {
                anyhow::Error::from(error).context("--shadow")
            }
            other => anyhow::Error::from(other).context(name),
        }
    }
}

/// The exact silhouette of the model in the frame's image.
fn exact_shape(mesh: &TriangleMesh, params: &FrameParams) -> anyhow::Result<ExactShape> {
    let camera = &params.camera;
    let edges = silhouette_edges(mesh, camera.eye);
    let with_outline = params.antialias == Antialias::Soft;
    Ok(ExactShape::new(mesh, &edges, camera, with_outline)?)
}
