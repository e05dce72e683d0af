//! The way over a triangle: in each row of pixels, the columns whose centres may lie in it.

use std::ops::Range;

use glam::DVec2;

/// Up to this distance from the image's corner, pixels, rounding moves an edge's place in a row by far less than a pixel.
const MOST_SURE_PX: f64 = 1e9;

/// More than rounding moves an edge's place in a row, pixels.
const ROUNDING_PX: f64 = 0.01;

/// Places in a row are whole numbers of this part of a pixel, as a power of two.
const FRACTION_BITS: u32 = 32;
const ONE: i64 = 1 << FRACTION_BITS;

/// The pixels whose centres may lie in a box: rows and columns, within an image.
pub(super) fn centres_between(low: f64, high: f64, size: u32) -> Range<i64> {
    // Casts of floats saturate, so a triangle far outside gives an empty range.
    let first = (low - 0.5).ceil().max(0.0) as i64;
    let end = ((high - 0.5).floor() + 1.0).clamp(0.0, f64::from(size)) as i64;
    first..end
}

/// Where an edge crosses one row of pixel centres after the other, in parts of a pixel.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    at: i64,
    per_row: i64,
}

impl Crossing {
    /// Of the edge between two points, at the centres of a row that it crosses, and of those after it.
    fn new(p: DVec2, q: DVec2, row: i64) -> Self {
        let slope = (q.x - p.x) / (q.y - p.y);
        let at = p.x + slope * (row as f64 + 0.5 - p.y);
        // The steep slope of an edge that crosses no other row may be cut off.
        let parts = |x: f64| (x * ONE as f64) as i64;
        Self {
            at: parts(at),
            per_row: parts(slope),
        }
    }

    fn next_row(&mut self) {
        self.at = self.at.wrapping_add(self.per_row);
    }
}

/// Calls `visit` with rows out of `rows` and in each the columns out of `columns` whose centres may lie in the triangle: all that
/// do, and at most one more at each end. Rows without any are left out.
///
/// Without this, a needle across the image would cost as many pixels as its box. `rows` and `columns` are those of the
/// triangle's box, see [`centres_between`].
#[inline]
pub(super) fn visit_rows(
    corners: [DVec2; 3],
    rows: Range<i64>,
    columns: Range<i64>,
    mut visit: impl FnMut(i64, Range<i64>),
) {
    if rows.is_empty() || columns.is_empty() {
        return;
    }
    let [mut top, mut middle, mut bottom] = corners;
    if middle.y < top.y {
        (top, middle) = (middle, top);
    }
    if bottom.y < middle.y {
        (middle, bottom) = (bottom, middle);
        if middle.y < top.y {
            (top, middle) = (middle, top);
        }
    }
    let is_sure = |p: &DVec2| p.abs().max_element() < MOST_SURE_PX;
    if !(corners.iter().all(is_sure) && top.y < bottom.y) {
        for row in rows {
            visit(row, columns.clone());
        }
        return;
    }
    // Each row lies between the long edge and one of the two others; an edge along a row bounds none.
    let turn = if middle.y < bottom.y {
        ((middle.y - 0.5).ceil() as i64).clamp(rows.start, rows.end)
    } else {
        rows.end
    };
    let mut long = Crossing::new(top, bottom, rows.start);
    let margin = (ROUNDING_PX * ONE as f64) as i64;
    for (part, [p, q]) in [
        (rows.start..turn, [top, middle]),
        (turn..rows.end, [middle, bottom]),
    ] {
        if part.is_empty() {
            continue;
        }
        let mut short = Crossing::new(p, q, part.start);
        for row in part {
            let (low, high) = (long.at.min(short.at), long.at.max(short.at));
            // The first centre at or after the one, and the last at or before the other.
            let first = (low - margin + ONE / 2 - 1) >> FRACTION_BITS;
            let last = (high + margin - ONE / 2) >> FRACTION_BITS;
            if first <= last {
                let found = first.max(columns.start)..(last + 1).min(columns.end);
                if !found.is_empty() {
                    visit(row, found);
                }
            }
            long.next_row();
            short.next_row();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_needle_costs_its_rows_and_not_its_box() {
        let needle = [[1.0, 1.0], [1000.0, 1001.0], [1000.0, 1000.0]].map(DVec2::from);
        let mut looked_at = 0;
        let (rows, columns) = (centres_between(1.0, 1001.0, 1024), 0..1024);
        visit_rows(needle, rows, columns, |_, columns| {
            looked_at += columns.end - columns.start;
        });
        assert!((500..1200).contains(&looked_at), "{looked_at} pixels");
    }
}
