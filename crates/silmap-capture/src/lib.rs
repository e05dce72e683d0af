//! Calibrated cameras and masks of a real object in, a carved closed mesh out.
//!
#![doc = include_str!("../README.md")]
//!
//! # Conventions
//!
//! Inside, image coordinates are pixels from the image's top-left *corner*, x right, y down; a camera has axes right, down and forward in
//! object space. What each file has instead:
//!
//! | file | pose | camera's axes | first pixel's centre | intrinsics | source | test |
//! |---|---|---|---|---|---|---|
//! | `cameras.json` | world to camera: `P` = s·K·\[R t\], s > 0; or `K`, `R`, `t` | x right, y down, z forward | `pixel_centre`, 0.5 where it is missing; the image is shifted by ½ − `pixel_centre` | in `P` or `K`: unequal focal lengths, principal point, skew | Hartley, Zisserman, Multiple View Geometry, 2nd ed., eq. 6.11; the layout is this project's | `matrices_are_read_as_written` |
//! | `transforms.json` | camera to world: `transform_matrix`, 4×4 or 3×4 | x right, y **up**, z **backward** (OpenGL, Blender) | 0.5: `cx`, `cy` count from the corner | `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h` for the file or a frame; `camera_angle_x` where `fl_x` is missing | nerfstudio, docs, "Data conventions"; instant-ngp, docs, `nerf_dataset_tips` | `poses_of_nerf_are_read_as_written`, `both_files_of_one_capture_agree` |
//! | `*_par.txt` | world to camera: `name`, K, R, t | x right, y down, z forward | 0.0 | in K | Seitz et al., CVPR 2006, and the sets' `README.txt` | `lines_of_middlebury_are_read_as_written` |
//!
//! Masks: white, or opaque, is the object. Outside of an image is unknown, and not background.

mod bounds;
mod cameras_json;
mod carve;
mod declared;
mod error;
mod field;
mod folder;
mod json;
mod mask_file;
pub mod mask_image;
mod middlebury;
mod octree;
mod paint;
mod pieces;
mod pinhole;
mod residual;
mod seen;
mod signed_distance;
mod surface;
#[cfg(test)]
mod tests;
mod transforms_json;
mod view;
mod visual_hull;

pub use carve::{CARVE, CarveError, CarveParams, Carved, SURFACE, VOTES, carve};
pub use error::{CaptureError, CaptureFault};
pub use folder::{is_capture, read};
pub use paint::{PAINT, Painted, paint};
pub use pinhole::{Matrix34, Pinhole, PinholeFault};
pub use residual::{Residual, disagreeing, median, residuals, silhouette};
pub use seen::{SeenOutline, seen_outlines};
pub use view::{CameraFormat, Capture, CaptureView, CaptureWarning};
pub use visual_hull::visual_hull_silhouette;
