//! The mask of a camera: out of a picture file, or out of the alpha channel of a photograph.

use std::path::Path;

use image::DynamicImage;
use silmap_geometry::Mask;
use silmap_mesh_io::input;

use crate::mask_image::{MaskFault, MaskImage, checked, of_alpha, of_picture, picture};

/// Reads a mask that must have this size.
///
/// # Errors
/// When the file cannot be read or understood, has another size, or shows no outline.
pub(crate) fn read(path: &Path, size: (u32, u32)) -> Result<MaskImage, MaskFault> {
    let picture = read_picture(path)?;
    check_size(&picture, size)?;
    of_picture(&picture)
}

/// Reads the alpha channel of a photograph as a mask; `None` where it has none, or says nothing.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_alpha(path: &Path, size: (u32, u32)) -> Result<Option<Mask>, MaskFault> {
    let picture = read_picture(path)?;
    let Some(mask) = of_alpha(&picture) else {
        return Ok(None);
    };
    check_size(&picture, size)?;
    checked(mask).map(Some)
}

/// Columns and rows of a picture, by its header; `None` where it cannot be read.
pub(crate) fn size_of(path: &Path) -> Option<(u32, u32)> {
    image::image_dimensions(path).ok()
}

/// Decodes a picture, known by its content.
///
/// # Errors
/// When it cannot be read, is no picture, or is too large.
pub(crate) fn read_picture(path: &Path) -> Result<DynamicImage, MaskFault> {
    picture(&input::read(path).map_err(MaskFault::Unreadable)?)
}

fn check_size(picture: &DynamicImage, wanted: (u32, u32)) -> Result<(), MaskFault> {
    let (width, height) = (picture.width(), picture.height());
    if (width, height) == wanted {
        return Ok(());
    }
    Err(MaskFault::OtherSize {
        width,
        height,
        wanted_width: wanted.0,
        wanted_height: wanted.1,
    })
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma, LumaA, RgbImage};

    use super::*;

    const SIZE: (u32, u32) = (24, 20);

    fn is_disc(x: u32, y: u32) -> bool {
        (f64::from(x) - 10.0).hypot(f64::from(y) - 12.0) < 7.0
    }

    #[test]
    fn soft_hard_and_tiny_values_are_cut_alike() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let mut disc = Mask::new(SIZE.0, SIZE.1);
        for (x, y) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
            disc.set(x, y, is_disc(x, y));
        }
        for (inside, outside) in [(255_u8, 0_u8), (1, 0), (200, 100), (130, 120)] {
            let value = |x, y| Luma([if is_disc(x, y) { inside } else { outside }]);
            GrayImage::from_fn(24, 20, value).save(&path).unwrap();
            assert_eq!(read(&path, SIZE).unwrap().mask, disc, "{inside} {outside}");
        }
        // Alpha decides, whatever the colours.
        image::ImageBuffer::from_fn(24, 20, |x, y| LumaA([9_u8, 255 * u8::from(is_disc(x, y))]))
            .save(&path)
            .unwrap();
        assert_eq!(read(&path, SIZE).unwrap().mask, disc);
        assert_eq!(read_alpha(&path, SIZE).unwrap(), Some(disc));
        RgbImage::new(24, 20).save(&path).unwrap();
        assert_eq!(read_alpha(&path, SIZE).unwrap(), None);
    }

    /// An object that fills all corners of an image is no background.
    #[test]
    fn masks_of_a_capture_are_never_turned() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let value = |x, y| Luma([if is_disc(x, y) { 0_u8 } else { 255 }]);
        GrayImage::from_fn(24, 20, value).save(&path).unwrap();
        let MaskImage { mask, notes } = read(&path, SIZE).unwrap();
        assert!(mask.get(0, 0) && !mask.get(10, 12) && notes.is_empty());
        assert!(!crate::mask_image::read(&path).unwrap().mask.get(0, 0));
    }

    #[test]
    fn what_shows_no_outline_or_has_another_size_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let message = || read(&path, (4, 4)).unwrap_err().to_string();
        assert!(message().starts_with("cannot be read"));
        for (value, word) in [(0, "(black)"), (255, "(white)")] {
            GrayImage::from_pixel(4, 4, Luma([value]))
                .save(&path)
                .unwrap();
            assert!(message().contains(word), "{}", message());
        }
        GrayImage::new(2, 4).save(&path).unwrap();
        assert_eq!(message(), "it has 2 × 4 pixels, not 4 × 4");
        std::fs::write(&path, "what is this?").unwrap();
        assert!(message().contains("a mask is a picture"));
    }
}
