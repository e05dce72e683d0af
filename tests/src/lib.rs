//! What the test suites share.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

pub mod dense_maps;
pub mod device;
pub mod instances;
pub mod outside;
pub mod pass;
pub mod scene;
pub mod tolerance;
pub mod view_weights;

/// README, whose program is compiled as it stands there.
#[doc = include_str!("../../README.md")]
#[cfg(doctest)]
pub mod readme {}

/// READMEs of crates, with theirs.
#[doc = include_str!("../../crates/silmap-map/README.md")]
#[doc = include_str!("../../crates/silmap-runtime/README.md")]
#[cfg(doctest)]
pub mod readmes_of_crates {}
