//! Pictures as PNG files inside a page.

use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use silmap_geometry::ColourImage;

/// A picture as the address of an image that holds itself. A picture with too few bytes for its size is an empty address.
pub(crate) fn data_url(picture: &ColourImage) -> String {
    let mut bytes = Cursor::new(Vec::new());
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
    let (width, height) = (picture.width, picture.height);
    let has_all = picture.rgba.len() as u64 == 4 * u64::from(width) * u64::from(height);
    if !has_all
        || encoder
            .write_image(&picture.rgba, width, height, ExtendedColorType::Rgba8)
            .is_err()
    {
        return "data:,".to_owned();
    }
    format!(
        "data:image/png;base64,{}",
        STANDARD.encode(bytes.into_inner())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_from_its_address() {
        let picture = ColourImage {
            width: 3,
            height: 2,
            rgba: (0..24).collect(),
        };
        let url = data_url(&picture);
        let bytes = STANDARD
            .decode(url.strip_prefix("data:image/png;base64,").unwrap())
            .unwrap();
        let back = image::load_from_memory(&bytes).unwrap().to_rgba8();
        assert_eq!(back.into_raw(), picture.rgba);
        let short = ColourImage {
            height: 3,
            ..picture
        };
        assert_eq!(data_url(&short), "data:,");
    }
}
