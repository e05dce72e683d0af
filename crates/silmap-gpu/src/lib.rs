//! The graphics device: adapter and capability tier, read-back, timing, mesh chunks and the shader table.
//!
//! Nothing here knows what a silhouette is. Everything works within WebGL2's limits (no compute, no storage buffers);
//! what needs more asks for [`Tier::Full`]. On the web a program chooses by wgpu's features `webgpu` and `webgl` what is drawn by.

mod chunks;
mod device;
mod platform;
mod readback;
pub mod shaders;
mod timing;

pub use chunks::{MeshChunk, split_faces};
pub use device::{Gpu, GpuError, Tier};
pub use platform::wait_for;
pub use readback::{PendingRead, Readback, RowLayout};
pub use timing::FrameTimer;
pub use wgpu;
