//! From a mesh to an asset: the stages of the preprocess (section 3 of the paper).

mod build_error;
mod build_params;
pub mod capture;
mod captured;
pub mod dense_map;
pub mod for_height;
mod gaps;
pub mod other_hull;
mod part_outlines;
pub mod parts;
pub mod pipeline;
pub mod progress;
pub mod recipe;
mod record;
pub mod seen;
pub mod simplify_contour;
pub mod simplify_map;
pub mod texture;

pub use progress::PrepWarning;
