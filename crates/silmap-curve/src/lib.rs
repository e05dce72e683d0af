//! Outlines as curves in space, and what makes them quick to use: eyes nearby share one ([`cells`]), it is thinned out ([`thin`]), sorted
//! for shaders ([`bands`], [`curve`]), and kept in blocks of a memory of a fixed size ([`block_cache`]).
//!
//! No device, thread or file is used, so that a renderer of any kind can have its outlines from here: `silmap-runtime`, and three.js by
//! `silmap-outlines`.

pub mod bands;
pub mod block_cache;
mod blocks;
pub mod cells;
pub mod curve;
pub mod of_cell;
pub mod thin;
pub mod winding_triangles;
