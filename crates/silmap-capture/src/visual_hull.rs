//! The silhouette of the visual hull, pixel by pixel: whether the ray through a pixel's centre meets a point that is inside the other masks.
//!
//! Nothing is divided into voxels but the ray, in steps of a pixel of the finest of the other views, so that what comes out is what carving
//! with ever smaller voxels comes to.
//!
//! Source: W. Matusik, C. Buehler, R. Raskar, S. Gortler, L. McMillan. Image-Based Visual Hulls. SIGGRAPH 2000.
//! Deviation: rays are followed in steps instead of intersected with the masks' outlines.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::{Bounds, Mask};

use crate::pinhole::Pinhole;
use crate::view::CaptureView;

/// The pixels of `camera`'s image in which the visual hull of `views` is seen.
///
/// A point is in it when at most `outvoted` views see it beside their masks, and two at least see it in theirs. It is looked for in
/// `bounds`, in the coordinates of the cameras, and only where `is_near` has pixels.
#[must_use]
pub fn visual_hull_silhouette(
    views: &[&CaptureView],
    outvoted: usize,
    camera: &Pinhole,
    (bounds, is_near): (&Bounds, &Mask),
) -> Mask {
    let finest = views
        .iter()
        .map(|v| v.camera.pixels_per_tangent() / v.camera.eye.distance(bounds.center))
        .fold(0.0, f64::max);
    let rows: Vec<Vec<u32>> = (0..camera.height)
        .into_par_iter()
        .map(|y| {
            // A view that said no to the last point is likely to say it again.
            let mut order: Vec<usize> = (0..views.len()).collect();
            let mut start = None;
            (0..camera.width)
                .filter(|&x| is_near.get(x.into(), y.into()))
                .filter(|&x| {
                    let image = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let ray = Ray::through(camera, image, bounds, finest);
                    let found = ray.and_then(|ray| {
                        ray.meets(start, |point| is_inside(views, &mut order, outvoted, point))
                    });
                    start = found.or(start);
                    found.is_some()
                })
                .collect()
        })
        .collect();
    let mut mask = Mask::new(camera.width, camera.height);
    for (y, row) in (0_u32..).zip(rows) {
        for x in row {
            mask.set(x, y, true);
        }
    }
    mask
}

/// The part of a ray in a sphere.
struct Ray {
    eye: DVec3,
    direction: DVec3,
    from: f64,
    step: f64,
    steps: u32,
}

impl Ray {
    /// `None` where the ray passes by.
    fn through(camera: &Pinhole, image: DVec2, bounds: &Bounds, finest: f64) -> Option<Self> {
        let direction = camera.direction(image).normalize_or_zero();
        let to_center = bounds.center - camera.eye;
        let along = to_center.dot(direction);
        let aside = to_center.length_squared() - along * along;
        let half = bounds.radius * bounds.radius - aside;
        if half <= 0.0 || finest <= 0.0 {
            return None;
        }
        let half = half.sqrt();
        let from = (along - half).max(0.0);
        let length = along + half - from;
        let steps = (length * finest).ceil().max(1.0) as u32;
        Some(Self {
            eye: camera.eye,
            direction,
            from,
            step: length / f64::from(steps),
            steps,
        })
    }

    /// A step at which `is_inside`, if there is one; `likely` is looked at first.
    fn meets(&self, likely: Option<u32>, mut is_inside: impl FnMut(DVec3) -> bool) -> Option<u32> {
        let at =
            |k: u32| self.eye + self.direction * (self.from + self.step * (f64::from(k) + 0.5));
        let likely = likely.filter(|&k| k < self.steps);
        likely
            .filter(|&k| is_inside(at(k)))
            .or_else(|| (0..self.steps).find(|&k| is_inside(at(k))))
    }
}

fn is_inside(views: &[&CaptureView], order: &mut [usize], outvoted: usize, point: DVec3) -> bool {
    let (mut outside, mut inside) = (0, 0);
    for place in 0..order.len() {
        let view = views[order[place]];
        let Some((image, _)) = view.camera.project(point) else {
            continue;
        };
        if !view.is_known(image) {
            continue;
        }
        if (view.mask).get(image.x.floor() as i64, image.y.floor() as i64) {
            inside += 1;
        } else {
            outside += 1;
            order[..=place].rotate_right(1);
            if outside > outvoted {
                return false;
            }
        }
    }
    inside >= 2
}
