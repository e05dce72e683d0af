//! The viewpoints where outlines stray farthest: what is drawn there, and both outlines to lay over it.

use silmap_geometry::{Camera, ColourImage, TriangleMesh, Watch};
use silmap_gpu::Gpu;
use silmap_map::{Asset, MapReader, Method};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};

use crate::evaluate::test_camera;
use crate::exact_outlines::ExactOutlines;
use crate::{ErrorSample, MeasureError, StrayView};

/// The viewpoints of the samples, with pictures of so many pixels a side; what is drawn only where there is a graphics adapter.
///
/// # Errors
/// When interrupted, the map is broken, or something cannot be drawn.
pub(crate) fn stray_views(
    (asset, model): (&Asset, &TriangleMesh),
    samples: &[(Method, &ErrorSample)],
    (size_px, gpu): (u32, Option<&Gpu>),
    watch: &Watch<'_>,
) -> Result<Vec<StrayView>, MeasureError> {
    let map = &asset.map;
    let mut reader = MapReader::new(map)?;
    let mut exact = ExactOutlines::new(model);
    let mut hull = gpu.map(|gpu| ClippedHull::new(gpu, asset)).transpose()?;
    let mut views = Vec::with_capacity(samples.len());
    for &(method, sample) in samples {
        watch.check()?;
        let camera = test_camera(sample.eye, map, size_px)?;
        let found = silmap_map::outline(map, &camera, method, &mut reader)?;
        let params = frame_params(camera, method);
        views.push(StrayView {
            sample: sample.clone(),
            camera,
            truth: exact.seen_by(&camera)?,
            predicted: found.simple_loops().clone(),
            drawn: hull.as_mut().map(|h| h.draw(&params)).transpose()?,
        });
    }
    Ok(views)
}

fn frame_params(camera: Camera, method: Method) -> FrameParams {
    FrameParams {
        camera,
        mode: Mode::Clipped,
        method,
        paint: Paint::default(),
        antialias: Antialias::default(),
        background: Background::Transparent,
        edges: EdgeParams::default(),
        shadow: None,
        light: None,
    }
}

/// The asset's hull on a device.
struct ClippedHull<'g> {
    gpu: &'g Gpu,
    renderer: PictureRenderer,
}

impl<'g> ClippedHull<'g> {
    fn new(gpu: &'g Gpu, asset: &Asset) -> Result<Self, MeasureError> {
        let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
        renderer.load_asset(gpu, asset)?;
        Ok(Self { gpu, renderer })
    }

    fn draw(&mut self, params: &FrameParams) -> Result<ColourImage, MeasureError> {
        Ok(self.renderer.render(self.gpu, params)?)
    }
}
