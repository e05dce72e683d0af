//! Whether two neighbouring sides of an outline cross on their way down, and where.

use glam::DVec4;

/// Heights between which nothing crosses.
pub(crate) const NOWHERE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// Widens a range of heights to hold all places where one side lies beyond the next.
pub(crate) fn widen_by_crossing(left: &[DVec4], right: &[DVec4], range: &mut (f64, f64)) {
    // Mostly the two do not even come near each other.
    let rightmost = (left.iter()).fold(f64::NEG_INFINITY, |x, p| if p.x > x { p.x } else { x });
    let leftmost = (right.iter()).fold(f64::INFINITY, |x, p| if p.x < x { p.x } else { x });
    if rightmost < leftmost {
        return;
    }
    widen_where_beyond(left, right, 1.0, range);
    widen_where_beyond(right, left, -1.0, range);
}

/// Widens a range of heights by those between the vertices around each vertex of `line` that lies beyond `other` in the direction
/// of `sign`.
fn widen_where_beyond(line: &[DVec4], other: &[DVec4], sign: f64, range: &mut (f64, f64)) {
    let mut k = 0;
    for (i, p) in line.iter().enumerate() {
        while k + 2 < other.len() && other[k + 1].y < p.y {
            k += 1;
        }
        let (a, b) = (other[k], other[k + 1]);
        // Compared without a division: the segment goes down.
        let height = b.y - a.y;
        if sign * ((p.x - a.x) * height - (b.x - a.x) * (p.y - a.y)) > 0.0 {
            let above = line[i.saturating_sub(1)].y.min(a.y);
            let below = line[(i + 1).min(line.len() - 1)].y.max(b.y);
            *range = (range.0.min(above), range.1.max(below));
        }
    }
}
