//! Image files.

use std::io::Cursor;

use anyhow::Context;
use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, ImageFormat, Luma, RgbaImage};
use silmap_geometry::{ColourImage, Mask};

use crate::names::PictureKind;

/// Of 100; lines stay clean.
const JPEG_QUALITY: u8 = 92;

/// A picture as the bytes of a PNG file.
///
/// # Errors
/// When the picture's bytes do not fit its size.
pub(crate) fn encode_png(picture: &ColourImage) -> anyhow::Result<Vec<u8>> {
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.rgba.clone())
        .context("the picture has too few pixels for its size")?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .context("the picture cannot be encoded")?;
    Ok(bytes.into_inner())
}

/// A picture as the bytes of a file of this format. JPEG has no transparency: what is see-through there is as dark as its own
/// colour says.
///
/// # Errors
/// When the picture's bytes do not fit its size, or it is too large for the format.
pub(crate) fn encode_picture(picture: &ColourImage, kind: PictureKind) -> anyhow::Result<Vec<u8>> {
    let format = match kind {
        PictureKind::Png => return encode_png(picture),
        PictureKind::Jpeg => ImageFormat::Jpeg,
        PictureKind::Webp => ImageFormat::WebP,
    };
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.rgba.clone())
        .context("the picture has too few pixels for its size")?;
    let mut bytes = Cursor::new(Vec::new());
    let encoded = if kind == PictureKind::Jpeg {
        let opaque = image::DynamicImage::ImageRgba8(image).into_rgb8();
        opaque.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))
    } else {
        image.write_to(&mut bytes, format)
    };
    encoded.context("the picture cannot be encoded")?;
    Ok(bytes.into_inner())
}

/// A mask as the bytes of a PNG file, white inside.
///
/// # Errors
/// When the encoder fails.
pub(crate) fn encode_mask_png(mask: &Mask) -> anyhow::Result<Vec<u8>> {
    let image = GrayImage::from_fn(mask.width(), mask.height(), |x, y| {
        Luma([if mask.get(x.into(), y.into()) { 255 } else { 0 }])
    });
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .context("the mask cannot be encoded")?;
    Ok(bytes.into_inner())
}

/// Pixels of white between pictures that are put together.
const GAP_PX: u32 = 8;

/// Pictures of one height side by side, in one.
pub(crate) fn beside(pictures: &[&ColourImage]) -> ColourImage {
    let height = pictures.iter().map(|p| p.height).max().unwrap_or(0);
    let width = total_with_gaps(pictures.iter().map(|p| p.width));
    let mut sheet = white(width, height);
    let mut x = 0;
    for picture in pictures {
        paste(&mut sheet, picture, (x, 0));
        x += picture.width + GAP_PX;
    }
    sheet
}

/// Pictures of one width one below the other, in one.
pub(crate) fn stacked(pictures: &[ColourImage]) -> ColourImage {
    let width = pictures.iter().map(|p| p.width).max().unwrap_or(0);
    let height = total_with_gaps(pictures.iter().map(|p| p.height));
    let mut sheet = white(width, height);
    let mut y = 0;
    for picture in pictures {
        paste(&mut sheet, picture, (0, y));
        y += picture.height + GAP_PX;
    }
    sheet
}

fn total_with_gaps(sides: impl ExactSizeIterator<Item = u32>) -> u32 {
    let gaps = (sides.len() as u32).saturating_sub(1);
    sides.sum::<u32>() + gaps * GAP_PX
}

fn white(width: u32, height: u32) -> ColourImage {
    ColourImage {
        width,
        height,
        rgba: vec![255; width as usize * height as usize * 4],
    }
}

fn paste(sheet: &mut ColourImage, picture: &ColourImage, (x, y): (u32, u32)) {
    let row_bytes = picture.width as usize * 4;
    for (j, row) in picture.rgba.chunks_exact(row_bytes).enumerate() {
        let start = ((y as usize + j) * sheet.width as usize + x as usize) * 4;
        sheet.rgba[start..start + row_bytes].copy_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(width: u32, height: u32, value: u8) -> ColourImage {
        ColourImage {
            width,
            height,
            rgba: vec![value; (width * height * 4) as usize],
        }
    }

    #[test]
    fn pictures_are_put_together_with_a_gap() {
        let (dark, light) = (plain(3, 2, 10), plain(5, 2, 200));
        let row = beside(&[&dark, &light]);
        assert_eq!((row.width, row.height), (3 + GAP_PX + 5, 2));
        let red =
            |image: &ColourImage, x: u32, y: u32| image.rgba[((y * image.width + x) * 4) as usize];
        assert_eq!(
            [red(&row, 2, 1), red(&row, 3, 1), red(&row, 3 + GAP_PX, 1)],
            [10, 255, 200]
        );
        let both = stacked(&[row.clone(), row]);
        assert_eq!(both.height, 4 + GAP_PX);
        assert_eq!([red(&both, 0, 2), red(&both, 0, 2 + GAP_PX)], [255, 10]);
    }

    #[test]
    fn a_png_comes_back_as_it_was() {
        let mut picture = plain(4, 3, 77);
        picture.rgba[0] = 1;
        let bytes = encode_png(&picture).unwrap();
        assert_eq!(
            image::load_from_memory(&bytes)
                .unwrap()
                .to_rgba8()
                .into_raw(),
            picture.rgba
        );
        assert!(
            encode_png(&ColourImage {
                width: 9,
                ..picture
            })
            .is_err()
        );
    }
}
