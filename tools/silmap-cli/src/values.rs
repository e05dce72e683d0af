//! Parsing of option values: points, sizes, shares, lengths and colours.

use glam::DVec3;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_report::animation::FrameRate;

/// Columns and rows of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// A part of the whole, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Share(pub(crate) f64);

/// A length in model units or as a multiple of the model's bounding-sphere radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Length {
    /// Model units.
    Units(f64),
    /// Times the bounding-sphere radius.
    Radii(f64),
}

impl Length {
    /// The length in bounding-sphere radii, for a model with this one.
    pub(crate) fn in_radii(self, model_radius: f64) -> f64 {
        match self {
            Self::Units(length) => length / model_radius,
            Self::Radii(factor) => factor,
        }
    }

    /// The length in model units, for a model of this bounding-sphere radius.
    pub(crate) fn in_units(self, model_radius: f64) -> f64 {
        match self {
            Self::Units(length) => length,
            Self::Radii(factor) => factor * model_radius,
        }
    }
}

/// What is behind the model in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backdrop {
    /// Nothing.
    Transparent,
    /// sRGB red, green and blue.
    Colour([u8; 3]),
}

/// A number of bytes, with K, M or G for 1024, 1024² or 1024³ of them.
pub(crate) fn parse_bytes(text: &str) -> Result<u64, String> {
    let (number, unit) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1 << 10),
        Some((at, 'M')) => (&text[..at], 1 << 20),
        Some((at, 'G')) => (&text[..at], 1 << 30),
        _ => (text, 1),
    };
    let bytes = number
        .trim()
        .parse::<u64>()
        .ok()
        .and_then(|n| n.checked_mul(unit));
    bytes
        .filter(|&n| n > 0)
        .ok_or_else(|| format!("`{text}` is no number of bytes, such as 400000, 400K or 2M"))
}

/// Three numbers with commas between. `nan` and `inf` are numbers here: what needs a finite one says so.
pub(crate) fn parse_point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse())
        .collect::<Result<_, _>>()
        .map_err(|_| {
            format!("`{text}` is not three numbers with commas between, such as -1,0,2")
        })?;
    match numbers[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!(
            "three numbers are needed, such as -1,0,2; here are {}",
            numbers.len()
        )),
    }
}

/// A point as it is typed, numbers of very many digits with an exponent.
pub(crate) fn point_text(point: DVec3) -> String {
    /// Numbers from the first to the second are read at a glance without an exponent.
    const PLAIN: std::ops::Range<f64> = 1e-5..1e9;
    let text = |x: f64| {
        if x == 0.0 || PLAIN.contains(&x.abs()) || !x.is_finite() {
            x.to_string()
        } else {
            format!("{x:e}")
        }
    };
    point.to_array().map(text).join(",")
}

/// Columns, an x, rows.
pub(crate) fn parse_size(text: &str) -> Result<Size, String> {
    let parse = |part: &str| {
        part.parse()
            .ok()
            .filter(|side| (1..=MAX_SIDE_PX).contains(side))
    };
    text.split_once(['x', 'X', '×'])
        .and_then(|(width, height)| Some((parse(width)?, parse(height)?)))
        .map(|(width, height)| Size { width, height })
        .ok_or_else(|| {
            format!("a size is columns x rows such as 640x480, each from 1 to {MAX_SIDE_PX}")
        })
}

/// A percentage such as `0.5%`, or the same as a plain fraction, `0.005`.
pub(crate) fn parse_share(text: &str) -> Result<Share, String> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|v| v / 100.0),
        None => text.parse::<f64>(),
    };
    value
        .ok()
        .filter(|v| *v > 0.0 && *v < 1.0)
        .map(Share)
        .ok_or_else(|| {
            "a share lies between 0 and 100 %: write 0.5% or, the same, 0.005".to_owned()
        })
}

/// A positive length: `0.2` in model units, `3R` in bounding-sphere radii.
pub(crate) fn parse_length(text: &str) -> Result<Length, String> {
    let (number, in_radii) = match text.strip_suffix(['R', 'r']) {
        Some(number) => (number.trim(), true),
        None => (text, false),
    };
    let value = parse_positive(number).map_err(|_| {
        "a length is a positive number of model units, or of bounding-sphere radii with an R behind: 3R".to_owned()
    })?;
    Ok(if in_radii {
        Length::Radii(value)
    } else {
        Length::Units(value)
    })
}

/// A length of time above zero that a clock can hold.
pub(crate) fn parse_seconds(text: &str) -> Result<f64, String> {
    const MOST: f64 = 1e9;
    parse_positive(text)
        .ok()
        .filter(|&seconds| seconds <= MOST)
        .ok_or_else(|| "a number of seconds above 0 is needed, and below 10⁹".to_owned())
}

/// Frames per second that browsers show as they are.
pub(crate) fn parse_rate(text: &str) -> Result<FrameRate, String> {
    text.parse().ok().and_then(FrameRate::new).ok_or_else(|| {
        format!(
            "a number of frames per second from {} to {} is needed",
            FrameRate::SLOWEST,
            FrameRate::FASTEST
        )
    })
}

/// A finite number above zero.
pub(crate) fn parse_positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|v: &f64| v.is_finite() && *v > 0.0)
        .ok_or_else(|| "a number above 0 is needed".to_owned())
}

/// An angle above zero and up to a right one, degrees.
pub(crate) fn parse_angle(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|v: &f64| *v > 0.0 && *v <= 90.0)
        .ok_or_else(|| "an angle above 0 and up to 90 degrees is needed".to_owned())
}

/// `#rrggbb`, the number sign optional, or `transparent`.
pub(crate) fn parse_backdrop(text: &str) -> Result<Backdrop, String> {
    if text == "transparent" {
        return Ok(Backdrop::Transparent);
    }
    let digits = text.strip_prefix('#').unwrap_or(text);
    Some(digits)
        .filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))
        .and_then(|d| u32::from_str_radix(d, 16).ok())
        .map(|rgb| {
            let [_, red, green, blue] = rgb.to_be_bytes();
            Backdrop::Colour([red, green, blue])
        })
        .ok_or_else(|| "a background is #rrggbb in hexadecimal digits, or transparent".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points() {
        assert_eq!(parse_point("-1,0,2"), Ok(DVec3::new(-1.0, 0.0, 2.0)));
        assert_eq!(parse_point(" 1e-2, .5 ,3"), Ok(DVec3::new(0.01, 0.5, 3.0)));
        assert!(parse_point("nan,0,0").is_ok_and(|p| p.x.is_nan()));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "1;2;3"] {
            assert!(parse_point(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn points_are_shown_as_they_are_typed() {
        for text in ["0,0.1,-3", "1e300,-2.5e-10,123456.5", "NaN,inf,0"] {
            assert_eq!(point_text(parse_point(text).unwrap()), text);
        }
    }

    #[test]
    fn angles() {
        assert_eq!(parse_angle("12.5"), Ok(12.5));
        for bad in ["0", "-1", "91", "nan", "inf", "1e300", ""] {
            assert!(parse_angle(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes() {
        assert_eq!(
            parse_size("640x480"),
            Ok(Size {
                width: 640,
                height: 480
            })
        );
        for bad in ["640", "0x10", "10x0", "-1x4", "20000x10", "x", "1x2x3"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn shares_and_lengths() {
        assert_eq!(parse_share("0.5%"), Ok(Share(0.005)));
        assert_eq!(parse_share("0.005"), Ok(Share(0.005)));
        for bad in ["0", "0%", "100%", "nan", "-1%", "%"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_length("3R"), Ok(Length::Radii(3.0)));
        assert_eq!(parse_length("0.4"), Ok(Length::Units(0.4)));
        assert_eq!(Length::Radii(3.0).in_units(2.0), 6.0);
        for bad in ["R", "0", "-3R", "inf", "3Q"] {
            assert!(parse_length(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn backdrops() {
        assert_eq!(
            parse_backdrop("#ff8000"),
            Ok(Backdrop::Colour([255, 128, 0]))
        );
        assert_eq!(parse_backdrop("000000"), Ok(Backdrop::Colour([0; 3])));
        assert_eq!(parse_backdrop("transparent"), Ok(Backdrop::Transparent));
        for bad in ["#fff", "#gggggg", "red", "#ééé", "+12345", "#ff8000ff"] {
            assert!(parse_backdrop(bad).is_err(), "{bad}");
        }
    }
}
