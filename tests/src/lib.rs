//! What the test suites share.

pub mod device;
pub mod scene;
pub mod tolerance;
