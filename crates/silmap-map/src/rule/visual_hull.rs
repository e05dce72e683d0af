//! The rule of method `hull`: all pairs of intervals, as far as their rays can meet in the model's bounding sphere.
//!
//! Source: Silhouette Mapping, section 5.3: the two-view visual hull is the union of all pairs. Deviation: points x₁ and x₂ of a
//! pair have the parallax x₁ − x₂, and only what a sphere around the model allows is kept. The pairs of points of two intervals are
//! a rectangle, the parallax cuts a band out of it, and an end of the interpolated interval is a corner of what is left: which
//! corner does not depend on the viewpoint between the views.

use glam::DVec2;

/// A range of parallax, or of heights.
pub(super) type Range = (f64, f64);

/// The points of either view that an end is interpolated from: places and disparities.
pub(super) type Corner = (DVec2, DVec2);

/// Which points of its two intervals an end is seen by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Bound {
    /// The ends of both, which meet at an allowed depth.
    #[default]
    Both,
    /// An end of one, with the parallax of the farthest allowed depth.
    Farthest,
    /// An end of one, with the parallax of the nearest allowed depth.
    Nearest,
}

fn parallax((one, two): Corner) -> f64 {
    one.x - two.x
}

/// Moves the left or right corner of a whole pair to that of a band of parallax.
pub(super) fn keep_within((least, greatest): Range, corner: &mut Corner, is_left: bool) -> Bound {
    let (limit, bound) = if parallax(*corner) < least {
        (least, Bound::Farthest)
    } else if parallax(*corner) > greatest {
        (greatest, Bound::Nearest)
    } else {
        return Bound::Both;
    };
    // From the rectangle's corner the band lies along the interval of the first view or of the second.
    let (one, two) = if (bound == Bound::Farthest) == is_left {
        (corner.1.x + limit, corner.1.x)
    } else {
        (corner.0.x, corner.0.x - limit)
    };
    *corner = (DVec2::new(one, limit), DVec2::new(two, limit));
    bound
}

/// The parallax between a pair of viewpoints that points of a sphere about the center can have.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SphereParallax {
    /// Distance between the viewpoints.
    pub(crate) baseline: f64,
    /// Depth of the center along the frame's forward axis.
    pub(crate) center_depth: f64,
    /// Radius of the sphere; without one all parallax is allowed.
    pub(crate) radius: Option<f64>,
}

impl SphereParallax {
    /// A range of parallax that is allowed on all scanlines between two heights: the farther from the middle, the narrower.
    pub(crate) fn narrowest(&self, (y_top, y_bottom): Range) -> Range {
        self.at(y_top.abs().max(y_bottom.abs()))
    }

    /// A range that holds all parallax that is allowed on some scanline between two heights.
    pub(crate) fn widest(&self, (y_top, y_bottom): Range) -> Range {
        self.at(0.0_f64.clamp(y_top, y_bottom))
    }

    /// The least and the greatest parallax on the scanline at height y.
    ///
    /// A point at depth z has parallax b/z. The epipolar plane cuts the sphere in a disc whose middle has depth c/(1 + y²).
    /// Contours are stored to a fraction of a pixel, so that touching rays may miss: hence the slack, which also covers that
    /// the range is taken as linear within a slab.
    pub(crate) fn at(&self, y: f64) -> Range {
        let Some(radius) = self.radius else {
            return EVERYTHING;
        };
        let stretch = 1.0 + y * y;
        let off_plane = y * y * self.center_depth * self.center_depth / stretch;
        let reach = ((radius * radius - off_plane).max(0.0) / stretch).sqrt();
        let middle = self.center_depth / stretch;
        let nearest = (middle - reach).max(self.baseline / MAX_PARALLAX);
        let least = self.baseline / (middle + reach);
        (
            least - PARALLAX_SLACK,
            self.baseline / nearest + PARALLAX_SLACK,
        )
    }
}

/// Nothing is excluded.
pub(super) const EVERYTHING: Range = (f64::NEG_INFINITY, f64::INFINITY);

/// Tangent units: more parallax than rays in front of both views can have.
const MAX_PARALLAX: f64 = 1e3;

/// Tangent units: about two pixels of a 512² capture.
const PARALLAX_SLACK: f64 = 3e-3;
