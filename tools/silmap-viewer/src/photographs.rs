//! Photographs in the picture: small ones in space, and over the whole picture that of the camera that the eye is at.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use egui::{Color32, ColorImage, Mesh, Shape, TextureHandle, TextureId, pos2};
use glam::{DVec2, DVec3};
use silmap_capture::Pinhole;

use crate::orbit::Orbit;
use crate::overlays::View;
use crate::scene::Scene;
use crate::shot::{Shot, shrunk};

/// The most pixels that the picture over all has a side.
const FULL_SIDE_PX: u32 = 2048;

/// Small pictures that are given to the device in one frame, so that it does not wait for all.
const UPLOADS: usize = 4;

/// Half the diagonal of a small picture in space, in radii of the model.
const HALF_DIAGONAL_REL: f64 = 0.3;

/// An eye that is this near is at a camera, in radii of the model.
const AT_CAMERA_REL: f64 = 1e-6;

/// Cells of a picture's grid along each side: within one it is drawn as if without perspective.
const CELLS: u32 = 8;

/// The large picture of one photograph.
enum Full {
    Reading(Receiver<Option<ColorImage>>),
    There(TextureHandle),
    Missing,
}

/// What of the photographs is on the device.
#[derive(Default)]
pub(crate) struct ShotTextures {
    of: Arc<[Shot]>,
    small: Vec<TextureHandle>,
    full: Option<(usize, Full)>,
}

impl ShotTextures {
    /// Gives some more small pictures to the device.
    fn follow(&mut self, context: &egui::Context, shots: &Arc<[Shot]>) {
        if !Arc::ptr_eq(&self.of, shots) {
            *self = Self {
                of: Arc::clone(shots),
                ..Self::default()
            };
        }
        for shot in shots.iter().skip(self.small.len()).take(UPLOADS) {
            let none = || ColorImage::filled([1, 1], Color32::from_gray(160));
            let small = shot.small.clone().unwrap_or_else(none);
            let texture = context.load_texture(shot.name(), small, egui::TextureOptions::LINEAR);
            self.small.push(texture);
        }
        if self.small.len() < shots.len() {
            context.request_repaint();
        }
    }

    /// The large picture of a photograph, read beside the drawing, one after the other; the small one until it is there.
    fn full(&mut self, context: &egui::Context, k: usize) -> Option<TextureId> {
        if let Some((_, full @ Full::Reading(_))) = &mut self.full
            && let Full::Reading(picture) = full
        {
            let options = egui::TextureOptions::LINEAR;
            match picture.try_recv() {
                Ok(Some(picture)) => {
                    *full = Full::There(context.load_texture("photograph", picture, options));
                }
                Err(TryRecvError::Empty) => {}
                Ok(None) | Err(TryRecvError::Disconnected) => *full = Full::Missing,
            }
        }
        let is_free = !matches!(self.full, Some((_, Full::Reading(_))));
        if is_free && self.full.as_ref().is_none_or(|(of, _)| *of != k) {
            self.full = Some((k, self.read(context, k)));
        }
        match &self.full {
            Some((of, Full::There(texture))) if *of == k => Some(texture.id()),
            _ => self.small.get(k).map(TextureHandle::id),
        }
    }

    fn read(&self, context: &egui::Context, k: usize) -> Full {
        let (sender, picture) = channel();
        let (shots, context) = (Arc::clone(&self.of), context.clone());
        let side_px = FULL_SIDE_PX.min(context.input(|input| input.max_texture_side) as u32);
        let thread = std::thread::Builder::new().name("photograph".to_owned());
        let started = thread.spawn(move || {
            let read = shots.get(k).and_then(|shot| shot.source.picture());
            // Nobody listens any more where another one is looked at.
            let _ = sender.send(read.map(|picture| shrunk(picture, side_px)));
            context.request_repaint();
        });
        if started.is_ok() {
            Full::Reading(picture)
        } else {
            Full::Missing
        }
    }
}

/// Photographs in the picture.
pub(crate) struct Photographs {
    textures: ShotTextures,
    /// The photograph that was chosen last, and how it was looked at then.
    pub(crate) chosen: Option<(usize, Orbit)>,
    /// Of photographs over the picture, 0 to 1.
    pub(crate) opacity: f32,
}

impl Default for Photographs {
    fn default() -> Self {
        Self {
            textures: ShotTextures::default(),
            chosen: None,
            opacity: 0.75,
        }
    }
}

impl Photographs {
    /// Frees what is on the device of other photographs.
    pub(crate) fn keep_to(&mut self, shots: &Arc<[Shot]>) {
        if !Arc::ptr_eq(&self.textures.of, shots) {
            (self.textures, self.chosen) = (ShotTextures::default(), None);
            self.textures.of = Arc::clone(shots);
        }
    }

    /// The photograph whose camera the eye is at: of several, the chosen one.
    pub(crate) fn at_eye(&self, scene: &Scene, orbit: &Orbit) -> Option<usize> {
        let near = AT_CAMERA_REL * scene.sphere().radius;
        let eye = orbit.eye();
        let is_at = |k: &usize| {
            let shot = scene.shots.get(*k);
            shot.is_some_and(|shot| shot.camera.eye.distance(eye) < near)
        };
        let chosen = self.chosen.map(|(k, _)| k).filter(is_at);
        chosen.or_else(|| (0..scene.shots.len()).find(|k| is_at(k)))
    }

    /// The photograph after the one that is looked from, or before it; `None` where there are none.
    pub(crate) fn next(&self, scene: &Scene, orbit: &Orbit, is_forward: bool) -> Option<usize> {
        let count = scene.shots.len();
        // A camera may be too near for the eye to be at it.
        let chosen = self.chosen.filter(|(_, looked)| looked == orbit);
        let now = chosen.map(|(k, _)| k).or_else(|| self.at_eye(scene, orbit));
        let next = match (now, is_forward) {
            (Some(k), true) => (k + 1) % count.max(1),
            (Some(k), false) => k.checked_sub(1).or(count.checked_sub(1))?,
            (None, true) => 0,
            (None, false) => count.checked_sub(1)?,
        };
        (next < count).then_some(next)
    }

    /// Draws the photographs into the picture: that at the eye over it, or else all of them where they were taken.
    pub(crate) fn draw(
        &mut self,
        context: &egui::Context,
        view: &View<'_>,
        (scene, orbit): (&Scene, &Orbit),
    ) {
        let shots = &scene.shots;
        self.textures.follow(context, shots);
        let radius = scene.sphere().radius;
        if let Some(k) = self.at_eye(scene, orbit) {
            if let Some(texture) = self.textures.full(context, k) {
                let depth = orbit.distance.max(radius);
                draw(view, &shots[k], depth, (texture, self.opacity));
            }
            return;
        }
        let mut order: Vec<usize> = (0..self.textures.small.len()).collect();
        let eye = orbit.eye();
        let nearness = |&k: &usize| shots[k].camera.eye.distance(eye);
        order.sort_by(|a, b| nearness(b).total_cmp(&nearness(a)));
        for k in order {
            let shot = &shots[k];
            let depth = HALF_DIAGONAL_REL * radius * shot.depth_of_unit();
            let texture = self.textures.small[k].id();
            draw(view, shot, depth, (texture, self.opacity));
            view.pyramid(shot.camera.eye, corners(&shot.camera, depth));
        }
    }
}

/// A point of a photograph's image, put so deep in space.
fn placed(camera: &Pinhole, image: DVec2, depth: f64) -> DVec3 {
    camera.eye + camera.direction(image) * depth
}

fn corners(camera: &Pinhole, depth: f64) -> [DVec3; 4] {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
        .map(|(x, y)| placed(camera, DVec2::new(x, y), depth))
}

/// Draws a photograph on a plane before its camera.
fn draw(view: &View<'_>, shot: &Shot, depth: f64, (texture, opacity): (TextureId, f32)) {
    let camera = &shot.camera;
    let size = DVec2::new(camera.width.into(), camera.height.into());
    let colour = Color32::WHITE.gamma_multiply(opacity);
    let mut mesh = Mesh::with_texture(texture);
    let mut is_seen = Vec::new();
    for row in 0..=CELLS {
        for column in 0..=CELLS {
            let share = DVec2::new(column.into(), row.into()) / f64::from(CELLS);
            let place = view.point(placed(camera, share * size, depth));
            is_seen.push(place.is_some());
            mesh.vertices.push(egui::epaint::Vertex {
                pos: place.unwrap_or_default(),
                uv: pos2(share.x as f32, share.y as f32),
                color: colour,
            });
        }
    }
    let at = |row: u32, column: u32| row * (CELLS + 1) + column;
    for row in 0..CELLS {
        for column in 0..CELLS {
            let cell = [
                at(row, column),
                at(row, column + 1),
                at(row + 1, column),
                at(row + 1, column + 1),
            ];
            if cell.iter().all(|&v| is_seen[v as usize]) {
                mesh.add_triangle(cell[0], cell[1], cell[2]);
                mesh.add_triangle(cell[2], cell[1], cell[3]);
            }
        }
    }
    if !mesh.indices.is_empty() && mesh.calc_bounds().intersects(view.rect) {
        view.painter.add(Shape::mesh(mesh));
    }
}
