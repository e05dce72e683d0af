//! The viewer: a window, or a web page, in which an asset is turned, compared with its mesh, and looked into.
//!
//! [`App`] is the same program in both. It draws with `silmap-study`, as `silmap render` does, and many instances with `silmap-runtime`.

mod app;
mod bar;
mod blit;
#[cfg(not(target_arch = "wasm32"))]
mod captures;
mod choices;
mod crowd;
#[cfg(target_arch = "wasm32")]
mod download;
#[cfg(not(target_arch = "wasm32"))]
mod export;
#[cfg(target_arch = "wasm32")]
mod fetch;
#[cfg(not(target_arch = "wasm32"))]
mod files;
mod left;
#[cfg(not(target_arch = "wasm32"))]
mod live_error;
mod loader;
pub mod look;
mod making;
#[cfg(not(target_arch = "wasm32"))]
mod opening;
pub mod orbit;
mod overlays;
#[cfg(target_arch = "wasm32")]
pub mod page;
mod panel;
mod panes;
#[cfg(not(target_arch = "wasm32"))]
mod photographs;
mod scene;
mod seen;
#[cfg(not(target_arch = "wasm32"))]
pub mod serve;
#[cfg(not(target_arch = "wasm32"))]
mod shot;
mod stage;
mod start;
mod timing;
mod viewer;
mod viewport;
#[cfg(not(target_arch = "wasm32"))]
pub mod window;

pub use app::App;
pub use scene::Scene;
pub use start::{Opened, Start};
pub use viewer::{Message, Viewer};
