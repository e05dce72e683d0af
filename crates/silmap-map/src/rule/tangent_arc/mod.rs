//! The rule of method `tight`: ends of intervals joined by the arc that touches both views' tangent rays.

pub(crate) mod prepare;
pub(crate) mod rule;
