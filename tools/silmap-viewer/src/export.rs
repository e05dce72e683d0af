//! Pictures out: what is seen in the window as a file, and a turn around it as an animation.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use silmap_geometry::ClosedMesh;
use silmap_gpu::Gpu;
use silmap_map::Asset;
use silmap_report::animation::{Animation, AnimationFormat, AnimationParams, FrameRate};
use silmap_study::{FrameParams, PictureOptions, PictureRenderer};

use crate::loader::{Loading, News, Teller};
use crate::orbit::Orbit;
use crate::seen::{Pixels, Seen};
use crate::stage::Picture;
use crate::viewer::Viewer;
use crate::viewport;

/// Frames of a turn, how many come in a second, and how good they are, 0 to 100.
const TURN_FRAMES: u32 = 60;
const TURN_RATE: f64 = 20.0;
const TURN_QUALITY: u8 = 75;

/// Begins to save the picture that is seen, in the size that it has in the window.
pub(crate) fn save_picture(viewer: &mut Viewer, context: &egui::Context) {
    let name = viewer.export.name.clone();
    let seen = match Seen::of(viewer) {
        Ok(seen) => seen,
        Err(reason) => return viewer.say(format!("{name}: {reason}"), true),
    };
    viewer.loading = Some(Loading::beside(context, &name.clone(), move |_, _| {
        let written = seen
            .wait()
            .map_err(anyhow::Error::msg)
            .and_then(|pixels| write_picture(&PathBuf::from(&name), pixels));
        match written {
            Ok((width, height)) => {
                News::Said(format!("{name} is written: {width} × {height} pixels"))
            }
            Err(reason) => News::Failed(format!("{name}: {reason:#}")),
        }
    }));
}

fn write_picture(path: &Path, (rgba, size_px): Pixels) -> anyhow::Result<(u32, u32)> {
    let picture = image::RgbaImage::from_raw(size_px.0, size_px.1, rgba);
    let picture = picture.context("invariant: there is a pixel for each place")?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    write_whole(path, &bytes.into_inner())?;
    Ok(size_px)
}

/// The file appears whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = beside(path)?;
    file.write_all(bytes)?;
    file.persist(path)?;
    Ok(())
}

/// A file without a name yet, in the folder of one.
fn beside(path: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))
}

/// A turn that is drawn and written on a thread of its own.
struct Turn {
    path: PathBuf,
    orbit: Orbit,
    params: FrameParams,
    gpu: Gpu,
    relight: bool,
    asset: Option<Arc<Asset>>,
    model: Option<Arc<ClosedMesh>>,
}

/// Begins to write what is seen as an animation that turns once around, under the picture's name with `.webp`.
pub(crate) fn save_turn(viewer: &mut Viewer, context: &egui::Context) {
    let path = PathBuf::from(&viewer.export.name).with_extension("webp");
    let camera = viewer.orbit.camera(viewer.panes.size_px);
    let how = (viewer.shown(viewer.look.shown), viewer.method_of(0));
    let picture = viewport::picture(viewer, how, &camera);
    let (Picture::Single(params), Some(stage)) = (picture, &viewer.stage) else {
        viewer.say("a turn of many instances cannot be saved: show one", true);
        return;
    };
    let turn = Turn {
        orbit: viewer.orbit,
        params,
        gpu: stage.gpu.clone(),
        relight: stage.can_relight(),
        asset: viewer.scene.asset.clone(),
        model: viewer.scene.model.clone(),
        path,
    };
    let name = turn.path.display().to_string();
    viewer.loading = Some(Loading::beside(context, &name, move |teller, stop| {
        let written = turn.write(teller, stop);
        let name = turn.path.display();
        match written {
            Ok(Some(bytes)) => News::Said(format!(
                "{name} is written: {TURN_FRAMES} frames, {bytes} bytes"
            )),
            Ok(None) => News::Stopped,
            Err(reason) => News::Failed(format!("{name}: {reason:#}")),
        }
    }));
}

/// Begins to write the asset as it is shown, under the picture's name with `.glb`.
pub(crate) fn save_asset(viewer: &mut Viewer, context: &egui::Context) {
    let Some(asset) = viewer.scene.asset.clone() else {
        return;
    };
    let path = PathBuf::from(&viewer.export.name).with_extension("glb");
    let name = path.display().to_string();
    viewer.loading = Some(Loading::beside(context, &name, move |_, _| {
        let name = path.display();
        let written = silmap_map::asset::write(&asset)
            .map_err(anyhow::Error::from)
            .and_then(|bytes| {
                write_whole(&path, &bytes)?;
                Ok(bytes.len())
            });
        match written {
            Ok(bytes) => News::Said(format!("{name} is written: {bytes} bytes")),
            Err(reason) => News::Failed(format!("{name}: {reason:#}")),
        }
    }));
}

impl Turn {
    /// Bytes that were written; `None` where it was stopped.
    fn write(&self, teller: &Teller, stop: &AtomicBool) -> anyhow::Result<Option<u64>> {
        let options = PictureOptions {
            relight: self.relight,
            ..PictureOptions::default()
        };
        let mut renderer = PictureRenderer::new(&self.gpu, options);
        if let Some(asset) = &self.asset {
            renderer.load_asset(&self.gpu, asset)?;
        }
        if let Some(model) = &self.model {
            renderer.load_model(&self.gpu, model.mesh())?;
        }
        let size_px = (self.params.camera.width_px, self.params.camera.height_px);
        let mut file = beside(&self.path)?;
        let params = AnimationParams {
            format: AnimationFormat::Webp(Some(TURN_QUALITY)),
            size_px,
            frames: TURN_FRAMES,
            rate: FrameRate::new(TURN_RATE).context("invariant: there is such a rate")?,
        };
        let mut animation = Animation::new(file.as_file_mut(), &params)?;
        for k in 0..TURN_FRAMES {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let share = f64::from(k) / f64::from(TURN_FRAMES);
            let doing = "drawing a turn".to_owned();
            teller.tell(News::Progress(doing, Some(share as f32)));
            let mut orbit = self.orbit;
            orbit.azimuth_rad += std::f64::consts::TAU * share;
            let frame = FrameParams {
                camera: orbit.camera(size_px),
                ..self.params.clone()
            };
            animation.push(&renderer.render(&self.gpu, &frame)?)?;
        }
        animation.finish()?;
        let bytes = file.as_file().metadata()?.len();
        file.persist(&self.path)?;
        Ok(Some(bytes))
    }
}
