//! What the program knows: what is loaded, how it is looked at, and what has been said.

use silmap_map::MapReader;

use crate::loader::{Loading, News, watched};
use crate::look::{Look, Pose, Shown, Upwards};
use crate::making::{Ready, Shape};
use crate::orbit::Orbit;
use crate::panes::Panes;
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

/// What sliders are at while they are dragged: the asset is made anew for where they come to rest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Dragged {
    pub(crate) views: Option<u32>,
    pub(crate) faces: Option<u32>,
}

/// What is loaded, and how it is looked at.
pub struct Viewer {
    pub(crate) stage: Option<Stage>,
    pub(crate) scene: Scene,
    /// What was made of what was loaded.
    pub(crate) shape: Shape,
    /// Whether lights can be moved, where that was tried.
    pub(crate) can_relight: Option<bool>,
    /// What sliders that are being dragged are at.
    pub(crate) dragged: Dragged,
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
    /// Whether it goes on turning when it is let go.
    pub(crate) has_inertia: bool,
    /// How the picture is dragged, or was when it was let go, points in a second.
    pub(crate) spin: egui::Vec2,
    pub(crate) timing: Timing,
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) export: Export,
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) error: crate::live_error::LiveError,
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) photographs: crate::photographs::Photographs,
    /// Where the pictures are in the window.
    pub(crate) panes: Panes,
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
            shape: Shape::default(),
            can_relight: None,
            dragged: Dragged::default(),
            reader: None,
            look,
            orbit: Orbit::default(),
            frames_next: true,
            loading: None,
            panel_is_open: true,
            help_is_open: false,
            hint_is_shown: true,
            is_turning: false,
            has_inertia: false,
            spin: egui::Vec2::ZERO,
            timing: Timing::default(),
            #[cfg(not(target_arch = "wasm32"))]
            export: Export::default(),
            #[cfg(not(target_arch = "wasm32"))]
            error: crate::live_error::LiveError::default(),
            #[cfg(not(target_arch = "wasm32"))]
            photographs: crate::photographs::Photographs::default(),
            panes: Panes::default(),
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
        // Where y upwards is not the same.
        let is_other = orbit.roll_rad != 0.0
            || orbit.elevation_rad.abs() > 1.57
            || orbit.upwards != glam::DVec3::Y;
        let origin = self.scene.origin;
        let look = Look {
            pose: (!self.scene.is_empty()).then(|| Pose {
                eye: orbit.eye() + origin,
                target: Some(orbit.target + origin),
                up: is_other.then_some(up),
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
    }

    /// The method of a pane, 0 or 1.
    pub(crate) fn method_of(&self, pane: usize) -> silmap_map::Method {
        let beside = self.look.beside_method.filter(|_| pane == 1);
        self.scene.method(beside.unwrap_or(self.look.method).0)
    }

    /// Where the picture is in the window: left, top, width and height, pixels.
    #[must_use]
    pub fn picture_place(&self) -> [f32; 4] {
        let Panes {
            origin_px: [x, y],
            size_px: (width, height),
            ..
        } = self.panes;
        [x, y, width as f32, height as f32]
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

    /// What is upwards: as it is asked for, or as the scene has it.
    pub(crate) fn upwards(&self) -> glam::DVec3 {
        match self.look.upwards {
            Upwards::Auto => self.scene.upwards.unwrap_or(glam::DVec3::Y),
            Upwards::Y => glam::DVec3::Y,
            Upwards::Z => glam::DVec3::Z,
        }
    }

    /// Looks at all of it.
    pub(crate) fn frame(&mut self) {
        self.orbit.frame(self.framed_sphere(), self.panes.aspect());
    }

    /// Takes what was made in place of what was shown.
    pub(crate) fn show(&mut self, ready: Ready) {
        let Some(stage) = &mut self.stage else {
            return;
        };
        let was_empty = self.scene.is_empty();
        let is_same = !was_empty && ready.scene.source == self.scene.source;
        if ready.renderer.is_some() {
            self.can_relight = ready.can_relight;
        }
        stage.take(ready.renderer, ready.crowd, ready.shape.relight);
        self.reader = ready.reader;
        self.shape = ready.shape;
        self.scene = ready.scene;
        #[cfg(not(target_arch = "wasm32"))]
        self.photographs.keep_to(&self.scene.shots);
        if !is_same && !was_empty {
            // They were asked for of something else.
            (self.look.keep, self.look.faces) = (None, None);
        }
        self.keep_to_shape(ready.asked);
        if !ready.is_reshaped {
            self.message = (!self.scene.warnings.is_empty()).then(|| Message {
                text: self.scene.warnings.join("\n"),
                is_error: false,
            });
            self.timing.clear();
            self.frames_next |= !is_same;
        }
        if let Some(text) = ready.complaint {
            self.say(text, true);
        }
    }

    /// Asks for no other views and no other hull than are shown, where it is what was asked for; what was chosen since then comes next.
    fn keep_to_shape(&mut self, asked: Shape) {
        if self.scene.asset.is_some() && self.look.keep == asked.keep {
            self.look.keep = self.shape.keep;
        }
        if self.scene.can_have_other_hull() && self.look.faces == asked.faces {
            self.look.faces = self.shape.faces;
        }
    }

    /// What was asked for cannot be had, or is not wanted any more.
    pub(crate) fn fall_back(&mut self, asked: Shape) {
        self.keep_to_shape(asked);
        if asked.relight && !self.shape.relight {
            self.look.light = None;
        }
        if asked.crowd != self.shape.crowd {
            self.look.instances = 1;
        }
    }

    /// The shape that is asked for.
    fn wanted(&self) -> Shape {
        let is_asset = self.scene.asset.is_some();
        let is_crowd = is_asset && self.look.instances > 1;
        let method = self.scene.method(self.look.method.0);
        Shape {
            keep: self.look.keep.filter(|_| is_asset),
            faces: (self.look.faces).filter(|_| self.scene.can_have_other_hull()),
            // What is there stays.
            relight: self.look.light.is_some() || self.shape.relight,
            crowd: if is_crowd {
                Some(method)
            } else {
                self.shape.crowd
            },
        }
    }

    /// The shape to give to what is loaded next.
    pub(crate) fn wanted_of_next(&self) -> Shape {
        let is_crowd = self.look.instances > 1;
        // What is asked for of what is shown is not asked for of something else.
        let is_first = self.scene.is_empty();
        Shape {
            keep: self.look.keep.filter(|_| is_first),
            faces: self.look.faces.filter(|_| is_first),
            relight: self.look.light.is_some(),
            crowd: is_crowd.then(|| self.scene.method(self.look.method.0)),
        }
    }

    /// Begins to make what is asked for of what is shown, where it has another shape.
    pub(crate) fn catch_up(&mut self, context: &egui::Context) {
        if self.look.light.is_some() && self.can_relight == Some(false) {
            self.look.light = None;
            self.say(silmap_study::RenderError::NotRelit.to_string(), true);
        }
        let wanted = self.wanted();
        if self.loading.is_some() || self.scene.is_empty() || wanted == self.shape {
            return;
        }
        let Some(maker) = self.stage.as_ref().map(Stage::maker) else {
            return;
        };
        let (scene, shapes) = (self.scene.clone(), (wanted, Some(self.shape)));
        let name = scene.name.clone();
        let mut loading = Loading::beside(context, &name, move |teller, stop| {
            let made = watched(teller, stop, |watch| maker.make(scene, shapes, watch));
            match made {
                Ok(Some(ready)) => News::Done(Box::new(ready)),
                Ok(None) => News::Stopped,
                Err(error) => News::Failed(error),
            }
        });
        loading.reshapes = Some(wanted);
        loading.progress.0 = "making ready".to_owned();
        self.loading = Some(loading);
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

    /// Looks from a photograph's camera.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn look_from_shot(&mut self, k: usize) {
        let aspect = self.panes.aspect();
        if let Some(shot) = self.scene.shots.get(k) {
            self.orbit = shot.orbit(&self.orbit, self.scene.sphere(), aspect);
            self.orbit.keep_outside(self.scene.sphere());
            self.photographs.chosen = Some((k, self.orbit));
            self.look.overlays.photographs = true;
        }
    }

    /// Looks from the next photograph, or the one before.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn step_shots(&mut self, is_forward: bool) {
        if let Some(k) = self.photographs.next(&self.scene, &self.orbit, is_forward) {
            self.look_from_shot(k);
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
