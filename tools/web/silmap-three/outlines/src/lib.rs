//! Outlines of assets for renderers in JavaScript: `silmap-three` draws with them.
//!
//! [`OutlineMaker`] has a silhouette map and makes outlines, in a worker where there is one. [`OutlineCells`] is with the renderer: it
//! knows which outlines there are, where in a texture they lie, and which are wanted. Both are of one module, so that eyes are divided
//! into cells the same way on both sides.
//!
//! No struct's methods panic on what JavaScript can pass; sizes of arrays that differ count as the shorter one.

mod cells;
mod maker;

pub use cells::OutlineCells;
pub use maker::OutlineMaker;
