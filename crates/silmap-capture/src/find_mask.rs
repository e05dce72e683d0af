//! Where the mask of a view is: where its file says, beside the photograph, in the photograph's alpha channel, or by a rule in the
//! photograph itself.

use std::path::{Path, PathBuf};

use crate::declared::{DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::mask_file::{self, CameraMask, MaskOptions};
use crate::mask_image::MaskFault;

/// Extensions of masks that are found by convention.
const MASK_EXTENSIONS: [&str; 2] = ["png", "webp"];

/// The mask of a view; `None` where there is none.
///
/// # Errors
/// When a mask that is there cannot be used: with the view and the file.
pub(crate) fn find_mask(
    view: &DeclaredView,
    folder: &Path,
    options: &MaskOptions,
) -> Result<Option<CameraMask>, CaptureFault> {
    let size = (view.camera.width, view.camera.height);
    let photo = view.photo.as_deref().filter(|photo| photo.is_file());
    let fault = |mask: &Path| {
        let (view, mask) = (view.name.clone(), mask.to_owned());
        move |fault: MaskFault| CaptureFault::Mask {
            view,
            mask,
            fault: Box::new(fault),
        }
    };
    let read = |path: &Path| mask_file::read(path, (photo, size), options).map_err(fault(path));
    match &view.mask {
        MaskPlace::Named(path) => return read(path).map(Some),
        MaskPlace::ByConvention | MaskPlace::OneOf(_) => {
            let beside = match (&view.mask, view.photo.as_deref()) {
                (MaskPlace::OneOf(places), _) => places.clone(),
                (_, Some(photo)) => conventional(photo, folder),
                (_, None) => Vec::new(),
            };
            let named =
                MASK_EXTENSIONS.map(|e| folder.join("masks").join(format!("{}.{e}", view.name)));
            if let Some(path) = beside.into_iter().chain(named).find(|p| p.is_file()) {
                return read(&path).map(Some);
            }
            if let Some(photo) = photo {
                let found = mask_file::read_alpha(photo, size).map_err(fault(photo))?;
                if found.is_some() {
                    return Ok(found);
                }
            }
        }
        MaskPlace::None => {}
    }
    match (photo, options.rule) {
        (Some(photo), Some(rule)) => {
            let made = mask_file::by_rule(photo, size, rule);
            made.map(Some).map_err(fault(photo))
        }
        _ => Ok(None),
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
