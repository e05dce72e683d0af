//! Which picture formats an asset may hold.

use super::document::WEBP;
use super::{AssetError, EncodedImage};

/// Refuses a picture whose first bytes are not those of its type.
pub(super) fn check_picture(image: &EncodedImage, what: &'static str) -> Result<(), AssetError> {
    let starts_with = |signature: &[u8]| image.bytes.starts_with(signature);
    let is_right = match image.mime_type.as_str() {
        "image/png" => starts_with(b"\x89PNG\r\n\x1a\n"),
        "image/jpeg" => starts_with(b"\xff\xd8\xff"),
        WEBP => starts_with(b"RIFF") && image.bytes.get(8..12) == Some(b"WEBP"),
        _ => false,
    };
    if is_right {
        return Ok(());
    }
    Err(not_a_picture(image, what))
}

/// Refuses what a plain glTF viewer would not read.
pub(super) fn check_atlas_picture(image: &EncodedImage) -> Result<(), AssetError> {
    const WHAT: &str = "of the atlas";
    if image.mime_type == WEBP {
        return Err(not_a_picture(image, WHAT));
    }
    check_picture(image, WHAT)
}

fn not_a_picture(image: &EncodedImage, what: &'static str) -> AssetError {
    AssetError::NotAPicture {
        what,
        mime_type: image.mime_type.clone(),
    }
}
