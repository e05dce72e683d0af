//! What the test suites share.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

pub mod dense_maps;
pub mod device;
pub mod outside;
pub mod scene;
pub mod tolerance;
