//! Reading a capture: which file has its cameras, and where each mask is.

use std::fs;
use std::path::Path;

use rayon::prelude::*;

use crate::camera_files::{self, CameraFile};
use crate::declared::Declared;
use crate::error::{CaptureError, CaptureFault};
use crate::find_mask::find_mask;
use crate::mask_file::{self, CameraMask, MaskOptions};
use crate::undistort::without_lens;
use crate::view::{CameraFormat, Capture, CaptureView, CaptureWarning};

/// Reads a capture: a camera file, or a folder that holds one; and the masks.
///
/// # Errors
/// One sentence that names the file and the first view at fault.
pub fn read(path: &Path) -> Result<Capture, CaptureError> {
    read_with(path, &MaskOptions::default())
}

/// As [`read`], with masks as the options say.
///
/// # Errors
/// As [`read`].
pub fn read_with(path: &Path, masks: &MaskOptions) -> Result<Capture, CaptureError> {
    let CameraFile {
        format,
        path: file,
        folder,
        declared,
    } = camera_files::read(path)?;
    with_masks(declared, (format, &file, &folder), masks).map_err(|fault| CaptureError {
        path: file,
        fault: Box::new(fault),
    })
}

fn with_masks(
    declared: Declared,
    (format, file, folder): (CameraFormat, &Path, &Path),
    options: &MaskOptions,
) -> Result<Capture, CaptureFault> {
    let found: Vec<Result<Option<CameraMask>, CaptureFault>> = (declared.views.par_iter())
        .map(|view| find_mask(view, folder, options))
        .collect();
    let listed = declared.views.len();
    let (mut views, mut warnings) = (Vec::new(), declared.warnings);
    let is_unused = |w: &&CaptureWarning| matches!(w, CaptureWarning::Unused { .. });
    let listed = listed + warnings.iter().filter(is_unused).count();
    for (view, mask) in declared.views.into_iter().zip(found) {
        let Some(CameraMask {
            mask,
            outline,
            notes,
        }) = mask?
        else {
            warnings.push(CaptureWarning::NoMask { view: view.name });
            continue;
        };
        warnings.extend(notes.into_iter().map(|note| CaptureWarning::Mask {
            view: view.name.clone(),
            note,
        }));
        let photo = match (view.photo.as_deref())
            .map(|path| mask_file::fits(path, (view.camera.width, view.camera.height)))
        {
            Some(Err(reason)) => {
                let view = view.name.clone();
                warnings.push(CaptureWarning::Photo { view, reason });
                None
            }
            Some(Ok(())) => view.photo.clone(),
            None => None,
        };
        let as_taken = CaptureView {
            name: view.name,
            camera: view.camera,
            outline,
            mask,
            photo,
            lens: None,
            taken: None,
            known: None,
        };
        views.push(without_lens(as_taken, &view.distortion)?);
    }
    // The last thing to be said: what is wrong with a view comes before.
    if !declared.is_metric {
        return Err(CaptureFault::Projective);
    }
    if views.len() < 2 {
        return Err(CaptureFault::TooFewMasks {
            count: views.len(),
            views: listed,
        });
    }
    let of_folder = || {
        let whole = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        let name = whole.file_name().map(|n| n.to_string_lossy().into_owned());
        name.unwrap_or_else(|| "capture".to_owned())
    };
    Ok(Capture {
        name: declared.name.unwrap_or_else(of_folder),
        path: file.to_owned(),
        format,
        pixel_centre: declared.pixel_centre,
        object_bounds: declared.object_bounds,
        views,
        listed,
        warnings,
    })
}
