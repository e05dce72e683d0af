//! One outline of several: of each what lies in its own sector of the picture.
//!
//! Half-lines from an apex part the plane into sectors, each with an outline of its own, which is cut where it crosses the two
//! half-lines of its sector. Along a half-line exactly one of the outlines on its two sides is inside on every other stretch between
//! cuts, and there the half-line itself is boundary: cuts are joined two by two in the order of their distance from the apex. An odd
//! number of them begins with one at the apex, where an even number of half-lines has such. What comes out is closed by construction.
//!
//! Source: beyond the paper.

use glam::{DVec2, DVec3, DVec4, Vec3Swizzles};

use crate::loops::{DeepLoops, SeenLoops};

/// Buffers for cutting and joining.
#[derive(Clone, Debug, Default)]
pub(crate) struct SectorMerge {
    apex: DVec2,
    /// Directions, in the order of their angles; sector k lies between half-lines k and k + 1.
    half_lines: Vec<DVec2>,
    /// Outlines within their sectors: points of one stretch after the other, and where each ends.
    points: Vec<DVec3>,
    ends: Vec<u32>,
    /// Of each stretch, whether it is a loop that no half-line cuts; later also whether it was joined to others.
    is_done: Vec<bool>,
    cuts: Vec<Cut>,
    /// Of each end of a stretch what it is joined to.
    joined: Vec<Joint>,
}

/// A beginning or an end of a stretch: twice its number, and one more for the end.
type End = u32;

/// Where a stretch meets a half-line.
#[derive(Clone, Copy, Debug)]
struct Cut {
    half_line: usize,
    distance: f64,
    end: End,
}

/// What an end is joined to.
#[derive(Clone, Copy, Debug, Default)]
struct Joint {
    to: End,
    by_apex: bool,
}

/// A point, and how far it is inside of a sector's two half-lines.
#[derive(Clone, Copy, Debug)]
struct Sided {
    point: DVec3,
    sides: [f64; 2],
}

impl Sided {
    fn is_in(&self) -> bool {
        self.is_inside(0) && self.is_inside(1)
    }

    /// A half-line belongs to the sector that it begins.
    fn is_inside(&self, half_line: usize) -> bool {
        self.sides[half_line] > 0.0 || (half_line == 0 && self.sides[0] == 0.0)
    }

    /// How far along the way to `other` the line of a half-line is crossed.
    fn crossing(&self, other: &Self, half_line: usize) -> f64 {
        let (here, there) = (self.sides[half_line], other.sides[half_line]);
        here / (here - there)
    }
}

impl SectorMerge {
    /// Begins anew, with `count` sectors of the same angle, three or more.
    pub(crate) fn start(&mut self, apex: DVec2, count: usize) {
        self.apex = apex;
        self.half_lines.clear();
        self.half_lines
            .extend((0..count).map(|k| half_line(k, count)));
        self.points.clear();
        self.ends.clear();
        self.is_done.clear();
        self.cuts.clear();
    }

    /// Keeps of the loops of an outline what lies in sector `k`.
    pub(crate) fn add(&mut self, k: usize, outline: &SeenLoops) {
        let half_lines = [k, (k + 1) % self.half_lines.len()];
        for points in outline.iter() {
            self.add_loop(half_lines, points);
        }
    }

    fn add_loop(&mut self, half_lines: [usize; 2], points: &[DVec3]) {
        let [from, to] = half_lines.map(|k| self.half_lines[k]);
        let apex = self.apex;
        let sided = |point: DVec3| {
            let arm = point.xy() - apex;
            let sides = [from.perp_dot(arm), arm.perp_dot(to)];
            Sided { point, sides }
        };
        let Some(start) = points.iter().position(|&p| !sided(p).is_in()) else {
            self.points.extend_from_slice(points);
            self.close_stretch(true);
            return;
        };
        let (after, until) = (points[start + 1..].iter(), points[..=start].iter());
        let mut before = sided(points[start]);
        for &point in after.chain(until) {
            let here = sided(point);
            self.add_edge(half_lines, &before, &here);
            before = here;
        }
    }

    fn add_edge(&mut self, half_lines: [usize; 2], a: &Sided, b: &Sided) {
        let entry = (0..2)
            .filter(|&side| !a.is_inside(side))
            .map(|side| (a.crossing(b, side), side))
            .max_by(|x, y| x.0.total_cmp(&y.0));
        let exit = (0..2)
            .filter(|&side| !b.is_inside(side))
            .map(|side| (a.crossing(b, side), side))
            .min_by(|x, y| x.0.total_cmp(&y.0));
        let is_through = match (entry, exit) {
            // Outside of the same half-line at both ends, or on the other side of the apex.
            (Some(entry), Some(exit)) => {
                let is_across = (0..2).all(|side| a.is_inside(side) != b.is_inside(side));
                is_across && entry.1 != exit.1 && entry.0 < exit.0
            }
            _ => true,
        };
        if !is_through {
            return;
        }
        if let Some((t, side)) = entry {
            let end = 2 * self.ends.len() as End;
            self.push_cut(half_lines[side], a.point.lerp(b.point, t), end);
        }
        match exit {
            None => self.points.push(b.point),
            Some((t, side)) => {
                let end = 2 * self.ends.len() as End + 1;
                self.push_cut(half_lines[side], a.point.lerp(b.point, t), end);
                self.close_stretch(false);
            }
        }
    }

    fn push_cut(&mut self, half_line: usize, point: DVec3, end: End) {
        let distance = (point.xy() - self.apex).dot(self.half_lines[half_line]);
        self.points.push(point);
        self.cuts.push(Cut {
            half_line,
            distance,
            end,
        });
    }

    fn close_stretch(&mut self, is_whole: bool) {
        self.ends.push(self.points.len() as u32);
        self.is_done.push(is_whole);
    }

    fn stretch(&self, k: usize) -> &[DVec3] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.points[start as usize..self.ends[k] as usize]
    }

    /// The joined outline; the apex has no depth.
    pub(crate) fn finish(&mut self, output: &mut DeepLoops) {
        output.clear();
        self.join_cuts();
        for k in (0..self.ends.len()).filter(|&k| self.is_done[k]) {
            let whole = self.stretch(k).iter().map(|p| p.extend(0.0));
            output.open_loop().extend(whole);
            output.close();
        }
        for first in 0..self.ends.len() {
            let mut at = 2 * first as End;
            while !std::mem::replace(&mut self.is_done[at as usize / 2], true) {
                let points = self.stretch(at as usize / 2).iter().map(|p| p.extend(0.0));
                let open = output.open_loop();
                if at.is_multiple_of(2) {
                    open.extend(points);
                } else {
                    open.extend(points.rev());
                }
                let joint = self.joined[(at ^ 1) as usize];
                if joint.by_apex {
                    open.push(DVec4::new(self.apex.x, self.apex.y, 0.0, 0.0));
                }
                at = joint.to;
            }
            output.close();
        }
    }

    /// Joins cuts two by two.
    fn join_cuts(&mut self) {
        self.cuts.sort_unstable_by(|a, b| {
            let by_distance = a.distance.total_cmp(&b.distance);
            (a.half_line.cmp(&b.half_line)).then(by_distance.then(a.end.cmp(&b.end)))
        });
        self.joined.clear();
        self.joined.resize(2 * self.ends.len(), Joint::default());
        let mut waiting_at_apex = None;
        let joined = &mut self.joined;
        let mut join = |one: End, two: End, by_apex| {
            joined[one as usize] = Joint { to: two, by_apex };
            joined[two as usize] = Joint { to: one, by_apex };
        };
        for cuts in self.cuts.chunk_by(|a, b| a.half_line == b.half_line) {
            let (odd, pairs) = cuts.split_at(cuts.len() % 2);
            for pair in pairs.chunks_exact(2) {
                join(pair[0].end, pair[1].end, false);
            }
            if let [first] = odd {
                match waiting_at_apex.take() {
                    None => waiting_at_apex = Some(first.end),
                    Some(other) => join(other, first.end, true),
                }
            }
        }
    }
}

/// Direction `k` of `count` that are spread evenly.
pub(crate) fn half_line(k: usize, count: usize) -> DVec2 {
    DVec2::from_angle(k as f64 / count as f64 * std::f64::consts::TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loops::FlatLoops;
    use glam::Vec4Swizzles;
    use proptest::prelude::*;

    const APEX: DVec2 = DVec2::new(0.3, -0.2);

    /// A ring of random width: an outer loop, and a hole.
    fn ring() -> impl Strategy<Value = Vec<Vec<DVec2>>> {
        let spokes = prop::collection::vec((0.2..2.0_f64, 0.1..0.9_f64), 3..12);
        let middle = (-1.0..1.0_f64, -1.0..1.0_f64).prop_map(DVec2::from);
        (middle, spokes).prop_map(|(middle, spokes)| {
            let place = |k: usize, distance: f64| middle + half_line(k, spokes.len()) * distance;
            let outer = spokes.iter().enumerate().map(|(k, s)| place(k, s.0));
            let hole = spokes.iter().enumerate().map(|(k, s)| place(k, s.0 * s.1));
            let mut hole: Vec<DVec2> = hole.collect();
            hole.reverse();
            vec![outer.collect(), hole]
        })
    }

    fn outline() -> impl Strategy<Value = FlatLoops> {
        prop::collection::vec(ring(), 0..3).prop_map(|rings| {
            let mut outline = FlatLoops::default();
            outline.assign(rings.iter().flatten().map(Vec::as_slice));
            outline
        })
    }

    fn seen(loops: &FlatLoops) -> SeenLoops {
        let mut seen = SeenLoops::default();
        for points in loops.iter() {
            points.iter().for_each(|p| seen.push(p.extend(0.5)));
            seen.close();
        }
        seen
    }

    fn joined(outlines: &[FlatLoops]) -> FlatLoops {
        let mut join = SectorMerge::default();
        join.start(APEX, outlines.len());
        for (k, outline) in outlines.iter().enumerate() {
            join.add(k, &seen(outline));
        }
        let (mut deep, mut flat) = (DeepLoops::default(), FlatLoops::default());
        join.finish(&mut deep);
        for points in deep.iter() {
            // What is joined keeps its depth, the apex has none.
            assert!(points.iter().all(|p| p.z == 0.5 || p.xy() == APEX));
            points.iter().for_each(|p| flat.push(p.xy()));
            flat.close();
        }
        flat
    }

    /// By the number of edges that a half-line to the right crosses.
    fn is_inside(loops: &FlatLoops, p: DVec2) -> bool {
        let mut is_inside = false;
        for points in loops.iter() {
            let mut a = points[points.len() - 1];
            for &b in points {
                let is_across = (a.y > p.y) != (b.y > p.y);
                is_inside ^= is_across && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                a = b;
            }
        }
        is_inside
    }

    fn sector_of(p: DVec2, count: usize) -> usize {
        let turns = ((p - APEX).to_angle() / std::f64::consts::TAU).rem_euclid(1.0);
        (turns * count as f64) as usize % count
    }

    fn probes() -> impl Iterator<Item = DVec2> {
        // Off all lines that loops may have.
        (0..900).map(|k| DVec2::new(f64::from(k % 30), f64::from(k / 30)) * 0.1713 - 2.4917)
    }

    proptest! {
        /// Each sector shows its own outline.
        #[test]
        fn every_wedge_shows_its_own(outlines in prop::collection::vec(outline(), 3..9)) {
            let joined = joined(&outlines);
            for p in probes() {
                let own = &outlines[sector_of(p, outlines.len())];
                prop_assert_eq!(is_inside(&joined, p), is_inside(own, p), "at {}", p);
            }
        }

        /// One outline, cut and joined again, is what it was, which way its loops run included.
        #[test]
        fn the_same_outline_in_every_wedge_stays(outline in ring(), count in 3..9_usize) {
            let mut same = FlatLoops::default();
            same.assign(outline.iter().map(Vec::as_slice));
            let joined = joined(&vec![same.clone(); count]);
            let area = |loops: &FlatLoops| -> f64 {
                loops.iter().map(silmap_geometry::polygon::signed_area).sum()
            };
            prop_assert!((area(&joined) - area(&same)).abs() < 1e-9);
        }
    }

    #[test]
    fn another_wedge_shows_another() {
        let square = |x: f64| {
            let mut loops = FlatLoops::default();
            let corners = [(x, -1.0), (x + 1.0, -1.0), (x + 1.0, 1.0), (x, 1.0)];
            loops.assign([corners.map(DVec2::from).as_slice()]);
            loops
        };
        let outlines = [square(0.1), square(0.4), square(0.1), square(0.1)];
        let joined = joined(&outlines);
        let differs = |other: &FlatLoops| {
            probes()
                .filter(|&p| is_inside(&joined, p) != is_inside(other, p))
                .count()
        };
        assert!(differs(&outlines[0]) > 0 && differs(&outlines[1]) > 0);
    }
}
