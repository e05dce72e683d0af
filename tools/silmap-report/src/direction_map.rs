//! The error over all directions of view, as a map of the sphere.
//!
//! Each pixel of the map is a mean of the measured directions around it, with weights that fall to nothing within about the distance
//! between neighbours.

use glam::DVec3;
use silmap_geometry::ColourImage;
use silmap_measure::DirectionErrors;

use crate::globe::{self, push, text};
use crate::palette;
use crate::scale::LogScale;

/// Size of the drawing.
const SIZE: (f64, f64) = (520.0, 336.0);
/// The bar of colours: left, top, width, height.
const BAR: (f64, f64, f64, f64) = (60.0, 290.0, 400.0, 12.0);

/// The scale that all maps of a page share, in percent.
pub(crate) fn shared_scale(all: &[DirectionErrors]) -> Option<LogScale> {
    let mut shares: Vec<f64> = all
        .iter()
        .flat_map(|d| &d.samples)
        .map(|s| 100.0 * s.1)
        .filter(|v| *v > 0.0 && v.is_finite())
        .collect();
    shares.sort_by(f64::total_cmp);
    // The few directions that are right by luck would take half of the scale.
    const IGNORED: usize = 100;
    let low = shares.len() / IGNORED;
    LogScale::around(shares.into_iter().skip(low))
}

/// The map of one method with the directions of the views kept.
pub(crate) fn direction_map(
    errors: &DirectionErrors,
    kept_views: &[DVec3],
    scale: &LogScale,
) -> String {
    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Error by direction, method {}\">",
        SIZE.0, SIZE.1, errors.method
    );
    let picture = coloured(&errors.samples, scale);
    globe::globe(&mut svg, &format!("map-{}", errors.method), &picture);
    for view in kept_views {
        globe::dot(&mut svg, *view, 2.1, "#fff");
    }
    globe::axes(&mut svg);
    colour_bar(&mut svg, scale);
    svg.push_str("</svg>");
    svg
}

/// The map's rectangle in colours.
fn coloured(samples: &[(DVec3, f64)], scale: &LogScale) -> ColourImage {
    // Samples share the sphere: each has this much of it, and neighbours are about a side of that apart.
    let spacing_squared = 4.0 * std::f64::consts::PI / samples.len().max(1) as f64;
    globe::coloured(|direction| {
        scale.place(100.0 * mean_around(direction, samples, spacing_squared))
    })
}

/// A mean of the samples with weights that fall with the distance as Gauss's curve.
fn mean_around(direction: DVec3, samples: &[(DVec3, f64)], spacing_squared: f64) -> f64 {
    // The curve's variance in squares of the spacing, and where it is cut off; the nearest sample is always nearer than that.
    const VARIANCE: f64 = 0.16;
    const REACH_SQUARED: f64 = 3.0;
    let (mut sum, mut total) = (0.0, 0.0);
    for (at, share) in samples {
        let distance_squared = at.distance_squared(direction);
        if distance_squared < REACH_SQUARED * spacing_squared {
            let weight = (-0.5 * distance_squared / (VARIANCE * spacing_squared)).exp();
            sum += weight * share;
            total += weight;
        }
    }
    if total > 0.0 { sum / total } else { 0.0 }
}

fn colour_bar(svg: &mut String, scale: &LogScale) {
    let (left, top, width, height) = BAR;
    let count = palette::STOPS.len();
    let part = width / count as f64;
    // Slices of the bar, each a little wider than its part so that no gap shows.
    const SLICES: usize = 80;
    let slice = width / SLICES as f64;
    debug_assert!(part > slice, "fewer slices than stops");
    for k in 0..SLICES {
        let place = (k as f64 + 0.5) / SLICES as f64;
        push(
            svg,
            format_args!(
                "<rect x=\"{:.2}\" y=\"{top}\" width=\"{:.2}\" height=\"{height}\" fill=\"{}\"/>",
                left + k as f64 * slice,
                if k + 1 < SLICES { slice + 0.4 } else { slice },
                palette::hex(palette::along(place))
            ),
        );
    }
    for tick in scale.ticks() {
        let x = left + scale.place(tick) * width;
        let label = format!("{}\u{2009}%", (tick * 1e6).round() / 1e6);
        push(
            svg,
            format_args!(
                "<path d=\"M{x:.1} {:.1}v4\" stroke=\"{}\"/>",
                top + height,
                palette::hex(palette::INK)
            ),
        );
        text(svg, (x, top + height + 19.0), "middle", &label);
    }
    text(svg, (left + width, top - 7.0), "end", "misclassified");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_side_is_bright_and_the_other_dark() {
        let samples: Vec<(DVec3, f64)> = (0..400)
            .map(|k| {
                let z = (f64::from(k) + 0.5) / 200.0 - 1.0;
                let (sin, cos) = (f64::from(k) * 2.4).sin_cos();
                let rim = (1.0 - z * z).sqrt();
                let direction = DVec3::new(cos * rim, z, sin * rim);
                (direction, if direction.x > 0.0 { 0.1 } else { 0.001 })
            })
            .collect();
        let picture = coloured(
            &samples,
            &LogScale {
                from: 0.1,
                to: 10.0,
            },
        );
        let red = |x: u32| {
            let at = (picture.height / 2 * picture.width + x) * 4;
            picture.rgba[at as usize]
        };
        assert_eq!(red(3 * picture.width / 4), palette::STOPS[10][0]);
        assert_eq!(red(picture.width / 4), palette::STOPS[0][0]);
    }

    #[test]
    fn the_scale_holds_the_largest_error_of_all_methods() {
        let of = |share: f64| DirectionErrors {
            method: "hull".to_owned(),
            samples: vec![(DVec3::Z, share)],
        };
        let scale = shared_scale(&[of(0.004), of(0.03)]).unwrap();
        assert_eq!((scale.from, scale.to), (0.2, 5.0));
        assert_eq!(shared_scale(&[of(0.0)]), None);
    }
}
