//! Closed polygons in the image and filling them into masks.
//!
//! A region is a list of closed loops. Outer loops have positive area in image coordinates (x right, y down), holes
//! negative, so the signed areas add up to the region's.

use glam::DVec2;

use crate::Mask;

/// A closed polygon: the last point connects to the first.
pub type Loop = Vec<DVec2>;

/// Signed area of a loop: positive when it runs from +x to +y.
#[must_use]
pub fn signed_area(points: &[DVec2]) -> f64 {
    let Some(&origin) = points.first() else {
        return 0.0;
    };
    let twice: f64 = edges(points)
        .map(|(a, b)| (a - origin).perp_dot(b - origin))
        .sum();
    twice * 0.5
}

/// The edges of a closed loop, in order.
pub fn edges(points: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    let next = points.iter().cycle().skip(1);
    points.iter().copied().zip(next.copied())
}

/// First row whose centre lies at or below `y`.
fn row_from(y: f64) -> i64 {
    (y - 0.5).ceil() as i64
}

/// Squared distance of `p` from the segment between `a` and `b`.
#[must_use]
pub fn distance_squared_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (along, offset) = (b - a, p - a);
    let length_squared = along.length_squared();
    let t = offset.dot(along);
    if t <= 0.0 {
        offset.length_squared()
    } else if t >= length_squared {
        p.distance_squared(b)
    } else {
        let across = along.perp_dot(offset);
        across * across / length_squared
    }
}

/// Sets the pixels whose centre an odd number of loops surrounds; `mask` is overwritten.
///
/// Crossings toggle a bit and a prefix exclusive-or along each row spreads it, so the cost is that of the crossings and
/// of the words, with nothing to sort. A centre exactly on an edge belongs to the loop on its right or below.
pub fn fill_even_odd<L: AsRef<[DVec2]>>(loops: impl IntoIterator<Item = L>, mask: &mut Mask) {
    mask.clear();
    toggle_edges(loops, mask);
    spread_toggles(mask);
}

/// Toggles the first pixel right of each crossing of a loop's edges with the rows' centre lines.
fn toggle_edges<L: AsRef<[DVec2]>>(loops: impl IntoIterator<Item = L>, mask: &mut Mask) {
    let (width, height) = (f64::from(mask.width()), i64::from(mask.height()));
    for points in loops {
        for (a, b) in edges(points.as_ref()) {
            let (top, bottom) = if a.y <= b.y { (a, b) } else { (b, a) };
            let first = row_from(top.y).max(0);
            let last = row_from(bottom.y).min(height);
            let slope = (bottom.x - top.x) / (bottom.y - top.y);
            for j in first..last {
                let x = top.x + (j as f64 + 0.5 - top.y) * slope;
                let column = (x - 0.5).ceil().max(0.0);
                if column < width {
                    let i = column as usize;
                    mask.row_mut(j as u32)[i / 64] ^= 1 << (i % 64);
                }
            }
        }
    }
}

/// Replaces each row by the running exclusive-or of its bits from the left.
fn spread_toggles(mask: &mut Mask) {
    let words_per_row = mask.words_per_row();
    let tail_bits = mask.width() as usize % 64;
    let tail = if tail_bits == 0 {
        !0
    } else {
        (1_u64 << tail_bits) - 1
    };
    for row in mask.words_mut().chunks_exact_mut(words_per_row.max(1)) {
        let mut carry = 0_u64;
        for word in row.iter_mut() {
            let mut w = *word;
            for shift in [1, 2, 4, 8, 16, 32] {
                w ^= w << shift;
            }
            w ^= carry;
            carry = 0_u64.wrapping_sub(w >> 63);
            *word = w;
        }
        if let Some(last) = row.last_mut() {
            *last &= tail;
        }
    }
}

/// Sets the pixels about whose centre the loops wind a non-zero number of times; `mask` is overwritten.
pub fn fill_non_zero<L: AsRef<[DVec2]>>(loops: impl IntoIterator<Item = L>, mask: &mut Mask) {
    mask.clear();
    let (width, height) = (f64::from(mask.width()), i64::from(mask.height()));
    let rows_of = |top: DVec2, bottom: DVec2| {
        let rows = [top, bottom].map(|p| row_from(p.y).clamp(0, height) as usize);
        rows[0]..rows[1]
    };
    // Edges downwards, and how many pass each row: where that many crossings of the row begin.
    let mut sides: Vec<(DVec2, DVec2, u32)> = Vec::new();
    let mut begins = vec![0_u32; height as usize + 2];
    for points in loops {
        for (a, b) in edges(points.as_ref()) {
            let (top, bottom, is_down) = if a.y <= b.y { (a, b, 1) } else { (b, a, 0) };
            let rows = rows_of(top, bottom);
            if !rows.is_empty() {
                begins[rows.start + 1] = begins[rows.start + 1].wrapping_add(1);
                begins[rows.end + 1] = begins[rows.end + 1].wrapping_sub(1);
                sides.push((top, bottom, is_down));
            }
        }
    }
    let (mut passing, mut total) = (0_u32, 0_u32);
    for begin in &mut begins[1..] {
        passing = passing.wrapping_add(*begin);
        (*begin, total) = (total, total + passing);
    }
    // Columns of crossings, and in the lowest bit whether the edge goes down. `begins[j + 1]` is where the next one of row j goes.
    let mut crossings = vec![0_u32; total as usize];
    for &(top, bottom, is_down) in &sides {
        let slope = (bottom.x - top.x) / (bottom.y - top.y);
        for j in rows_of(top, bottom) {
            let x = top.x + (j as f64 + 0.5 - top.y) * slope;
            let column = (x - 0.5).ceil().clamp(0.0, width) as u32;
            let at = &mut begins[j + 1];
            crossings[*at as usize] = column << 1 | is_down;
            *at += 1;
        }
    }
    for j in 0..height as usize {
        let row = &mut crossings[begins[j] as usize..begins[j + 1] as usize];
        row.sort_unstable();
        let mut winding = 0_i64;
        for pair in row.windows(2) {
            winding += if pair[0] & 1 == 1 { 1 } else { -1 };
            if winding != 0 {
                mask.set_span(j as u32, i64::from(pair[0] >> 1), i64::from(pair[1] >> 1));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn even_odd_by_ray(loops: &[Loop], p: DVec2) -> bool {
        let mut inside = false;
        for (a, b) in loops.iter().flat_map(|l| edges(l)) {
            if (a.y <= p.y) != (b.y <= p.y) {
                let (top, bottom) = if a.y <= b.y { (a, b) } else { (b, a) };
                let x = top.x + (p.y - top.y) * ((bottom.x - top.x) / (bottom.y - top.y));
                inside ^= x <= p.x;
            }
        }
        inside
    }

    fn any_loops() -> impl Strategy<Value = Vec<Loop>> {
        // Eighths of a pixel, also outside the image: corners on centre lines, repeated points, self-crossings.
        let point = (-80_i32..1200, -80_i32..400)
            .prop_map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)) / 8.0);
        prop::collection::vec(prop::collection::vec(point, 0..12), 0..4)
    }

    proptest! {
        #[test]
        fn even_odd_equals_ray_parity(loops in any_loops()) {
            let mut mask = Mask::new(130, 40);
            fill_even_odd(&loops, &mut mask);
            for y in 0..40 {
                for x in 0..130 {
                    let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    prop_assert_eq!(mask.get(x.into(), y.into()), even_odd_by_ray(&loops, centre), "({}, {})", x, y);
                }
            }
        }

        #[test]
        fn non_zero_covers_even_odd(loops in any_loops()) {
            let (mut odd, mut wound) = (Mask::new(130, 40), Mask::new(130, 40));
            fill_even_odd(&loops, &mut odd);
            fill_non_zero(&loops, &mut wound);
            prop_assert_eq!(odd.count_missing_in(&wound), 0);
        }
    }

    #[test]
    fn overlap_is_a_hole_for_even_odd_only() {
        let square = |x: f64| {
            vec![
                DVec2::new(x, 2.0),
                DVec2::new(x + 10.0, 2.0),
                DVec2::new(x + 10.0, 8.0),
                DVec2::new(x, 8.0),
            ]
        };
        let loops = vec![square(2.0), square(6.0)];
        let mut mask = Mask::new(20, 10);
        fill_non_zero(&loops, &mut mask);
        assert_eq!(mask.count(), 14 * 6);
        fill_even_odd(&loops, &mut mask);
        assert_eq!(mask.count(), 8 * 6);
        assert_eq!(signed_area(&loops[0]), 60.0);
    }
}
