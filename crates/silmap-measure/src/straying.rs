//! How far two outlines stray from each other, in pixels: how far points on the boundary of each are from the boundary of the other.
//!
//! Shares of wrong pixels do not tell a hair or a slit from nothing, because they are thin; its length tells here.
//!
//! Source: the distances are those of Cignoni, Rocchini, Scopigno. Metro: Measuring Error on Simplified Surfaces. Computer Graphics
//! Forum 17(2), 1998, for curves of a plane; both directions are kept apart until the end.
//! Deviation: samples are half a pixel apart and compared with the other boundary's segments, not with its samples. A distance
//! between samples is larger, by less than a quarter of a pixel, and by almost nothing where it is some pixels. The largest distance
//! of all points of a boundary is at most a quarter of a pixel above that of its samples.

use glam::DVec2;
use serde::Serialize;
use silmap_geometry::Loop;
use silmap_geometry::polygon::edges;

use crate::nearest::SegmentGrid;

/// Pixels from one sample of a boundary to the next, at most.
const STEP_PX: f64 = 0.5;

/// The share of a boundary's samples that is nearer than [`Straying::p99_px`].
const MOST: f64 = 0.99;

/// How far two outlines stray from each other. Zero where neither has a boundary, infinite where only one has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Straying {
    /// Mean distance of a boundary point from the other boundary: the mean of both directions' means.
    pub mean_px: f64,
    /// 99 of 100 boundary points are at most so far: the larger of both directions'.
    pub p99_px: f64,
    /// The largest distance of both directions.
    pub largest_px: f64,
    /// Where that is: the point on the one boundary, pixels from the picture's corner.
    pub place: DVec2,
    /// The nearest point to it on the other.
    pub nearest: DVec2,
}

/// How far outlines stray from each other over some pictures, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StrayingSummary {
    /// Mean of [`Straying::mean_px`].
    pub mean: f64,
    /// Median of [`Straying::p99_px`].
    pub p99_median: f64,
    /// Median of [`Straying::largest_px`].
    pub largest_median: f64,
    /// What it is at most in nine of ten pictures.
    pub largest_p90: f64,
    /// What it is at the worst.
    pub largest: f64,
}

impl StrayingSummary {
    /// Of what was found in each picture; `None` of no picture.
    pub fn of(all: impl Iterator<Item = Straying>) -> Option<Self> {
        let all: Vec<Straying> = all.collect();
        let sorted = |of: fn(&Straying) -> f64| {
            let mut values: Vec<f64> = all.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let largest = sorted(|s| s.largest_px);
        Some(Self {
            mean: all.iter().map(|s| s.mean_px).sum::<f64>() / all.len() as f64,
            p99_median: quantile(&sorted(|s| s.p99_px), 0.5),
            largest_median: quantile(&largest, 0.5),
            largest_p90: quantile(&largest, 0.9),
            largest: *largest.last()?,
        })
    }
}

/// How far two outlines stray from each other: closed loops of both, in one picture.
#[must_use]
pub fn straying(one: &[Loop], two: &[Loop]) -> Straying {
    between(&boundary(one), &boundary(two))
}

/// The edges of all loops.
pub(crate) fn boundary(loops: &[Loop]) -> SegmentGrid {
    SegmentGrid::new(loops.iter().flat_map(|l| edges(l)).collect())
}

/// As [`straying`], of boundaries.
pub(crate) fn between(one: &SegmentGrid, two: &SegmentGrid) -> Straying {
    let (there, back) = (strays(one, two), strays(two, one));
    let (Some(there), Some(back)) = (there, back) else {
        let is_either = !(one.segments().is_empty() && two.segments().is_empty());
        let off = if is_either { f64::INFINITY } else { 0.0 };
        let place = one.segments().first().or(two.segments().first());
        let place = place.map_or(DVec2::ZERO, |s| s.0);
        return Straying {
            mean_px: off,
            p99_px: off,
            largest_px: off,
            place,
            nearest: place,
        };
    };
    let worse = if back.largest_px > there.largest_px {
        back
    } else {
        there
    };
    Straying {
        mean_px: f64::midpoint(there.mean_px, back.mean_px),
        p99_px: there.p99_px.max(back.p99_px),
        ..worse
    }
}

/// One direction; `None` where one of the two has no boundary.
fn strays(from: &SegmentGrid, to: &SegmentGrid) -> Option<Straying> {
    let mut found = Vec::new();
    let mut worst = None;
    for &(a, b) in from.segments() {
        let steps = (a.distance(b) / STEP_PX).ceil().max(1.0);
        for k in 0..steps as usize {
            let place = a.lerp(b, k as f64 / steps);
            let nearest = to.nearest(place)?;
            found.push(nearest.distance_squared);
            if worst.is_none_or(|(most, _, _)| nearest.distance_squared > most) {
                worst = Some((nearest.distance_squared, place, nearest));
            }
        }
    }
    let (_, place, nearest) = worst?;
    for distance in &mut found {
        *distance = distance.sqrt();
    }
    found.sort_by(f64::total_cmp);
    Some(Straying {
        mean_px: found.iter().sum::<f64>() / found.len() as f64,
        p99_px: quantile(&found, MOST),
        largest_px: quantile(&found, 1.0),
        place,
        nearest: to.point(place, nearest),
    })
}

/// Which value so large a share of them are below, between two values in proportion; zero of none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * sorted.len().saturating_sub(1) as f64;
    let value = |k: f64| sorted.get(k as usize).copied().unwrap_or(0.0);
    let (below, above) = (value(at.floor()), value(at.ceil()));
    // Infinities have no difference.
    if below == above {
        below
    } else {
        below + (above - below) * at.fract()
    }
}

#[cfg(test)]
mod tests;
