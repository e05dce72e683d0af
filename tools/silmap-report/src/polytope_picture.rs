//! The star-shaped polytope of views around the model, as plate 6 of the paper shows it.

use glam::DVec3;
use silmap_geometry::{Camera, CameraError, ColourImage, TriangleMesh};
use silmap_measure::PolytopeLevel;

use crate::canvas::{Canvas, Linear, Stroke, linear};
use crate::palette::Rgb;

/// Side of the picture, pixels.
const SIDE_PX: u32 = 460;
/// Where the eye of the picture is, as a direction from the center, and how far in radii of the outermost viewpoint.
const AWAY: DVec3 = DVec3::new(0.42, 0.36, 1.0);
const DISTANCE_REL: f64 = 3.2;
/// How much of the model is hidden by the polytope's faces.
const FACE_OPACITY: f32 = 0.45;
const FACE: Rgb = [0x9d, 0xb8, 0xd6];
const EDGES: Stroke = Stroke {
    colour: [0x3c, 0x72, 0xac],
    width_px: 1.0,
    opacity: 0.95,
    hidden_opacity: 0.06,
};
const VIEWPOINTS: Stroke = Stroke {
    colour: [0xd9, 0x6a, 0x12],
    width_px: 4.0,
    opacity: 1.0,
    hidden_opacity: 0.0,
};
/// With more viewpoints than this dots would hide the edges.
const MOST_DOTS: usize = 300;

/// The polytope with the model in it.
///
/// # Errors
/// When all viewpoints are at the center.
pub(crate) fn polytope_picture(
    level: &PolytopeLevel,
    model: &TriangleMesh,
    center: DVec3,
) -> Result<ColourImage, CameraError> {
    let radius = level
        .eyes
        .iter()
        .map(|e| e.distance(center))
        .fold(0.0, f64::max);
    let eye = center + AWAY.normalize_or_zero() * (DISTANCE_REL * radius);
    let camera = Camera::fit_sphere(eye, center, radius, None, (SIDE_PX, SIDE_PX))?;
    let mut picture = Canvas::new(&camera);
    picture.draw_model(model);

    let mut around = Canvas::new(&camera);
    let towards_light = (camera.up - camera.forward - camera.right * 0.5).normalize_or_zero();
    let shade = |face: usize, _: [f64; 3]| -> Linear {
        let [a, b, c] = level.triangles[face].map(|v| level.eyes[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let light = (0.35 + 0.65 * normal.dot(towards_light).max(0.0)) as f32;
        let [r, g, b] = linear(FACE).map(|c| c * light);
        [r, g, b, 1.0]
    };
    around.draw_faces(&level.eyes, &level.triangles, shade);
    picture.lay_over(&around, FACE_OPACITY);

    let edges: Vec<(DVec3, DVec3)> = level
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .filter(|(a, b)| a < b)
        .map(|(a, b)| (level.eyes[a as usize], level.eyes[b as usize]))
        .collect();
    picture.draw_lines(&edges, &EDGES);
    if level.eyes.len() <= MOST_DOTS {
        picture.draw_dots(&level.eyes, &VIEWPOINTS);
    }
    Ok(picture.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octahedron_has_a_picture() {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let eyes: Vec<DVec3> = axes.into_iter().chain(axes.map(|a| -a)).collect();
        let triangles = vec![
            [0, 1, 2],
            [1, 3, 2],
            [3, 4, 2],
            [4, 0, 2],
            [1, 0, 5],
            [3, 1, 5],
            [4, 3, 5],
            [0, 4, 5],
        ];
        let level = PolytopeLevel {
            label: "six".to_owned(),
            eyes,
            triangles,
        };
        let picture = polytope_picture(&level, &TriangleMesh::default(), DVec3::ZERO).unwrap();
        let alpha = |x: u32, y: u32| picture.rgba[((y * picture.width + x) * 4 + 3) as usize];
        assert!(alpha(SIDE_PX / 2, SIDE_PX / 2) > 100 && alpha(2, 2) == 0);
        let nothing = PolytopeLevel {
            eyes: Vec::new(),
            triangles: Vec::new(),
            ..level
        };
        assert!(polytope_picture(&nothing, &TriangleMesh::default(), DVec3::ZERO).is_err());
    }
}
