//! A box around what the masks leave, found without knowing where to look.

use glam::{DMat3, DVec2, DVec3, UVec3};
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::field::Field;
use crate::octree::{Grid, LEAF, Leaf, leaves};
use crate::residual::median;
use crate::signed_distance::bounds_of;
use crate::view::CaptureView;

/// Blocks along the side of a box while it is made smaller.
const BLOCKS: u32 = 48;

/// The box is looked at again as long as it becomes smaller by this factor, and so often at most.
const SMALLER: f64 = 0.95;
const MOST_ROUNDS: u32 = 12;

/// Half the side of the first box, in distances of the cameras from its middle.
const FIRST_REACH: f64 = 0.95;

/// How singular the equations for a point near all rays may be: rays that are parallel to a thousandth.
const LEAST_DETERMINANT: f64 = 1e-6;

/// The point nearest to the rays through the middles of all masks, and the median distance of the cameras from it; `None` where the
/// rays are parallel.
pub(crate) fn middle_of(views: &[CaptureView]) -> Option<(DVec3, f64)> {
    let (mut left, mut right) = (DMat3::ZERO, DVec3::ZERO);
    // About the first eye, which keeps the digits of cameras that are far from the origin.
    let origin = views.first()?.camera.eye;
    for view in views {
        let (low, high) = bounds_of(&view.mask)?;
        let half = |k: usize| 0.5 * (f64::from(low[k]) + f64::from(high[k]));
        let ray = view.camera.direction(DVec2::new(half(0), half(1)));
        let ray = ray.normalize_or_zero();
        let across = DMat3::IDENTITY - DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        left += across;
        right += across * (view.camera.eye - origin);
    }
    let count = views.len() as f64;
    if (left * (1.0 / count)).determinant() < LEAST_DETERMINANT {
        return None;
    }
    let middle = origin + left.inverse() * right;
    let distance = median(views.iter().map(|v| v.camera.eye.distance(middle)))?;
    (middle.is_finite() && distance > 0.0).then_some((middle, distance))
}

/// The first box: around the middle of all rays, almost as large as the ring of cameras.
pub(crate) fn first_box((middle, distance): (DVec3, f64)) -> [DVec3; 2] {
    let half = DVec3::splat(FIRST_REACH * distance);
    [middle - half, middle + half]
}

/// The smallest box of blocks around what is not outside in the box, with a margin; `None` where everything is.
pub(crate) fn shrink(
    field: &Field<'_>,
    mut around: [DVec3; 2],
    (stage, watch): (Stage, &Watch<'_>),
) -> Result<Option<[DVec3; 2]>, Interrupted> {
    let quiet = watch.quiet();
    let limits = around;
    for _ in 0..MOST_ROUNDS {
        let grid = Grid::over(around, BLOCKS * LEAF);
        let found = leaves(field, &grid, (stage, &quiet))?;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let is_near: Vec<bool> = (found.par_iter())
            .map(|leaf| leaf.is_full || comes_near(field, &grid, leaf))
            .collect();
        for (leaf, _) in found.iter().zip(&is_near).filter(|(_, near)| **near) {
            low = low.min(grid.point(leaf.first));
            high = high.max(grid.point(leaf.first) + f64::from(LEAF) * grid.cell);
        }
        if low.x > high.x {
            return Ok(None);
        }
        let before = (around[1] - around[0]).max_element();
        around = [low.max(limits[0]), high.min(limits[1])];
        if (around[1] - around[0]).max_element() > SMALLER * before {
            break;
        }
    }
    Ok(Some(around))
}

/// Whether the hull may come near a leaf. What is known of whole blocks is not enough: at the border of what cameras see, little is.
fn comes_near(field: &Field<'_>, grid: &Grid, leaf: &Leaf) -> bool {
    const STEP: u32 = 2;
    const STEPS: u32 = LEAF / STEP;
    // As far as from a point to the corners that it stands for, and more.
    let near = f64::from(STEP) * grid.cell;
    let mut room = Vec::new();
    (0..STEPS.pow(3)).any(|k| {
        let step = UVec3::new(k % STEPS, k / STEPS % STEPS, k / (STEPS * STEPS));
        let point = grid.point(leaf.first + STEP * step) + DVec3::splat(0.5 * near);
        field.value(point, &leaf.votes, 2.0 * near, &mut room) < near
    })
}
