//! The error over all directions of view, as a map of the sphere.
//!
//! Mollweide's projection, which keeps areas: a share of the map is a share of the directions. Each of its pixels is a mean of
//! the measured directions around it, with weights that fall to nothing within about the distance between neighbours.

use std::fmt::Write;

use glam::{DVec2, DVec3};
use silmap_geometry::ColourImage;
use silmap_measure::DirectionErrors;

use crate::palette;
use crate::png;
use crate::scale::LogScale;

/// Columns and rows of the picture of the map.
const PICTURE: (u32, u32) = (480, 240);
/// Where the map lies in the drawing: left, top, width, height.
const MAP: (f64, f64, f64, f64) = (30.0, 26.0, 460.0, 230.0);
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
    let (left, top, width, height) = MAP;
    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Error by direction, method {}\">",
        SIZE.0, SIZE.1, errors.method
    );
    let (middle, radii) = (
        DVec2::new(left + 0.5 * width, top + 0.5 * height),
        DVec2::new(0.5 * width, 0.5 * height),
    );
    let ellipse = format!(
        "<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\"",
        middle.x, middle.y, radii.x, radii.y
    );
    let id = format!("map-{}", errors.method);
    push(
        &mut svg,
        format_args!(
            "<clipPath id=\"{id}\">{ellipse}/></clipPath>\
             <image x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" \
             preserveAspectRatio=\"none\" clip-path=\"url(#{id})\" href=\"{}\"/>",
            png::data_url(&coloured(&errors.samples, scale))
        ),
    );
    graticule(&mut svg, middle, radii);
    push(
        &mut svg,
        format_args!(
            "{ellipse} fill=\"none\" stroke=\"{}\"/>",
            palette::hex(palette::INK)
        ),
    );
    for view in kept_views {
        let at = middle + mollweide(*view) * radii;
        push(
            &mut svg,
            format_args!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.1\" fill=\"#fff\" stroke=\"#111\" stroke-width=\"0.8\"/>",
                at.x, at.y
            ),
        );
    }
    for (x, y, anchor, label) in [
        (middle.x, top - 8.0, "middle", "+Y"),
        (middle.x, top + height + 18.0, "middle", "−Y"),
        (left - 6.0, middle.y + 5.0, "end", "−Z"),
        (left + width + 6.0, middle.y + 5.0, "start", "−Z"),
    ] {
        text(&mut svg, (x, y), anchor, label);
    }
    colour_bar(&mut svg, scale);
    svg.push_str("</svg>");
    svg
}

/// Where a direction is on the map: right and down from −1 to 1.
///
/// +Z is in the middle, +X halfway to the right, +Y at the top.
pub(crate) fn mollweide(direction: DVec3) -> DVec2 {
    let d = direction.normalize_or_zero();
    let latitude = d.y.clamp(-1.0, 1.0).asin();
    let longitude = d.x.atan2(d.z);
    // Newton's method for 2θ + sin 2θ = π sin(latitude), which is slow only at the poles themselves.
    let goal = std::f64::consts::PI * latitude.sin();
    let mut theta = latitude;
    const ROUNDS: usize = 40;
    for _ in 0..ROUNDS {
        let slope = 2.0 + 2.0 * (2.0 * theta).cos();
        if slope < f64::EPSILON {
            break;
        }
        theta -= (2.0 * theta + (2.0 * theta).sin() - goal) / slope;
        theta = theta.clamp(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2);
    }
    DVec2::new(longitude / std::f64::consts::PI * theta.cos(), -theta.sin())
}

/// The direction at a place of the map; places beside the ellipse are moved onto its rim.
pub(crate) fn direction_at(place: DVec2) -> DVec3 {
    let theta = (-place.y).clamp(-1.0, 1.0).asin();
    let sin = (2.0 * theta + (2.0 * theta).sin()) / std::f64::consts::PI;
    let cos = (1.0 - sin * sin).max(0.0).sqrt();
    let across = if theta.cos() > 0.0 {
        (place.x / theta.cos()).clamp(-1.0, 1.0)
    } else {
        0.0
    };
    let (x, z) = (across * std::f64::consts::PI).sin_cos();
    DVec3::new(x * cos, sin, z * cos)
}

/// The map's rectangle in colours.
fn coloured(samples: &[(DVec3, f64)], scale: &LogScale) -> ColourImage {
    let (width, height) = PICTURE;
    // Samples share the sphere: each has this much of it, and neighbours are about a side of that apart.
    let spacing_squared = 4.0 * std::f64::consts::PI / samples.len().max(1) as f64;
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for j in 0..height {
        for i in 0..width {
            let place = DVec2::new(
                (f64::from(i) + 0.5) / f64::from(width) * 2.0 - 1.0,
                (f64::from(j) + 0.5) / f64::from(height) * 2.0 - 1.0,
            );
            let share = mean_around(direction_at(place), samples, spacing_squared);
            rgba.extend(palette::along(scale.place(100.0 * share)));
            rgba.push(255);
        }
    }
    ColourImage {
        width,
        height,
        rgba,
    }
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

/// Meridians and parallels.
pub(crate) fn graticule(svg: &mut String, middle: DVec2, radii: DVec2) {
    const MERIDIANS_DEGREES: [i32; 5] = [-120, -60, 0, 60, 120];
    const PARALLELS_DEGREES: [i32; 5] = [-60, -30, 0, 30, 60];
    let at = |latitude: f64, longitude: f64| {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let (x, z) = longitude.to_radians().sin_cos();
        middle + mollweide(DVec3::new(x * cos, sin, z * cos)) * radii
    };
    let mut path = String::new();
    for longitude in MERIDIANS_DEGREES {
        let line = (-18..=18).map(|k| at(f64::from(k) * 5.0, f64::from(longitude)));
        add_line(&mut path, line);
    }
    for latitude in PARALLELS_DEGREES {
        let ends = [-179.999, 179.999].map(|longitude| at(f64::from(latitude), longitude));
        add_line(&mut path, ends.into_iter());
    }
    push(
        svg,
        format_args!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"#fff\" stroke-opacity=\"0.35\" stroke-width=\"0.8\"/>"
        ),
    );
}

fn add_line(path: &mut String, points: impl Iterator<Item = DVec2>) {
    for (k, p) in points.enumerate() {
        let verb = if k == 0 { 'M' } else { 'L' };
        push(path, format_args!("{verb}{:.1} {:.1}", p.x, p.y));
    }
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

pub(crate) fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, label: &str) {
    push(
        svg,
        format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"15\" fill=\"{}\">{label}</text>",
            palette::hex(palette::INK)
        ),
    );
}

pub(crate) fn push(svg: &mut String, part: std::fmt::Arguments<'_>) {
    // Writing into a string cannot fail.
    let _ = svg.write_fmt(part);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_where_the_labels_say() {
        for (direction, place) in [
            (DVec3::Z, DVec2::ZERO),
            (DVec3::X, DVec2::new(0.5, 0.0)),
            (DVec3::NEG_X, DVec2::new(-0.5, 0.0)),
            (DVec3::Y, DVec2::new(0.0, -1.0)),
            (DVec3::NEG_Y, DVec2::new(0.0, 1.0)),
        ] {
            let at = mollweide(direction);
            assert!(at.distance(place) < 1e-3, "{direction}: {at}");
        }
    }

    #[test]
    fn the_map_can_be_read_back() {
        for k in 0..200 {
            let z = f64::from(k) / 100.0 - 0.995;
            let (sin, cos) = (f64::from(k) * 2.4).sin_cos();
            let rim = (1.0 - z * z).max(0.0).sqrt();
            let direction = DVec3::new(cos * rim, sin * rim, z);
            let back = direction_at(mollweide(direction));
            assert!(back.distance(direction) < 1e-6, "{direction}: {back}");
        }
    }

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
