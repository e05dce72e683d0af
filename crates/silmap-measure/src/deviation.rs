//! How far two outlines are apart, in pixels.
//!
//! Two measures. How far the outlines stray from each other ([`straying`](crate::straying())): a slit that only one has counts by its
//! length, however thin. And how thick the region is that only one of them holds, twice the radius of the largest disc in it: what the
//! eye sees.

use glam::DVec2;
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::{Loop, Mask};

use crate::nearest::SegmentGrid;
use crate::straying::{between, boundary};

/// Samples of a pixel's side in which regions are compared.
const FINENESS: f64 = 4.0;

/// How far apart two outlines are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Mean distance of a boundary point to the other boundary, both ways; infinite where only one of the two has a boundary.
    pub mean_px: f64,
    /// The largest such distance; infinite where only one of the two has a boundary.
    pub most_px: f64,
    /// The thickest place of the region that only one of the two holds.
    pub thickest_px: f64,
}

/// How far two outlines are apart: loops that hold the points about which they wind a number of times other than zero, in a picture of
/// so many pixels.
#[must_use]
pub fn deviation(one: &[Loop], two: &[Loop], (width, height): (u32, u32)) -> Deviation {
    let (of_one, of_two) = (boundary(one), boundary(two));
    let found = between(&of_one, &of_two);
    Deviation {
        mean_px: found.mean_px,
        most_px: found.largest_px,
        thickest_px: thickest([(one, &of_one), (two, &of_two)], (width, height)),
    }
}

/// Loops, and their edges.
type Outlined<'a> = (&'a [Loop], &'a SegmentGrid);

fn thickest(outlines: [Outlined<'_>; 2], (width, height): (u32, u32)) -> f64 {
    let fine = |px: u32| (f64::from(px) * FINENESS) as u32;
    let [one, two] = outlines.map(|(loops, _)| {
        let mut mask = Mask::new(fine(width), fine(height));
        let larger = |l: &Loop| -> Loop { l.iter().map(|p| p * FINENESS).collect() };
        fill_non_zero(loops.iter().map(larger), &mut mask);
        mask
    });
    let mut most = 0.0_f64;
    for y in 0..fine(height) {
        let words = one.row(y).iter().zip(two.row(y)).zip(0_u32..);
        for ((a, b), at) in words {
            let mut different = a ^ b;
            while different != 0 {
                let x = 64 * at + different.trailing_zeros();
                different &= different - 1;
                let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / FINENESS;
                let nearest = outlines.iter().filter_map(|(_, grid)| grid.nearest(p));
                let radius_squared = nearest
                    .map(|n| n.distance_squared)
                    .fold(f64::INFINITY, f64::min);
                most = most.max(2.0 * radius_squared.sqrt());
            }
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Loop {
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
            .map(|(u, v)| DVec2::new(x + u, y + v))
            .to_vec()
    }

    #[test]
    fn a_shift_is_as_far_as_it_is() {
        let (one, two) = ([square(5.0, 5.0, 20.0)], [square(6.0, 5.0, 20.0)]);
        let found = deviation(&one, &two, (32, 32));
        assert!((found.most_px - 1.0).abs() < 1e-9, "{found:?}");
        // To within a sample's size.
        assert!((found.thickest_px - 1.0).abs() < 0.3, "{found:?}");
        assert!(found.mean_px > 0.3 && found.mean_px < 1.0, "{found:?}");
        let same = deviation(&one, &one, (32, 32));
        assert!(same.most_px < 1e-9 && same.thickest_px == 0.0, "{same:?}");
    }

    #[test]
    fn a_slit_is_long_and_not_thick() {
        let one = vec![square(5.0, 5.0, 20.0)];
        let slit = [(15.0, 5.0), (15.5, 5.0), (15.5, 17.0), (15.0, 17.0)];
        let mut hole = slit.map(DVec2::from).to_vec();
        hole.reverse();
        let two = vec![one[0].clone(), hole];
        let found = deviation(&one, &two, (32, 32));
        assert!(found.most_px > 7.0 && found.thickest_px < 0.6, "{found:?}");
        assert!(deviation(&one, &[], (32, 32)).most_px.is_infinite());
    }
}
