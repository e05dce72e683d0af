//! From where outlines rest on photographs, as a map of the sphere.

use glam::DVec3;
use silmap_geometry::ColourImage;
use silmap_map::{Polytope, SilhouetteMap};

use crate::globe::{self, MIDDLE, push};
use crate::palette;

/// Size of the drawing.
const SIZE: (f64, f64) = (520.0, 340.0);

/// The drawing, an SVG file; `None` for the map of a mesh, of which there are no photographs.
#[must_use]
pub fn coverage_map(map: &SilhouetteMap) -> Option<String> {
    let on_average = map.covered_on_average()?;
    let picture = coloured(map)?;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Share of outlines that rests on \
         photographs, by direction\" font-family=\"sans-serif\">",
        SIZE.0, SIZE.1
    );
    svg.push_str("<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>");
    globe::globe(&mut svg, "covered", &picture);
    for view in &map.views {
        let (radius, fill) = match view.photographed.unwrap_or(0.0) > 0.0 {
            true => (3.4, "#e0302a"),
            false => (1.8, "#fff"),
        };
        globe::dot(&mut svg, view.camera.eye - map.center, radius, fill);
    }
    globe::axes(&mut svg);
    let legend = format!(
        "red: photographs; white: views of the carved hull; bright: outlines rest on photographs ({:.0} % on average)",
        100.0 * on_average
    );
    push(
        &mut svg,
        format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"9.5\" fill=\"{}\">{legend}</text></svg>",
            MIDDLE.x,
            SIZE.1 - 22.0,
            palette::hex(palette::INK)
        ),
    );
    Some(svg)
}

/// The map's rectangle in colours; `None` where the map is no polytope.
fn coloured(map: &SilhouetteMap) -> Option<ColourImage> {
    let polytope = Polytope::new(map).ok()?;
    let mut last = 0;
    Some(globe::coloured(|direction| {
        covered_at(map, &polytope, direction, &mut last)
    }))
}

fn covered_at(map: &SilhouetteMap, polytope: &Polytope, direction: DVec3, last: &mut u32) -> f64 {
    let at = polytope.locate(map.center + direction * map.radius, *last);
    let Some(at) = at else { return 0.0 };
    *last = at.triangle;
    map.covered(at.triangle, at.barycentric).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use silmap_geometry::{Camera, CoverageRule};
    use silmap_map::CapturedView;

    use super::*;

    /// An octahedron, photographed from +X only.
    fn octahedron(of_photographs: bool) -> SilhouetteMap {
        let view = |eye: DVec3| CapturedView {
            camera: Camera::fit_sphere(eye * 3.0, DVec3::ZERO, 1.0, None, (64, 64)).unwrap(),
            contours: Vec::new(),
            photographed: of_photographs.then_some(eye.x.max(0.0)),
        };
        let corners = [
            DVec3::X,
            DVec3::Y,
            DVec3::NEG_X,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z,
        ];
        let triangles = (0..4).flat_map(|k| [[k, (k + 1) % 4, 4], [(k + 1) % 4, k, 5]]);
        SilhouetteMap {
            center: DVec3::ZERO,
            radius: 1.0,
            resolution_px: 64,
            tolerance_px: 0.5,
            coverage: CoverageRule::Center,
            views: corners.map(view).to_vec(),
            triangles: triangles.collect(),
        }
    }

    #[test]
    fn a_corner_is_bright_and_what_is_not_beside_it_dark() {
        let map = octahedron(true);
        let picture = coloured(&map).unwrap();
        let at = |direction: DVec3| {
            let place = globe::mollweide(direction) * 0.5 + 0.5;
            let column = ((place.x * 480.0) as usize).min(479);
            let row = ((place.y * 240.0) as usize).min(239);
            let k = 4 * (row * 480 + column);
            [picture.rgba[k], picture.rgba[k + 1], picture.rgba[k + 2]]
        };
        // A pixel is up to a degree from its corner.
        let brightest = palette::along(1.0);
        assert!(
            at(DVec3::X)
                .iter()
                .zip(brightest)
                .all(|(a, b)| a.abs_diff(b) < 20)
        );
        assert_eq!(at(DVec3::new(-1.0, 0.2, 0.3)), palette::along(0.0));
        // Four of eight triangles have one corner of three.
        assert!((map.covered_on_average().unwrap() - 1.0 / 6.0).abs() < 1e-12);
        let svg = coverage_map(&map).unwrap();
        assert_eq!(svg.matches("r=\"3.4\"").count(), 1);
        assert_eq!(svg.matches("r=\"1.8\"").count(), 5);
        assert!(svg.contains("(17 % on average)"));
    }

    #[test]
    fn the_map_of_a_mesh_has_none() {
        assert_eq!(coverage_map(&octahedron(false)), None);
        assert_eq!(octahedron(false).covered(0, [0.2, 0.3, 0.5]), None);
        let at = octahedron(true).covered(0, [0.2, 0.3, 0.5]);
        assert!((at.unwrap() - 0.2).abs() < 1e-12);
    }
}
