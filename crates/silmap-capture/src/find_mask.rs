//! Where the mask of a view is: where its file says, beside the photograph, in the photograph's alpha channel, or by a rule in the
//! photograph itself.

use std::path::{Path, PathBuf};

use crate::declared::MaskPlace;
use crate::error::CaptureFault;
use crate::mask_file::{self, CameraMask, MaskOptions};
use crate::mask_image::MaskFault;

/// Extensions of masks that are found by convention.
const MASK_EXTENSIONS: [&str; 2] = ["png", "webp"];

/// The mask of a view, of its place, name, photograph and size; `None` where there is none.
///
/// # Errors
/// When a mask that is there cannot be used: with the view and the file.
pub(crate) fn find_mask(
    place: &MaskPlace,
    (name, photo, size): (&str, Option<&Path>, (u32, u32)),
    folder: &Path,
    options: &MaskOptions,
) -> Result<Option<CameraMask>, CaptureFault> {
    let is_there = photo.filter(|photo| photo.is_file());
    let fault = |mask: &Path| {
        let (view, mask) = (name.to_owned(), mask.to_owned());
        move |fault: MaskFault| CaptureFault::Mask {
            view,
            mask,
            fault: Box::new(fault),
        }
    };
    let read = |path: &Path| mask_file::read(path, (is_there, size), options).map_err(fault(path));
    match place {
        MaskPlace::Named(path) => return read(path).map(Some),
        MaskPlace::ByConvention | MaskPlace::OneOf(_) => {
            let beside = match (place, photo) {
                (MaskPlace::OneOf(places), _) => places.clone(),
                (_, Some(photo)) => conventional(photo, folder),
                (_, None) => Vec::new(),
            };
            let named = MASK_EXTENSIONS.map(|e| folder.join("masks").join(format!("{name}.{e}")));
            if let Some(path) = beside.into_iter().chain(named).find(|p| p.is_file()) {
                return read(&path).map(Some);
            }
            if let Some(photo) = is_there {
                let found = mask_file::read_alpha(photo, size).map_err(fault(photo))?;
                if found.is_some() {
                    return Ok(found);
                }
            }
        }
        MaskPlace::None => {}
    }
    match (is_there, options.rule) {
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

/// In a folder of masks that of a photograph's name: `NAME.jpg.png`, which may mean no other photograph, and `NAME.png`.
pub(crate) fn named(masks: &Path, photo: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let whole = masks.join(photo);
    let short = whole.with_extension("");
    [whole, short].into_iter().flat_map(|name| {
        MASK_EXTENSIONS.map(|extension| {
            let mut file = name.clone().into_os_string();
            file.push(".");
            file.push(extension);
            PathBuf::from(file)
        })
    })
}

/// Those in the capture's folder of masks and in the one beside the photograph's folder.
fn conventional(photo: &Path, folder: &Path) -> Vec<PathBuf> {
    let Some(file) = photo.file_name().map(Path::new) else {
        return Vec::new();
    };
    let around = photo.parent().and_then(Path::parent);
    let places = [Some(folder), around].into_iter().flatten();
    let masks = places.flat_map(|place| named(&place.join("masks"), file));
    masks.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A photograph called `a.v2` has not the mask of one called `a`.
    #[test]
    fn a_mask_of_the_whole_name_is_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let masks = folder.path().join("masks");
        std::fs::create_dir(&masks).unwrap();
        let sizes = [("a.png", 4), ("a.v2.png", 5), ("b.jpg.webp", 6)];
        for (name, side) in sizes {
            let picture = image::GrayImage::new(side, 2);
            picture.save(masks.join(name)).unwrap();
        }
        for (photo, side) in [("a.jpg", 4), ("a.v2", 5), ("a.v3", 4), ("b.jpg", 6)] {
            let photo = folder.path().join("photos").join(photo);
            let found = size_by_pictures(&photo, folder.path());
            assert_eq!(found, Some((side, 2)), "{photo:?}");
        }
        assert_eq!(size_by_pictures(&masks.join("c.jpg"), folder.path()), None);
    }
}
