//! Exact geometric predicates.
//!
//! Source: J. R. Shewchuk. Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates. Discrete
//! & Computational Geometry 18, 1997; through the crate `robust`, and for points at infinity here.

use glam::{DVec2, DVec3};

/// Positive when `a`, `b`, `c` turn counter-clockwise (in a frame with y up), negative when clockwise, zero when they
/// are collinear. The sign is exact.
#[must_use]
pub fn orient2d(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coordinate = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coordinate(a), coordinate(b), coordinate(c))
}

/// Whether three points lie on one line, or two of them at one place. The answer is exact.
#[must_use]
pub fn are_collinear([a, b, c]: [DVec3; 3]) -> bool {
    // They do when they do in the projections along all three axes.
    [
        |p: DVec3| DVec2::new(p.x, p.y),
        |p: DVec3| DVec2::new(p.y, p.z),
        |p: DVec3| DVec2::new(p.z, p.x),
    ]
    .iter()
    .all(|project| orient2d(project(a), project(b), project(c)) == 0.0)
}

/// Positive when `p` lies on the side of the plane through `a`, `b`, `c` that sees them counter-clockwise (outside, for
/// a face of an outward mesh), negative on the other side, zero on the plane. The sign is exact.
#[must_use]
pub fn side_of_plane(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> f64 {
    let coordinate = |p: DVec3| robust::Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    // Shewchuk's determinant is positive below the plane.
    -robust::orient3d(coordinate(a), coordinate(b), coordinate(c), coordinate(p))
}

/// Positive when the direction `towards` leads to the side of the plane through `a`, `b`, `c` that sees them
/// counter-clockwise, negative when to the other, zero when along the plane: [`side_of_plane`] of a point infinitely far
/// away. The sign is exact for input whose products neither overflow nor underflow.
#[must_use]
pub fn direction_side_of_plane(a: DVec3, b: DVec3, c: DVec3, towards: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    let (yz, zx, xy) = (
        (u.y * v.z, u.z * v.y),
        (u.z * v.x, u.x * v.z),
        (u.x * v.y, u.y * v.x),
    );
    let value = towards.x * (yz.0 - yz.1) + towards.y * (zx.0 - zx.1) + towards.z * (xy.0 - xy.1);
    let size = towards.x.abs() * (yz.0.abs() + yz.1.abs())
        + towards.y.abs() * (zx.0.abs() + zx.1.abs())
        + towards.z.abs() * (xy.0.abs() + xy.1.abs());
    // Shewchuk's bound for the same expression is 3.5 of these epsilons (his are half as large).
    if value.abs() > 8.0 * f64::EPSILON * size {
        value
    } else {
        exact_triple_product(a, b, c, towards)
    }
}

/// `towards` · (a×b + b×c + c×a), rounded, with its exact sign: the sum of 18 products of three coordinates.
fn exact_triple_product(a: DVec3, b: DVec3, c: DVec3, towards: DVec3) -> f64 {
    let mut sum: Vec<f64> = Vec::with_capacity(72);
    for (p, q) in [(a, b), (b, c), (c, a)] {
        for (d, s, t) in [
            (towards.x, p.y, q.z),
            (-towards.x, p.z, q.y),
            (towards.y, p.z, q.x),
            (-towards.y, p.x, q.z),
            (towards.z, p.x, q.y),
            (-towards.z, p.y, q.x),
        ] {
            let (high, low) = two_product(s, t);
            for part in [low, high] {
                let (high, low) = two_product(d, part);
                grow_expansion(&mut sum, low);
                grow_expansion(&mut sum, high);
            }
        }
    }
    sum.last().copied().unwrap_or(0.0)
}

/// A product as the rounded value and what rounding took away.
fn two_product(s: f64, t: f64) -> (f64, f64) {
    let product = s * t;
    (product, s.mul_add(t, -product))
}

/// Adds a number to a sum kept as parts that do not overlap, the largest last and none of them zero.
fn grow_expansion(parts: &mut Vec<f64>, number: f64) {
    let mut carry = number;
    let mut kept = 0;
    for i in 0..parts.len() {
        let sum = carry + parts[i];
        let virtual_part = sum - carry;
        let rest = (carry - (sum - virtual_part)) + (parts[i] - virtual_part);
        carry = sum;
        if rest != 0.0 {
            parts[kept] = rest;
            kept += 1;
        }
    }
    parts.truncate(kept);
    if carry != 0.0 {
        parts.push(carry);
    }
}

/// Whether the open segment `p` `q` passes from one side of the plane of the triangle to the other within the closed
/// triangle.
#[must_use]
pub fn segment_pierces_triangle(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let from = side_of_plane(a, b, c, p);
    if from == 0.0 {
        return false;
    }
    let to = side_of_plane(a, b, c, q);
    if to == 0.0 || (from > 0.0) == (to > 0.0) {
        return false;
    }
    line_meets_triangle(p, q, [a, b, c])
}

/// Whether the line through `p` and `q`, which lie on different sides of a triangle's plane, meets the closed triangle.
fn line_meets_triangle(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let turns = [
        side_of_plane(p, q, a, b),
        side_of_plane(p, q, b, c),
        side_of_plane(p, q, c, a),
    ];
    turns.iter().all(|&s| s >= 0.0) || turns.iter().all(|&s| s <= 0.0)
}

/// Whether two triangles pass through one another: an edge of one goes through the other. Triangles that only touch, or
/// lie in one plane, do not cross.
#[must_use]
pub fn triangles_cross(first: [DVec3; 3], second: [DVec3; 3]) -> bool {
    // A corner that coincides with one of the other triangle is on its plane: rounded signs do not show this, and exact ones are slow.
    let sides = |[a, b, c]: [DVec3; 3], p: DVec3| match p == a || p == b || p == c {
        true => (0.0, true),
        false => (side_of_plane(a, b, c, p), false),
    };
    // Where one has no corner beyond the other's plane, and none on it but corners of both, no edge of either goes through the other:
    // in that plane the one has only what both share. Its first corners mostly decide whether this may be so.
    let of_second = second.map(|p| sides(first, p));
    let is_beside = |sides: &[(f64, bool); 3]| {
        let all = |is_there: fn(f64) -> bool| {
            sides.iter().all(|&(s, is_shared)| is_there(s) || is_shared)
        };
        sides.iter().any(|&(s, _)| s != 0.0) && (all(|s| s > 0.0) || all(|s| s < 0.0))
    };
    if is_beside(&of_second) {
        return false;
    }
    let of_first = first.map(|p| sides(second, p));
    if is_beside(&of_first) {
        return false;
    }
    let is_pierced = |t: [DVec3; 3], sides: [(f64, bool); 3], other: [DVec3; 3]| {
        [(0, 1), (1, 2), (2, 0)].into_iter().any(|(i, k)| {
            let (from, to) = (sides[i].0, sides[k].0);
            let is_across = (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0);
            is_across && line_meets_triangle(t[i], t[k], other)
        })
    };
    is_pierced(first, of_first, second) || is_pierced(second, of_second, first)
}

/// Whether two triangles are shown to have no point in common: never for triangles that meet, and nearly always for
/// others, but for some in one plane.
#[must_use]
pub fn triangles_are_apart(first: [DVec3; 3], second: [DVec3; 3]) -> bool {
    let is_beside = |[a, b, c]: [DVec3; 3], other: [DVec3; 3]| {
        let sides = other.map(|p| side_of_plane(a, b, c, p));
        sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
    };
    if is_beside(first, second) || is_beside(second, first) {
        return true;
    }
    // Triangles meet where an edge of one meets the other.
    let misses = |p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]| {
        let ends = [p, q].map(|end| side_of_plane(a, b, c, end));
        if ends[0] * ends[1] > 0.0 {
            return true;
        }
        let turns = [
            side_of_plane(p, q, a, b),
            side_of_plane(p, q, b, c),
            side_of_plane(p, q, c, a),
        ];
        turns.iter().any(|&s| s > 0.0) && turns.iter().any(|&s| s < 0.0)
    };
    let edges = |t: [DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    edges(first).iter().all(|&[p, q]| misses(p, q, second))
        && edges(second).iter().all(|&[p, q]| misses(p, q, first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn outside_is_where_corners_look_counter_clockwise() {
        let [a, b, c] = TRIANGLE;
        assert!(side_of_plane(a, b, c, DVec3::Z) > 0.0);
        assert!(side_of_plane(a, b, c, -DVec3::Z) < 0.0);
        assert_eq!(side_of_plane(a, b, c, DVec3::new(7.0, -3.0, 0.0)), 0.0);
        assert!(orient2d(DVec2::ZERO, DVec2::X, DVec2::Y) > 0.0);
    }

    /// Corners on a coarse grid, so that shared corners, common planes and triangles without area come up.
    fn grid_triangle() -> impl Strategy<Value = [DVec3; 3]> {
        let place = (-2..=2, -2..=2, -2..=2)
            .prop_map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.1);
        [place.clone(), place.clone(), place]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn crossing_is_an_edge_through_the_other(first in grid_triangle(), mut second in grid_triangle(), shared in 0..4_usize) {
            let count = shared.min(2);
            second[..count].copy_from_slice(&first[..count]);
            let edges = |t: [DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
            let goes_through = |one, other| {
                edges(one).iter().any(|&[p, q]| segment_pierces_triangle(p, q, other))
            };
            let expected = goes_through(first, second) || goes_through(second, first);
            prop_assert_eq!(triangles_cross(first, second), expected);
        }
    }

    #[test]
    fn a_line_is_told_from_a_sliver() {
        let (a, b) = (DVec3::new(0.1, 0.7, -3.0), DVec3::new(0.3, 2.1, -9.0));
        assert!(are_collinear([DVec3::ZERO, DVec3::ONE, 3.0 * DVec3::ONE]));
        assert!(are_collinear([a, b, a]));
        assert!(are_collinear([a, DVec3::ZERO, 2.0 * a]));
        let off = DVec3::new((2.0 * a.x).next_up(), 2.0 * a.y, 2.0 * a.z);
        assert!(!are_collinear([a, DVec3::ZERO, off]));
        assert!(!are_collinear(TRIANGLE));
    }

    #[test]
    fn one_unit_in_the_last_place_decides_the_side() {
        let lift = DVec3::new(1e5, -3e4, 7e4);
        let [a, b, c] = TRIANGLE.map(|p| p + lift);
        let p = DVec3::new(0.25, 0.25, 0.0) + lift;
        assert_eq!(side_of_plane(a, b, c, p), 0.0);
        assert!(side_of_plane(a, b, c, DVec3::new(p.x, p.y, p.z.next_up())) > 0.0);
        assert!(side_of_plane(a, b, c, DVec3::new(p.x, p.y, p.z.next_down())) < 0.0);
    }

    #[test]
    fn a_direction_along_a_plane_is_told_from_one_that_leaves_it() {
        let lift = DVec3::new(1e5, -3e4, 7e4);
        let [a, b, c] = TRIANGLE.map(|p| p + lift);
        assert_eq!(
            direction_side_of_plane(a, b, c, DVec3::new(7.0, -3.0, 0.0)),
            0.0
        );
        assert!(direction_side_of_plane(a, b, c, DVec3::new(7.0, -3.0, 1e-200)) > 0.0);
        assert!(direction_side_of_plane(a, b, c, DVec3::new(7.0, -3.0, -1e-200)) < 0.0);
    }

    proptest! {
        #[test]
        fn a_direction_is_a_point_far_away(coordinates in prop::array::uniform12(-4_i32..5), scale in 1_u32..4) {
            let point = |i: usize| DVec3::new(
                f64::from(coordinates[i]), f64::from(coordinates[i + 1]), f64::from(coordinates[i + 2]));
            let [a, b, c, d] = [point(0), point(3), point(6), point(9)];
            let by_numbers = d.dot((b - a).cross(c - a));
            let sign = |x: f64| x.partial_cmp(&0.0);
            prop_assert_eq!(sign(direction_side_of_plane(a, b, c, d)), sign(by_numbers));
            prop_assert_eq!(sign(exact_triple_product(a, b, c, d)), sign(by_numbers));
            // Thirds are rounded: a triangle in a plane through the origin, seen along a side, is exact all the same.
            let thirds = f64::from(scale) / 3.0;
            let [a, b, c] = [a * thirds, b * thirds, c * thirds];
            let along = a - b;
            let exact = exact_triple_product(a, b, c, along);
            let quick = direction_side_of_plane(a, b, c, along);
            prop_assert_eq!(sign(exact), sign(quick));
            prop_assert_eq!(sign(exact), sign(-exact_triple_product(b, a, c, along)));
        }
    }

    #[test]
    fn touching_is_not_crossing() {
        let on_face = [
            DVec3::new(0.2, 0.2, 0.0),
            DVec3::new(0.3, 0.2, 1.0),
            DVec3::new(0.2, 0.3, 1.0),
        ];
        assert!(!triangles_cross(TRIANGLE, on_face));
        let through = on_face.map(|p| p - DVec3::Z * 0.5);
        assert!(triangles_cross(TRIANGLE, through));
        assert!(triangles_cross(through, TRIANGLE));
        let beside = through.map(|p| p + DVec3::X);
        assert!(!triangles_cross(TRIANGLE, beside));
        let in_plane = TRIANGLE.map(|p| p + DVec3::new(0.1, 0.1, 0.0));
        assert!(!triangles_cross(TRIANGLE, in_plane));
        let sharing_a_corner = [
            DVec3::ZERO,
            DVec3::new(-1.0, 0.0, 1.0),
            DVec3::new(-1.0, 0.0, -1.0),
        ];
        assert!(!triangles_cross(TRIANGLE, sharing_a_corner));
    }

    proptest! {
        #[test]
        fn crossing_is_symmetric_and_ignores_orientation(coordinates in prop::array::uniform18(-2_i32..3)) {
            let point = |i: usize| DVec3::new(
                f64::from(coordinates[i]), f64::from(coordinates[i + 1]), f64::from(coordinates[i + 2]));
            let first = [point(0), point(3), point(6)];
            let second = [point(9), point(12), point(15)];
            let crosses = triangles_cross(first, second);
            prop_assert_eq!(crosses, triangles_cross(second, first));
            let apart = triangles_are_apart(first, second);
            prop_assert!(!(crosses && apart));
            prop_assert_eq!(apart, triangles_are_apart(second, first));
            let shares_a_corner = first.iter().any(|p| second.contains(p));
            prop_assert!(!(shares_a_corner && apart));
            // Lifted out of reach: a plane here that does not stand upright stays below 260 where the grid is.
            let lifted = second.map(|p| p + DVec3::Z * 1000.0);
            let stands_upright = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).z == 0.0;
            prop_assert!(stands_upright(first) || triangles_are_apart(first, lifted));
            prop_assert_eq!(crosses, triangles_cross([first[1], first[0], first[2]], second));
            prop_assert_eq!(crosses, triangles_cross(first, [second[2], second[0], second[1]]));
        }
    }
}
