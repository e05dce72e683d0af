//! How far the outlines of a scene's instances are from the exact ones, instance by instance, in the scene's pixels.

use glam::DVec2;
use serde::Serialize;
use silmap_geometry::Loop;

use crate::{Deviation, deviation};

/// Distances between outlines, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct OutlineErrorPx {
    /// Mean distance of boundary points.
    pub mean: f64,
    /// The largest distance.
    pub largest: f64,
    /// The thickest place of what only one outline holds.
    pub thickest: f64,
}

impl OutlineErrorPx {
    pub(super) fn of(all: &[Deviation]) -> Self {
        if all.is_empty() {
            return Self::default();
        }
        let largest = |of: fn(&Deviation) -> f64| all.iter().map(of).fold(0.0, f64::max);
        Self {
            mean: all.iter().map(|d| d.mean_px).sum::<f64>() / all.len() as f64,
            largest: largest(|d| d.most_px),
            thickest: largest(|d| d.thickest_px),
        }
    }
}

/// How far two outlines are apart, wherever in a large picture they are.
pub(super) fn apart(one: &[Loop], two: &[Loop]) -> Deviation {
    const ROOM_PX: f64 = 2.0;
    let all = || one.iter().chain(two).flatten().copied();
    let least = all().reduce(DVec2::min).unwrap_or_default() - ROOM_PX;
    let most = all().reduce(DVec2::max).unwrap_or_default() + ROOM_PX;
    let moved = |loops: &[Loop]| -> Vec<Loop> {
        loops
            .iter()
            .map(|l| l.iter().map(|p| p - least).collect())
            .collect()
    };
    let size = (most - least).ceil().max(DVec2::ONE);
    deviation(&moved(one), &moved(two), (size.x as u32, size.y as u32))
}
