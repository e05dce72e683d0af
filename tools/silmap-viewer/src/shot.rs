//! A photograph of what is shown: its camera, and a small picture of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use egui::ColorImage;
use glam::{DVec2, DVec3};
use image::RgbaImage;
use image::imageops::{FilterType, resize};
use rayon::prelude::*;
use silmap_capture::{CameraList, Capture, Pinhole};
use silmap_map::BoundingSphere;

use crate::orbit::Orbit;

/// Pixels of all small pictures together, and the sides that one may have.
const SMALL_PX: f64 = 12e6;
const SMALL_SIDES_PX: [f64; 2] = [96.0, 640.0];

/// Room around a picture that is looked through.
const MARGIN: f64 = 1.04;

/// The mean of what is up in all photographs is so long where they agree.
const AGREEMENT: f64 = 0.4;

/// An axis that is so near is meant: 25 degrees.
const AXIS_COSINE: f64 = 0.906;

/// Where a photograph comes from.
#[derive(Debug)]
pub(crate) enum ShotSource {
    /// A view of a capture that was read whole.
    View(Arc<Capture>, usize),
    /// A camera of a camera file.
    Camera(Arc<CameraList>, usize),
}

impl ShotSource {
    fn name(&self) -> &str {
        match self {
            Self::View(capture, k) => &capture.views[*k].name,
            Self::Camera(list, k) => &list.views[*k].name,
        }
    }

    fn camera(&self) -> Pinhole {
        match self {
            Self::View(capture, k) => capture.views[*k].camera,
            Self::Camera(list, k) => list.views[*k].camera,
        }
    }

    /// The photograph without its lens; `None` where there is none that can be read.
    pub(crate) fn picture(&self) -> Option<RgbaImage> {
        match self {
            Self::View(capture, k) => capture.views[*k].photograph().ok().flatten(),
            Self::Camera(list, k) => {
                let found = list.views[*k].photograph(&list.path, true);
                found.ok().flatten()
            }
        }
    }
}

/// A photograph's camera, and a small picture of it.
#[derive(Debug)]
pub(crate) struct Shot {
    pub(crate) source: ShotSource,
    /// In the coordinates of the scene.
    pub(crate) camera: Pinhole,
    pub(crate) small: Option<ColorImage>,
}

impl Shot {
    /// All photographs about an origin, in the order that they come in, telling what share is done; none where that was stopped.
    pub(crate) fn all(
        sources: impl Iterator<Item = ShotSource>,
        origin: DVec3,
        (tell, stop): (&(dyn Fn(f32) + Sync), &AtomicBool),
    ) -> Arc<[Self]> {
        let sources: Vec<_> = sources.collect();
        let count = sources.len();
        let side = (SMALL_PX / count.max(1) as f64).sqrt();
        let side_px = side.clamp(SMALL_SIDES_PX[0], SMALL_SIDES_PX[1]) as u32;
        let done = AtomicUsize::new(0);
        let shots: Vec<_> = (sources.into_par_iter())
            .map(|source| {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                let small = source.picture().map(|picture| shrunk(picture, side_px));
                tell((1 + done.fetch_add(1, Ordering::Relaxed)) as f32 / count as f32);
                Some(Self {
                    camera: source.camera().moved(-origin),
                    source,
                    small,
                })
            })
            .collect();
        let shots: Option<Vec<_>> = shots.into_iter().collect();
        shots.unwrap_or_default().into()
    }

    /// What the camera file calls it.
    pub(crate) fn name(&self) -> &str {
        self.source.name()
    }

    /// How far from the eye its picture's half diagonal is one.
    pub(crate) fn depth_of_unit(&self) -> f64 {
        let camera = &self.camera;
        let corner = camera.tangent(DVec2::ZERO);
        let opposite = camera.tangent(DVec2::new(camera.width.into(), camera.height.into()));
        2.0 / (opposite - corner).length()
    }

    /// The view from its camera, as one of another orbit, that shows all of its picture in a window of this aspect.
    pub(crate) fn orbit(&self, from: &Orbit, sphere: BoundingSphere, aspect: f64) -> Orbit {
        let camera = &self.camera;
        let [_, down, forward] = camera.axes;
        let to_middle = sphere.center - camera.eye;
        let depth = to_middle.dot(forward).max(sphere.radius);
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let corners = [DVec2::ZERO, size].map(|corner| camera.tangent(corner).abs());
        let far = corners[0].max(corners[1]) * MARGIN;
        let tangent = far.y.max(far.x / aspect);
        let target = camera.eye + forward * depth;
        from.looking(camera.eye, target, Some(-down), 2.0 * tangent.atan())
    }
}

/// What is upwards, as people hold cameras: along an axis where that is near; `None` where the photographs do not agree.
pub(crate) fn upwards<'a>(cameras: impl Iterator<Item = &'a Pinhole>) -> Option<DVec3> {
    let ups: Vec<DVec3> = cameras.map(|camera| -camera.axes[1]).collect();
    let mean = ups.iter().sum::<DVec3>() / ups.len().max(1) as f64;
    let up = (mean.length() > AGREEMENT).then(|| mean.normalize_or_zero())?;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let both = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let nearest = both.max_by(|a, b| a.dot(up).total_cmp(&b.dot(up)))?;
    Some(if nearest.dot(up) > AXIS_COSINE {
        nearest
    } else {
        up
    })
}

/// A picture with neither side longer than this.
pub(crate) fn shrunk(picture: RgbaImage, side_px: u32) -> ColorImage {
    let (width, height) = picture.dimensions();
    let longest = width.max(height);
    let picture = if longest > side_px {
        let fitted = |v: u32| (u64::from(v) * u64::from(side_px) / u64::from(longest)).max(1);
        let (width, height) = (fitted(width) as u32, fitted(height) as u32);
        resize(&picture, width, height, FilterType::Triangle)
    } else {
        picture
    };
    let size = [picture.width() as usize, picture.height() as usize];
    ColorImage::from_rgba_unmultiplied(size, picture.as_raw())
}
