//! The contour generator of a captured view on the model, as plate 4 of the paper shows it: the view's contour, each vertex
//! at its stored depth, seen from the view itself and from elsewhere.

use glam::{DMat3, DVec3};
use silmap_geometry::{Camera, CameraError, TriangleMesh};
use silmap_map::{CapturedView, SilhouetteMap};

use crate::Picture;
use crate::canvas::{Canvas, Stroke};
use crate::palette;

/// Side of a picture, pixels.
const SIDE_PX: u32 = 460;
/// How far the pictures' eyes are turned about the captured view's up axis, degrees, and how they are called.
const TURNS: [(f64, &str); 3] = [
    (0.0, "from the view itself"),
    (50.0, "from 50° to its right"),
    (-110.0, "from 110° to its left"),
];
/// A step from one contour vertex to the next that is longer than this, in bounding-sphere radii, is a jump from one part
/// of the model to another behind it.
const JUMP_REL: f64 = 0.12;
/// Opacity of lines behind the model.
const HIDDEN: f32 = 0.28;

/// The pictures of one view; empty when its contours have no depths.
///
/// # Errors
/// When a picture's eye would lie in the bounding sphere.
pub(crate) fn contour_generator_pictures(
    view: &CapturedView,
    map: &SilhouetteMap,
    model: &TriangleMesh,
) -> Result<Vec<Picture>, CameraError> {
    let lines = generator_lines(view, JUMP_REL * map.radius);
    if lines.outer.is_empty() {
        return Ok(Vec::new());
    }
    let stroke = |colour, width_px, opacity| Stroke {
        colour,
        width_px,
        opacity,
        hidden_opacity: HIDDEN * opacity,
    };
    TURNS
        .iter()
        .map(|&(degrees, label)| {
            let turn = DMat3::from_axis_angle(view.camera.up, degrees.to_radians());
            let eye = map.center + turn * (view.camera.eye - map.center);
            let size = (SIDE_PX, SIDE_PX);
            let camera = Camera::fit_sphere(eye, map.center, map.radius, None, size)?;
            let mut canvas = Canvas::new(&camera);
            canvas.draw_model(model);
            canvas.draw_lines(&lines.jumps, &stroke(palette::INK, 1.0, 0.5));
            canvas.draw_lines(&lines.outer, &stroke(palette::TOO_MUCH, 2.4, 1.0));
            canvas.draw_lines(&lines.holes, &stroke(palette::TOO_LITTLE, 2.4, 1.0));
            Ok(Picture {
                label: label.to_owned(),
                image: canvas.finish(),
            })
        })
        .collect()
}

/// Lines between neighbouring contour vertices in space.
#[derive(Clone, Debug, Default)]
struct GeneratorLines {
    outer: Vec<(DVec3, DVec3)>,
    holes: Vec<(DVec3, DVec3)>,
    /// Of either, where the next vertex lies on another part of the model.
    jumps: Vec<(DVec3, DVec3)>,
}

fn generator_lines(view: &CapturedView, jump: f64) -> GeneratorLines {
    let mut lines = GeneratorLines::default();
    for contour in &view.contours {
        if contour.depths.len() != contour.points.len() {
            continue;
        }
        let points: Vec<DVec3> = contour
            .points
            .iter()
            .zip(&contour.depths)
            .map(|(p, depth)| view.camera.object_from_image(*p, *depth))
            .collect();
        let is_outer = silmap_geometry::polygon::signed_area(&contour.points) > 0.0;
        for (k, from) in points.iter().enumerate() {
            let to = points[(k + 1) % points.len()];
            let along = view.camera.forward.dot(to - *from).abs();
            let kind = match (along > jump, is_outer) {
                (true, _) => &mut lines.jumps,
                (false, true) => &mut lines.outer,
                (false, false) => &mut lines.holes,
            };
            kind.push((*from, to));
        }
    }
    lines
}

/// The view that shows most: the one with most holes, and of these with most contour vertices.
pub(crate) fn telling_view(map: &SilhouetteMap) -> Option<&CapturedView> {
    let key = |view: &&CapturedView| {
        let vertices: usize = view.contours.iter().map(|c| c.points.len()).sum();
        (view.contours.len(), vertices)
    };
    map.views.iter().max_by_key(key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use silmap_map::ViewContour;

    fn view(depths: Vec<f64>) -> CapturedView {
        let camera = Camera::fit_sphere(DVec3::Z * 3.0, DVec3::ZERO, 1.0, None, (64, 64)).unwrap();
        let points = vec![
            DVec2::new(16.0, 16.0),
            DVec2::new(48.0, 16.0),
            DVec2::new(48.0, 48.0),
        ];
        CapturedView {
            camera,
            contours: vec![ViewContour {
                points,
                depths,
                ..ViewContour::default()
            }],
            photographed: None,
        }
    }

    #[test]
    fn lines_are_at_their_depths_and_jumps_apart() {
        let flat = generator_lines(&view(vec![3.0; 3]), 0.1);
        assert_eq!(
            (flat.outer.len(), flat.holes.len(), flat.jumps.len()),
            (3, 0, 0)
        );
        assert!(flat.outer.iter().all(|(p, _)| p.z.abs() < 1e-12));
        let deep = generator_lines(&view(vec![3.0, 3.0, 2.5]), 0.1);
        assert_eq!((deep.outer.len(), deep.jumps.len()), (1, 2));
        assert!(generator_lines(&view(Vec::new()), 0.1).outer.is_empty());
    }
}
