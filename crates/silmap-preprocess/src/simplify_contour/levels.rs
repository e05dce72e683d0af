//! Levels of detail of a contour, as nested subsets of its vertices.
//!
//! The greedy removal of [`super::simplify_contours`] goes on beyond the stored tolerance t, which doubles from level to level:
//! level k stays within 2ᵏ·t of the traced outline. Vertices do not move any more, so each level is a subset of the one before and
//! one small number a vertex, the coarsest level that has it, stores all of them. A vertex goes where the stored outline stays
//! within (2ᵏ − 1)·t of the edge across it; no level crosses itself, and none changes the nesting of its loops.
//!
//! Depths count too: a vertex also stays where the depth along the edge would be off by more than [`DEPTH_SHARE`] lets pass.
//!
//! In outward mode only concave vertices go, so that each level contains the one before. A convex outline keeps all of its
//! vertices then.
//!
//! Source: Silhouette Mapping, section 4, for the removal; levels are not in the paper.

use glam::DVec2;
use rayon::prelude::*;
use silmap_geometry::polygon::distance_squared_to_segment;
use silmap_geometry::{CoverageRule, Loop};
use silmap_map::{CapturedView, SilhouetteMap, ViewContour};

use super::outline::{Proposal, SimplifiedLoops, turn};
use super::{SimplifyContourParams, remove_vertices};

/// How much of an error in depth counts as an error in the image. Seen from between the views, a point that is too deep by so much
/// is beside its place by that times the sine of the angle, about a tenth; where the rule follows tangents it is less.
const DEPTH_SHARE: f64 = 0.1;

/// Finds the levels of all contours of a map, from its own tolerance and coverage rule; what was there is replaced.
pub fn add_levels(map: &mut SilhouetteMap) {
    let params = SimplifyContourParams {
        tolerance_px: map.tolerance_px,
        outward_only: map.coverage == CoverageRule::Any,
    };
    map.views
        .par_iter_mut()
        .for_each(|view| add_levels_to_view(view, &params));
}

pub(super) fn add_levels_to_view(view: &mut CapturedView, params: &SimplifyContourParams) {
    let px_per_tangent = 0.5 * f64::from(view.camera.width_px) / view.camera.half_tangent.x;
    // Contours of several parts may cross.
    for contours in view.contours.chunk_by_mut(|a, b| a.part == b.part) {
        let loops: Vec<Loop> = contours.iter().map(|c| c.points.clone()).collect();
        let deep = Deep::new(contours, px_per_tangent);
        let mut levels = levels_of(&loops, &deep, params).into_iter();
        for contour in contours {
            contour.levels = levels.by_ref().take(contour.points.len()).collect();
        }
    }
}

/// The vertices of all loops with the scale that compares their depths with pixels.
struct Deep {
    points: Vec<DVec2>,
    /// Inverse depths, which are linear along an edge's picture; empty where there are none.
    inverse: Vec<f64>,
    /// First and end vertex of each vertex's loop.
    loop_of: Vec<[u32; 2]>,
    px_per_tangent: f64,
}

impl Deep {
    fn new(contours: &[ViewContour], px_per_tangent: f64) -> Self {
        let has_depth = contours.iter().all(|c| c.depths.len() == c.points.len());
        let mut deep = Self {
            points: Vec::new(),
            inverse: Vec::new(),
            loop_of: Vec::new(),
            px_per_tangent,
        };
        for contour in contours {
            let first = deep.points.len() as u32;
            let end = first + contour.points.len() as u32;
            deep.points.extend(&contour.points);
            deep.loop_of.resize(end as usize, [first, end]);
            if has_depth {
                deep.inverse.extend(contour.depths.iter().map(|z| 1.0 / z));
            }
        }
        deep
    }

    /// The largest error of an edge from vertex `from` to vertex `to` of a loop at the vertices between: their distance from it
    /// or the share of the depth that counts, pixels, squared.
    fn worst_squared(&self, from: u32, to: u32) -> f64 {
        let [first, end] = self.loop_of[from as usize];
        let (a, b) = (self.points[from as usize], self.points[to as usize]);
        let along = b - a;
        let scale = 1.0 / along.length_squared().max(f64::MIN_POSITIVE);
        let next = |v: u32| if v + 1 == end { first } else { v + 1 };
        let mut worst = 0.0_f64;
        let mut v = next(from);
        while v != to {
            let p = self.points[v as usize];
            worst = worst.max(distance_squared_to_segment(p, a, b));
            if !self.inverse.is_empty() {
                let t = ((p - a).dot(along) * scale).clamp(0.0, 1.0);
                let [near, far, own] = [from, to, v].map(|v| self.inverse[v as usize]);
                // The relative error of the depth times the focal length is its size in the image.
                let off = (own / (near + (far - near) * t) - 1.0).abs();
                let off_px = DEPTH_SHARE * off * self.px_per_tangent;
                worst = worst.max(off_px * off_px);
            }
            v = next(v);
        }
        worst
    }
}

/// Per vertex, the coarsest level that has it.
fn levels_of(loops: &[Loop], deep: &Deep, params: &SimplifyContourParams) -> Vec<u8> {
    let mut levels = vec![ViewContour::COARSEST_LEVEL; deep.points.len()];
    // With a tolerance this small no corner is cut: the outline's vertices are those of the loops.
    let uncut = SimplifyContourParams {
        tolerance_px: 0.0,
        ..*params
    };
    let mut outline = SimplifiedLoops::new(loops, &uncut);
    for level in 1..=ViewContour::COARSEST_LEVEL {
        let limit_px = params.tolerance_px * (f64::from(1_u32 << level) - 1.0);
        let limit = limit_px * limit_px;
        let cost = |outline: &SimplifiedLoops, v: u32| {
            let [_, p, n, _] = outline.neighbourhood(v)?;
            if params.outward_only {
                let [a, b, c] = [p, v, n].map(|v| deep.points[v as usize]);
                if turn(a, b, c) > 0.0 {
                    return None;
                }
            }
            Some(deep.worst_squared(p, n)).filter(|&worst| worst <= limit)
        };
        let propose = |outline: &SimplifiedLoops, v: u32| {
            let [_, p, n, _] = outline.neighbourhood(v)?;
            let [a, b, c] = [p, v, n].map(|v| deep.points[v as usize]);
            Some(Proposal {
                before: a,
                after: c,
                takes_place: false,
                swept: [Some([a, b, c]), None, None, None, None],
            })
        };
        remove_vertices(&mut outline, cost, propose);
        for v in 0..outline.vertex_count() {
            if outline.is_gone(v) && levels[v as usize] == ViewContour::COARSEST_LEVEL {
                levels[v as usize] = level - 1;
            }
        }
    }
    levels
}
