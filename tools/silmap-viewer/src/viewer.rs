//! What the program knows: what is loaded, how it is looked at, and what has been said.

use std::sync::Arc;

use silmap_map::MapReader;

use crate::loader::Loading;
use crate::look::{Look, Pose, Shown};
use crate::orbit::Orbit;
use crate::scene::Scene;
use crate::stage::Stage;
use crate::timing::Timing;

/// A message at the top of the picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// One sentence, or a few.
    pub text: String,
    /// Whether something failed.
    pub is_error: bool,
}

/// Where a picture of what is seen goes.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Export {
    /// The file's name, as typed.
    pub(crate) name: String,
}

#[cfg(not(target_arch = "wasm32"))]
impl Default for Export {
    fn default() -> Self {
        Self {
            name: "silmap.png".to_owned(),
        }
    }
}

/// What is loaded, and how it is looked at.
pub struct Viewer {
    pub(crate) stage: Option<Stage>,
    pub(crate) scene: Scene,
    /// The asset as it was loaded, where the one that is shown has fewer views.
    pub(crate) whole: Option<Arc<silmap_map::Asset>>,
    pub(crate) reader: Option<MapReader>,
    pub(crate) look: Look,
    pub(crate) orbit: Orbit,
    /// Whether the camera is set once the size of the picture is known.
    pub(crate) frames_next: bool,
    pub(crate) loading: Option<Loading>,
    pub(crate) message: Option<Message>,
    pub(crate) panel_is_open: bool,
    pub(crate) help_is_open: bool,
    pub(crate) hint_is_shown: bool,
    pub(crate) is_turning: bool,
    pub(crate) timing: Timing,
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) export: Export,
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) error: crate::live_error::LiveError,
    pub(crate) picture_px: (u32, u32),
    pub(crate) origin_px: [f32; 2],
}

impl std::fmt::Debug for Viewer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Viewer")
            .field("scene", &self.scene.name)
            .field("look", &self.look)
            .field("message", &self.message)
            .finish_non_exhaustive()
    }
}

impl Viewer {
    /// Nothing yet, on the window's device.
    pub(crate) fn new(device: Option<&egui_wgpu::RenderState>, look: Look) -> Self {
        let stage = device.map(Stage::new);
        Self {
            message: stage.is_none().then(|| Message {
                text: "there is no graphics device to draw with".to_owned(),
                is_error: true,
            }),
            stage,
            scene: Scene::default(),
            whole: None,
            reader: None,
            look,
            orbit: Orbit::default(),
            frames_next: true,
            loading: None,
            panel_is_open: true,
            help_is_open: false,
            hint_is_shown: true,
            is_turning: false,
            timing: Timing::default(),
            #[cfg(not(target_arch = "wasm32"))]
            export: Export::default(),
            #[cfg(not(target_arch = "wasm32"))]
            error: crate::live_error::LiveError::default(),
            picture_px: (1, 1),
            origin_px: [0.0; 2],
        }
    }

    /// Says something.
    pub(crate) fn say(&mut self, text: impl Into<String>, is_error: bool) {
        self.message = Some(Message {
            text: text.into(),
            is_error,
        });
    }

    /// What is said at the moment.
    #[must_use]
    pub fn message(&self) -> Option<&Message> {
        self.message.as_ref()
    }

    /// What is shown.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How it is looked at.
    #[must_use]
    pub fn look(&self) -> &Look {
        &self.look
    }

    /// Whether the graphics device is gone.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        let lost =
            |stage: &Stage| matches!(stage.check(), Err(silmap_gpu::GpuError::DeviceLost { .. }));
        self.stage.as_ref().is_some_and(lost)
    }

    /// Whether something is loaded or built.
    #[must_use]
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// How the picture is looked at now, as a link says it.
    #[must_use]
    pub fn link(&self) -> String {
        let orbit = &self.orbit;
        let (_, up) = orbit.frame_axes();
        let origin = self.scene.origin;
        let look = Look {
            pose: (!self.scene.is_empty()).then(|| Pose {
                eye: orbit.eye() + origin,
                target: Some(orbit.target + origin),
                up: (orbit.roll_rad != 0.0 || orbit.elevation_rad.abs() > 1.57).then_some(up),
                fov_y_degrees: Some(orbit.fov_y_rad.to_degrees()),
            }),
            ..self.look
        };
        look.link()
    }

    /// Looks at it another way.
    pub fn take_look(&mut self, look: Look) {
        self.frames_next |= look.pose.is_some();
        self.look = look;
        self.apply_keep();
        self.apply_light();
    }

    /// Where the picture is in the window: left, top, width and height, pixels.
    #[must_use]
    pub fn picture_place(&self) -> [f32; 4] {
        let [x, y] = self.origin_px;
        [x, y, self.picture_px.0 as f32, self.picture_px.1 as f32]
    }

    /// How many pictures were drawn, and the mean milliseconds of the last ones: of this thread, and until the device had drawn them,
    /// which is −1 where the device does not tell.
    #[must_use]
    pub fn times_millis(&self) -> [f64; 3] {
        let (processor, device) = self.timing.means();
        let millis = |seconds: Option<f64>| seconds.map_or(-1.0, |s| 1e3 * s);
        [
            self.timing.count() as f64,
            millis(processor),
            millis(device),
        ]
    }

    /// Whether a picture was drawn of what is shown.
    #[must_use]
    pub fn has_drawn(&self) -> bool {
        !self.scene.is_empty() && self.timing.means().0.is_some()
    }

    /// The sphere that is framed.
    pub(crate) fn framed_sphere(&self) -> silmap_map::BoundingSphere {
        let sphere = self.scene.sphere();
        if self.look.instances > 1 && self.scene.asset.is_some() {
            crate::crowd::sphere_of(sphere, self.look.instances)
        } else {
            sphere
        }
    }

    /// Looks at all of it.
    pub(crate) fn frame(&mut self) {
        let (width, height) = self.picture_px;
        let aspect = f64::from(width) / f64::from(height.max(1));
        self.orbit.frame(self.framed_sphere(), aspect);
    }

    /// Takes what was loaded in place of what was shown.
    pub(crate) fn show(&mut self, scene: Scene) {
        let is_same = scene.name == self.scene.name && !self.scene.is_empty();
        let Some(stage) = &mut self.stage else {
            return;
        };
        let relight = self.look.light.is_some();
        let reader = match scene.asset.as_ref().map(|a| MapReader::new(&a.map)) {
            Some(Err(error)) => {
                self.say(format!("{}: {error}", scene.name), true);
                return;
            }
            Some(Ok(reader)) => Some(reader),
            None => None,
        };
        if let Err(error) = stage.load(scene.asset.as_deref(), scene.model.as_deref(), relight) {
            self.say(format!("{}: {error}", scene.name), true);
            return;
        }
        self.reader = reader;
        self.message = (!scene.warnings.is_empty()).then(|| Message {
            text: scene.warnings.join("\n"),
            is_error: false,
        });
        self.whole = None;
        self.timing.clear();
        self.scene = scene;
        self.frames_next |= !is_same;
        self.apply_keep();
    }

    /// What can be shown of what is asked for: while a mesh has no asset yet, or an asset no mesh, what is there.
    pub(crate) fn shown(&self, asked: Shown) -> Shown {
        let lacks_asset = asked.needs_asset() && self.scene.asset.is_none();
        let lacks_model = asked.needs_model() && self.scene.model.is_none();
        match (lacks_asset, lacks_model) {
            (false, false) => asked,
            (true, _) => Shown::Original,
            (false, true) => Shown::Clipped,
        }
    }

    /// Makes the map have as many views as is asked for.
    pub(crate) fn apply_keep(&mut self) {
        #[cfg(not(target_arch = "wasm32"))]
        {
            use silmap_preprocess::fewer_views::{ViewGoal, keep_fewer_views};
            let whole = self.whole.clone().or_else(|| self.scene.asset.clone());
            let Some(whole) = whole else {
                return;
            };
            let all = whole.map.views.len() as u32;
            let made = match self.look.keep.filter(|&keep| keep < all) {
                Some(keep) => match keep_fewer_views(&whole, ViewGoal::Keep(keep)) {
                    Ok(fewer) => Arc::new(fewer),
                    Err(error) => {
                        self.look.keep = None;
                        let text = format!("{}: {error}", self.scene.name);
                        self.say(text, true);
                        return;
                    }
                },
                None => Arc::clone(&whole),
            };
            let is_shown = (self.scene.asset.as_ref()).is_some_and(|a| Arc::ptr_eq(a, &made));
            if is_shown {
                return;
            }
            let (Ok(reader), Some(stage)) = (MapReader::new(&made.map), &mut self.stage) else {
                return;
            };
            if let Err(error) = stage.replace_asset(&made) {
                let text = format!("{}: {error}", self.scene.name);
                self.say(text, true);
                return;
            }
            self.reader = Some(reader);
            self.scene.asset = Some(made);
            self.whole = Some(whole);
        }
    }

    /// Loads what is needed to move lights, or does without again.
    pub(crate) fn apply_light(&mut self) {
        let wants = self.look.light.is_some();
        let Some(stage) = &mut self.stage else {
            return;
        };
        if wants == stage.can_relight() || !wants {
            return;
        }
        let asset = self.scene.asset.as_deref();
        if let Err(error) = stage.load(asset, self.scene.model.as_deref(), true) {
            self.look.light = None;
            self.say(error.to_string(), true);
        }
    }

    /// Shows so many instances, and frames them.
    pub(crate) fn set_instances(&mut self, count: u32) {
        self.look.instances = count;
        self.frame();
        // From a little above, so that those behind are seen.
        if count > 1 && self.orbit.elevation_rad.abs() < 0.2 {
            self.orbit.elevation_rad = 0.35;
        }
    }
}
