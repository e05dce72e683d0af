//! How fine an asset is made for how large it is to be seen.

use std::ops::RangeInclusive;

use crate::build_params::BuildParams;
use crate::texture::TextureParams;

/// The height that the defaults are for, pixels.
pub const DEFAULT_HEIGHT_PX: u32 = 1024;

/// Heights that an asset can be made for, pixels: captured pictures have half of them a side, 128 to 2048.
pub const HEIGHTS_PX: RangeInclusive<u32> = 256..=4096;

impl BuildParams {
    /// The defaults for a model that is seen at most `height_px` pixels tall: the height of a picture that just holds its bounding sphere.
    ///
    /// Captured pictures, texture views, depth pictures and the atlas have half as many pixels a side, and depths have one bit more each
    /// time that the height is doubled, so that all errors are as many pixels of the screen at each height. A contour's tolerance stays what
    /// it is in pixels of the capture, and is so twice that on the screen.
    ///
    /// Heights outside of [`HEIGHTS_PX`] count as the nearest within.
    #[must_use]
    pub fn for_height(height_px: u32) -> Self {
        let height_px = height_px.clamp(*HEIGHTS_PX.start(), *HEIGHTS_PX.end());
        let default = Self::default();
        let scale = f64::from(height_px) / f64::from(DEFAULT_HEIGHT_PX);
        let scaled = |side_px: u32| (f64::from(side_px) * scale).round() as u32;
        let textures = TextureParams {
            size_px: scaled(default.textures.size_px),
            relief_px: scaled(default.textures.relief_px),
            relief_bits: default
                .textures
                .relief_bits
                .saturating_add_signed(scale.log2().round() as i32),
            atlas_px: scaled(default.textures.atlas_px),
            ..default.textures
        };
        Self {
            for_height_px: Some(height_px),
            resolution_px: scaled(default.resolution_px),
            textures,
            ..default
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_for_one_height() {
        let plain = BuildParams {
            for_height_px: Some(DEFAULT_HEIGHT_PX),
            ..BuildParams::default()
        };
        assert_eq!(BuildParams::for_height(DEFAULT_HEIGHT_PX), plain);
    }

    #[test]
    fn all_heights_can_be_built_and_grow_finer() {
        let mut before = BuildParams::for_height(0);
        for height_px in HEIGHTS_PX.step_by(64) {
            let params = BuildParams::for_height(height_px);
            assert_eq!(params.resolution_px, height_px / 2);
            params.textures.validate().unwrap();
            let sizes = |p: &BuildParams| {
                let t = &p.textures;
                [
                    p.resolution_px,
                    t.size_px,
                    t.relief_px,
                    t.relief_bits,
                    t.atlas_px,
                ]
            };
            let grow = sizes(&before)
                .iter()
                .zip(sizes(&params))
                .all(|(a, b)| *a <= b);
            assert!(grow, "{height_px}");
            assert_eq!(params.tolerance_px, before.tolerance_px);
            before = params;
        }
        assert_eq!(before.resolution_px, 2048);
        assert_eq!(BuildParams::for_height(u32::MAX), before);
    }
}
