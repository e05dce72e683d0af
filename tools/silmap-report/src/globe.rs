//! A map of all directions around an object, in Mollweide's projection: it keeps areas, so that a share of the map is a share of the
//! directions.

use std::fmt::Write;

use glam::{DVec2, DVec3};
use silmap_geometry::ColourImage;

use crate::{palette, png};

/// Columns and rows of the picture of the map.
const PICTURE: (u32, u32) = (480, 240);
/// Where the middle of the map is in a drawing, and half the map's size.
pub(crate) const MIDDLE: DVec2 = DVec2::new(260.0, 141.0);
const RADII: DVec2 = DVec2::new(230.0, 115.0);

/// The map's rectangle, in the palette's colour for each direction's value from 0 to 1.
pub(crate) fn coloured(mut value: impl FnMut(DVec3) -> f64) -> ColourImage {
    let (width, height) = PICTURE;
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for (i, j) in (0..height).flat_map(|j| (0..width).map(move |i| (i, j))) {
        let place = DVec2::new(
            (f64::from(i) + 0.5) / f64::from(width) * 2.0 - 1.0,
            (f64::from(j) + 0.5) / f64::from(height) * 2.0 - 1.0,
        );
        rgba.extend(palette::along(value(direction_at(place))));
        rgba.push(255);
    }
    ColourImage {
        width,
        height,
        rgba,
    }
}

/// Draws the map in its ellipse. The page has nothing else of this `id`.
pub(crate) fn globe(svg: &mut String, id: &str, picture: &ColourImage) {
    let (corner, size) = (MIDDLE - RADII, 2.0 * RADII);
    let ellipse = format!(
        "<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\"",
        MIDDLE.x, MIDDLE.y, RADII.x, RADII.y
    );
    push(
        svg,
        format_args!(
            "<clipPath id=\"{id}\">{ellipse}/></clipPath>\
             <image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
             preserveAspectRatio=\"none\" clip-path=\"url(#{id})\" href=\"{}\"/>",
            corner.x,
            corner.y,
            size.x,
            size.y,
            png::data_url(picture)
        ),
    );
    graticule(svg);
    push(
        svg,
        format_args!(
            "{ellipse} fill=\"none\" stroke=\"{}\"/>",
            palette::hex(palette::INK)
        ),
    );
}

/// Marks a direction.
pub(crate) fn dot(svg: &mut String, direction: DVec3, radius: f64, fill: &str) {
    let at = MIDDLE + mollweide(direction) * RADII;
    push(
        svg,
        format_args!(
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"#111\" stroke-width=\"0.8\"/>",
            at.x, at.y
        ),
    );
}

/// Names of the axes at the map's rim.
pub(crate) fn axes(svg: &mut String) {
    let (low, high) = (MIDDLE - RADII, MIDDLE + RADII);
    for (x, y, anchor, label) in [
        (MIDDLE.x, low.y - 8.0, "middle", "+Y"),
        (MIDDLE.x, high.y + 18.0, "middle", "−Y"),
        (low.x - 6.0, MIDDLE.y + 5.0, "end", "−Z"),
        (high.x + 6.0, MIDDLE.y + 5.0, "start", "−Z"),
    ] {
        text(svg, (x, y), anchor, label);
    }
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
fn direction_at(place: DVec2) -> DVec3 {
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

/// Meridians and parallels.
fn graticule(svg: &mut String) {
    const MERIDIANS_DEGREES: [i32; 5] = [-120, -60, 0, 60, 120];
    const PARALLELS_DEGREES: [i32; 5] = [-60, -30, 0, 30, 60];
    let at = |latitude: f64, longitude: f64| {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let (x, z) = longitude.to_radians().sin_cos();
        MIDDLE + mollweide(DVec3::new(x * cos, sin, z * cos)) * RADII
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
}
