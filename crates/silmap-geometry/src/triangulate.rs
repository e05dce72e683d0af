//! Cutting polygons in space into triangles.
//!
//! Ear cutting that always returns exactly `n − 2` triangles and uses every corner, also for corners on a straight line:
//! a cutter that drops those would tear the mesh open against the neighbouring polygon. Among the ears it prefers the
//! one with the largest smallest angle. Where no proper ear is left (self-touching or folded polygons) it cuts the least
//! bad corner rather than giving up.
//!
//! Source: G. H. Meisters. Polygons have ears. American Mathematical Monthly 82, 1975.
//! Deviations: corners are chosen by shape, not in order; a polygon need not be plane, it is judged by its projection
//! along its area vector.

use glam::{DVec2, DVec3};

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
/// The time is quadratic in the number of corners.
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
    let n = points.len();
    let mut previous: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    let mut next: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
    let mut is_left: Vec<bool> = vec![true; n];
    let mut score: Vec<f64> = (0..n)
        .map(|i| ear_score(points, &next, [previous[i], i, next[i]]))
        .collect();
    let mut triangles = Vec::with_capacity(n - 2);
    while triangles.len() < n - 2 {
        let best = (0..n)
            .filter(|&i| is_left[i])
            .max_by(|&a, &b| score[a].total_cmp(&score[b]).then(b.cmp(&a)))
            .expect("more than two corners are left");
        let (before, after) = (previous[best], next[best]);
        triangles.push([before as u32, best as u32, after as u32]);
        is_left[best] = false;
        next[before] = after;
        previous[after] = before;
        for i in [before, after] {
            score[i] = ear_score(points, &next, [previous[i], i, next[i]]);
        }
    }
    triangles
}

/// How good it is to cut the corner `[before, corner, after]` off now. Positive: a proper ear, the sine of its smallest
/// angle. Zero: a straight corner. Negative: a reflex corner, or one with others inside.
fn ear_score(points: &[DVec2], next: &[usize], [before, corner, after]: [usize; 3]) -> f64 {
    /// Put below every reflex or straight corner's own score.
    const OCCUPIED: f64 = -2.0;
    let [a, b, c] = [points[before], points[corner], points[after]];
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
    let mut other = next[after];
    while other != before {
        let p = points[other];
        let is_a_corner = p == a || p == b || p == c;
        if !is_a_corner
            && (b - a).perp_dot(p - a) >= 0.0
            && (c - b).perp_dot(p - b) >= 0.0
            && (a - c).perp_dot(p - c) >= 0.0
        {
            return OCCUPIED;
        }
        other = next[other];
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
    }
}
