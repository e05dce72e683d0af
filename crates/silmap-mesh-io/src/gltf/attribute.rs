//! Values for each vertex of a primitive.

use super::accessor::Accessor;

/// Values for each vertex, from an accessor or decoded.
pub(super) enum Attribute<'a> {
    Stored(Accessor<'a>),
    Decoded { width: usize, values: Vec<f64> },
}

impl Attribute<'_> {
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Stored(accessor) => accessor.count,
            Self::Decoded { width, values } => values.len().checked_div(*width).unwrap_or(0),
        }
    }

    pub(super) fn width(&self) -> usize {
        match self {
            Self::Stored(accessor) => accessor.width(),
            Self::Decoded { width, .. } => *width,
        }
    }

    /// The first components of an element, zero where it has fewer.
    pub(super) fn get<const N: usize>(&self, element: usize) -> [f64; N] {
        match self {
            Self::Stored(accessor) => accessor.get(element),
            Self::Decoded { width, values } => {
                let values = &values[element * width..(element + 1) * width];
                std::array::from_fn(|k| values.get(k).copied().unwrap_or(0.0))
            }
        }
    }
}
