//! Outlines for eyes off the polytope, put together from sectors of the picture.

pub(crate) mod join;
mod merge;
pub(crate) mod sectors;
