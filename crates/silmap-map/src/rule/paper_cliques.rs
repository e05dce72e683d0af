//! The rule of method `paper`: only intervals of one clique may hold the same geometry (section 5.3, "Mutant pants").
//!
//! Source: Silhouette Mapping, section 5.3: convex and concave extrema of the silhouettes in y (frontier points) are
//! matched between the views and tracked from span to span; matched ones separate cliques, unmatched ones join the nearest.
//! Deviation: what is tracked here are the *gaps* between neighbouring intervals. A gap lives from the extremum that opens it
//! to the extremum that closes it, two gaps match when these agree, and where two matched gaps are both present they cut the
//! spans into cliques. Intervals that no matched gap separates stay together, which is "join the nearest clique".

use crate::sweep::cursor::SweepCursor;
use crate::sweep::interval::SpanInterval;
use crate::sweep::monotone_chain::MonotoneChains;

/// Where the intervals of two views are cut into cliques: cliques end before interval `.0` of the first view and `.1` of the
/// second. Pairs are kept within a clique only.
type Cuts = Vec<(usize, usize)>;

/// Two gaps match when the scanlines they share are at least this part of the scanlines that either has.
const MIN_SHARED_SCANLINES: f64 = 0.5;

/// How a gap begins or ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Extremum {
    /// At a concave extremum: an interval splits, or two merge.
    Concave,
    /// At a convex one: an interval appears beside another, or disappears.
    Convex,
}

#[derive(Clone, Copy, Debug)]
struct Gap {
    y_top: f64,
    y_bottom: f64,
    top: Extremum,
    bottom: Extremum,
}

impl Gap {
    /// Scanlines in both over scanlines in either.
    fn agreement(&self, other: &Self) -> f64 {
        let shared = self.y_bottom.min(other.y_bottom) - self.y_top.max(other.y_top);
        let either = self.y_bottom.max(other.y_bottom) - self.y_top.min(other.y_top);
        if either > 0.0 { shared / either } else { 0.0 }
    }
}

/// The gaps of one view, and which of them lie in each of its own slabs, which reach from one chain end to the next.
#[derive(Clone, Debug, Default)]
struct GapTracks {
    gaps: Vec<Gap>,
    /// Gap ids of all slabs, left to right, one slab after the other.
    ids: Vec<u32>,
    /// Slab s, between heights s and s + 1, holds `ids[starts[s]..starts[s + 1]]`.
    starts: Vec<u32>,
    heights: Vec<f64>,
    spans: [Vec<SpanInterval>; 2],
}

/// Whether one of the intervals holds x.
fn covers(span: &[SpanInterval], x: f64) -> bool {
    span.iter().any(|i| i.enter.x <= x && x <= i.exit.x)
}

/// The gap right of interval `g`.
fn gap_at(span: &[SpanInterval], g: usize) -> (f64, f64) {
    (span[g].exit.x, span[g + 1].enter.x)
}

/// The item of an iterator that has exactly one.
fn only(mut items: impl Iterator<Item = usize>) -> Option<usize> {
    items.next().filter(|_| items.next().is_none())
}

fn kind(covered: bool) -> Extremum {
    if covered {
        Extremum::Concave
    } else {
        Extremum::Convex
    }
}

impl GapTracks {
    /// Follows the gaps of a silhouette. Between two heights where no chain ends, gaps go on as they are.
    fn track(&mut self, chains: &MonotoneChains, cursor: &mut SweepCursor) {
        self.gaps.clear();
        self.ids.clear();
        self.starts.clear();
        self.starts.push(0);
        self.heights.clear();
        let [mut above, mut here] = std::mem::take(&mut self.spans);
        above.clear();
        cursor.restart();
        let mut y = chains.first_y();
        while y.is_finite() {
            self.heights.push(y);
            cursor.enter(chains, y);
            let end = cursor.end(chains);
            if !end.is_finite() {
                break;
            }
            cursor.intervals(chains, y, &mut here);
            if above.len() > 1 || here.len() > 1 {
                self.add_slab((y, end), &above, &here);
            }
            self.starts.push(self.ids.len() as u32);
            cursor.intervals(chains, end, &mut above);
            y = end;
        }
        self.spans = [above, here];
    }

    fn add_slab(
        &mut self,
        (y_top, y_bottom): (f64, f64),
        above: &[SpanInterval],
        here: &[SpanInterval],
    ) {
        let n_above = above.len().saturating_sub(1);
        let n_here = here.len().saturating_sub(1);
        let first_above = self.ids.len() - n_above;
        let touch = |a: usize, h: usize| {
            let (p, q) = (gap_at(above, a), gap_at(here, h));
            p.0.max(q.0) < p.1.min(q.1)
        };
        for h in 0..n_here {
            // A gap goes on when it touches one gap above, and that one touches no other below.
            let continued = only((0..n_above).filter(|&a| touch(a, h)))
                .filter(|&a| only((0..n_here).filter(|&other| touch(a, other))).is_some());
            let id = match continued {
                Some(a) => self.ids[first_above + a],
                None => {
                    let (left, right) = gap_at(here, h);
                    let top = kind(covers(above, 0.5 * (left + right)));
                    self.gaps.push(Gap {
                        y_top,
                        y_bottom,
                        top,
                        bottom: Extremum::Convex,
                    });
                    self.gaps.len() as u32 - 1
                }
            };
            self.gaps[id as usize].y_bottom = y_bottom;
            self.ids.push(id);
        }
        for a in 0..n_above {
            let gap = &mut self.gaps[self.ids[first_above + a] as usize];
            if gap.y_bottom <= y_top {
                let (left, right) = gap_at(above, a);
                gap.bottom = kind(covers(here, 0.5 * (left + right)));
            }
        }
    }

    /// The gaps in the view's own slab around height `y`, from left to right.
    fn gaps_at(&self, y: f64) -> &[u32] {
        match self.heights.partition_point(|&height| height <= y) {
            slab if slab == 0 || slab >= self.starts.len() => &[],
            slab => &self.ids[self.starts[slab - 1] as usize..self.starts[slab] as usize],
        }
    }
}

/// The gaps of two views that match.
#[derive(Clone, Debug, Default)]
struct GapMatching {
    /// Per gap of the first view: the matching gap of the second.
    partner: Vec<Option<u32>>,
    candidates: Vec<(f64, u32, u32)>,
    taken: Vec<bool>,
}

impl GapMatching {
    /// Matches gaps one to one, best agreement first.
    fn assign(&mut self, one: &GapTracks, two: &GapTracks) {
        self.candidates.clear();
        for (i, a) in (0_u32..).zip(&one.gaps) {
            for (j, b) in (0_u32..).zip(&two.gaps) {
                let agreement = a.agreement(b);
                if (a.top == b.top || a.bottom == b.bottom) && agreement >= MIN_SHARED_SCANLINES {
                    self.candidates.push((agreement, i, j));
                }
            }
        }
        self.candidates
            .sort_unstable_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
        self.partner.clear();
        self.partner.resize(one.gaps.len(), None);
        self.taken.clear();
        self.taken.resize(two.gaps.len(), false);
        for &(_, i, j) in &self.candidates {
            if self.partner[i as usize].is_none() && !self.taken[j as usize] {
                self.partner[i as usize] = Some(j);
                self.taken[j as usize] = true;
            }
        }
    }

    /// Where matched gaps cut the spans at height `y`; none when the views order them differently, for then geometry
    /// crosses over between them.
    fn cuts(&self, one: &GapTracks, two: &GapTracks, y: f64, cuts: &mut Cuts) {
        cuts.clear();
        let others = two.gaps_at(y);
        for (i, &gap) in (1..).zip(one.gaps_at(y)) {
            let Some(partner) = self.partner[gap as usize] else {
                continue;
            };
            if let Some(j) = others.iter().position(|&g| g == partner) {
                let j = j + 1;
                if cuts.last().is_some_and(|&(_, before)| before >= j) {
                    cuts.clear();
                    return;
                }
                cuts.push((i, j));
            }
        }
    }
}

/// The cliques of two silhouettes.
#[derive(Clone, Debug, Default)]
pub(super) struct CliqueCuts {
    gaps: [GapTracks; 2],
    matching: GapMatching,
    cuts: Cuts,
}

impl CliqueCuts {
    /// Tracks the gaps of both views and matches them.
    pub(super) fn assign(&mut self, chains: &[MonotoneChains; 2], cursor: &mut SweepCursor) {
        for (gaps, chains) in self.gaps.iter_mut().zip(chains) {
            gaps.track(chains, cursor);
        }
        let [one, two] = &self.gaps;
        self.matching.assign(one, two);
    }

    /// Where the spans at height `y` are cut.
    pub(super) fn at(&mut self, y: f64) -> &[(usize, usize)] {
        let [one, two] = &self.gaps;
        self.matching.cuts(one, two, y, &mut self.cuts);
        &self.cuts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn track(loops: &[&[(f64, f64)]]) -> GapTracks {
        let mut chains = MonotoneChains::default();
        for points in loops {
            for &(x, y) in *points {
                chains.push(DVec3::new(x, y, 0.0));
            }
            chains.close(0.0);
        }
        chains.seal();
        let mut tracks = GapTracks::default();
        tracks.track(&chains, &mut SweepCursor::default());
        tracks
    }

    const SQUARE: &[(f64, f64)] = &[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];

    #[test]
    fn a_hole_is_one_gap_between_concave_extrema() {
        let hole = &[(4.0, 5.0), (5.0, 8.0), (6.0, 5.5), (5.0, 2.0)];
        let tracks = track(&[SQUARE, hole]);
        assert_eq!(tracks.gaps.len(), 1);
        let gap = tracks.gaps[0];
        assert_eq!(
            (gap.y_top, gap.y_bottom, gap.top, gap.bottom),
            (2.0, 8.0, Extremum::Concave, Extremum::Concave)
        );
        assert_eq!(tracks.gaps_at(5.2), [0]);
        assert!(tracks.gaps_at(1.0).is_empty() && tracks.gaps_at(9.0).is_empty());
    }

    #[test]
    fn two_ears_leave_a_gap_from_convex_to_concave() {
        let ears = &[(0.0, 10.0), (1.0, 0.0), (4.0, 6.0), (8.0, 2.0), (9.0, 10.0)];
        let tracks = track(&[ears]);
        assert_eq!(tracks.gaps.len(), 1);
        let gap = tracks.gaps[0];
        assert_eq!(
            (gap.y_top, gap.y_bottom, gap.top, gap.bottom),
            (2.0, 6.0, Extremum::Convex, Extremum::Concave)
        );
    }

    #[test]
    fn holes_match_across_views_and_strangers_do_not() {
        let hole = |y: f64| [(4.0, y + 1.0), (5.0, y + 3.0), (6.0, y + 1.0), (5.0, y)];
        let (one, near, far) = (
            track(&[SQUARE, &hole(2.0)]),
            track(&[SQUARE, &hole(2.4)]),
            track(&[SQUARE, &hole(5.0)]),
        );
        let mut matching = GapMatching::default();
        let mut cuts = Cuts::new();
        matching.assign(&one, &near);
        matching.cuts(&one, &near, 3.0, &mut cuts);
        assert_eq!(cuts, [(1, 1)]);
        matching.cuts(&one, &near, 2.2, &mut cuts);
        assert_eq!(cuts, [], "the second view has no gap there yet");
        matching.assign(&one, &far);
        assert_eq!(matching.partner, [None]);
    }
}
