//! The fixed studio light that shades untextured models, in texture views and in the renderer alike.
//!
//! The light is fixed to the object, so that a texture view taken from one side stays right from every other. A key and a
//! fill light, each by Lambert's cosine, over an ambient term.

/// Linear colour of a surface that says nothing about its own.
pub const DEFAULT_ALBEDO: [f32; 3] = [0.62, 0.58, 0.52];

/// Ambient term, a factor on the albedo.
pub const AMBIENT: f32 = 0.22;

/// Directions *to* the two lights, object space (normalised where used), with the intensity in the last place.
pub const LIGHTS: [[f32; 4]; 2] = [[0.45, 0.75, 0.55, 0.62], [-0.7, 0.15, -0.35, 0.30]];

/// Intensity of a light that is moved about a model in place of those two, over the same ambient term: what faces it is as bright as its
/// albedo.
pub const MOVED: f32 = 1.0 - AMBIENT;

/// Linear factor on the albedo for a surface with unit `normal`.
#[must_use]
pub fn irradiance(normal: [f32; 3]) -> f32 {
    LIGHTS.iter().fold(AMBIENT, |sum, &[x, y, z, intensity]| {
        let length = (x * x + y * y + z * z).sqrt();
        let cosine = (normal[0] * x + normal[1] * y + normal[2] * z) / length;
        sum + intensity * cosine.max(0.0)
    })
}

/// sRGB encoding of a linear value in [0, 1].
#[must_use]
pub fn srgb_from_linear(linear: f32) -> f32 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear value of an sRGB-encoded one in [0, 1].
#[must_use]
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_its_own_inverse() {
        for k in 0..=255 {
            let v = k as f32 / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(v)) - v).abs() < 1e-5);
        }
    }

    #[test]
    fn no_normal_over_exposes() {
        for k in 0..1000 {
            let (z, turn) = (k as f32 / 499.5 - 1.0, k as f32 * 2.4);
            let rim = (1.0 - z * z).max(0.0).sqrt();
            let light = irradiance([rim * turn.cos(), rim * turn.sin(), z]);
            assert!((AMBIENT..=1.0).contains(&light), "{light}");
        }
    }
}
