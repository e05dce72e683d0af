//! Photographs of the original: as texture views, and as colours of single points.
//!
//! A texture view at a photograph's own eye shows the photograph under a homography, whatever the geometry between. Where the photograph
//! shows no object the colours of the object run on, so that no filter and no smaller version of the picture takes background in.
//!
//! Sources: P. Debevec, C. Taylor, J. Malik. Modeling and Rendering Architecture from Photographs. SIGGRAPH 1996, section 3 (photographs
//! projected onto a coarse model); R. Hartley, A. Zisserman. Multiple View Geometry, 2nd edition, 2004, section 8.4.2 (one eye, two
//! image planes).

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{Camera, ClosedMesh, Photograph, TriangleMesh};

use super::item_buffer::ItemBuffer;
use super::picture::Picture;
use super::visibility::{HullFaces, lattice};
use crate::progress;

/// A texture view wider than this (tangent of half the field of view) is too close to what it shows.
const MOST_TANGENT: f64 = 4.0;

/// Of the places of a face, so many must show the object in a photograph that paints it.
const LEAST_SHOWN: f64 = 0.6;

/// Places are taken so far towards the face's middle from its edges, which may be the object's border.
const TOWARDS_MIDDLE: f64 = 0.15;

/// The others lie at most so far beside what is shown: colours run on that far without telling lies. Pixels.
const RUN_ON_PX: f64 = 3.0;

/// Most samples along each axis of a pixel of a texture view, where the photograph is that much finer.
const MOST_SAMPLES: usize = 6;

/// Side of the pictures that tell what a photograph's eye sees of the original, pixels.
const DEPTH_PX: u32 = 384;

/// How far the original may lie in front of a point and not hide it, as a share of the bounding radius.
const SLACK_REL: f64 = 0.015;

/// Weights of photographs at a point: those more oblique than the first have none; the rest by the cosine to this power.
const LEAST_COSINE: f64 = 0.1;
const SHARPNESS: i32 = 6;

/// Farther from the border than this a photograph has all of its weight, pixels; at the border it has none.
const FADE_PX: f64 = 6.0;

/// Weight of the surface's own colour beside those of photographs, so that the one goes over into the others: a hundredth of what an oblique
/// photograph has (at a cosine of one half 2.5e-3).
const OWN_WEIGHT: f64 = 1e-5;

/// The square camera at a photograph's eye that looks at a point with the photograph's own up; `None` where the eye is at that point.
pub(super) fn camera_at(photograph: &Photograph, target: DVec3, side_px: u32) -> Option<Camera> {
    let [_, below, forward] = photograph.image_from_object.map(|row| row.truncate());
    let ahead = forward.normalize_or_zero();
    let up = -(below - below.dot(ahead) * ahead);
    let look = |up| Camera::with_half_tangent(photograph.eye, target, up, 1.0, (side_px, side_px));
    look(Some(up)).or_else(|_| look(None)).ok()
}

/// Whether a texture view holds the whole hull at a sensible angle.
pub(super) fn is_in_front(camera: &Camera, hull: &HullFaces) -> bool {
    let mut points = hull.corners.iter().flatten();
    camera.half_tangent.max_element() <= MOST_TANGENT && points.all(|&p| camera.depth(p) > 0.0)
}

/// Whether the photograph shows the surface that a face stands for, and no background there.
pub(super) fn shows_face(photograph: &Photograph, points: [DVec3; 3]) -> bool {
    let (mut shown, mut all) = (0, 0);
    for weights in lattice() {
        let inward = weights.map(|w| w + TOWARDS_MIDDLE * (1.0 / 3.0 - w));
        let point: DVec3 = (0..3).map(|k| points[k] * inward[k]).sum();
        let Some(image) = photograph.project(point) else {
            return false;
        };
        all += 1;
        if photograph.look(image).is_some() {
            shown += 1;
        } else if !is_near_what_is_shown(photograph, image) {
            return false;
        }
    }
    f64::from(shown) >= LEAST_SHOWN * f64::from(all)
}

fn is_near_what_is_shown(photograph: &Photograph, image: DVec2) -> bool {
    let away = photograph.border_px + RUN_ON_PX;
    (0..8).any(|k| {
        let turn = f64::from(k) * std::f64::consts::FRAC_PI_4;
        let aside = away * DVec2::new(turn.cos(), turn.sin());
        photograph.look(image + aside).is_some()
    })
}

/// The photograph as a camera at its eye takes it; what it does not show stays unknown.
pub(super) fn resampled(photograph: &Photograph, camera: &Camera) -> Picture {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let place = |at: DVec2| photograph.image_from_direction(camera.direction_from_image(at));
    // Pixels of the photograph beside one of the picture, in its middle: it changes little over the picture.
    let middle = 0.5 * camera.size();
    let finer = match (place(middle), place(middle + DVec2::X)) {
        (Some(a), Some(b)) => a.distance(b),
        _ => 1.0,
    };
    let samples = (finer.ceil() as usize).clamp(1, MOST_SAMPLES);
    let mut picture = Picture::new(width, height);
    for y in 0..height {
        for x in 0..width {
            for sample in 0..samples * samples {
                let step = |k: usize| (k as f64 + 0.5) / samples as f64;
                let at = DVec2::new(
                    x as f64 + step(sample % samples),
                    y as f64 + step(sample / samples),
                );
                if let Some(seen) = place(at).and_then(|image| photograph.look(image)) {
                    picture.add(y * width + x, seen.colour);
                }
            }
        }
    }
    picture
}

/// Photographs that are asked for the colours of points of the original.
#[derive(Debug)]
pub(super) struct Looks<'a> {
    /// Each with what its eye sees of the original.
    of: Vec<(&'a Photograph, Camera, DepthMap)>,
    slack: f64,
}

impl<'a> Looks<'a> {
    pub(super) fn new(
        original: &ClosedMesh,
        photographs: &'a [Photograph],
        fit: impl Fn(&Camera) -> Camera + Sync,
        watch: &Watch<'_>,
    ) -> Result<Self, Interrupted> {
        let center = original.bounds().center;
        let of = (photographs.par_iter())
            .map(|photograph| {
                watch.check()?;
                watch.advance(progress::TEXTURES, 1);
                Ok(camera_at(photograph, center, DEPTH_PX).map(|camera| {
                    let camera = fit(&camera);
                    let depths = DepthMap::draw(&camera, original.mesh());
                    (photograph, camera, depths)
                }))
            })
            .collect::<Result<Vec<_>, Interrupted>>()?;
        Ok(Self {
            of: of.into_iter().flatten().collect(),
            slack: SLACK_REL * original.bounds().radius,
        })
    }

    /// The colour of a point with this unit normal, where nothing but photographs counts `own`.
    pub(super) fn colour(&self, point: DVec3, normal: DVec3, own: [f32; 3]) -> [f32; 3] {
        let mut sum = own.map(|c| OWN_WEIGHT * f64::from(c));
        let mut weights = OWN_WEIGHT;
        for (photograph, camera, depths) in &self.of {
            let cosine = (photograph.eye - point).normalize_or_zero().dot(normal);
            if cosine <= LEAST_COSINE {
                continue;
            }
            let seen = photograph.project(point).and_then(|at| photograph.look(at));
            let Some(seen) = seen else { continue };
            let depth = camera.depth(point);
            let image = camera.image_from_object(point);
            if depth <= 0.0 || depth > depths.farthest_around(image) + self.slack {
                continue;
            }
            let trust = (seen.inside_px / FADE_PX).clamp(0.0, 1.0);
            let weight = trust * (cosine - LEAST_COSINE).powi(2) * cosine.powi(SHARPNESS);
            for (s, c) in sum.iter_mut().zip(seen.colour) {
                *s += weight * f64::from(c);
            }
            weights += weight;
        }
        sum.map(|s| (s / weights) as f32)
    }
}

/// How deep the nearest surface lies at each pixel, in less memory than an [`ItemBuffer`].
#[derive(Debug)]
struct DepthMap {
    side: i64,
    inverse_depths: Vec<f32>,
}

impl DepthMap {
    fn draw(camera: &Camera, mesh: &TriangleMesh) -> Self {
        let buffer = ItemBuffer::draw_mesh(camera, mesh);
        let pixels = camera.width_px as usize * camera.height_px as usize;
        Self {
            side: camera.width_px.into(),
            inverse_depths: (0..pixels)
                .map(|p| buffer.inverse_depth(p) as f32)
                .collect(),
        }
    }

    /// As [`ItemBuffer::farthest_around`].
    fn farthest_around(&self, p: DVec2) -> f64 {
        let (x, y) = (p.x.floor() as i64, p.y.floor() as i64);
        let inside = 1..self.side - 1;
        if !inside.contains(&x) || !inside.contains(&y) {
            return f64::INFINITY;
        }
        let around = (y - 1..=y + 1).flat_map(|j| (x - 1..=x + 1).map(move |i| j * self.side + i));
        let smallest = around
            .map(|at| self.inverse_depths[at as usize])
            .fold(f32::INFINITY, f32::min);
        1.0 / f64::from(smallest)
    }
}
