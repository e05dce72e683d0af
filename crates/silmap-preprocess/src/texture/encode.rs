//! Image encoding, and the choice of a quality within a byte budget.

use std::ops::RangeInclusive;
use std::sync::OnceLock;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use rayon::prelude::*;
use silmap_geometry::lighting::srgb_from_linear;
use silmap_map::EncodedImage;

use super::picture::Picture;
use super::{PictureFormat, TextureError};

/// A picture in bytes, three a pixel.
#[derive(Debug)]
pub(super) struct RawPicture {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
    /// The PNG file, once it has been requested.
    png: OnceLock<Vec<u8>>,
}

impl RawPicture {
    fn new(picture: &Picture, byte: impl Fn(f32) -> f32) -> Self {
        let pixels = (0..picture.pixels.len()).flat_map(|pixel| picture.colour(pixel));
        Self {
            width: picture.width as u32,
            height: picture.height as u32,
            rgb: pixels.map(|v| (byte(v) * 255.0).round() as u8).collect(),
            png: OnceLock::new(),
        }
    }

    /// Colours in linear light as sRGB.
    pub(super) fn of_colours(picture: &Picture) -> Self {
        Self::new(picture, srgb_from_linear)
    }

    /// Normals of any length as glTF has them: from −1…1 to 0…255.
    pub(super) fn of_normals(picture: &Picture) -> Self {
        let mut unit = picture.clone();
        for pixel in 0..unit.pixels.len() {
            let normal = glam::Vec3::from(picture.colour(pixel));
            let [x, y, z] = normal.try_normalize().unwrap_or(glam::Vec3::Z).to_array();
            unit.pixels[pixel] = [x, y, z, 1.0];
        }
        Self::new(&unit, |v| 0.5 * v + 0.5)
    }

    /// The picture as a file. The quality, 1 to 100, is that of formats that lose something; a JPEG gives way to a PNG that is no
    /// larger.
    pub(super) fn encode(
        &self,
        format: PictureFormat,
        quality: u8,
    ) -> Result<EncodedImage, TextureError> {
        let (mime_type, bytes) = match format {
            PictureFormat::Png => ("image/png", self.png()?.to_vec()),
            PictureFormat::Webp => ("image/webp", self.webp(quality)?),
            PictureFormat::Jpeg => {
                let jpeg = self.jpeg(quality)?;
                let png = self.png()?;
                match png.len() <= jpeg.len() {
                    true => ("image/png", png.to_vec()),
                    false => ("image/jpeg", jpeg),
                }
            }
        };
        Ok(EncodedImage {
            mime_type: mime_type.into(),
            bytes,
        })
    }

    fn png(&self) -> Result<&[u8], TextureError> {
        if self.png.get().is_none() {
            let mut bytes = Vec::new();
            let (compression, filter) = (CompressionType::Default, FilterType::Adaptive);
            PngEncoder::new_with_quality(&mut bytes, compression, filter).write_image(
                &self.rgb,
                self.width,
                self.height,
                ExtendedColorType::Rgb8,
            )?;
            // Another thread may have been first, with the same bytes.
            let _ = self.png.set(bytes);
        }
        Ok(self.png.get().map_or(&[], Vec::as_slice))
    }

    fn jpeg(&self, quality: u8) -> Result<Vec<u8>, TextureError> {
        let side = |px: u32| {
            u16::try_from(px).map_err(|_| TextureError::Parameter {
                what: "pixels a side of a JPEG",
                value: px,
                low: 1,
                high: u16::MAX.into(),
            })
        };
        let (width, height) = (side(self.width)?, side(self.height)?);
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, quality);
        // Colours as sharp as everything else; tables of codes made for the picture save 3 to 10 %, most at low quality.
        encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
        encoder.set_optimized_huffman_tables(true);
        encoder.encode(&self.rgb, width, height, ColorType::Rgb)?;
        Ok(bytes)
    }

    #[cfg(not(feature = "webp"))]
    fn webp(&self, _: u8) -> Result<Vec<u8>, TextureError> {
        Err(TextureError::NoWebp)
    }

    #[cfg(feature = "webp")]
    fn webp(&self, quality: u8) -> Result<Vec<u8>, TextureError> {
        webp::Encoder::from_rgb(&self.rgb, self.width, self.height)
            .encode_simple(false, quality.into())
            .map(|memory| memory.to_vec())
            .map_err(TextureError::Webp)
    }
}

/// All pictures of a hull before they are files.
#[derive(Debug)]
pub(super) struct RawSet {
    pub(super) views: Vec<RawPicture>,
    pub(super) atlas: RawPicture,
    pub(super) normals: Option<RawPicture>,
}

/// The same as files.
#[derive(Debug)]
pub(super) struct EncodedSet {
    pub(super) views: Vec<EncodedImage>,
    pub(super) atlas: EncodedImage,
    pub(super) normals: Option<EncodedImage>,
}

impl EncodedSet {
    fn bytes(&self) -> u64 {
        let all = self.views.iter().chain([&self.atlas]).chain(&self.normals);
        all.map(|image| image.bytes.len() as u64).sum()
    }
}

impl RawSet {
    /// The pictures as files. Those of the atlas are half as far from perfect: what a format loses there shows along the borders of
    /// tiles.
    pub(super) fn encode(
        &self,
        format: PictureFormat,
        quality: u8,
    ) -> Result<EncodedSet, TextureError> {
        // What plain glTF viewers show must be in a format that they know.
        let plain = match format {
            PictureFormat::Webp => PictureFormat::Jpeg,
            other => other,
        };
        let atlas_quality = u8::midpoint(quality, 100);
        let views = self.views.par_iter().map(|v| v.encode(format, quality));
        Ok(EncodedSet {
            views: views.collect::<Result<_, _>>()?,
            atlas: self.atlas.encode(plain, atlas_quality)?,
            normals: (self.normals.as_ref())
                .map(|n| n.encode(plain, atlas_quality))
                .transpose()?,
        })
    }

    /// The pictures at the highest of these qualities at which they have at most `budget` bytes, or at the lowest when they have more
    /// there too; and whether they keep to the budget.
    pub(super) fn encode_within(
        &self,
        format: PictureFormat,
        qualities: RangeInclusive<u8>,
        budget: u64,
    ) -> Result<(EncodedSet, bool), TextureError> {
        let (mut low, mut high) = qualities.into_inner();
        let mut found = self.encode(format, low)?;
        if found.bytes() > budget || format == PictureFormat::Png {
            let fits = found.bytes() <= budget;
            return Ok((found, fits));
        }
        while low < high {
            let middle = low + (high - low).div_ceil(2);
            let tried = self.encode(format, middle)?;
            if tried.bytes() <= budget {
                (low, found) = (middle, tried);
            } else {
                high = middle - 1;
            }
        }
        Ok((found, true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let mut picture = Picture::new(96, 64);
        for pixel in 0..96 * 64 {
            let grain = 0.05 * ((pixel * pixel) as f32 * 0.618).sin();
            let ramp = (pixel % 96) as f32 / 192.0;
            picture.add(pixel, [0.3 + grain, 0.2 + ramp + grain, 0.6 + grain]);
        }
        picture
    }

    #[test]
    fn files_hold_the_picture() {
        let raw = RawPicture::of_colours(&picture());
        for (format, mime_type, most) in [
            (PictureFormat::Png, "image/png", 0),
            (PictureFormat::Jpeg, "image/jpeg", 24),
            // Its colours are stored at half the size.
            (PictureFormat::Webp, "image/webp", 60),
        ] {
            let file = raw.encode(format, 95).unwrap();
            assert_eq!(file.mime_type, mime_type);
            let back = image::load_from_memory(&file.bytes).unwrap().to_rgb8();
            let off = back
                .as_raw()
                .iter()
                .zip(&raw.rgb)
                .map(|(a, b)| a.abs_diff(*b));
            assert!(off.max().unwrap() <= most, "{format:?}");
        }
    }

    #[test]
    fn normals_are_unit_and_half_way_up() {
        let mut picture = Picture::new(2, 1);
        picture.add(0, [0.0, 0.0, 3.0]);
        picture.add(1, [0.0, -0.5, 0.0]);
        assert_eq!(
            RawPicture::of_normals(&picture).rgb,
            [128, 128, 255, 128, 0, 128]
        );
    }

    #[test]
    fn quality_falls_as_far_as_the_budget_needs() {
        let raw = RawSet {
            views: vec![RawPicture::of_colours(&picture())],
            atlas: RawPicture::of_colours(&picture()),
            normals: None,
        };
        for format in [PictureFormat::Jpeg, PictureFormat::Webp] {
            let bytes = |quality| raw.encode(format, quality).unwrap().bytes();
            let (low, high) = (bytes(20), bytes(90));
            assert!(low < high);
            let budget = u64::midpoint(low, high);
            let (set, fits) = raw.encode_within(format, 20..=90, budget).unwrap();
            assert!(
                fits && set.bytes() <= budget && set.bytes() > low,
                "{format:?}"
            );
            let (set, fits) = raw.encode_within(format, 20..=90, low - 1).unwrap();
            assert!(!fits && set.bytes() == low);
            let (set, fits) = raw.encode_within(format, 20..=90, high).unwrap();
            assert!(fits && set.bytes() == high);
        }
        // A plain viewer does not know WebP.
        let set = raw.encode(PictureFormat::Webp, 90).unwrap();
        assert_ne!(set.atlas.mime_type, "image/webp");
    }
}
