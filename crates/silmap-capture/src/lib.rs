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
//! | `transforms.json` | camera to world: `transform_matrix`, 4×4 or 3×4; `applied_transform` and `applied_scale` are in it already and are not undone, so that results lie in this file's frame | x right, y **up**, z **backward** (OpenGL, Blender) | 0.5: `cx`, `cy` count from the corner | `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h` for the file or a frame; `camera_angle_x` where `fl_x` is missing; `k1` … `p2` of `OPENCV` or `OPENCV_FISHEYE`, `k4` the factor of r⁸ unless there are `k5`, `k6` | nerfstudio, docs, "Data conventions", and `cameras/camera_utils.py`; instant-ngp, docs, `nerf_dataset_tips` | `poses_of_nerf_are_read_as_written`, `both_files_of_one_capture_agree`, `the_transform_that_was_applied_is_not_applied_again`, `lenses_of_transforms_are_taken_out` |
//! | `*_par.txt` | world to camera: `name`, K, R, t | x right, y down, z forward | 0.0 | in K | Seitz et al., CVPR 2006, and the sets' `README.txt` | `lines_of_middlebury_are_read_as_written` |
//! | COLMAP: `cameras`, `images`, `rigs`, `frames`, `.bin` or `.txt` | world to camera: w, x, y, z, t of each image; where that is none, the frame's, then the sensor's in its rig | x right, y down, z forward | 0.5 | by model; every model but `RAD_TAN_THIN_PRISM_FISHEYE` and `EQUIRECTANGULAR` | COLMAP, docs, "Output Format", and `src/colmap/sensor/models.h` | `models_of_colmap_are_read_as_written`, `poses_are_taken_from_rigs_and_frames_where_images_have_none`, `lenses_map_directions_as_colmap_does` |
//! | `cameras.xml` of Metashape | camera to component or chunk: `transform`, 4×4; then the component's `transform` (scale, rotation, translation), or the chunk's where it has none | x right, y down, z forward | 0.5: `cx`, `cy` count from the image's **middle** | `f`, `cx`, `cy`, `b1` (columns' focal length − `f`), `b2` (skew), `k1` … `k4`, `p1`, `p2` (the other way round than OpenCV's) of frame and fisheye sensors | Agisoft, Metashape Professional User Manual, appendix "Camera models" | `cameras_of_metashape_are_read_as_written` |
//! | `txt/*.txt` of PMVS: `CONTOUR` and P | world to image, of either sign | x right, y down, z forward | 0.0 | in P | Furukawa, Ponce, IEEE PAMI 32(8), 2010; docs of PMVS-2 | `matrices_of_pmvs_are_read_as_written` |
//! | `*.P`, `*.txt`, `FileStorage` of OpenCV: P | world to image, of either sign | x right, y down, z forward | 0.0 | in P | Hartley, Zisserman, section 6.2; OpenCV, docs, "XML/YAML Persistence" | `plain_matrices_are_read_as_written` |
//!
//! Files of the last two kinds do not say where the first pixel's centre is; COLMAP writes matrices for PMVS with 0.5.
//!
//! Lens distortion is taken out: outlines point by point, masks from them, photographs by sampling, see [`Lens`]. What the photograph
//! does not show is unknown.
//!
//! Masks: white, or opaque, is the object; [`MaskOptions`] has the other way round. Outside of an image is unknown, and not background.
//! Two values are inside and outside, whatever they are; of more the border is at one half of white, and the outline passes between pixels
//! where the mask does. nerfstudio keeps whatever is not zero, so that soft masks are larger there. A mask may have a whole multiple of the
//! image's columns and rows, or the same part of both.
//!
//! EXIF's orientation: cameras belong to pixels as they are stored, as COLMAP reads them. A photograph or mask is turned only where its size
//! fits the camera's image turned and not as stored; a mask of the photograph turned is turned back. Notes say so; what fits neither way is
//! refused. Half turns and mirrored pictures do not show in sizes: pixels are taken as stored then.
//!
//! # What is noticed of wrong cameras
//!
//! [`misread()`] carves coarse hulls by other readings of all cameras and names the one that makes the masks agree: mirrored pictures,
//! transposed rotations, poses of the other direction, axes of other signs. What the masks cannot tell is not said, and where two readings
//! are as good both are. [`image_shift()`] measures a step of all image coordinates by epipolar tangents, to a few hundredths of a pixel
//! where masks and cameras are exact. In real sets it adds to what the calibration is off by: x by −2.9 ± 0.1 px in `squirrel`, (0.1, 0.3) ±
//! 0.1 px in the hemisphere of Middlebury's dinosaur. A step of half a pixel changes that figure by 0.5 ± 0.02, but whether half a pixel of
//! it is a convention or the principal point nobody can tell by masks. One axis cannot be told where all cameras turn about one line.

mod border;
mod bounds;
mod camera_files;
mod camera_list;
mod cameras_json;
mod carve;
mod colmap;
mod declared;
mod drawing;
mod error;
mod field;
mod find_mask;
mod folder;
mod for_asset;
mod gains;
mod json;
mod lens;
mod levels;
mod looker;
mod mask_file;
pub mod mask_image;
mod mask_rule;
mod matrices;
mod metashape;
mod middlebury;
mod misread;
mod octree;
mod paint;
mod photographs;
mod pictures;
mod pieces;
mod pinhole;
mod reading;
mod resample;
mod residual;
mod seen;
mod shift;
mod signed_distance;
#[cfg(test)]
mod slips;
mod surface;
mod tangency;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_colmap;
#[cfg(test)]
mod tests_formats;
#[cfg(test)]
mod tests_lens;
#[cfg(test)]
mod tests_turntable;
mod transforms_json;
mod turntable;
mod undistort;
mod view;
mod view_names;
mod visual_hull;

pub use camera_files::is_capture;
pub use camera_list::{CameraList, CameraView, ViewMask, read_cameras};
pub use carve::{CARVE, CarveError, CarveParams, Carved, SURFACE, VOTES, carve_wider};
pub use drawing::{Drawing, DrawingFault};
pub use error::{CaptureError, CaptureFault};
pub use folder::{read, read_with};
pub use for_asset::{Coloured, coloured, fitting_resolution_px, silhouettes_with_room};
pub use gains::{GAINS, GainRange, even_out};
pub use lens::{Distortion, Lens, Projection};
pub use mask_file::MaskOptions;
pub use mask_rule::{MaskRule, UnknownRule};
pub use misread::{READINGS, carve, misread};
pub use paint::{PAINT, Painted, paint};
pub use photographs::{PHOTOGRAPHS, ViewPhotograph, photographs};
pub use pinhole::{Matrix34, Pinhole, PinholeFault};
pub use reading::{Misread, Reading};
pub use residual::{Residual, disagreeing, median, quantile, residuals, silhouette};
pub use seen::{SeenOutline, seen_outlines};
pub use shift::{ImageShift, ShiftKind};
pub use tangency::image_shift;
pub use view::{CameraFormat, Capture, CaptureView, CaptureWarning};
pub use visual_hull::visual_hull_silhouette;
