//! Masks as people and programs draw them: the outline strays by about a pixel, and some have a bite out or a blob added.

use glam::DVec2;
use silmap_capture::Pinhole;
use silmap_geometry::{Bvh, Mask};

use super::noise::{even, scrambled, smooth};

/// How far the outline strays at most, along each axis, and over what length, pixels.
const STRAY_PX: f64 = 1.7;
const STRAY_OVER_PX: f64 = 9.0;

/// Farther than this from the outline a mask is not drawn again, pixels.
const NEAR_PX: i64 = 4;

/// Radius of a bite or blob, over the square root of the mask's area.
const SPOILED_REL: f64 = 0.24;

/// Places on the outline that are tried for it.
const TRIED: i64 = 24;

/// Stands for the seeds of this module.
const SEED: i64 = 37;

/// The mask of a view, its outline a little off.
pub(super) fn drawn(tree: &Bvh, camera: &Pinhole, view: usize) -> Mask {
    let is_seen = |at: DVec2| {
        let ray = camera.direction(at);
        tree.first_hit(camera.eye, ray, 0.0, f64::INFINITY)
            .is_some()
    };
    let (width, height) = (camera.width, camera.height);
    let centre = |x: u32, y: u32| DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let mut exact = Mask::new(width, height);
    for (x, y) in pixels(width, height) {
        exact.set(x, y, is_seen(centre(x, y)));
    }
    let mut mask = exact.clone();
    let seed = SEED + 2 * view as i64;
    for (x, y) in pixels(width, height) {
        if !is_near_outline(&exact, (x, y)) {
            continue;
        }
        let at = centre(x, y);
        let place = [at.x / STRAY_OVER_PX, at.y / STRAY_OVER_PX, 0.0];
        let stray = DVec2::new(smooth(place, seed), smooth(place, seed + 1));
        mask.set(x, y, is_seen(at + STRAY_PX * stray));
    }
    mask
}

fn pixels(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

fn is_near_outline(mask: &Mask, (x, y): (u32, u32)) -> bool {
    let (x, y) = (i64::from(x), i64::from(y));
    let here = mask.get(x, y);
    // The outline crosses one of eight rays, or passes so narrowly between them that it does not matter.
    [
        (1, 0),
        (1, 1),
        (0, 1),
        (-1, 1),
        (-1, 0),
        (-1, -1),
        (0, -1),
        (1, -1),
    ]
    .iter()
    .any(|&(dx, dy)| (1..=NEAR_PX).any(|k| mask.get(x + k * dx, y + k * dy) != here))
}

/// Which masks are spoiled: a share of them, rounded up, spread by chance.
pub(super) fn chosen(views: usize, share: f64) -> Vec<usize> {
    let count = ((share * views as f64).ceil() as usize).min(views);
    let mut order: Vec<usize> = (0..views).collect();
    order.sort_by_key(|&v| scrambled(&[SEED, 5, v as i64]));
    order.truncate(count);
    order
}

/// Takes a bite out of a mask, or adds a blob to it: a disc about a place of its outline, of several the one where it changes most.
pub(super) fn spoil(mask: &mut Mask, view: usize) {
    let is_bite = view.is_multiple_of(2);
    let (width, height) = (mask.width(), mask.height());
    let border: Vec<(u32, u32)> = pixels(width, height)
        .filter(|&(x, y)| {
            let (x, y) = (i64::from(x), i64::from(y));
            mask.get(x, y) && !(mask.get(x + 1, y) && mask.get(x - 1, y) && mask.get(x, y + 1))
        })
        .collect();
    if border.is_empty() {
        return;
    }
    let radius = SPOILED_REL * (mask.count() as f64).sqrt();
    let disc = |(cx, cy): (u32, u32)| {
        pixels(width, height).filter(move |&(x, y)| {
            let aside = f64::from(x) - f64::from(cx);
            let below = f64::from(y) - f64::from(cy);
            aside.hypot(below) < radius
        })
    };
    let changed = |middle: (u32, u32)| {
        disc(middle)
            .filter(|&(x, y)| mask.get(x.into(), y.into()) == is_bite)
            .count()
    };
    let place = |k: i64| {
        let turn = 0.5 + 0.5 * even(&[SEED, 6, view as i64, k]);
        border[((turn * border.len() as f64) as usize).min(border.len() - 1)]
    };
    // Of equals the first.
    let best = (0..TRIED)
        .map(place)
        .rev()
        .max_by_key(|&middle| changed(middle));
    let middle = best.unwrap_or(border[0]);
    for (x, y) in disc(middle) {
        mask.set(x, y, !is_bite);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use silmap_capture::silhouette;

    use super::*;

    fn made() -> (Mask, Mask) {
        let model = silmap_models::torus(800);
        let tree = Bvh::new(&model);
        let axes = [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z];
        let lens = (DVec2::splat(300.0), DVec2::splat(80.0));
        let eye = DVec3::new(0.0, 0.0, 6.0);
        let camera = Pinhole::from_pose(eye, axes, lens, (160, 160)).unwrap();
        (
            drawn(&tree, &camera, 4),
            silhouette(&model, &camera).unwrap(),
        )
    }

    #[test]
    fn outlines_stray_by_about_a_pixel() {
        let (mask, exact) = made();
        let off = mask.count_different(&exact) as f64;
        // The outline of the torus: circles of radii 1.4 and 0.6, fifty pixels to the unit.
        let length = std::f64::consts::TAU * 2.0 * 51.0;
        assert!((0.2..1.2).contains(&(off / length)), "{}", off / length);
        assert!((mask.count() as f64 - exact.count() as f64).abs() < 0.5 * off);
    }

    #[test]
    fn spoiling_takes_out_or_adds_much_more_than_that() {
        for view in [4, 5] {
            let (mask, _) = made();
            let mut spoiled = mask.clone();
            spoil(&mut spoiled, view);
            let (more, less) = (
                spoiled.count_missing_in(&mask),
                mask.count_missing_in(&spoiled),
            );
            let (much, none) = if view == 4 {
                (less, more)
            } else {
                (more, less)
            };
            assert_eq!(none, 0);
            assert!(much as f64 > 0.03 * mask.count() as f64, "{much}");
        }
        assert_eq!(chosen(44, 0.0).len(), 0);
        assert_eq!(chosen(44, 0.02).len(), 1);
        assert_eq!(chosen(44, 0.1).len(), 5);
    }
}
