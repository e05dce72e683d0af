//! Triangulation of polygons in space.
//!
//! Ear cutting that always returns exactly `n − 2` triangles and uses every corner, also for corners on a straight line:
//! a cutter that drops those would tear the mesh open against the neighbouring polygon. Among the ears it prefers the
//! one with the largest smallest angle. Where no proper ear is left (self-touching or folded polygons) it cuts the least
//! bad corner rather than giving up.
//!
//! Source: G. H. Meisters. Polygons have ears. American Mathematical Monthly 82, 1975.
//! Deviations: corners are chosen by shape, not in order; a polygon need not be plane, it is judged by its projection
//! along its area vector.

mod remaining;

use glam::{DVec2, DVec3};

use self::remaining::Remaining;
use crate::queue::CostQueue;

/// A corner turns if the sine of its angle exceeds this: below, three points count as being on a line.
const STRAIGHT_SINE: f64 = 1e-12;

/// Twice the area of a polygon times its unit normal (Newell), about its first corner so that digits are kept.
#[must_use]
pub fn area_vector(points: &[DVec3]) -> DVec3 {
    let Some(&origin) = points.first() else {
        return DVec3::ZERO;
    };
    points
        .windows(2)
        .map(|pair| (pair[0] - origin).cross(pair[1] - origin))
        .sum()
}

/// Cuts a polygon into `points.len() − 2` triangles of corner numbers, wound as the polygon; empty below three corners.
///
/// Corners in the way of an ear are found by place: the time grows by the power of 1.5 of their number at most, for long thin ears.
#[must_use]
pub fn triangulate_polygon(points: &[DVec3]) -> Vec<[u32; 3]> {
    match points.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        4 => triangulate_quad(points),
        _ => cut_ears(&flatten(points)),
    }
}

/// Coordinates in the plane across the area vector, in which the polygon runs counter-clockwise.
fn flatten(points: &[DVec3]) -> Vec<DVec2> {
    let normal = area_vector(points).normalize_or(DVec3::Z);
    let (right, up) = normal.any_orthonormal_pair();
    let origin = points[0];
    points
        .iter()
        .map(|&p| DVec2::new((p - origin).dot(right), (p - origin).dot(up)))
        .collect()
}

/// The shorter diagonal that leaves two triangles facing as the quadrilateral does; the first one on a tie.
fn triangulate_quad(points: &[DVec3]) -> Vec<[u32; 3]> {
    let normal = area_vector(points);
    let facing = |[a, b, c]: [usize; 3]| {
        (points[b] - points[a])
            .cross(points[c] - points[a])
            .dot(normal)
    };
    let first = facing([0, 1, 2]).min(facing([0, 2, 3]));
    let second = facing([1, 2, 3]).min(facing([1, 3, 0]));
    let first_is_shorter =
        points[0].distance_squared(points[2]) <= points[1].distance_squared(points[3]);
    let takes_first = match (first > 0.0, second > 0.0) {
        (true, false) => true,
        (false, true) => false,
        (true, true) => first_is_shorter,
        (false, false) => first >= second,
    };
    if takes_first {
        vec![[0, 1, 2], [0, 2, 3]]
    } else {
        vec![[1, 2, 3], [1, 3, 0]]
    }
}

fn cut_ears(points: &[DVec2]) -> Vec<[u32; 3]> {
    Cutter::new(points).cut()
}

/// A polygon that ears are being cut from.
struct Cutter<'a> {
    points: &'a [DVec2],
    previous: Vec<usize>,
    next: Vec<usize>,
    remaining: Remaining<'a>,
    /// Of each corner how bad it is to cut it.
    cost: Vec<f64>,
    /// Corners by their cost; some are out of date.
    queue: CostQueue<usize>,
}

impl<'a> Cutter<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let n = points.len();
        let mut cutter = Self {
            points,
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
            next: (0..n).map(|i| (i + 1) % n).collect(),
            remaining: Remaining::new(points),
            cost: vec![0.0; n],
            queue: CostQueue::with_capacity(3 * n),
        };
        for corner in 0..n {
            cutter.judge(corner);
        }
        cutter
    }

    fn cut(&mut self) -> Vec<[u32; 3]> {
        let n = self.points.len();
        let mut triangles = Vec::with_capacity(n - 2);
        while triangles.len() < n - 2 {
            let (cost, best) = self.queue.pop().expect("more than two corners are left");
            if !self.remaining.has(best) || self.cost[best].to_bits() != cost.to_bits() {
                continue;
            }
            let (before, after) = (self.previous[best], self.next[best]);
            triangles.push([before as u32, best as u32, after as u32]);
            self.remaining.remove(best);
            self.next[before] = after;
            self.previous[after] = before;
            self.judge(before);
            self.judge(after);
        }
        triangles
    }

    /// Finds out how good it is to cut a corner now.
    fn judge(&mut self, corner: usize) {
        let places = [self.previous[corner], corner, self.next[corner]].map(|i| self.points[i]);
        let cost = -ear_score(places, &mut self.remaining);
        self.cost[corner] = cost;
        self.queue.push(cost, corner);
    }
}

/// A triangle that may be cut off, its corners counter-clockwise.
struct Ear([DVec2; 3]);

impl Ear {
    fn has_corner_at(&self, p: DVec2) -> bool {
        self.0.contains(&p)
    }

    /// Whether a point lies in the triangle or on its rim.
    fn contains(&self, p: DVec2) -> bool {
        let [a, b, c] = self.0;
        (b - a).perp_dot(p - a) >= 0.0
            && (c - b).perp_dot(p - b) >= 0.0
            && (a - c).perp_dot(p - c) >= 0.0
    }

    /// Whether [`Self::contains`] may hold for a point of a box. Rounding keeps order, so that what is computed for the corner
    /// farthest on an edge's inner side bounds what is computed for any point.
    fn may_meet(&self, min: DVec2, max: DVec2) -> bool {
        let [a, b, c] = self.0;
        [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
            let along = to - from;
            let farthest = DVec2::new(
                if along.y > 0.0 { min.x } else { max.x },
                if along.x > 0.0 { max.y } else { min.y },
            );
            along.perp_dot(farthest - from) >= 0.0
        })
    }
}

/// How good it is to cut the middle one of three corners in a row off now. Positive: a proper ear, the sine of its smallest
/// angle. Zero: a straight corner. Negative: a reflex corner, or one with others inside.
fn ear_score([a, b, c]: [DVec2; 3], remaining: &mut Remaining<'_>) -> f64 {
    /// Put below every reflex or straight corner's own score.
    const OCCUPIED: f64 = -2.0;
    let lengths = [a.distance(b), b.distance(c), c.distance(a)];
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let doubled_area = (b - a).perp_dot(c - b);
    // The smallest angle lies between the two longest sides.
    let product_of_two_longest = lengths.iter().product::<f64>()
        / lengths
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min)
            .max(f64::MIN_POSITIVE);
    let sine = if longest > 0.0 && product_of_two_longest > 0.0 {
        doubled_area / product_of_two_longest
    } else {
        0.0
    };
    if sine <= STRAIGHT_SINE {
        let is_reflex = sine < -STRAIGHT_SINE;
        return if is_reflex { sine.max(-1.0) } else { 0.0 };
    }
    if remaining.any_in(&Ear([a, b, c])) {
        return OCCUPIED;
    }
    sine
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3], triangles: &[[u32; 3]]) -> (f64, f64) {
        let normal = area_vector(points).normalize_or_zero();
        triangles
            .iter()
            .fold((0.0, f64::INFINITY), |(sum, least), t| {
                let [a, b, c] = t.map(|i| points[i as usize]);
                let signed = 0.5 * (b - a).cross(c - a).dot(normal);
                (sum + signed.abs(), least.min(signed))
            })
    }

    fn plane(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|p| DVec3::new(p[0], p[1], 3.0)).collect()
    }

    #[test]
    fn an_l_is_not_cut_as_a_fan() {
        let l = plane(&[
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
            [0.0, 0.0],
            [2.0, 0.0],
        ]);
        let triangles = triangulate_polygon(&l);
        assert_eq!(triangles.len(), 4);
        let (sum, least) = area(&l, &triangles);
        assert!((sum - 3.0).abs() < 1e-12 && least > 0.0, "{sum} {least}");
        let fan: Vec<[u32; 3]> = (1..5).map(|i| [0, i, i + 1]).collect();
        assert!(area(&l, &fan).1 < 0.0, "a fan must fail this test");
    }

    #[test]
    fn a_dart_is_cut_along_its_inner_diagonal() {
        for turn in 0..4 {
            let mut dart = plane(&[[0.0, 0.0], [2.0, -3.0], [0.5, 0.0], [2.0, 3.0]]);
            dart.rotate_left(turn);
            let (sum, least) = area(&dart, &triangulate_polygon(&dart));
            assert!(
                (sum - 1.5).abs() < 1e-12 && least > 0.0,
                "{turn}: {sum} {least}"
            );
        }
    }

    #[test]
    fn straight_corners_stay_in_the_mesh() {
        let square = plane(&[
            [0.0, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [2.0, 2.0],
            [0.0, 2.0],
        ]);
        let triangles = triangulate_polygon(&square);
        assert_eq!(triangles.len(), 4);
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used, [0, 1, 2, 3, 4, 5]);
        assert!((area(&square, &triangles).0 - 4.0).abs() < 1e-12);
    }

    #[test]
    fn folded_and_repeated_points_still_give_n_minus_two() {
        let same = vec![DVec3::ONE; 7];
        assert_eq!(triangulate_polygon(&same).len(), 5);
        let bow = plane(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [-1.0, 1.0]]);
        assert_eq!(triangulate_polygon(&bow).len(), 3);
        assert!(triangulate_polygon(&bow[..2]).is_empty());
    }

    /// The plain way: every ear is looked for among all corners, and every corner that is left is looked for in it.
    fn cut_plainly(points: &[DVec2]) -> Vec<[u32; 3]> {
        let mut left: Vec<usize> = (0..points.len()).collect();
        let score = |left: &[usize], at: usize| {
            let n = left.len();
            let ear = [left[(at + n - 1) % n], left[at], left[(at + 1) % n]].map(|i| points[i]);
            let others: Vec<DVec2> = left.iter().map(|&i| points[i]).collect();
            ear_score(ear, &mut Remaining::new(&others))
        };
        let mut scores: Vec<f64> = (0..left.len()).map(|at| score(&left, at)).collect();
        let mut triangles = Vec::new();
        while left.len() > 2 {
            let n = left.len();
            let best = (0..n)
                .max_by(|&a, &b| scores[a].total_cmp(&scores[b]).then(b.cmp(&a)))
                .unwrap();
            let ear = [(best + n - 1) % n, best, (best + 1) % n].map(|at| left[at] as u32);
            triangles.push(ear);
            left.remove(best);
            scores.remove(best);
            let n = left.len();
            for at in [(best + n - 1) % n, best % n] {
                scores[at] = score(&left, at);
            }
        }
        triangles
    }

    /// Any corner inside or on the rim, asked of each.
    fn any_in_plainly(points: &[DVec2], ear: &Ear) -> bool {
        let mut points = points.iter();
        points.any(|&p| !ear.has_corner_at(p) && ear.contains(p))
    }

    /// A polygon with so many prongs; the corners between them are reflex.
    fn comb(prongs: usize) -> Vec<DVec2> {
        let mut points = vec![DVec2::new(prongs as f64, -1.0), DVec2::new(0.0, -1.0)];
        for i in 0..prongs {
            let x = i as f64;
            points.extend([
                DVec2::new(x, 0.0),
                DVec2::new(x + 0.3, 40.0),
                DVec2::new(x + 0.6, 40.0),
                DVec2::new(x + 0.9, 0.0),
            ]);
        }
        points.reverse();
        points
    }

    fn disc(corners: usize) -> Vec<DVec2> {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / corners as f64;
        (0..corners).map(|i| DVec2::from_angle(angle(i))).collect()
    }

    /// Rays from one place, to which the polygon comes back between any two.
    fn star(rays: usize) -> Vec<DVec2> {
        let out = disc(rays);
        out.iter().flat_map(|&p| [DVec2::ZERO, p]).collect()
    }

    fn looked_at(points: &[DVec2]) -> usize {
        let mut cutter = Cutter::new(points);
        assert_eq!(cutter.cut().len(), points.len() - 2);
        cutter.remaining.looked_at
    }

    #[test]
    fn large_polygons_are_cut_without_looking_at_everything() {
        for polygon in [|n| comb(n / 4), disc, |n| star(n / 2)] {
            let (few, many) = (looked_at(&polygon(1_000)), looked_at(&polygon(8_000)));
            // The power of 1.5, 23 times, with some to spare; the square would be 64 times as much.
            assert!(many < 32 * few, "{few} for 1000 corners, {many} for 8000");
        }
        // What is counted, without a tree over places: every corner for every ear.
        assert!(looked_at(&disc(1_000)) < 1_000 * 1_000 / 4);
    }

    proptest::proptest! {
        #[test]
        fn a_star_shaped_polygon_keeps_its_area(
            radii in proptest::collection::vec(0.05..1.0_f64, 3..60),
            tilt in -1.0..1.0_f64,
        ) {
            let points: Vec<DVec3> = radii.iter().enumerate().map(|(i, r)| {
                let angle = std::f64::consts::TAU * i as f64 / radii.len() as f64;
                DVec3::new(r * angle.cos(), r * angle.sin(), tilt * r * angle.cos())
            }).collect();
            let triangles = triangulate_polygon(&points);
            proptest::prop_assert_eq!(triangles.len(), points.len() - 2);
            let whole = 0.5 * area_vector(&points).length();
            let (sum, least) = area(&points, &triangles);
            proptest::prop_assert!((sum - whole).abs() < 1e-9 && least > -1e-12, "{} {} {}", sum, whole, least);
        }

        #[test]
        fn ears_are_the_ones_of_the_plain_way(
            // A coarse grid: many corners on one line, at one place, and crossing sides.
            corners in proptest::collection::vec((0..7_i32, 0..7_i32), 5..40),
            shake in 0.0..0.3_f64,
        ) {
            let points: Vec<DVec2> = corners.iter().zip(0..).map(|(&(x, y), i)| {
                let off = if i % 3 == 0 { shake } else { 0.0 };
                DVec2::new(f64::from(x) + off, f64::from(y))
            }).collect();
            proptest::prop_assert_eq!(cut_ears(&points), cut_plainly(&points));
            let mut remaining = Remaining::new(&points);
            for ear in points.windows(3).map(|w| Ear([w[0], w[1], w[2]])) {
                proptest::prop_assert_eq!(remaining.any_in(&ear), any_in_plainly(&points, &ear));
            }
        }
    }
}
