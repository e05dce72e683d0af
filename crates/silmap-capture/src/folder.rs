//! Reading a capture: which file has its cameras, and where each mask is.

use std::fs;
use std::path::Path;

use rayon::prelude::*;

use crate::camera_files::{self, CameraFile};
use crate::declared::{Declared, DeclaredView};
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
    with_masks(declared, (format, &file, &folder), masks).map_err(|fault| fault.at(&file))
}

fn with_masks(
    declared: Declared,
    (format, file, folder): (CameraFormat, &Path, &Path),
    options: &MaskOptions,
) -> Result<Capture, CaptureFault> {
    let found: Vec<Result<_, CaptureFault>> = (declared.views.par_iter())
        .map(|view| with_mask(view, folder, options))
        .collect();
    let (mut views, mut warnings) = (Vec::new(), declared.warnings);
    let is_unused = |w: &&CaptureWarning| matches!(w, CaptureWarning::Unused { .. });
    let listed = found.len() + warnings.iter().filter(is_unused).count();
    for result in found {
        let (view, of_view) = result?;
        views.extend(view);
        warnings.extend(of_view);
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

/// A view with its mask, and without its lens; `None` where there is no mask. And what was odd.
fn with_mask(
    view: &DeclaredView,
    folder: &Path,
    options: &MaskOptions,
) -> Result<(Option<CaptureView>, Vec<CaptureWarning>), CaptureFault> {
    let (name, size) = (view.name.clone(), (view.camera.width, view.camera.height));
    let of_view = (name.as_str(), view.photo.as_deref(), size);
    let Some(CameraMask {
        mask,
        outline,
        notes,
    }) = find_mask(&view.mask, of_view, folder, options)?
    else {
        return Ok((None, vec![CaptureWarning::NoMask { view: name }]));
    };
    let note = |note| CaptureWarning::Mask {
        view: name.clone(),
        note,
    };
    let mut warnings: Vec<CaptureWarning> = notes.into_iter().map(note).collect();
    let mut photo = view.photo.clone();
    if let Some(Err(reason)) = view
        .photo
        .as_deref()
        .map(|path| mask_file::fits(path, size))
    {
        photo = None;
        warnings.push(CaptureWarning::Photo {
            view: name.clone(),
            reason,
        });
    }
    let as_taken = CaptureView {
        name,
        camera: view.camera,
        outline,
        mask,
        photo,
        lens: None,
        taken: None,
        known: None,
    };
    Ok((Some(without_lens(as_taken, view.distortion)?), warnings))
}
