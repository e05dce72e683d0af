//! Span intervals, and the tangent rays that bound them.

/// Which end of a span interval a tangent ray bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The object lies at greater x.
    Left,
    /// The object lies at smaller x.
    Right,
}

impl Side {
    /// Left for 0, right for 1.
    pub(crate) fn of_end(end: usize) -> Self {
        if end == 0 { Self::Left } else { Self::Right }
    }
}

/// A ray that is tangent to the object: its place on the scanline, and the depth of the point that it touches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TangentRay {
    /// Place on the scanline.
    pub x: f64,
    /// Disparity of the point between the two views of the pair: baseline over depth.
    pub disparity: f64,
    /// How the disparity changes with the viewpoint's place between the two views, where the rule knows it: what is touched
    /// slides along the ray, the faster the flatter the object is there.
    pub slide: f64,
}

impl TangentRay {
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

/// An interval of a span on one scanline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpanInterval {
    /// Where a scanline enters the silhouette.
    pub enter: TangentRay,
    /// Where it leaves again.
    pub exit: TangentRay,
}

/// Sorts a short, almost sorted list by a key, and reports every two items that change places; equal keys keep their order.
pub(crate) fn insertion_sort<T: Copy, K: PartialOrd>(
    items: &mut [T],
    key: impl Fn(T) -> K,
    mut swapped: impl FnMut(T, T),
) {
    for i in 1..items.len() {
        let item = items[i];
        let k = key(item);
        let mut j = i;
        while j > 0 && key(items[j - 1]) > k {
            swapped(items[j - 1], item);
            items[j] = items[j - 1];
            j -= 1;
        }
        items[j] = item;
    }
}
