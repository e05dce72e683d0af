//! Frames as people draw them: many instances in one scene and one pass, by each way there is.
//!
//! Rows: the full mesh, meshes simplified by meshopt (500 and 5,000 faces, and as many as give the clipped picture's own outline
//! error), the hull, the hull clipped by the stencil and by the coverage function, and a pass for each instance.

use std::time::Instant;

use glam::Vec3;
use serde::Serialize;
use silmap_geometry::{Camera, TriangleMesh, Watch};
use silmap_gpu::Gpu;
use silmap_map::asset::AssetSizes;
use silmap_map::{Asset, BoundingSphere, CoarseHull, Method};
use silmap_runtime::{
    Antialias, ClipBy, DepthDirection, DepthTarget, Instance, LoadedAsset, Outline, Renderer,
    RendererOptions, TargetFormats, Transform,
};
use silmap_study::{FrameParams, Mode, PictureOptions, PictureRenderer};

use crate::bench::{Look, picture_params};
use crate::exact_outlines::ExactOutlines;
use crate::median::median;
use crate::{Deviation, MeasureError};
use errors::apart;
use mesh_instances::MeshInstances;
use place::object_camera;
use stage::{COLOUR, DEPTH, FrameSeconds, Stage};

mod errors;
mod mesh_instances;
mod place;
mod results;
mod stage;

pub use errors::OutlineErrorPx;
pub use place::SceneParams;
pub use results::SceneResults;

/// What is measured.
#[derive(Debug)]
pub struct SceneBench<'a> {
    /// The model.
    pub full: &'a TriangleMesh,
    /// Its asset.
    pub asset: &'a Asset,
    /// Bytes of the asset's file.
    pub sizes: AssetSizes,
    /// The scene.
    pub params: SceneParams,
    /// Asked now and then whether to stop.
    pub watch: &'a Watch<'a>,
}

/// Where the processor's seconds go, on average.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CpuParts {
    /// Finding what is in the picture, and its outlines.
    pub outlines: f64,
    /// Handing data to the queue.
    pub upload: f64,
    /// Recording the pass.
    pub encode: f64,
}

/// One way to draw the scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRow {
    /// `full`, `lod-500`, `lod-5000`, `lod-equal-error`, `hull`, `clipped-stencil`, `clipped-coverage` or `each-a-pass`.
    pub name: String,
    /// Faces of an instance.
    pub faces: usize,
    /// Of the device for a frame.
    pub seconds_median: f64,
    /// Of the processor for a frame.
    pub cpu_seconds_mean: f64,
    /// Its longest frame.
    pub cpu_seconds_max: f64,
    /// Where they go.
    pub cpu_parts: CpuParts,
    /// Against exact outlines.
    pub outline_error_px: OutlineErrorPx,
    /// Bytes of what is drawn: vertices and faces of a mesh, the file of an asset.
    pub bytes: u64,
    /// Frames that were timed.
    pub repeat: usize,
    /// Outlines interpolated a frame.
    pub interpolated_mean: f64,
    /// Instances that were timed, where that is not all: times are scaled to all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timed_instances: Option<usize>,
}

/// Frames before timing: caches fill and clocks rise.
const WARM_UP: usize = 60;

/// A row is timed for this many seconds, and for three frames at least.
const MOST_ROW_SECONDS: f64 = 25.0;
const FEWEST_FRAMES: usize = 3;

/// Instances whose outlines are compared, and in how many frames.
const COMPARED: usize = 12;
const COMPARED_FRAMES: usize = 4;

/// Instances that are drawn in a pass each at most; the time is that for all.
const MOST_PASSES: usize = 40;

/// Faces of simplified meshes.
const LODS: [usize; 2] = [500, 5_000];

/// How near the outline error of the mesh with as many faces as needed comes to the clipped one's.
const EQUAL_STEPS: usize = 7;

impl SceneBench<'_> {
    /// Measures all rows.
    ///
    /// # Errors
    /// When interrupted, the asset cannot be drawn or the device fails.
    pub fn run(&self, gpu: &Gpu) -> Result<SceneResults, MeasureError> {
        let stage = Stage::new(gpu, self.params.side_px);
        let sphere = self.asset.map.bounding_sphere();
        let transforms = self.params.transforms(&sphere);
        let mut scene = Scene {
            bench: self,
            stage: &stage,
            sphere,
            transforms,
            exact: ExactOutlines::new(self.full),
        };
        let stencil = scene.clipped(ClipBy::Stencil, false)?;
        let coverage = scene.clipped(ClipBy::Coverage, false)?;
        let hull = scene.clipped(ClipBy::Stencil, true)?;
        let mut rows = vec![scene.mesh("full".to_owned(), self.full)?];
        for faces in LODS {
            let mesh = simplified(self.full, faces);
            rows.push(scene.mesh(format!("lod-{faces}"), &mesh)?);
        }
        let equal = scene.equal_error_mesh(stencil.outline_error_px.mean)?;
        rows.push(scene.mesh("lod-equal-error".to_owned(), &equal)?);
        rows.extend([hull, stencil, coverage]);
        rows.push(scene.each_a_pass()?);
        let measured_on = (gpu.adapter_name(), stage.has_timestamps());
        Ok(SceneResults::new(&self.params, rows, measured_on))
    }
}

/// The scene while it is measured.
struct Scene<'s, 'a> {
    bench: &'s SceneBench<'a>,
    stage: &'s Stage<'s>,
    sphere: BoundingSphere,
    transforms: Vec<Transform>,
    exact: ExactOutlines<'a>,
}

impl Scene<'_, '_> {
    fn camera(&self, frame: usize) -> Result<Camera, MeasureError> {
        Ok(self.bench.params.camera(&self.sphere, frame)?)
    }

    /// Instances whose outlines are compared.
    fn compared(&self) -> impl Iterator<Item = usize> + use<> {
        let count = self.transforms.len();
        (0..count).step_by(count.div_ceil(COMPARED).max(1))
    }

    /// Times frames, after some that are only prepared and one that is drawn: it makes what a device makes when first needed.
    fn time(
        &self,
        prepared: usize,
        mut frame: impl FnMut(&Camera, bool) -> Result<FrameSeconds, MeasureError>,
    ) -> Result<Vec<FrameSeconds>, MeasureError> {
        for k in 0..=prepared {
            self.bench.watch.check()?;
            frame(&self.camera(k)?, k == prepared)?;
        }
        let mut times = Vec::new();
        let started = Instant::now();
        for k in 1..=self.bench.params.frames {
            self.bench.watch.check()?;
            times.push(frame(&self.camera(prepared + k)?, true)?);
            let is_long = started.elapsed().as_secs_f64() > MOST_ROW_SECONDS;
            if is_long && times.len() >= FEWEST_FRAMES {
                break;
            }
        }
        Ok(times)
    }

    /// The hull, clipped or whole.
    fn clipped(&mut self, clip: ClipBy, is_whole: bool) -> Result<SceneRow, MeasureError> {
        let gpu = self.stage.gpu;
        let options = RendererOptions {
            clip,
            antialias: Antialias::Samples,
            ..RendererOptions::new(TargetFormats {
                colour: Some(COLOUR),
                depth: Some(DepthTarget {
                    format: DEPTH,
                    direction: DepthDirection::Forward,
                }),
                samples: 1,
            })
        };
        let mut renderer = Renderer::new(&gpu.device, options)?;
        let loaded = renderer.load(&gpu.device, &gpu.queue, self.bench.asset)?;
        let instances = instances(&loaded, &self.transforms, is_whole);
        let prepared = if is_whole { 0 } else { WARM_UP };
        let times = self.time(prepared, |camera, is_drawn| {
            let view = self.bench.params.view(camera);
            let since = Instant::now();
            let stats = renderer.plan(&view, &instances)?;
            let outlines = since.elapsed().as_secs_f64();
            let since = Instant::now();
            renderer.upload(&gpu.device, &gpu.queue);
            let upload = since.elapsed().as_secs_f64();
            if !is_drawn {
                return Ok(FrameSeconds::default());
            }
            let (device, encode) = self.stage.pass(|pass| renderer.draw(pass))?;
            Ok(FrameSeconds {
                device,
                outlines,
                upload,
                encode,
                interpolated: stats.interpolated,
            })
        })?;
        let mut off = Vec::new();
        let hull = mesh_of(&self.bench.asset.hull);
        let mut of_hull = is_whole.then(|| ExactOutlines::new(&hull));
        for k in 0..COMPARED_FRAMES {
            let camera = self.camera(WARM_UP + k * self.bench.params.frames / COMPARED_FRAMES)?;
            renderer.plan(&self.bench.params.view(&camera), &instances)?;
            for i in self.compared() {
                self.bench.watch.check()?;
                let own = object_camera(&camera, &self.transforms[i]);
                let exact = self.exact.seen_by(&own)?;
                let drawn = match &mut of_hull {
                    Some(hull) => hull.seen_by(&own)?,
                    None => renderer.outline_px(i).unwrap_or_default(),
                };
                off.push(apart(&drawn, &exact));
            }
        }
        let sizes = self.bench.sizes;
        let (name, bytes) = match (is_whole, clip) {
            (true, _) => ("hull", sizes.hull + sizes.textures),
            (false, ClipBy::Stencil) => ("clipped-stencil", sizes.total),
            (false, ClipBy::Coverage) => ("clipped-coverage", sizes.total),
        };
        let faces = self.bench.asset.hull.faces.len();
        Ok(row(name.to_owned(), faces, bytes, &times, &off))
    }

    /// A mesh in all places.
    fn mesh(&mut self, name: String, mesh: &TriangleMesh) -> Result<SceneRow, MeasureError> {
        let gpu = self.stage.gpu;
        let count = self.transforms.len();
        let mut drawn = MeshInstances::new(gpu, mesh, (COLOUR, DEPTH), count);
        let times = self.time(0, |camera, _| {
            let view = self.bench.params.view(camera);
            let since = Instant::now();
            drawn.plan(&view, &self.transforms);
            let outlines = since.elapsed().as_secs_f64();
            let since = Instant::now();
            drawn.upload(&gpu.queue);
            let upload = since.elapsed().as_secs_f64();
            let (device, encode) = self.stage.pass(|pass| drawn.draw(pass))?;
            Ok(FrameSeconds {
                device,
                outlines,
                upload,
                encode,
                interpolated: 0,
            })
        })?;
        let off = if std::ptr::eq(mesh, self.bench.full) {
            Vec::new()
        } else {
            self.deviations_of(mesh)?
        };
        Ok(row(name, mesh.faces.len(), drawn.bytes, &times, &off))
    }

    /// How far a mesh's outlines are from the model's.
    fn deviations_of(&mut self, mesh: &TriangleMesh) -> Result<Vec<Deviation>, MeasureError> {
        let mut own = ExactOutlines::new(mesh);
        let mut off = Vec::new();
        for k in 0..COMPARED_FRAMES {
            let camera = self.camera(WARM_UP + k * self.bench.params.frames / COMPARED_FRAMES)?;
            for i in self.compared() {
                self.bench.watch.check()?;
                let camera = object_camera(&camera, &self.transforms[i]);
                let (exact, drawn) = (self.exact.seen_by(&camera)?, own.seen_by(&camera)?);
                off.push(apart(&drawn, &exact));
            }
        }
        Ok(off)
    }

    /// The coarsest mesh whose mean outline error is no larger.
    fn equal_error_mesh(&mut self, error_px: f64) -> Result<TriangleMesh, MeasureError> {
        let (mut few, mut many) = (50.0_f64, self.bench.full.faces.len() as f64);
        let mut found = None;
        for _ in 0..EQUAL_STEPS {
            let faces = (few * many).sqrt();
            let mesh = simplified(self.bench.full, faces as usize);
            let off = OutlineErrorPx::of(&self.deviations_of(&mesh)?);
            if off.mean <= error_px {
                (many, found) = (faces, Some(mesh));
            } else {
                few = faces;
            }
        }
        Ok(found.unwrap_or_else(|| self.bench.full.clone()))
    }

    /// An encoder and passes of its own for each instance.
    fn each_a_pass(&mut self) -> Result<SceneRow, MeasureError> {
        let gpu = self.stage.gpu;
        let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
        renderer.load_asset(gpu, self.bench.asset)?;
        let best = Method::best_for(&self.bench.asset.map);
        let count = self.transforms.len().min(MOST_PASSES);
        let scale = self.transforms.len() as f64 / count as f64;
        let times = self.time(0, |camera, _| {
            let mut sum = FrameSeconds::default();
            for transform in &self.transforms[..count] {
                let own = object_camera(camera, transform);
                let params: FrameParams = picture_params(
                    own,
                    Look::new(Mode::Clipped, best, silmap_study::Antialias::None),
                );
                let target = &self.stage.colour;
                let (device, encode) = self.stage.submit(|encoder| {
                    renderer.record(gpu, encoder, target, &params)?;
                    Ok(())
                })?;
                sum.device += device * scale;
                sum.encode += encode * scale;
                sum.interpolated += 1;
            }
            Ok(sum)
        })?;
        let faces = self.bench.asset.hull.faces.len();
        let bytes = self.bench.sizes.total;
        let row = row("each-a-pass".to_owned(), faces, bytes, &times, &[]);
        Ok(SceneRow {
            timed_instances: (scale > 1.0).then_some(count),
            interpolated_mean: row.interpolated_mean * scale,
            ..row
        })
    }
}

fn instances<'a>(
    loaded: &'a LoadedAsset,
    transforms: &[Transform],
    is_whole: bool,
) -> Vec<Instance<'a>> {
    let outline = if is_whole {
        Outline::Whole
    } else {
        Outline::OfAsset
    };
    transforms
        .iter()
        .map(|&transform| Instance {
            outline,
            ..Instance::new(loaded, transform)
        })
        .collect()
}

fn row(
    name: String,
    faces: usize,
    bytes: u64,
    times: &[FrameSeconds],
    off: &[Deviation],
) -> SceneRow {
    let mean = |of: fn(&FrameSeconds) -> f64| {
        times.iter().map(of).sum::<f64>() / times.len().max(1) as f64
    };
    SceneRow {
        name,
        faces,
        seconds_median: median(&mut times.iter().map(|t| t.device).collect::<Vec<f64>>()),
        cpu_seconds_mean: mean(FrameSeconds::processor),
        cpu_seconds_max: times
            .iter()
            .map(FrameSeconds::processor)
            .fold(0.0, f64::max),
        cpu_parts: CpuParts {
            outlines: mean(|t| t.outlines),
            upload: mean(|t| t.upload),
            encode: mean(|t| t.encode),
        },
        outline_error_px: OutlineErrorPx::of(off),
        bytes,
        repeat: times.len(),
        interpolated_mean: mean(|t| t.interpolated as f64),
        timed_instances: None,
    }
}

/// The hull as a mesh.
fn mesh_of(hull: &CoarseHull) -> TriangleMesh {
    TriangleMesh {
        positions: hull
            .positions
            .iter()
            .map(|&p| Vec3::from(p).as_dvec3())
            .collect(),
        faces: hull.faces.clone(),
        ..TriangleMesh::default()
    }
}

/// The mesh with about so many faces, by meshopt.
fn simplified(mesh: &TriangleMesh, faces: usize) -> TriangleMesh {
    let points: Vec<[f32; 3]> = mesh
        .positions
        .iter()
        .map(|p| p.as_vec3().to_array())
        .collect();
    let indices = meshopt::simplify_decoder(
        mesh.faces.as_flattened(),
        &points,
        3 * faces,
        f32::MAX,
        meshopt::SimplifyOptions::None,
        None,
    );
    let mut kept = vec![u32::MAX; points.len()];
    let mut simple = TriangleMesh::default();
    for face in indices.as_chunks::<3>().0 {
        let face = face.map(|v| {
            let at = &mut kept[v as usize];
            if *at == u32::MAX {
                *at = simple.positions.len() as u32;
                simple.positions.push(mesh.positions[v as usize]);
            }
            *at
        });
        simple.faces.push(face);
    }
    simple
}
