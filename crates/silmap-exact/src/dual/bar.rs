//! A balanced-aspect-ratio tree of the points of a chart: every region is convex and fat, and is cut in two so that both parts
//! are fat and have a constant share of the points.
//!
//! Cuts are across the three axes, the six diagonals of the cube's sides, or its four own diagonals. The last ones are what
//! keeps the tree balanced: where points crowd together at a corner of a region, the corner can be cut off, and what is
//! left is as fat as before. Where no such cut exists, one that leaves the points on one side takes away as much of the
//! region as it can, so that the crowd comes to lie at a corner.
//!
//! Source: as for the parent module, section 2.1; C. A. Duncan, M. T. Goodrich, S. G. Kobourov. Balanced Aspect Ratio Trees:
//! Combining the Advantages of k-d Trees and Octrees. Journal of Algorithms 38, 2001.
//! Deviations: a cut's place is sought among quantiles of the points, and fatness tested, instead of a construction that
//! guarantees both. After [`MOST_UNBALANCED`] cuts in a row that do not share the points out, they are left together.

use std::cmp::Ordering;

use glam::DVec3;

use super::points::{Draft, LEAF_POINTS, Point};

/// A region's largest extent over its smallest, across the directions of cuts, is at most this.
pub(super) const MOST_ASPECT: f64 = 6.0;
/// Shares of the points on the lower side of a cut, the most balanced first. The last ones say what counts as balanced.
const SHARES: [f64; 7] = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8];
/// Cuts in a row without a share for both sides, after which points are taken to coincide.
pub(super) const MOST_UNBALANCED: u32 = 12;
/// Places of a cut that does not share points out, over the region's extent.
const PLACES: [f64; 5] = [0.5, 0.25, 0.75, 0.15, 0.85];

/// Directions of cuts.
const DIRECTIONS: [DVec3; 13] = [
    DVec3::X,
    DVec3::Y,
    DVec3::Z,
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(1.0, -1.0, 0.0),
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(1.0, 0.0, -1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, 1.0, -1.0),
    DVec3::ONE,
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
];

/// Divides the points of one chart, whose places begin with `first`.
pub(super) fn divide(points: &mut [Point], first: usize, drafts: &mut Vec<Draft>) {
    divide_watched(points, first, drafts, &mut |_, _| {});
}

/// The same; `watch` is called with each region and the number of its points.
fn divide_watched(
    points: &mut [Point],
    first: usize,
    drafts: &mut Vec<Draft>,
    watch: &mut dyn FnMut(&Region, usize),
) {
    divide_region(points, first, (&Region::cube(), 0), drafts, watch);
}

fn divide_region(
    points: &mut [Point],
    first: usize,
    (region, unbalanced): (&Region, u32),
    drafts: &mut Vec<Draft>,
    watch: &mut dyn FnMut(&Region, usize),
) {
    watch(region, points.len());
    let place = drafts.len();
    drafts.push(Draft {
        points: first..first + points.len(),
        child_count: 0,
    });
    if points.len() <= LEAF_POINTS || unbalanced > MOST_UNBALANCED {
        return;
    }
    let balanced = region.balanced_cut(points);
    let unbalanced = if balanced.is_some() {
        0
    } else {
        unbalanced + 1
    };
    let Some(cut) = balanced.or_else(|| region.shrinking_cut(points)) else {
        return;
    };
    points.sort_by_key(|p| !cut.is_below(p));
    let below = points.partition_point(|p| cut.is_below(p));
    let (low, high) = points.split_at_mut(below);
    for (part, start, region) in [
        (low, first, &cut.parts[0]),
        (high, first + below, &cut.parts[1]),
    ] {
        if !part.is_empty() {
            divide_region(part, start, (region, unbalanced), drafts, watch);
            drafts[place].child_count += 1;
        }
    }
}

/// A point's place in its chart.
fn place_of(point: &Point) -> DVec3 {
    let [a, b, c, d] = point.at;
    match point.chart / 2 {
        0 => DVec3::new(b, c, d),
        1 => DVec3::new(a, c, d),
        2 => DVec3::new(a, b, d),
        _ => DVec3::new(a, b, c),
    }
}

/// A plane across a region, and the two parts.
struct Cut {
    direction: DVec3,
    offset: f64,
    parts: [Region; 2],
}

impl Cut {
    fn is_below(&self, point: &Point) -> bool {
        self.direction.dot(place_of(point)) < self.offset
    }
}

/// A convex region of a chart, as the corners of its sides, in order around each.
#[derive(Clone, Debug)]
struct Region(Vec<Vec<DVec3>>);

impl Region {
    /// A whole chart.
    fn cube() -> Self {
        let side = |axis: usize, value: f64| {
            let turn = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let corner = |[u, v]: [f64; 2]| {
                let mut corner = DVec3::splat(value);
                corner[(axis + 1) % 3] = u;
                corner[(axis + 2) % 3] = v;
                corner
            };
            turn.map(corner).to_vec()
        };
        let sides = (0..3).flat_map(|axis| [side(axis, -1.0), side(axis, 1.0)]);
        Self(sides.collect())
    }

    /// From where to where it reaches along a direction.
    fn extent(&self, direction: DVec3) -> [f64; 2] {
        let values = self.0.iter().flatten().map(|p| p.dot(direction));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    }

    /// How far it reaches along each direction, of equal units.
    fn widths(&self) -> [f64; 13] {
        DIRECTIONS.map(|d| {
            let [low, high] = self.extent(d);
            (high - low) / d.length()
        })
    }

    fn aspect(&self) -> f64 {
        let widths = self.widths();
        let largest = widths.iter().fold(0.0_f64, |a, &b| a.max(b));
        let smallest = widths.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        largest / smallest
    }

    /// The cut that shares the points out best of those that leave two fat parts.
    fn balanced_cut(&self, points: &[Point]) -> Option<Cut> {
        let widths = self.widths();
        let mut directions: Vec<usize> = (0..DIRECTIONS.len()).collect();
        directions.sort_by(|&a, &b| widths[b].total_cmp(&widths[a]));
        let mut values = vec![Vec::new(); DIRECTIONS.len()];
        for share in SHARES {
            for &k in &directions {
                let sorted = &mut values[k];
                if sorted.is_empty() {
                    sorted.extend(points.iter().map(|p| place_of(p).dot(DIRECTIONS[k])));
                    sorted.sort_unstable_by(f64::total_cmp);
                }
                let at = (share * sorted.len() as f64) as usize;
                let offset = 0.5 * (sorted[at - 1] + sorted[at]);
                // Rounding, or points at the same place, may put all on one side.
                let below = sorted.partition_point(|&v| v < offset) as f64 / sorted.len() as f64;
                let least = SHARES[5] * 0.9;
                if !(least..=1.0 - least).contains(&below) {
                    continue;
                }
                let cut = self.cut(DIRECTIONS[k], offset);
                if cut.is_some() {
                    return cut;
                }
            }
        }
        None
    }

    /// The cut that leaves least of the region around most of the points.
    fn shrinking_cut(&self, points: &[Point]) -> Option<Cut> {
        let mut best: Option<(f64, Cut)> = None;
        for direction in DIRECTIONS {
            let [low, high] = self.extent(direction);
            for place in PLACES {
                let offset = low + (high - low) * place;
                let Some(cut) = self.cut(direction, offset) else {
                    continue;
                };
                let below = points.iter().filter(|p| cut.is_below(p)).count();
                let kept = usize::from(2 * below < points.len());
                let size: f64 = cut.parts[kept].widths().iter().sum();
                if best.as_ref().is_none_or(|(least, _)| size < *least) {
                    best = Some((size, cut));
                }
            }
        }
        best.map(|(_, cut)| cut)
    }

    /// Cuts the region in two; `None` when a part would not be fat.
    fn cut(&self, direction: DVec3, offset: f64) -> Option<Cut> {
        let [low, high] = self.extent(direction);
        let is_across = low < offset && offset < high;
        if !is_across {
            return None;
        }
        let parts = [1.0, -1.0].map(|sign| self.clipped(direction * sign, offset * sign));
        let is_fat = parts.iter().all(|part| part.aspect() <= MOST_ASPECT);
        is_fat.then_some(Cut {
            direction,
            offset,
            parts,
        })
    }

    /// What lies below a plane.
    fn clipped(&self, direction: DVec3, offset: f64) -> Self {
        let mut sides = Vec::with_capacity(self.0.len() + 1);
        let mut lid = Vec::new();
        for side in &self.0 {
            let mut kept = Vec::with_capacity(side.len() + 1);
            for (k, &p) in side.iter().enumerate() {
                let q = side[(k + 1) % side.len()];
                let [from, to] = [p, q].map(|c| c.dot(direction) - offset);
                if from <= 0.0 {
                    kept.push(p);
                }
                if from == 0.0 {
                    lid.push(p);
                }
                if from * to < 0.0 {
                    let crossing = p + (q - p) * (from / (from - to));
                    kept.push(crossing);
                    lid.push(crossing);
                }
            }
            if kept.len() > 2 {
                sides.push(kept);
            }
        }
        if lid.len() > 2 {
            let middle = lid.iter().sum::<DVec3>() / lid.len() as f64;
            let (x, y) = (direction / direction.length()).any_orthonormal_pair();
            let angle = |p: &DVec3| (*p - middle).dot(y).atan2((*p - middle).dot(x));
            lid.sort_by(|a, b| match angle(a).total_cmp(&angle(b)) {
                Ordering::Equal => a.x.total_cmp(&b.x),
                order => order,
            });
            lid.dedup();
            sides.push(lid);
        }
        Self(sides)
    }
}

#[cfg(test)]
#[path = "bar_tests.rs"]
mod tests;
