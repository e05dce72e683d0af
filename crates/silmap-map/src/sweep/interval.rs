//! What bounds a silhouette across a slab: sides, and intervals between them.

/// Where a ray touches the object: its place on the scanline, and how deep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Touch {
    /// Place on the scanline.
    pub x: f64,
    /// Disparity of the point between the two views of the pair: baseline over depth.
    pub disparity: f64,
    /// How the disparity changes with the viewpoint's place between the two views, where the rule knows it: what is touched
    /// slides along the ray, the faster the flatter the object is there.
    pub slide: f64,
}

impl Touch {
    /// Linear interpolation: (1 − α) of `self` and α of `other`, exact at 0 and 1.
    pub(crate) fn lerp(self, other: Self, alpha: f64) -> Self {
        let mix = |a: f64, b: f64| a * (1.0 - alpha) + b * alpha;
        Self {
            x: mix(self.x, other.x),
            disparity: mix(self.disparity, other.disparity),
            slide: mix(self.slide, other.slide),
        }
    }
}

/// A touching ray that is linear across a slab: at its top and at its bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    /// At the slab's top (smaller y).
    pub top: Touch,
    /// At the slab's bottom.
    pub bottom: Touch,
}

impl Side {
    /// The x at `share` of the way from top to bottom; exact at 0 and 1.
    #[must_use]
    pub(crate) fn at(self, share: f64) -> f64 {
        if share <= 0.0 {
            self.top.x
        } else if share >= 1.0 {
            self.bottom.x
        } else {
            self.top.x + (self.bottom.x - self.top.x) * share
        }
    }

    /// The touching ray at `share` of the way from top to bottom; exact at 0 and 1.
    pub(crate) fn touch_at(self, share: f64) -> Touch {
        if share <= 0.0 {
            self.top
        } else if share >= 1.0 {
            self.bottom
        } else {
            let mix = |a: f64, b: f64| a + (b - a) * share;
            Touch {
                x: mix(self.top.x, self.bottom.x),
                disparity: mix(self.top.disparity, self.bottom.disparity),
                slide: mix(self.top.slide, self.bottom.slide),
            }
        }
    }

    /// Linear interpolation between two sides: (1 − α) of `self` and α of `other`, exact at 0 and 1.
    #[must_use]
    pub(crate) fn lerp(self, other: Self, alpha: f64) -> Self {
        Self {
            top: self.top.lerp(other.top, alpha),
            bottom: self.bottom.lerp(other.bottom, alpha),
        }
    }

    /// Where in (0, 1) the two sides cross.
    #[must_use]
    pub(crate) fn crossing(self, other: Self) -> Option<f64> {
        let (above, below) = (self.top.x - other.top.x, self.bottom.x - other.bottom.x);
        if above * below >= 0.0 {
            return None;
        }
        let share = above / (above - below);
        (share > 0.0 && share < 1.0).then_some(share)
    }
}

/// An interval of a span across a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    /// Where a scanline enters the silhouette.
    pub enter: Side,
    /// Where it leaves again.
    pub exit: Side,
}

/// An interval of a span on one scanline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Section {
    /// Where the scanline enters the silhouette.
    pub enter: Touch,
    /// Where it leaves again.
    pub exit: Touch,
}

/// Sorts a short, almost sorted list by a key; equal keys keep their order.
pub(crate) fn insertion_sort<T: Copy>(items: &mut [T], key: impl Fn(&T) -> f64) {
    for i in 1..items.len() {
        let item = items[i];
        let k = key(&item);
        let mut j = i;
        while j > 0 && key(&items[j - 1]) > k {
            items[j] = items[j - 1];
            j -= 1;
        }
        items[j] = item;
    }
}
