//! The page's colours: of the methods, of right and wrong pixels, and of shares.
//!
//! The colours of shares follow matplotlib's `viridis` (van der Walt and Smith 2015, public domain), which keeps its order of
//! brightness for colour-blind eyes and on paper.

/// An sRGB colour.
pub(crate) type Rgb = [u8; 3];

/// Text and axes; the page's style sheet replaces it by its own ink, light or dark.
pub(crate) const INK: Rgb = [0x33, 0x33, 0x33];
/// Grid lines; replaced as well.
pub(crate) const GRID: Rgb = [0xe4, 0xe4, 0xe4];
/// Pixels that are inside in truth and prediction.
pub(crate) const RIGHT: Rgb = [0x9a, 0x9a, 0x9f];
/// Pixels that are predicted inside and are not: too much.
pub(crate) const TOO_MUCH: Rgb = [0xe0, 0x30, 0x2a];
/// Pixels that are inside and predicted outside: too little.
pub(crate) const TOO_LITTLE: Rgb = [0x2f, 0x6d, 0xf0];
/// What is not one of the methods: the curve of an even spread.
pub(crate) const OTHER: Rgb = [0x8a, 0x8a, 0x92];

/// The colour of a method's lines.
pub(crate) fn of_method(name: &str) -> Rgb {
    match name {
        "paper" => [0xc7, 0x3a, 0x82],
        "hull" => [0xd9, 0x82, 0x1b],
        "tight" => [0x2b, 0x86, 0xd0],
        "brute" => [0xc4, 0x4e, 0x52],
        "brute-parallel" => [0xdd, 0xa0, 0x3c],
        "cones" => [0x3c, 0x9d, 0x5f],
        "jc" => [0x8d, 0x6a, 0xc8],
        "dual" => [0x17, 0x8a, 0xa6],
        // Other searches of dual space.
        _ if name.starts_with("dual") => [0x5a, 0x55, 0xb5],
        _ => OTHER,
    }
}

/// A colour as CSS writes it.
pub(crate) fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Evenly spaced colours of the scale of shares, smallest first.
pub(crate) const STOPS: [Rgb; 11] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x24, 0x75],
    [0x41, 0x44, 0x87],
    [0x35, 0x5f, 0x8d],
    [0x2a, 0x78, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x22, 0xa8, 0x84],
    [0x44, 0xbf, 0x70],
    [0x7a, 0xd1, 0x51],
    [0xbd, 0xdf, 0x26],
    [0xfd, 0xe7, 0x25],
];

/// The colour at `place`, 0 to 1, of the scale of shares.
pub(crate) fn along(place: f64) -> Rgb {
    let at = place.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let first = (at.floor() as usize).min(STOPS.len() - 2);
    let part = at - first as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(STOPS[first][k]), f64::from(STOPS[first + 1][k]));
        (a + (b - a) * part).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_starts_and_ends_where_it_should_and_only_brightens() {
        assert_eq!(
            (along(-1.0), along(0.0), along(1.0), along(f64::NAN)),
            (STOPS[0], STOPS[0], STOPS[10], along(f64::NAN))
        );
        let brightness = |place: f64| {
            let [r, g, b] = along(place).map(f64::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        for k in 1..=100 {
            let (before, now) = (f64::from(k - 1) / 100.0, f64::from(k) / 100.0);
            assert!(brightness(now) > brightness(before) - 0.5, "{now}");
        }
    }
}
