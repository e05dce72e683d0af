//! What a scene needs before it can be drawn, made beside the drawing: another number of views, another hull, what is on the device.

use std::sync::Arc;

use silmap_geometry::Watch;
use silmap_gpu::Gpu;
use silmap_map::fewer_views::{ViewGoal, keep_fewer_views};
use silmap_map::{Asset, MapReader, Method};
use silmap_study::{PictureOptions, PictureRenderer};

use crate::crowd::Crowd;
use crate::scene::Scene;

/// What is made of what was loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shape {
    /// How many views the map keeps; all where `None`.
    pub(crate) keep: Option<u32>,
    /// How many faces the hull has at most; its own where `None`.
    pub(crate) faces: Option<u32>,
    /// Whether lights can be moved.
    pub(crate) relight: bool,
    /// The method of many instances, where they can be drawn.
    pub(crate) crowd: Option<Method>,
}

impl Shape {
    /// What one model is drawn by.
    fn of_one(&self) -> (Option<u32>, Option<u32>, bool) {
        (self.keep, self.faces, self.relight)
    }
}

/// A scene that can be drawn at once.
pub(crate) struct Ready {
    pub(crate) scene: Scene,
    /// The shape that was asked for, and the one that it has.
    pub(crate) asked: Shape,
    pub(crate) shape: Shape,
    /// Whether it is another shape of what was shown, and nothing else.
    pub(crate) is_reshaped: bool,
    pub(crate) reader: Option<MapReader>,
    /// `None`: the one that is there.
    pub(crate) renderer: Option<PictureRenderer>,
    /// Whether lights can be moved, where that was tried.
    pub(crate) can_relight: Option<bool>,
    /// `None`: the one that is there, where the renderer is.
    pub(crate) crowd: Option<Crowd>,
    /// Why its shape is not the one that was asked for.
    pub(crate) complaint: Option<String>,
}

/// Makes scenes ready, on any thread.
#[derive(Clone, Debug)]
pub(crate) struct Maker {
    pub(crate) gpu: Gpu,
    pub(crate) options: PictureOptions,
}

impl Maker {
    /// Makes a scene ready in a shape; one that is shown has its shape already. `None` where it was stopped.
    ///
    /// # Errors
    /// One sentence, when the scene cannot be drawn.
    pub(crate) fn make(
        &self,
        mut scene: Scene,
        (asked, present): (Shape, Option<Shape>),
        watch: &Watch<'_>,
    ) -> Result<Option<Ready>, String> {
        let mut shape = asked;
        if watch.check().is_err() {
            return Ok(None);
        }
        let Ok(complaint) = reshape(&mut scene, &mut shape, watch) else {
            return Ok(None);
        };
        let named = |error: &dyn std::fmt::Display| format!("{}: {error}", scene.name);
        let reader = (scene.asset.as_ref())
            .map(|asset| MapReader::new(&asset.map))
            .transpose()
            .map_err(|error| named(&error))?;
        let options = PictureOptions {
            relight: shape.relight,
            ..self.options.clone()
        };
        let is_other = present.is_none_or(|present| present.of_one() != shape.of_one());
        let renderer = is_other
            .then(|| {
                let mut renderer = PictureRenderer::new(&self.gpu, options.clone());
                if let Some(asset) = &scene.asset {
                    renderer.load_asset(&self.gpu, asset)?;
                }
                if let Some(model) = &scene.model {
                    renderer.load_model(&self.gpu, model.mesh())?;
                }
                Ok(renderer)
            })
            .transpose()
            .map_err(|error: silmap_study::RenderError| named(&error))?;
        let is_there = present.and_then(|present| present.crowd);
        let crowd = match (&scene.asset, shape.crowd) {
            (Some(asset), Some(method)) if is_other || is_there != Some(method) => {
                let made = Crowd::new(&self.gpu, &options, (method, asset));
                Some(made.map_err(|error| named(&error))?)
            }
            _ => None,
        };
        // What the device refused belongs to what was made.
        self.gpu.check_once().map_err(|error| named(&error))?;
        if watch.check().is_err() {
            return Ok(None);
        }
        let tried = renderer.as_ref().filter(|_| shape.relight);
        let can_relight = tried.map(PictureRenderer::can_relight);
        Ok(Some(Ready {
            is_reshaped: present.is_some(),
            scene,
            asked,
            shape,
            reader,
            renderer,
            can_relight,
            crowd,
            complaint,
        }))
    }
}

/// The caller asked to stop.
struct Stopped;

/// Gives the asset as many views and faces as is asked for, and says why it has not where it cannot.
fn reshape(
    scene: &mut Scene,
    shape: &mut Shape,
    watch: &Watch<'_>,
) -> Result<Option<String>, Stopped> {
    let Some(whole) = scene.loaded().cloned() else {
        (shape.keep, shape.faces, shape.crowd) = (None, None, None);
        return Ok(None);
    };
    let mut complaint = None;
    let mut made = Arc::clone(&whole);
    match other_hull(scene, &whole, shape, watch) {
        Ok(asset) => made = asset,
        Err(_) if watch.check().is_err() => return Err(Stopped),
        Err(error) => {
            complaint = Some(format!("{}: {error}", scene.name));
            shape.faces = None;
        }
    }
    let all = made.map.views.len() as u32;
    shape.keep = shape.keep.filter(|&keep| keep < all);
    if let Some(keep) = shape.keep {
        match keep_fewer_views(&made, ViewGoal::Keep(keep)) {
            Ok(fewer) => made = Arc::new(fewer),
            Err(error) => {
                complaint = Some(format!("{}: {error}", scene.name));
                shape.keep = None;
            }
        }
    }
    scene.whole = (!Arc::ptr_eq(&made, &whole)).then_some(whole);
    scene.asset = Some(made);
    Ok(complaint)
}

/// The asset with the hull that is asked for, made anew where it is not there yet.
#[cfg(not(target_arch = "wasm32"))]
fn other_hull(
    scene: &mut Scene,
    whole: &Arc<Asset>,
    shape: &mut Shape,
    watch: &Watch<'_>,
) -> Result<Arc<Asset>, String> {
    use silmap_preprocess::other_hull::with_hull_faces;
    use silmap_preprocess::pipeline::Photographed;

    let own_faces = whole.hull.faces.len() as u32;
    shape.faces = (shape.faces).filter(|&f| f != own_faces && scene.can_have_other_hull());
    let (Some(faces), Some(model)) = (shape.faces, &scene.model) else {
        scene.with_other_hull = None;
        return Ok(Arc::clone(whole));
    };
    let there = scene.with_other_hull.as_ref();
    if let Some((_, asset)) = there.filter(|(of, _)| *of == faces) {
        return Ok(Arc::clone(asset));
    }
    let none = Photographed::default();
    let seen = scene.photographed.as_deref().unwrap_or(&none);
    let made = with_hull_faces(whole, (model, seen), faces, watch);
    let (asset, _) = made.map_err(|error| error.to_string())?;
    // Some models' hulls do not become as coarse as that.
    let faces = faces.max(asset.hull.faces.len() as u32);
    shape.faces = Some(faces).filter(|&faces| faces != own_faces);
    let asset = Arc::new(asset);
    scene.with_other_hull = Some((faces, Arc::clone(&asset)));
    Ok(asset)
}

/// On a page hulls stay as they are.
#[cfg(target_arch = "wasm32")]
fn other_hull(
    _: &mut Scene,
    whole: &Arc<Asset>,
    shape: &mut Shape,
    _: &Watch<'_>,
) -> Result<Arc<Asset>, String> {
    shape.faces = None;
    Ok(Arc::clone(whole))
}
