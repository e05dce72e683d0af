//! Vertices where the contour generator bends in depth but not in the image.
//!
//! Simplified contours have few vertices, and between two of them depth is taken to change as along a straight line in space. Where
//! the contour generator bends towards the eye, or one part of the object ends in front of another, that is wrong by any
//! amount, and the outline seen from beside tears. So vertices are added on the edges until depth is right between
//! them too; the contour's picture stays what it is. Where depth jumps, two vertices lie one step of a file's grid apart.
//!
//! Source: beyond the paper, which needs no depths. Which vertices are needed is chosen as by Douglas and Peucker, Algorithms for the
//! Reduction of the Number of Points Required to Represent a Digitized Line, 1973, in the plane of place on the edge and inverse
//! depth, where straight lines in space are straight.

use glam::DVec2;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::{Bounds, Camera, Loop};

use super::depth::{Probe, vertex_depths};
use super::rim_edges::RimEdges;
use crate::simplify_contour::VERTEX_STEPS_PER_PX;

/// How far off the depth may be between vertices, in radii of the bounding sphere: about eight pixels of a 512² capture. Seen from
/// a viewpoint between two views it moves the outline by a small part of that.
const TOLERANCE_REL: f64 = 0.03;

/// Depth is looked at in places this far apart on an edge, pixels.
const SPACING_PX: f64 = 2.0;

/// One step of the grid on which a file keeps vertices, pixels.
const STEP_PX: f64 = 1.0 / VERTEX_STEPS_PER_PX;

/// Loops in pixels, and for each of their vertices the depth along the camera's `forward` of the point seen there.
pub type LoopsWithDepths = (Vec<Loop>, Vec<Vec<f64>>);

/// Finds the depth of the contour generator along `loops`, outlines of the object as `camera` sees it: at their vertices, as
/// [`tangent_depths`](super::tangent_depths) does, and at vertices that are added on their edges where it is not linear between these.
///
/// Added vertices are rounded to the file's grid; with `outward_only`, to the side where the object is not.
#[must_use]
pub fn deep_contours(
    bvh: &Bvh,
    bounds: &Bounds,
    camera: &Camera,
    loops: &[Loop],
    outward_only: bool,
) -> LoopsWithDepths {
    let search = RimSearch {
        bvh,
        bounds,
        camera,
        edges: None,
        outward_only,
    };
    let none: Vec<Vec<bool>> = loops.iter().map(|l| vec![false; l.len()]).collect();
    search.deep_contours(loops, &none)
}

/// Where the depth of a contour generator is looked for.
#[derive(Clone, Copy, Debug)]
pub struct RimSearch<'a> {
    /// The object.
    pub bvh: &'a Bvh,
    /// Bounds of the model that it is of.
    pub bounds: &'a Bounds,
    /// What sees it.
    pub camera: &'a Camera,
    /// The edges where it turns away from the camera, where they are known.
    pub edges: Option<&'a RimEdges>,
    /// As for [`deep_contours`].
    pub outward_only: bool,
}

impl RimSearch<'_> {
    /// As [`deep_contours`], but nothing is added on edges between two vertices that are marked.
    #[must_use]
    pub fn deep_contours(&self, loops: &[Loop], marked: &[Vec<bool>]) -> LoopsWithDepths {
        let Self {
            bvh,
            bounds,
            camera,
            edges,
            outward_only,
        } = *self;
        let center_depth = camera.depth(bounds.center);
        let probe = Probe::new(bvh, bounds, camera).with_edges(edges);
        let depths = vertex_depths(&probe, loops, center_depth);
        let mut rim = Rim {
            probe,
            unit: center_depth * center_depth / bounds.radius,
            outward_only,
            samples: Vec::new(),
            open: Vec::new(),
            needed: Vec::new(),
        };
        let split = |((points, depths), marked): ((&Loop, &Vec<f64>), &Vec<bool>)| {
            let mut output = (Loop::new(), Vec::new());
            for k in 0..points.len() {
                let next = (k + 1) % points.len();
                output.0.push(points[k]);
                output.1.push(depths[k]);
                if marked[k] && marked[next] {
                    continue;
                }
                rim.split(
                    &Edge::new(points[k], points[next]),
                    (depths[k], depths[next]),
                    &mut output,
                );
            }
            output
        };
        let loops = loops.iter().zip(&depths);
        loops.zip(marked).map(split).unzip()
    }
}

/// An edge of an outline, the object to its left seen against the y axis.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: DVec2,
    to: DVec2,
    length: f64,
    /// Unit normal towards the object.
    inward: DVec2,
}

impl Edge {
    fn new(from: DVec2, to: DVec2) -> Self {
        let length = from.distance(to);
        Self {
            from,
            to,
            length,
            inward: (to - from).normalize_or_zero().perp(),
        }
    }

    fn at(&self, share: f64) -> DVec2 {
        self.from.lerp(self.to, share)
    }

    /// The place of the file's grid nearest to the edge's point at `share`, among those not on the object's side if asked for.
    fn rounded(&self, share: f64, outward_only: bool) -> DVec2 {
        let p = self.at(share);
        let round = |p: DVec2| (p * VERTEX_STEPS_PER_PX).round() * STEP_PX;
        let nearest = round(p);
        if !outward_only || (nearest - self.from).dot(self.inward) <= 0.0 {
            return nearest;
        }
        // A step outwards along the axis that the normal is closer to is outside for certain.
        let axis = if self.inward.x.abs() > self.inward.y.abs() {
            DVec2::X * self.inward.x.signum()
        } else {
            DVec2::Y * self.inward.y.signum()
        };
        nearest - axis * STEP_PX
    }
}

/// Where on an edge, as a share of it, and the inverse depth there, in units that are radii at the center.
#[derive(Clone, Copy, Debug)]
struct Sample {
    share: f64,
    nearness: f64,
}

struct Rim<'a> {
    probe: Probe<'a>,
    /// Inverse depths times this change at the center as depths in radii do.
    unit: f64,
    outward_only: bool,
    samples: Vec<Sample>,
    open: Vec<(usize, usize)>,
    needed: Vec<usize>,
}

impl Rim<'_> {
    /// Appends the vertices that are needed between the ends of an edge, which have the given depths.
    fn split(&mut self, edge: &Edge, (first, last): (f64, f64), output: &mut (Loop, Vec<f64>)) {
        self.look_along(edge, (first, last));
        self.choose();
        for &k in &self.needed {
            let Sample { share, nearness } = self.samples[k];
            // Of two vertices at a jump the second moves on to the next place of the grid.
            let step = STEP_PX / edge.length;
            let places = [share, share + step, share + 1.5 * step]
                .into_iter()
                .filter(|&s| s < 1.0)
                .map(|s| edge.rounded(s, self.outward_only));
            let is_free = |p: &DVec2| output.0.last() != Some(p) && *p != edge.to;
            if let Some(p) = places.into_iter().find(is_free) {
                output.0.push(p);
                output.1.push(self.unit / nearness);
            }
        }
    }

    /// Collects samples of an edge from one end to the other.
    fn look_along(&mut self, edge: &Edge, (first, last): (f64, f64)) {
        let n = (edge.length / SPACING_PX).ceil().max(1.0) as usize;
        self.samples.clear();
        self.samples.push(Sample {
            share: 0.0,
            nearness: self.unit / first,
        });
        for k in 1..=n {
            let share = k as f64 / n as f64;
            let sample = if k == n {
                Some(Sample {
                    share: 1.0,
                    nearness: self.unit / last,
                })
            } else {
                self.sample(edge, share)
            };
            if let Some(sample) = sample {
                self.narrow_jump(edge, sample);
                self.samples.push(sample);
            }
        }
    }

    fn sample(&self, edge: &Edge, share: f64) -> Option<Sample> {
        let depth = self.probe.depth_at(edge.at(share), edge.inward)?;
        let nearness = self.unit / depth;
        Some(Sample { share, nearness })
    }

    /// Where depth jumps between the last sample and `next`, adds samples directly before and behind the jump.
    fn narrow_jump(&mut self, edge: &Edge, next: Sample) {
        let Some(&last) = self.samples.last() else {
            return;
        };
        let off = |a: Sample, b: Sample| (a.nearness - b.nearness).abs();
        let is_jump = |a: Sample, b: Sample| off(a, b) > 2.0 * TOLERANCE_REL;
        let (mut before, mut behind) = (last, next);
        while is_jump(before, behind) && (behind.share - before.share) * edge.length > STEP_PX {
            let Some(middle) = self.sample(edge, 0.5 * (before.share + behind.share)) else {
                break;
            };
            if off(middle, before) > off(middle, behind) {
                behind = middle;
            } else {
                before = middle;
            }
        }
        if is_jump(before, behind) {
            let between = [before, behind].into_iter();
            (self.samples).extend(between.filter(|s| last.share < s.share && s.share < next.share));
        }
    }

    /// Chooses the samples that straight lines need to be right within the tolerance.
    fn choose(&mut self) {
        self.needed.clear();
        self.open.clear();
        self.open.push((0, self.samples.len() - 1));
        while let Some((a, b)) = self.open.pop() {
            let (one, two) = (self.samples[a], self.samples[b]);
            let off = |k: &usize| {
                let sample = self.samples[*k];
                let t = (sample.share - one.share) / (two.share - one.share);
                (sample.nearness - (one.nearness + (two.nearness - one.nearness) * t)).abs()
            };
            let worst = (a + 1..b).max_by(|i, j| off(i).total_cmp(&off(j)));
            if let Some(k) = worst.filter(|k| off(k) > TOLERANCE_REL) {
                self.needed.push(k);
                self.open.extend([(a, k), (k, b)]);
            }
        }
        self.needed.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::cpu::rasterise;
    use crate::capture::tangent_depths;
    use crate::simplify_contour::{SimplifyContourParams, simplify_contours};
    use glam::DVec3;
    use silmap_geometry::polygon::signed_area;
    use silmap_geometry::trace::trace_contours;
    use silmap_geometry::{CoverageRule, Mask, TriangleMesh};
    use silmap_models as models;

    fn captured(mesh: &TriangleMesh, direction: DVec3) -> (Camera, Vec<Loop>) {
        let bounds = mesh.bounds();
        let eye = bounds.center + direction.normalize_or_zero() * 3.0 * bounds.radius;
        let camera =
            Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (512, 512)).unwrap();
        let mut mask = Mask::new(512, 512);
        rasterise(mesh, &camera, CoverageRule::Center, &mut mask).unwrap();
        let params = SimplifyContourParams::default();
        (camera, simplify_contours(&trace_contours(&mask), &params))
    }

    /// The share of places along the loops where the depth between vertices is off by more than twice the tolerance.
    fn share_off(mesh: &TriangleMesh, camera: &Camera, loops: &[Loop], depths: &[Vec<f64>]) -> f64 {
        let (bvh, bounds) = (Bvh::new(mesh), mesh.bounds());
        let probe = Probe::new(&bvh, &bounds, camera);
        let (mut n, mut n_off) = (0, 0);
        for (points, depths) in loops.iter().zip(depths) {
            for k in 0..points.len() {
                let next = (k + 1) % points.len();
                let edge = Edge::new(points[k], points[next]);
                // Places that are not those looked at.
                for j in 0..(edge.length / 1.3) as usize {
                    let share = (j as f64 + 0.37) * 1.3 / edge.length;
                    let Some(depth) = probe.depth_at(edge.at(share), edge.inward) else {
                        continue;
                    };
                    let linear = 1.0 / ((1.0 - share) / depths[k] + share / depths[next]);
                    n += 1;
                    n_off +=
                        usize::from((depth - linear).abs() > 2.0 * TOLERANCE_REL * bounds.radius);
                }
            }
        }
        n_off as f64 / n as f64
    }

    #[test]
    fn depth_is_right_between_vertices_too() {
        for (mesh, direction) in [
            (models::trefoil_knot(20_000), DVec3::new(0.4, 0.2, 1.0)),
            (models::trefoil_knot(20_000), DVec3::new(1.0, 0.1, 0.2)),
            (models::three_holed_torus(20_000), DVec3::new(1.0, 0.3, 0.5)),
        ] {
            let (camera, loops) = captured(&mesh, direction);
            let (bvh, bounds) = (Bvh::new(&mesh), mesh.bounds());
            let (deep, depths) = deep_contours(&bvh, &bounds, &camera, &loops, false);
            let off = share_off(&mesh, &camera, &deep, &depths);
            assert!(off < 0.01, "{off} of the outline is off");
            let at_vertices = tangent_depths(&bvh, &bounds, &camera, &loops);
            let control = share_off(&mesh, &camera, &loops, &at_vertices);
            assert!(
                control > 3.0 * off.max(0.005),
                "the control is {control} off"
            );
        }
    }

    #[test]
    fn the_picture_stays_what_it_is() {
        let mesh = models::trefoil_knot(20_000);
        let (camera, loops) = captured(&mesh, DVec3::new(0.4, 0.2, 1.0));
        let (bvh, bounds) = (Bvh::new(&mesh), mesh.bounds());
        for outward_only in [false, true] {
            let (deep, depths) = deep_contours(&bvh, &bounds, &camera, &loops, outward_only);
            let n_before: usize = loops.iter().map(Vec::len).sum();
            let n_after: usize = deep.iter().map(Vec::len).sum();
            assert!(
                n_before < n_after && n_after < 2 * n_before,
                "{n_before} -> {n_after}"
            );
            for ((before, after), depths) in loops.iter().zip(&deep).zip(&depths) {
                assert_eq!(after.len(), depths.len());
                let mut rest = after.iter();
                assert!(
                    before.iter().all(|p| rest.any(|q| p == q)),
                    "vertices stay, in order"
                );
                assert!((0..after.len()).all(|k| after[k] != after[(k + 1) % after.len()]));
                let change = signed_area(after) - signed_area(before);
                let perimeter: f64 = (0..before.len())
                    .map(|k| before[k].distance(before[(k + 1) % before.len()]))
                    .sum();
                // Rounding to the nearest place goes to both sides, rounding outwards to one.
                let share = if outward_only { 0.5 } else { 0.05 };
                assert!(
                    change.abs() < share * STEP_PX * perimeter,
                    "area changes by {change}"
                );
                assert!(!outward_only || change >= -1e-9, "area shrinks by {change}");
            }
        }
    }
}
