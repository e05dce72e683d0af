//! Sweeping horizontal lines down silhouettes that were cut into y-monotone chains.

pub(crate) mod coverage;
pub(crate) mod crossing;
pub(crate) mod cursor;
mod hairs;
pub(crate) mod intersection;
pub(crate) mod interval;
pub(crate) mod loop_builder;
pub(crate) mod monotone_chain;
pub(crate) mod sleeve;
pub(crate) mod union;
