//! Reading a capture: which file has its cameras, and where each mask is.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use silmap_geometry::trace::trace_contours;

use crate::camera_files::{self, CameraFile};
use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::{CaptureError, CaptureFault};
use crate::mask_file;
use crate::mask_image::{MaskFault, MaskImage};
use crate::undistort::without_lens;
use crate::view::{CameraFormat, Capture, CaptureView, CaptureWarning};

/// Extensions of masks that are found by convention.
const MASK_EXTENSIONS: [&str; 2] = ["png", "webp"];

/// Reads a capture: a camera file, or a folder that holds one; and the masks.
///
/// # Errors
/// One sentence that names the file and the first view at fault.
pub fn read(path: &Path) -> Result<Capture, CaptureError> {
    let CameraFile {
        format,
        path: file,
        folder,
        declared,
    } = camera_files::read(path)?;
    with_masks(declared, (format, &file, &folder)).map_err(|fault| CaptureError {
        path: file,
        fault: Box::new(fault),
    })
}

fn with_masks(
    declared: Declared,
    (format, file, folder): (CameraFormat, &Path, &Path),
) -> Result<Capture, CaptureFault> {
    let found: Vec<Result<Option<MaskImage>, CaptureFault>> = (declared.views.par_iter())
        .map(|view| find_mask(view, folder))
        .collect();
    let listed = declared.views.len();
    let (mut views, mut warnings) = (Vec::new(), declared.warnings);
    let listed = listed + warnings.len();
    for (view, mask) in declared.views.into_iter().zip(found) {
        let Some(MaskImage { mask, notes }) = mask? else {
            warnings.push(CaptureWarning::NoMask { view: view.name });
            continue;
        };
        warnings.extend(notes.into_iter().map(|note| CaptureWarning::Mask {
            view: view.name.clone(),
            note,
        }));
        let photo = match view.photo.as_deref().map(|path| usable(path, &view)) {
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
            outline: trace_contours(&mask),
            mask,
            photo,
            lens: None,
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

/// Why a photograph cannot be used, by its header.
fn usable(path: &Path, view: &DeclaredView) -> Result<(), String> {
    let shown = path.display();
    let Some((width, height)) = mask_file::size_of(path) else {
        return Err(format!("{shown} is not there, or no picture"));
    };
    let (wanted_width, wanted_height) = (view.camera.width, view.camera.height);
    if (width, height) == (wanted_width, wanted_height) {
        return Ok(());
    }
    Err(format!(
        "{shown} has {width} × {height} pixels, not {wanted_width} × {wanted_height}"
    ))
}

pub(crate) fn find_mask(
    view: &DeclaredView,
    folder: &Path,
) -> Result<Option<MaskImage>, CaptureFault> {
    let size = (view.camera.width, view.camera.height);
    let fault = |mask: &Path| {
        let (view, mask) = (view.name.clone(), mask.to_owned());
        move |fault: MaskFault| CaptureFault::Mask {
            view,
            mask,
            fault: Box::new(fault),
        }
    };
    match &view.mask {
        MaskPlace::None => return Ok(None),
        MaskPlace::Named(path) => {
            return mask_file::read(path, size).map(Some).map_err(fault(path));
        }
        MaskPlace::ByConvention | MaskPlace::OneOf(_) => {}
    }
    let beside = match (&view.mask, view.photo.as_deref()) {
        (MaskPlace::OneOf(places), _) => places.clone(),
        (_, Some(photo)) => conventional(photo, folder),
        (_, None) => Vec::new(),
    };
    let named = MASK_EXTENSIONS.map(|e| folder.join("masks").join(format!("{}.{e}", view.name)));
    if let Some(path) = beside.into_iter().chain(named).find(|p| p.is_file()) {
        return mask_file::read(&path, size).map(Some).map_err(fault(&path));
    }
    match view.photo.as_deref().filter(|photo| photo.is_file()) {
        Some(photo) => {
            let mask = mask_file::read_alpha(photo, size).map_err(fault(photo))?;
            let notes = Vec::new();
            Ok(mask.map(|mask| MaskImage { mask, notes }))
        }
        None => Ok(None),
    }
}

/// Columns and rows of a photograph, or of the mask that is found by convention.
pub(crate) fn size_by_pictures(photo: &Path, folder: &Path) -> Option<(u32, u32)> {
    let mut places = std::iter::once(photo.to_owned()).chain(conventional(photo, folder));
    places.find_map(|path| mask_file::size_of(&path))
}

/// `masks/NAME.png` and `masks/NAME.jpg.png`, in the capture's folder and beside the photograph's.
fn conventional(photo: &Path, folder: &Path) -> Vec<PathBuf> {
    let mut places = vec![folder.join("masks")];
    if let Some(around) = photo.parent().and_then(Path::parent) {
        places.push(around.join("masks"));
    }
    let names = [photo.file_stem(), photo.file_name()];
    let mut paths = Vec::new();
    for place in &places {
        for name in names.into_iter().flatten() {
            for extension in MASK_EXTENSIONS {
                let mut file = name.to_owned();
                file.push(".");
                file.push(extension);
                paths.push(place.join(file));
            }
        }
    }
    paths
}
