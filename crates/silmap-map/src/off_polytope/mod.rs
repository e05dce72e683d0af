//! Outlines for eyes off the polytope, put together from sectors of the picture.

mod merge;
pub(crate) mod sectors;
