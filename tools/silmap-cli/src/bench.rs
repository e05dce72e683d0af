//! Timing everything that gives an outline or a picture, row by row, at the same viewpoints and on the same machine.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 7, tables 1 and 2.

use std::time::Instant;

use serde::Serialize;
use silmap_exact::{EdgeMesh, Extractor, Method as Extraction, Outliner};
use silmap_geometry::polygon::{edges as segments, fill_even_odd};
use silmap_geometry::{Camera, Loop, Mask, TriangleMesh};
use silmap_gpu::{FrameTimer, Gpu, wait_for, wgpu};
use silmap_map::asset::AssetSizes;
use silmap_map::{Asset, Interpolation, Method, Scratch};
use silmap_runtime::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, Renderer, RendererOptions,
};

use crate::exact_shape::ExactShape;
use crate::interrupt;

/// Most viewpoints at which outlines are compared.
const COMPARED_VIEWS: usize = 8;

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) name: String,
    /// Faces that are drawn or searched.
    pub(crate) faces: Option<usize>,
    /// Of the device for a frame; of the processor where nothing is drawn.
    pub(crate) seconds_median: f64,
    /// Of the processor, for the outline and for recording the frame.
    pub(crate) cpu_seconds_median: f64,
    /// Distance to the exact outline: the area between the two over the exact one's length, pixels.
    pub(crate) outline_error: Option<f64>,
    /// Pixels on the wrong side, of those inside.
    pub(crate) misclassified: Option<f64>,
    /// What has to be kept.
    pub(crate) bytes: u64,
    pub(crate) repeat: usize,
    /// Of all viewpoints, on average, as are the next two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) silhouette_edges: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tested_edges: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) visited_nodes: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) build_seconds: Option<f64>,
}

impl Row {
    fn new(name: String, faces: Option<usize>, bytes: u64) -> Self {
        Self {
            name,
            faces,
            seconds_median: 0.0,
            cpu_seconds_median: 0.0,
            outline_error: None,
            misclassified: None,
            bytes,
            repeat: 0,
            silhouette_edges: None,
            tested_edges: None,
            visited_nodes: None,
            build_seconds: None,
        }
    }

    /// Processor and device, one after the other, for rows that draw.
    pub(crate) fn frame_seconds(&self) -> f64 {
        self.seconds_median + self.cpu_seconds_median
    }

    fn with_times(mut self, mut device: Vec<f64>, mut processor: Vec<f64>) -> Self {
        self.repeat = device.len();
        self.seconds_median = median(&mut device);
        self.cpu_seconds_median = median(&mut processor);
        self
    }

    fn with_errors(mut self, errors: &[(f64, f64)]) -> Self {
        let count = errors.len().max(1) as f64;
        self.outline_error = Some(errors.iter().map(|e| e.0).sum::<f64>() / count);
        self.misclassified = Some(errors.iter().map(|e| e.1).sum::<f64>() / count);
        self
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// What is measured.
#[derive(Debug)]
pub(crate) struct Bench<'a> {
    pub(crate) full: &'a TriangleMesh,
    /// The mesh simplified to the hull's faces, drawn beside it.
    pub(crate) simplified: Option<&'a TriangleMesh>,
    pub(crate) asset: &'a Asset,
    pub(crate) sizes: AssetSizes,
    /// One after the other around the model, for each frame as many as it has instances.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) instances: usize,
    pub(crate) extractions: Vec<Extraction>,
}

/// The exact outline at a viewpoint.
struct Truth {
    camera: Camera,
    mask: Mask,
    length_px: f64,
}

impl Truth {
    /// Distance in pixels and misclassified share of a mask.
    fn errors_of(&self, found: &Mask) -> (f64, f64) {
        let different = found.count_different(&self.mask) as f64;
        (
            different / self.length_px.max(1.0),
            different / self.mask.count().max(1) as f64,
        )
    }
}

/// Draws frames to a texture and times them.
struct Drawer<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    target: wgpu::TextureView,
    timer: Option<FrameTimer>,
}

/// How a frame gets the region that it is clipped to.
enum Region<'r, 'm> {
    /// None, or interpolated.
    Own,
    /// Exact edges.
    Exact(&'r mut Extractor<'m>),
}

fn params(camera: Camera, mode: Mode, method: Method, antialias: Antialias) -> FrameParams {
    FrameParams {
        camera,
        mode,
        method,
        paint: Paint::default(),
        antialias,
        background: Background::Transparent,
        edges: EdgeParams::default(),
    }
}

impl Bench<'_> {
    /// Measures all rows; also says whether the device's own clock was read.
    ///
    /// # Errors
    /// When interrupted, the mesh is not manifold, the map is broken or the device fails.
    pub(crate) fn run(&self, gpu: &Gpu) -> anyhow::Result<(Vec<Row>, bool)> {
        let mut rows = Vec::new();
        let truths = self.truths()?;
        self.time_contours(&truths, &mut rows)?;
        let edge_mesh = EdgeMesh::new(self.full)?;
        let mut extractors = Vec::new();
        for &method in &self.extractions {
            interrupt::check()?;
            let since = Instant::now();
            let mut extractor = Extractor::new(&edge_mesh, method);
            let build_seconds = since.elapsed().as_secs_f64();
            rows.push(self.time_extraction(method, &mut extractor, build_seconds)?);
            extractors.push((method, extractor));
        }
        let mut drawer = self.drawer(gpu)?;
        self.time_frames(&mut drawer, &truths, extractors, &mut rows)?;
        Ok((rows, drawer.timer.is_some()))
    }

    /// The rows of extraction alone.
    ///
    /// # Errors
    /// When interrupted, or the mesh is not manifold.
    pub(crate) fn extraction_rows(&self) -> anyhow::Result<Vec<Row>> {
        let edge_mesh = EdgeMesh::new(self.full)?;
        (self.extractions.iter())
            .map(|&method| {
                interrupt::check()?;
                let since = Instant::now();
                let mut extractor = Extractor::new(&edge_mesh, method);
                let build_seconds = since.elapsed().as_secs_f64();
                self.time_extraction(method, &mut extractor, build_seconds)
            })
            .collect()
    }

    /// The rows of interpolation alone.
    ///
    /// # Errors
    /// When interrupted, or the map is broken.
    pub(crate) fn contour_rows(&self) -> anyhow::Result<Vec<Row>> {
        let mut rows = Vec::new();
        self.time_contours(&self.truths()?, &mut rows)?;
        Ok(rows)
    }

    fn truths(&self) -> anyhow::Result<Vec<Truth>> {
        let step = self.cameras.len().div_ceil(COMPARED_VIEWS).max(1);
        let mut outliner = Outliner::new(&self.full.positions);
        (self.cameras.iter().step_by(step))
            .map(|&camera| {
                let edges = silmap_exact::silhouette_edges(self.full, camera.eye);
                let loops = outliner.outline(&edges, &camera)?;
                let mut mask = Mask::new(camera.width_px, camera.height_px);
                fill_even_odd(&loops, &mut mask);
                let length_px = loops
                    .iter()
                    .flat_map(|l| segments(l))
                    .map(|(a, b)| a.distance(b));
                Ok(Truth {
                    camera,
                    length_px: length_px.sum(),
                    mask,
                })
            })
            .collect()
    }

    fn time_contours(&self, truths: &[Truth], rows: &mut Vec<Row>) -> anyhow::Result<()> {
        let map = &self.asset.map;
        let mut scratch = Scratch::new(map)?;
        for method in Method::all_for(map) {
            let mut times = Vec::new();
            // The first round fills buffers that a frame finds warm.
            for is_timed in [false, true] {
                for camera in &self.cameras {
                    interrupt::check()?;
                    let since = Instant::now();
                    scratch.interpolate(map, camera, Interpolation::from(method))?;
                    if is_timed {
                        times.push(since.elapsed().as_secs_f64());
                    }
                }
            }
            let mut errors = Vec::new();
            for truth in truths {
                let outline = silmap_map::outline(map, &truth.camera, method, &mut scratch)?;
                let mut mask = Mask::new(truth.camera.width_px, truth.camera.height_px);
                fill_even_odd::<&Loop>(outline.simple_loops(), &mut mask);
                errors.push(truth.errors_of(&mask));
            }
            let row = Row::new(format!("contour-{}", method.name()), None, self.sizes.map);
            rows.push(row.with_times(times.clone(), times).with_errors(&errors));
        }
        Ok(())
    }

    fn time_extraction(
        &self,
        method: Extraction,
        extractor: &mut Extractor<'_>,
        build_seconds: f64,
    ) -> anyhow::Result<Row> {
        let (mut times, mut edges) = (Vec::new(), Vec::new());
        let (mut found, mut tested, mut visited) = (0, 0, 0);
        extractor.forget();
        for is_timed in [false, true] {
            for camera in &self.cameras {
                interrupt::check()?;
                let viewpoint = silmap_exact::Viewpoint::Eye(camera.eye);
                let since = Instant::now();
                let work = extractor.extract(&viewpoint, &mut edges);
                if is_timed {
                    times.push(since.elapsed().as_secs_f64());
                    found += edges.len();
                    tested += work.tested_edges;
                    visited += work.visited_nodes;
                }
            }
        }
        let mean = |sum: usize| Some(sum as f64 / times.len().max(1) as f64);
        let bytes = extractor.data_bytes() as u64;
        let row = Row::new(
            format!("edges-{method}"),
            Some(self.full.faces.len()),
            bytes,
        );
        Ok(Row {
            silhouette_edges: mean(found),
            tested_edges: mean(tested),
            visited_nodes: mean(visited),
            build_seconds: Some(build_seconds),
            ..row
        }
        .with_times(times.clone(), times))
    }

    fn drawer<'g>(&self, gpu: &'g Gpu) -> anyhow::Result<Drawer<'g>> {
        let options = RendererOptions::default();
        let (width, height) = (self.cameras.first()).map_or((1, 1), |c| (c.width_px, c.height_px));
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("measured frame"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: options.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let mut renderer = Renderer::new(gpu, options);
        renderer.load_asset(gpu, self.asset)?;
        renderer.load_model(gpu, self.full)?;
        Ok(Drawer {
            gpu,
            renderer,
            target: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            timer: FrameTimer::new(gpu),
        })
    }

    fn time_frames(
        &self,
        drawer: &mut Drawer<'_>,
        truths: &[Truth],
        extractors: Vec<(Extraction, Extractor<'_>)>,
        rows: &mut Vec<Row>,
    ) -> anyhow::Result<()> {
        let best = Method::best_for(&self.asset.map);
        let faces = self.full.faces.len();
        let hull_faces = self.asset.hull.faces.len();
        // As the renderer keeps them: positions and normals, and three indices a face.
        let bytes_of = |m: &TriangleMesh| (36 * m.positions.len() + 12 * m.faces.len()) as u64;
        let full_bytes = bytes_of(self.full);
        if let Some(simple) = self.simplified {
            drawer.renderer.load_model(drawer.gpu, simple)?;
            let name = "simplified".to_owned();
            let row = Row::new(name, Some(simple.faces.len()), bytes_of(simple));
            let how = (Mode::Original, best, Antialias::None);
            rows.push(self.time_row(drawer, truths, (row, how), &mut Region::Own)?);
            drawer.renderer.load_model(drawer.gpu, self.full)?;
        }
        let painted = self.sizes.hull + self.sizes.textures;
        let mut plan = vec![
            (
                Row::new("full".to_owned(), Some(faces), full_bytes),
                (Mode::Original, best, Antialias::None),
            ),
            (
                Row::new("hull".to_owned(), Some(hull_faces), painted),
                (Mode::Textured, best, Antialias::None),
            ),
        ];
        for method in Method::all_for(&self.asset.map) {
            for (antialias, name) in [
                (Antialias::None, "none"),
                (Antialias::Soft, "soft"),
                (Antialias::Msaa, "msaa"),
            ] {
                let name = format!("clipped-{}-{name}", method.name());
                plan.push((
                    Row::new(name, Some(hull_faces), self.sizes.total),
                    (Mode::Clipped, method, antialias),
                ));
            }
        }
        for (row, how) in plan {
            rows.push(self.time_row(drawer, truths, (row, how), &mut Region::Own)?);
        }
        for (method, mut extractor) in extractors {
            let bytes = painted + extractor.data_bytes() as u64;
            let row = Row::new(format!("exact-{method}"), Some(hull_faces), bytes);
            let how = (Mode::Exact, best, Antialias::None);
            extractor.forget();
            let mut region = Region::Exact(&mut extractor);
            rows.push(self.time_row(drawer, truths, (row, how), &mut region)?);
        }
        Ok(())
    }

    fn time_row(
        &self,
        drawer: &mut Drawer<'_>,
        truths: &[Truth],
        (row, (mode, method, antialias)): (Row, (Mode, Method, Antialias)),
        region: &mut Region<'_, '_>,
    ) -> anyhow::Result<Row> {
        let (mut device, mut processor) = (Vec::new(), Vec::new());
        let frames = self.cameras.chunks(self.instances.max(1));
        // The first frame makes pipelines and grows buffers.
        for (k, cameras) in frames.clone().take(1).chain(frames).enumerate() {
            interrupt::check()?;
            let frame: Vec<FrameParams> = (cameras.iter())
                .map(|&camera| params(camera, mode, method, antialias))
                .collect();
            let (on_device, on_processor) = drawer.frame(&frame, region, self.full)?;
            if k > 0 {
                device.push(on_device);
                processor.push(on_processor);
            }
        }
        let mut errors = Vec::new();
        for truth in truths {
            interrupt::check()?;
            let frame = params(truth.camera, mode, method, antialias);
            let mask = drawer.mask(&frame, region, self.full)?;
            errors.push(truth.errors_of(&mask));
        }
        Ok(row.with_times(device, processor).with_errors(&errors))
    }
}

impl Region<'_, '_> {
    fn shape(
        &mut self,
        frame: &FrameParams,
        mesh: &TriangleMesh,
    ) -> anyhow::Result<Option<ExactShape>> {
        let Self::Exact(extractor) = self else {
            return Ok(None);
        };
        let mut edges = Vec::new();
        extractor.extract(&silmap_exact::Viewpoint::Eye(frame.camera.eye), &mut edges);
        ExactShape::new(mesh, &edges, &frame.camera, false).map(Some)
    }
}

impl Drawer<'_> {
    /// Seconds of the device and of the processor for a frame of several instances, each drawn over the last.
    fn frame(
        &mut self,
        instances: &[FrameParams],
        region: &mut Region<'_, '_>,
        mesh: &TriangleMesh,
    ) -> anyhow::Result<(f64, f64)> {
        wait_for(self.gpu, None)?;
        let (mut on_processor, mut submitted) = (0.0, 0.0);
        for (k, frame) in instances.iter().enumerate() {
            let since = Instant::now();
            let mut encoder = (self.gpu.device)
                .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            if let (0, Some(timer)) = (k, &self.timer) {
                timer.start(&mut encoder);
            }
            let (gpu, target) = (self.gpu, &self.target);
            match region.shape(frame, mesh)? {
                Some(shape) => {
                    let of_frame = (frame, &shape.clip_shape());
                    (self.renderer).record_shape(gpu, &mut encoder, target, of_frame)?;
                }
                None => self.renderer.record(gpu, &mut encoder, target, frame)?,
            }
            if let (true, Some(timer)) = (k + 1 == instances.len(), &self.timer) {
                timer.end(&mut encoder);
            }
            let commands = encoder.finish();
            on_processor += since.elapsed().as_secs_f64();
            let since = Instant::now();
            self.gpu.queue.submit([commands]);
            if self.timer.is_none() {
                wait_for(self.gpu, None)?;
            }
            submitted += since.elapsed().as_secs_f64();
        }
        let on_device = match &self.timer {
            Some(timer) => timer.seconds(self.gpu)?,
            None => submitted,
        };
        Ok((on_device, on_processor))
    }

    /// The pixels that a picture covers.
    fn mask(
        &mut self,
        frame: &FrameParams,
        region: &mut Region<'_, '_>,
        mesh: &TriangleMesh,
    ) -> anyhow::Result<Mask> {
        let picture = match region.shape(frame, mesh)? {
            Some(shape) => (self.renderer).render_shape(self.gpu, frame, &shape.clip_shape())?,
            None => self.renderer.render(self.gpu, frame)?,
        };
        let mut mask = Mask::new(picture.width, picture.height);
        for (i, pixel) in (0..).zip(picture.rgba.chunks_exact(4)) {
            mask.set(i % picture.width, i / picture.width, pixel[3] > 127);
        }
        Ok(mask)
    }
}
