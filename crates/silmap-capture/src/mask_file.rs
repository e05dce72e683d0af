//! A mask out of a picture file, or out of the alpha channel of a photograph.
//!
//! What is object, in this order: where the picture has an alpha channel that is not the same everywhere, what is more than half
//! opaque; in a picture of two brightnesses the brighter one, unless it is black (a mask of 0 and 1 is one); else what is at least half
//! as bright as white. A bright object may fill the image, so that nothing is ever taken the other way round.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageReader};
use silmap_geometry::Mask;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_mesh_io::input;

use crate::error::MaskFault;

/// Reads a mask that must have this size.
///
/// # Errors
/// When the file cannot be read or understood, has another size, or shows no outline.
pub(crate) fn read(path: &Path, (width, height): (u32, u32)) -> Result<Mask, MaskFault> {
    let picture = read_picture(path)?;
    check_size(&picture, (width, height))?;
    let mask = of_alpha(&picture).unwrap_or_else(|| of_brightness(&picture));
    checked(mask)
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

/// Decodes a picture, known by its content, after a look at the size that its header claims.
///
/// # Errors
/// When it cannot be read, is no picture, or is too large.
pub(crate) fn read_picture(path: &Path) -> Result<DynamicImage, MaskFault> {
    let bytes = input::read(path).map_err(MaskFault::Unreadable)?;
    let reader = || ImageReader::new(Cursor::new(&bytes[..])).with_guessed_format();
    let sized = reader().map_err(MaskFault::Unreadable)?;
    let (width, height) = sized.into_dimensions().map_err(MaskFault::Damaged)?;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(MaskFault::TooLarge { width, height });
    }
    let whole = reader().map_err(MaskFault::Unreadable)?;
    whole.decode().map_err(MaskFault::Damaged)
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

fn checked(mask: Mask) -> Result<Mask, MaskFault> {
    match mask.count() {
        0 => Err(MaskFault::Empty),
        all if all == u64::from(mask.width()) * u64::from(mask.height()) => Err(MaskFault::Full),
        _ => Ok(mask),
    }
}

fn mask_of(width: u32, height: u32, is_inside: impl Fn(u32, u32) -> bool) -> Mask {
    let mut mask = Mask::new(width, height);
    for y in 0..height {
        for x in 0..width {
            if is_inside(x, y) {
                mask.set(x, y, true);
            }
        }
    }
    mask
}

fn of_alpha(picture: &DynamicImage) -> Option<Mask> {
    if !picture.color().has_alpha() {
        return None;
    }
    let rgba = picture.to_rgba16();
    let first = rgba.pixels().next()?.0[3];
    if rgba.pixels().all(|p| p.0[3] == first) {
        return None;
    }
    let is_inside = |x, y| rgba.get_pixel(x, y).0[3] > u16::MAX / 2;
    Some(mask_of(rgba.width(), rgba.height(), is_inside))
}

fn of_brightness(picture: &DynamicImage) -> Mask {
    let luma = picture.to_luma16();
    let (mut low, mut high) = (u16::MAX, 0);
    for pixel in luma.pixels() {
        low = low.min(pixel.0[0]);
        high = high.max(pixel.0[0]);
    }
    let has_two = low == 0 && luma.pixels().all(|p| p.0[0] == low || p.0[0] == high);
    let threshold = if has_two { 0 } else { u16::MAX / 2 };
    let is_inside = |x, y| luma.get_pixel(x, y).0[0] > threshold;
    mask_of(luma.width(), luma.height(), is_inside)
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma, LumaA, RgbImage};

    use super::*;

    fn is_disc(x: u32, y: u32) -> bool {
        (f64::from(x) - 10.0).hypot(f64::from(y) - 12.0) < 7.0
    }

    #[test]
    fn soft_hard_and_tiny_values_are_cut_alike() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let disc = mask_of(24, 20, is_disc);
        for (inside, outside) in [(255_u8, 0_u8), (1, 0), (200, 100), (130, 120)] {
            let value = |x, y| Luma([if is_disc(x, y) { inside } else { outside }]);
            GrayImage::from_fn(24, 20, value).save(&path).unwrap();
            assert_eq!(read(&path, (24, 20)).unwrap(), disc, "{inside} {outside}");
        }
        // Alpha decides, whatever the colours.
        image::ImageBuffer::from_fn(24, 20, |x, y| LumaA([9_u8, 255 * u8::from(is_disc(x, y))]))
            .save(&path)
            .unwrap();
        assert_eq!(read(&path, (24, 20)).unwrap(), disc);
        assert_eq!(read_alpha(&path, (24, 20)).unwrap(), Some(disc));
        RgbImage::new(24, 20).save(&path).unwrap();
        assert_eq!(read_alpha(&path, (24, 20)).unwrap(), None);
    }

    #[test]
    fn what_shows_no_outline_or_has_another_size_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let message = || read(&path, (4, 4)).unwrap_err().to_string();
        assert!(message().starts_with("cannot be read"));
        for (value, word) in [(0, "empty"), (255, "full")] {
            GrayImage::from_pixel(4, 4, Luma([value]))
                .save(&path)
                .unwrap();
            assert!(message().contains(word), "{}", message());
        }
        GrayImage::new(2, 4).save(&path).unwrap();
        assert_eq!(message(), "has 2 × 4 pixels, not 4 × 4");
        std::fs::write(&path, "no picture").unwrap();
        assert!(message().contains("no picture"));
    }
}
