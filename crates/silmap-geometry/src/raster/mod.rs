//! Triangles as pixels, on the processor.
//!
//! There is one way over a triangle, row by row through the pixel centres that may lie in it, and two rules that say which do:
//!
//! - [`ImageTriangle`] tests centres in `f64` and returns depth and weights of corners: for pictures, in which the nearest face wins.
//! - [`cover`] rounds corners to a lattice and tests in integers, so that faces which share corners leave no cracks and a mask is the
//!   same on every machine; it also has the rule by which every pixel that is touched is covered.
//!
//! What a triangle costs grows with its rows and the pixels in it, not with the box around it.

mod coverage;
mod image_triangle;
mod rows;

pub use coverage::{RasterError, cover};
pub use image_triangle::{ImageTriangle, ImageVertex, Sample};
