//! Conversion of read-back bytes to a picture with straight alpha.

use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};

/// Divides premultiplied colours by their alpha. Colours are sRGB-encoded bytes of premultiplied linear values, as an
/// sRGB target holds them; alpha is linear.
pub(crate) fn unpremultiply(rgba: &mut [u8]) {
    let linear: Vec<f32> = (0..=255_u8)
        .map(|v| linear_from_srgb(f32::from(v) / 255.0))
        .collect();
    for pixel in rgba.chunks_exact_mut(4) {
        let alpha = pixel[3];
        if alpha == 255 {
            continue;
        }
        for channel in &mut pixel[..3] {
            *channel = if alpha == 0 {
                0
            } else {
                let straight = linear[usize::from(*channel)] * 255.0 / f32::from(alpha);
                (srgb_from_linear(straight) * 255.0).round() as u8
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn premultiplied(encoded: u8, alpha: u8) -> u8 {
        let linear = linear_from_srgb(f32::from(encoded) / 255.0) * f32::from(alpha) / 255.0;
        (srgb_from_linear(linear) * 255.0).round() as u8
    }

    #[test]
    fn the_colour_comes_back_from_under_its_alpha() {
        for alpha in [40, 128, 200, 255] {
            for colour in [0, 90, 180, 255] {
                let mut pixel = [premultiplied(colour, alpha), 0, 0, alpha];
                unpremultiply(&mut pixel);
                let off = (i32::from(pixel[0]) - i32::from(colour)).abs();
                assert!(off <= 2, "{colour} under {alpha} came back as {}", pixel[0]);
            }
        }
    }

    #[test]
    fn nothing_is_black_and_stays_nothing() {
        let mut pixel = [77, 77, 77, 0];
        unpremultiply(&mut pixel);
        assert_eq!(pixel, [0; 4]);
    }
}
