//! Formatting of numbers.

/// Coordinates are printed to this share of the length that they are measured with, as a power of ten.
const DIGITS: i32 = 5;
/// Numbers from 10 to the first of these powers on, up to the second, are printed without an exponent.
const PLAIN: std::ops::Range<i32> = -5..9;

/// A coordinate of a model of this radius: with digits down to a small share of that radius, and an exponent where
/// it would be a row of zeros.
pub(crate) fn coordinate(value: f64, radius: f64) -> String {
    let power = |x: f64| x.abs().log10().floor();
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let unit = if radius > 0.0 && radius.is_finite() {
        power(radius)
    } else {
        power(value)
    };
    let (own, unit) = (power(value) as i32, unit as i32);
    if PLAIN.contains(&own.max(unit)) {
        let decimals = (DIGITS - 1 - unit).clamp(0, 12) as usize;
        return format!("{value:.decimals$}");
    }
    let decimals = (own - unit + DIGITS - 1).clamp(0, 16) as usize;
    format!("{value:.decimals$e}")
}

/// Three coordinates with commas between them.
pub(crate) fn point([x, y, z]: [f64; 3], radius: f64) -> String {
    [x, y, z].map(|c| coordinate(c, radius)).join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_sizes_stay_numbers() {
        for (value, radius, wanted) in [
            (0.0947312, 0.0947312, "0.094731"),
            (-0.0000004, 0.0947312, "-0.000000"),
            (1.5, 1.0, "1.5000"),
            (500_123.25, 2.0, "500123.2500"),
            (3e-12, 3e-12, "3.0000e-12"),
            (1e-20, 1.0, "0.0000"),
            (7e150, 7e150, "7.0000e150"),
            (1e12, 1.0, "1.0000000000000000e12"),
            (0.0, 1e-9, "0"),
            (2.0, 0.0, "2.0000"),
            (f64::NAN, 1.0, "NaN"),
        ] {
            assert_eq!(coordinate(value, radius), wanted);
        }
    }

    /// What is printed is the number, to the share that is promised.
    #[test]
    fn what_is_printed_is_the_number() {
        for power in -290..290 {
            let radius = 10.0_f64.powi(power) * 2.5;
            for value in [radius, -radius * 0.3, radius * 1e3, radius * 1e-3] {
                let text = coordinate(value, radius);
                let back: f64 = text.parse().unwrap();
                assert!((back - value).abs() <= 1e-4 * radius, "{value} as {text}");
                assert!(text.len() < 20, "{text}");
            }
        }
    }
}
