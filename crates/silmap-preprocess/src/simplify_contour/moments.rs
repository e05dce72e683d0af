//! Least-squares lines through stretches of a polyline, by sums of moments.

use std::ops::{Add, Sub};

use glam::DVec2;

/// Integrals over a polyline, by length: of 1, x, y, x², xy and y².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    length: f64,
    first: DVec2,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Add for Moments {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            length: self.length + other.length,
            first: self.first + other.first,
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }
}

impl Sub for Moments {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            length: self.length - other.length,
            first: self.first - other.first,
            xx: self.xx - other.xx,
            xy: self.xy - other.xy,
            yy: self.yy - other.yy,
        }
    }
}

impl Moments {
    pub(super) fn of_segment(a: DVec2, b: DVec2) -> Self {
        let length = a.distance(b);
        let square = |u: f64, v: f64| length * (u * u + u * v + v * v) / 3.0;
        Self {
            length,
            first: (a + b) * (0.5 * length),
            xx: square(a.x, b.x),
            xy: length * (2.0 * (a.x * a.y + b.x * b.y) + a.x * b.y + b.x * a.y) / 6.0,
            yy: square(a.y, b.y),
        }
    }

    /// The line with the least integral of squared distances.
    pub(super) fn fit(&self) -> Line {
        let center = self.first / self.length;
        let xx = self.xx - self.first.x * center.x;
        let xy = self.xy - self.first.x * center.y;
        let yy = self.yy - self.first.y * center.y;
        // Eigenvectors of the symmetric matrix: the direction comes from the row that cancels less.
        let half_difference = (xx - yy) * 0.5;
        let root = (half_difference * half_difference + xy * xy).sqrt();
        let direction = if half_difference >= 0.0 {
            DVec2::new(half_difference + root, xy)
        } else {
            DVec2::new(xy, root - half_difference)
        };
        Line {
            center,
            normal: direction.normalize_or_zero().perp(),
            residual: ((xx + yy) * 0.5 - root).max(0.0),
        }
    }
}

/// A line fitted to a stretch of outline.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Line {
    pub(super) center: DVec2,
    /// Unit normal; zero when the stretch has no extent.
    pub(super) normal: DVec2,
    /// Integral of the squared distances, px³.
    pub(super) residual: f64,
}
