//! A closed loop as triangles whose signed areas add up to it: for the stencil, where windings are counted.
//!
//! Every second point is the middle of a triangle between its two neighbours and goes; so on with those that are left. Each triangle lies
//! at the border, those of the first round are small, and all together hardly cover more than the loop, where a fan covers much of it
//! several times. Any loop will do, crossing itself or not.
//!
//! Source: Silhouette Mapping, section 8.1, takes fans. Deviation: the order in which Skia triangulates paths from the middle out (its class
//! `MiddleOutPolygonTriangulator`), as one formula for each point.

/// What stands for the triangle of a point that begins no edge.
pub const NO_EDGE: u32 = u32::MAX;

/// Bits of the number of points to the next corner.
const AFTER_BITS: u32 = 27;

/// The triangle of which point `middle` of a loop of `count` points is the middle, whose first point comes again as number `count`: how
/// far the corner before it is, a power of two, and the one after it; nothing where that is the loop's first point.
#[must_use]
pub fn triangle(middle: u32, count: u32) -> (u32, u32) {
    if middle == 0 {
        return (1, 0);
    }
    let before = middle & middle.wrapping_neg();
    (before, before.min(count - middle))
}

/// The same as one number, for `shaders/windings.wgsl`.
#[must_use]
pub fn packed_triangle(middle: u32, count: u32) -> u32 {
    let (before, after) = triangle(middle, count);
    before.trailing_zeros() << AFTER_BITS | after
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    /// How often a loop winds about a point.
    fn winding(points: &[DVec2], place: DVec2) -> i32 {
        let steps = points.iter().zip(points.iter().cycle().skip(1));
        steps
            .map(|(&a, &b)| {
                let is_up = b.y > place.y;
                if (a.y > place.y) == is_up {
                    return 0;
                }
                let is_right = ((b - a).perp_dot(place - a) > 0.0) == is_up;
                match (is_right, is_up) {
                    (true, true) => 1,
                    (true, false) => -1,
                    (false, _) => 0,
                }
            })
            .sum()
    }

    proptest! {
        /// Windings about any point add up to that of the loop.
        #[test]
        fn triangles_add_up_to_the_loop(
            points in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 3..70), x in -1.0..1.0_f64, y in -1.0..1.0_f64,
        ) {
            let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
            let count = points.len() as u32;
            let place = DVec2::new(x, y);
            let corner = |k: u32| points[(k % count) as usize];
            let sum: i32 = (0..count)
                .map(|k| (k, triangle(k, count)))
                .filter(|(_, (_, after))| *after > 0)
                .map(|(k, (before, after))| {
                    winding(&[corner(k - before), corner(k), corner(k + after)], place)
                })
                .sum();
            prop_assert_eq!(sum, winding(&points, place));
        }

        /// All of it is in the one number, which is never that of no edge.
        #[test]
        fn one_number_holds_a_triangle(count in 3..(1_u32 << AFTER_BITS), share in 0.0..1.0_f64) {
            let middle = (f64::from(count - 1) * share) as u32;
            let packed = packed_triangle(middle, count);
            prop_assert_ne!(packed, NO_EDGE);
            let unpacked = (1 << (packed >> AFTER_BITS), packed & ((1 << AFTER_BITS) - 1));
            prop_assert_eq!(unpacked, triangle(middle, count));
        }
    }

    /// On a circle they cover the loop and nothing else; a fan about a point of it does so too, but not with so wide triangles.
    #[test]
    fn a_convex_loop_is_covered_once() {
        let count = 100;
        let at = |k: u32| {
            DVec2::from_angle(f64::from(k % count) / f64::from(count) * std::f64::consts::TAU)
        };
        let double_area = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
        let mut sum = 0.0;
        let mut perimeters = 0.0;
        for k in 1..count {
            let (before, after) = triangle(k, count);
            let (a, b, c) = (at(k - before), at(k), at(k + after));
            assert!(double_area(a, b, c) >= 0.0);
            sum += double_area(a, b, c);
            perimeters += a.distance(b) + b.distance(c) + c.distance(a);
        }
        let wanted: f64 = (0..count).map(|k| at(k).perp_dot(at(k + 1))).sum();
        assert!((sum - wanted).abs() < 1e-9);
        let fan: f64 = (1..count).map(|k| at(0).distance(at(k)) * 2.0).sum();
        assert!(perimeters < 0.3 * fan, "{perimeters} of {fan}");
    }
}
