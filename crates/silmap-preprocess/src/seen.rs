//! Silhouettes that somebody has seen: photographs' outlines as views of a map, and the viewpoints that close the polytope.
//!
//! A map's view is a square picture that looks at the model's center. A photograph's outline is carried into it by the rays of its
//! points, as the eye is the same. Where no photograph was taken from, and only there, viewpoints are added from which the model itself
//! is drawn.
//!
//! Source: beyond the paper, whose viewpoints are evenly spread (section 3).

use glam::{DVec2, DVec3};
use silmap_geometry::polygon::{fill_non_zero, signed_area};
use silmap_geometry::{Bounds, Camera, CameraError, Loop, Mask, SeenSilhouette};
use silmap_map::simplified_polytope::is_readable;

use crate::capture::spiral_directions;
use crate::dense_map::triangulate_view_sphere;
use crate::progress::Unused;
use crate::simplify_contour::{SimplifyContourParams, VERTEX_STEPS_PER_PX, simplify_contours};

/// Eyes this near to each other, seen from the center, look from the same direction: half a degree.
pub const SAME_DIRECTION_COSINE: f64 = 0.999_962;

/// No viewpoint is added nearer to a photograph's than this many usual distances between photographs...
const FREE_AROUND: f64 = 1.25;

/// ... nor than this, if that is less: 12°.
const MOST_FREE_RAD: f64 = 0.21;

/// Viewpoints of photographs, and those that close the polytope around the model.
#[derive(Clone, Debug, Default)]
pub struct Viewpoints {
    /// Numbers of the silhouettes that are used: the first views.
    pub seen: Vec<usize>,
    /// Cameras of all views.
    pub cameras: Vec<Camera>,
    /// The silhouettes that are not used.
    pub unused: Vec<(usize, Unused)>,
}

/// Finds viewpoints all around `bounds` that hold those of `seen`. As many are added as a sphere of `count` evenly spread ones has where
/// no silhouette was seen; none where no silhouette can be used.
///
/// # Errors
/// When there is no picture of that size.
pub fn viewpoints(
    seen: &[SeenSilhouette],
    bounds: &Bounds,
    (count, resolution_px): (u32, u32),
) -> Result<Viewpoints, CameraError> {
    let arm = |k: usize| seen[k].eye - bounds.center;
    let mut unused = Vec::new();
    // Those that are seen best come first.
    let mut order: Vec<usize> = (0..seen.len()).collect();
    order.sort_by(|&a, &b| seen[b].photographed.total_cmp(&seen[a].photographed));
    let mut used: Vec<usize> = Vec::new();
    for k in order {
        let is_same = |&&other: &&usize| {
            arm(k)
                .normalize_or_zero()
                .dot(arm(other).normalize_or_zero())
                > SAME_DIRECTION_COSINE
        };
        if let Some(&as_view) = used.iter().find(is_same) {
            unused.push((k, Unused::SameDirection { as_view }));
        } else if arm(k).length() <= bounds.radius || !is_in_front(&seen[k], bounds) {
            unused.push((k, Unused::Behind));
        } else {
            used.push(k);
        }
    }
    used.sort_unstable();
    let radius = reaching(bounds, resolution_px);
    while !used.is_empty() {
        let mut arms: Vec<DVec3> = used.iter().map(|&k| arm(k)).collect();
        let usual = middle(arms.iter().map(|a| a.length())).unwrap_or(1.0);
        arms.extend(closing(&arms, count).into_iter().map(|d| d * usual));
        let eyes: Vec<DVec3> = arms.iter().map(|a| bounds.center + *a).collect();
        let triangles = triangulate_view_sphere(bounds.center, &eyes).unwrap_or_default();
        // Of an impossible triangle the eye goes that is least like the others.
        let odd = |&t: &[u32; 3]| {
            let own = t.iter().map(|&v| v as usize).filter(|&v| v < used.len());
            own.max_by(|&a, &b| {
                let off = |v: usize| (arms[v].length() / usual).ln().abs();
                off(a).total_cmp(&off(b))
            })
        };
        let bad = triangles
            .iter()
            .filter(|t| !is_readable(t.map(|v| arms[v as usize]), radius));
        let Some(worst) = bad.filter_map(odd).next() else {
            let size = (resolution_px, resolution_px);
            let camera =
                |&eye: &DVec3| Camera::fit_sphere(eye, bounds.center, bounds.radius, None, size);
            let cameras = eyes.iter().map(camera).collect::<Result<_, _>>()?;
            unused.sort_unstable_by_key(|&(k, _)| k);
            return Ok(Viewpoints {
                seen: used,
                cameras,
                unused,
            });
        };
        unused.push((used.remove(worst), Unused::Distance));
    }
    unused.sort_unstable_by_key(|&(k, _)| k);
    Ok(Viewpoints {
        unused,
        ..Viewpoints::default()
    })
}

/// The radius that contours in pictures of that size reach at most: a few pixels more than the model's.
pub(crate) fn reaching(bounds: &Bounds, resolution_px: u32) -> f64 {
    bounds.radius * (1.0 + 6.0 / f64::from(resolution_px.max(1)))
}

/// Directions that are away from all arms.
fn closing(arms: &[DVec3], count: u32) -> Vec<DVec3> {
    let directions: Vec<DVec3> = arms.iter().map(|a| a.normalize_or_zero()).collect();
    let angle = |a: DVec3, b: DVec3| a.dot(b).clamp(-1.0, 1.0).acos();
    let nearest = |k: usize| {
        let others = (0..directions.len()).filter(|&j| j != k);
        others
            .map(|j| angle(directions[k], directions[j]))
            .fold(std::f64::consts::PI, f64::min)
    };
    let between = middle((0..directions.len()).map(nearest)).unwrap_or(1.0);
    let spacing = (4.0 * std::f64::consts::PI / f64::from(count.max(1))).sqrt();
    let free = (FREE_AROUND * between).min(MOST_FREE_RAD).max(spacing);
    let mut found = spiral_directions(count);
    found.retain(|d| directions.iter().all(|own| angle(*d, *own) > free));
    found
}

/// The number in the middle.
pub(crate) fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

fn is_in_front(seen: &SeenSilhouette, bounds: &Bounds) -> bool {
    let forward = bounds.center - seen.eye;
    let mut points = seen.outline.iter().flatten();
    points.all(|&p| seen.ray(p).dot(forward) > 0.0)
}

/// A seen outline in the picture of a camera at its eye, simplified, within the picture of the bounding sphere; outer loops have
/// positive area.
#[must_use]
pub fn outline_in(seen: &SeenSilhouette, camera: &Camera, tolerance_px: f64) -> Vec<Loop> {
    let to_camera = |p: DVec2| camera.image_from_direction(seen.ray(p));
    // How many of the camera's pixels one of the image is.
    let area = |points: &Loop| signed_area(points);
    let mapped: Vec<Loop> = (seen.outline.iter())
        .map(|points| points.iter().map(|&p| to_camera(p)).collect())
        .collect();
    let (before, after): (f64, f64) = (
        seen.outline.iter().map(area).sum(),
        mapped.iter().map(area).sum(),
    );
    let px = (after.abs() / before.abs().max(1.0))
        .sqrt()
        .max(f64::MIN_POSITIVE);
    // Half a pixel is what the steps of traced pixels need.
    let params = SimplifyContourParams {
        tolerance_px: (tolerance_px / px).max(SimplifyContourParams::default().tolerance_px),
        outward_only: false,
    };
    let middle = 0.5 * camera.size();
    let most = middle.x / silmap_geometry::camera::FIT_MARGIN + 1.0;
    let is_mirrored = after < 0.0;
    let mut found = Vec::new();
    for points in simplify_contours(&seen.outline, &params) {
        let mut points: Loop = (points.into_iter())
            .map(|p| {
                let off = to_camera(p) - middle;
                let inside = middle + off.clamp_length_max(most);
                (inside * VERTEX_STEPS_PER_PX).round() / VERTEX_STEPS_PER_PX
            })
            .collect();
        points.dedup();
        while points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        if is_mirrored {
            points.reverse();
        }
        if points.len() >= 3 && signed_area(&points) != 0.0 {
            found.push(points);
        }
    }
    found
}

/// The pixels of a picture that loops cover.
#[must_use]
pub fn covered(loops: &[Loop], camera: &Camera) -> Mask {
    let mut mask = Mask::new(camera.width_px, camera.height_px);
    fill_non_zero(loops, &mut mask);
    mask
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::capture::cpu::rasterise;
    use glam::DMat3;
    use silmap_geometry::trace::trace_contours;
    use silmap_geometry::{CoverageRule, TriangleMesh};
    use silmap_models as models;

    fn bounds() -> Bounds {
        models::torus(600).bounds()
    }

    /// What a camera that looks beside the model and is turned about its axis sees of the torus.
    fn silhouette(eye: DVec3, name: &str) -> SeenSilhouette {
        let mesh = models::torus(600);
        let target = mesh.bounds().center + DVec3::new(0.1, -0.07, 0.04) * mesh.bounds().radius;
        let up = Some(DVec3::new(0.3, 1.0, 0.2));
        let camera = Camera::look_at(eye, target, up, 0.9, (500, 400)).unwrap();
        seen_by(&mesh, &camera, name)
    }

    pub(crate) fn seen_by(mesh: &TriangleMesh, camera: &Camera, name: &str) -> SeenSilhouette {
        let mut mask = Mask::new(camera.width_px, camera.height_px);
        rasterise(mesh, camera, CoverageRule::Center, &mut mask).unwrap();
        let [o, x, y] = [DVec2::ZERO, DVec2::X, DVec2::Y].map(|p| camera.direction_from_image(p));
        SeenSilhouette {
            name: name.to_owned(),
            eye: camera.eye,
            outline: trace_contours(&mask),
            ray_from_image: DMat3::from_cols(x - o, y - o, o),
            photographed: 1.0,
        }
    }

    fn ring(count: u32, distance: f64) -> Vec<SeenSilhouette> {
        let bounds = bounds();
        (0..count)
            .map(|k| {
                let turn = std::f64::consts::TAU * f64::from(k) / f64::from(count);
                let direction = DVec3::new(turn.cos(), 0.3, turn.sin()).normalize_or_zero();
                silhouette(
                    bounds.center + direction * distance * bounds.radius,
                    &format!("{k}"),
                )
            })
            .collect()
    }

    #[test]
    fn an_outline_is_the_same_whoever_looks_from_there() {
        let mesh = models::torus(600);
        let bounds = bounds();
        let seen = &ring(7, 4.0)[2];
        let camera =
            Camera::fit_sphere(seen.eye, bounds.center, bounds.radius, None, (300, 300)).unwrap();
        let own = covered(&outline_in(seen, &camera, 0.5), &camera);
        let mut drawn = Mask::new(300, 300);
        rasterise(&mesh, &camera, CoverageRule::Center, &mut drawn).unwrap();
        let off = own.count_different(&drawn) as f64 / drawn.count() as f64;
        assert!(off < 0.01, "{off}");
        // A mirrored picture, traced with outer loops as ever, and its mirrored rays are the same.
        let mirrored = SeenSilhouette {
            outline: (seen.outline.iter())
                .map(|points| {
                    points
                        .iter()
                        .rev()
                        .map(|p| DVec2::new(500.0 - p.x, p.y))
                        .collect()
                })
                .collect(),
            ray_from_image: seen.ray_from_image
                * DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::new(500.0, 0.0, 1.0)),
            ..seen.clone()
        };
        let loops = outline_in(&mirrored, &camera, 0.5);
        assert!(loops.iter().map(|l| signed_area(l)).sum::<f64>() > 0.0);
        let off = covered(&loops, &camera).count_different(&own) as f64 / own.count() as f64;
        assert!(off < 0.01, "{off}");
    }

    #[test]
    fn what_nobody_saw_is_closed_and_nothing_else() {
        let seen = ring(24, 4.0);
        let found = viewpoints(&seen, &bounds(), (400, 128)).unwrap();
        assert_eq!(found.seen, (0..24).collect::<Vec<_>>());
        assert_eq!(found.unused, []);
        let direction = |c: &Camera| (c.eye - bounds().center).normalize_or_zero();
        let free = found.cameras.iter().skip(24).all(|c| {
            let beside = |s: &Camera| direction(s).dot(direction(c)) < 0.20_f64.cos();
            found.cameras.iter().take(24).all(beside)
        });
        assert!(free, "a viewpoint is added beside a photograph");
        let eyes: Vec<DVec3> = found.cameras.iter().map(|c| c.eye).collect();
        assert!(eyes.len() > 200 && eyes.len() < 424);
        assert!(triangulate_view_sphere(bounds().center, &eyes).is_ok());
    }

    #[test]
    fn the_same_direction_and_impossible_places_are_said() {
        let mut seen = ring(24, 4.0);
        // The same direction, seen less well; one in the model; one a hundred times as far.
        let mut again = seen[3].clone();
        again.photographed = 0.5;
        seen.push(again);
        let mut inside = seen[5].clone();
        inside.eye = bounds().center + DVec3::X * 0.5 * bounds().radius;
        seen.push(inside);
        let far = bounds().center + DVec3::new(0.3, 1.0, 0.2) * 400.0 * bounds().radius;
        seen.push(silhouette(far, "far"));
        let found = viewpoints(&seen, &bounds(), (400, 128)).unwrap();
        assert_eq!(
            found.unused,
            [
                (24, Unused::SameDirection { as_view: 3 }),
                (25, Unused::Behind),
                (26, Unused::Distance)
            ]
        );
        assert_eq!(found.seen.len(), 24);
    }

    #[test]
    fn directions_from_one_side_and_two_alone_are_closed_too() {
        for count in [1, 2, 5] {
            let found = viewpoints(&ring(24, 4.0)[..count], &bounds(), (400, 128)).unwrap();
            let eyes: Vec<DVec3> = found.cameras.iter().map(|c| c.eye).collect();
            assert!(triangulate_view_sphere(bounds().center, &eyes).is_ok());
            assert_eq!(found.seen.len(), count);
        }
    }
}
