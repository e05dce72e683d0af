//! Visibility of hull faces in texture views (section 8.2).
//!
//! A view may paint a face when (1) the face looks towards it, (2) no part of it is hidden by the rest of the hull (item
//! buffer at texture resolution), and (3) the picture shows, where the face takes its colours from, the surface that the
//! face stands for and nothing in front of it.
//!
//! Deviations: (3) is not in the paper, whose hull textures can show what occludes P(v) in the original.

use glam::DVec3;
use silmap_geometry::Camera;
use silmap_map::CoarseHull;

use super::item_buffer::ItemBuffer;
use silmap_geometry::raster::ImageTriangle;

/// Faces whose normal is at least this far off the direction to the eye (cosine) are too oblique to take colours from.
const MIN_COSINE: f64 = 0.15;

/// Share of the depth by which a face may lie behind what the hull's item buffer shows: shared edges, single precision.
const HULL_SLACK_REL: f64 = 1e-4;

/// How far the original may lie in front of P(v) without hiding it, as a share of the bounding radius: the pixel's own
/// width on a slanted surface.
const POINT_SLACK_REL: f64 = 0.015;

/// How far the original may bulge out between the corners, as a share of the face's longest edge, on top of
/// [`POINT_SLACK_REL`].
const BULGE_SLACK_REL: f64 = 0.25;

/// Points of a face are taken on a lattice of this many steps an edge.
const LATTICE_STEPS: u32 = 4;

/// The hull in double precision, with what visibility needs.
#[derive(Debug)]
pub struct HullFaces {
    /// Corners of each face, object space.
    pub corners: Vec<[DVec3; 3]>,
    /// P(v) at the corners.
    pub surface_corners: Vec<[DVec3; 3]>,
    /// Unit normals that point outwards.
    pub normals: Vec<DVec3>,
    /// Areas of the faces.
    pub areas: Vec<f64>,
}

impl HullFaces {
    /// A hull without P(v) stands for itself.
    #[must_use]
    pub fn new(hull: &CoarseHull) -> Self {
        let double = |points: &[[f32; 3]], v: u32| {
            points
                .get(v as usize)
                .or_else(|| hull.positions.get(v as usize))
                .map_or(DVec3::ZERO, |p| DVec3::from_array(p.map(f64::from)))
        };
        let all = |points: &[[f32; 3]]| -> Vec<[DVec3; 3]> {
            let face = |f: &[u32; 3]| f.map(|v| double(points, v));
            hull.faces.iter().map(face).collect()
        };
        let corners = all(&hull.positions);
        let crosses: Vec<DVec3> = corners
            .iter()
            .map(|[a, b, c]| (*b - *a).cross(*c - *a))
            .collect();
        Self {
            surface_corners: all(&hull.surface_points),
            normals: crosses.iter().map(|n| n.normalize_or_zero()).collect(),
            areas: crosses.iter().map(|n| 0.5 * n.length()).collect(),
            corners,
        }
    }

    /// How many faces.
    #[must_use]
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Cosine between a face's normal and the direction from its middle to the eye.
    #[must_use]
    pub fn cosine(&self, face: usize, eye: DVec3) -> f64 {
        let [a, b, c] = self.corners[face];
        let to_eye = eye - (a + b + c) / 3.0;
        to_eye.normalize_or_zero().dot(self.normals[face])
    }
}

/// For each hull face whether `camera` may paint it. `original` is the item buffer of the original at the camera's size and
/// `radius` the original's bounding radius.
pub(super) fn paintable_faces(
    hull: &HullFaces,
    original: &ItemBuffer,
    camera: &Camera,
    radius: f64,
) -> Vec<bool> {
    let own = ItemBuffer::draw(camera, hull.len(), |f| hull.corners[f]);
    (0..hull.len())
        .map(|face| {
            hull.cosine(face, camera.eye) >= MIN_COSINE
                && is_whole_face_in_front(hull.corners[face], &own, camera)
                && shows_own_surface(hull.surface_corners[face], original, camera, radius)
        })
        .collect()
}

fn is_whole_face_in_front(corners: [DVec3; 3], own: &ItemBuffer, camera: &Camera) -> bool {
    let Some(triangle) = ImageTriangle::project(camera, corners) else {
        return false;
    };
    let size = camera.size();
    let is_in_image = corners.iter().all(|&p| {
        let p = camera.image_from_object(p);
        p.cmpge(glam::DVec2::ZERO).all() && p.cmple(size).all()
    });
    let mut is_seen = is_in_image;
    let mut is_sampled = false;
    triangle.visit(camera, |sample| {
        is_sampled = true;
        is_seen &= sample.inverse_depth >= own.inverse_depth(sample.pixel) * (1.0 - HULL_SLACK_REL);
    });
    if is_sampled {
        return is_seen;
    }
    // Smaller than a pixel: its middle must not lie behind everything around.
    let middle = corners.iter().copied().sum::<DVec3>() / 3.0;
    let around = own.farthest_around(camera.image_from_object(middle));
    is_seen && camera.depth(middle) <= around * (1.0 + HULL_SLACK_REL)
}

/// Weights of a face's corners at the places where it is looked at.
pub(super) fn lattice() -> impl Iterator<Item = [f64; 3]> {
    (0..=LATTICE_STEPS)
        .flat_map(|i| (0..=LATTICE_STEPS - i).map(move |j| [i, j, LATTICE_STEPS - i - j]))
        .map(|steps| steps.map(|s| f64::from(s) / f64::from(LATTICE_STEPS)))
}

fn shows_own_surface(
    points: [DVec3; 3],
    original: &ItemBuffer,
    camera: &Camera,
    radius: f64,
) -> bool {
    // P(v) turned over in the image would mirror the picture on the face.
    if ImageTriangle::project(camera, points).is_none() {
        return false;
    }
    let longest = (0..3)
        .map(|k| points[k].distance(points[(k + 1) % 3]))
        .fold(0.0, f64::max);
    lattice().all(|weights| {
        let point: DVec3 = (0..3).map(|k| points[k] * weights[k]).sum();
        let is_corner = weights.contains(&1.0);
        let bulge = if is_corner {
            0.0
        } else {
            BULGE_SLACK_REL * longest
        };
        let slack = POINT_SLACK_REL * radius + bulge;
        camera.depth(point) <= original.farthest_around(camera.image_from_object(point)) + slack
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares that face +Z, the second `offset` in front of the first and shifted by `shift` along x.
    fn squares(offset: f64, shift: f64) -> (Vec<[DVec3; 3]>, HullFaces) {
        let mut corners = Vec::new();
        for (z, dx) in [(0.0, 0.0), (offset, shift)] {
            let [a, b, c, d] = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
                .map(|(x, y)| DVec3::new(0.8 * x + dx, 0.8 * y, z));
            corners.extend([[a, b, c], [a, c, d]]);
        }
        let positions: Vec<[f32; 3]> = corners
            .iter()
            .flatten()
            .map(|p| p.as_vec3().to_array())
            .collect();
        let hull = CoarseHull {
            faces: (0..4).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
            surface_points: positions.clone(),
            positions,
            volume_ratio: 1.0,
        };
        (corners, HullFaces::new(&hull))
    }

    fn camera(eye: DVec3) -> Camera {
        Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (128, 128)).unwrap()
    }

    fn paintable(hull: &HullFaces, original: &[[DVec3; 3]], eye: DVec3) -> Vec<bool> {
        let camera = camera(eye);
        let buffer = ItemBuffer::draw(&camera, original.len(), |f| original[f]);
        paintable_faces(hull, &buffer, &camera, 1.0)
    }

    #[test]
    fn free_faces_are_seen_from_the_front_only() {
        let (corners, hull) = squares(0.0, 0.0);
        let seen = |eye| paintable(&hull, &corners, eye);
        assert_eq!(seen(DVec3::new(0.3, 0.2, 3.0)), [true; 4]);
        assert_eq!(seen(DVec3::new(0.3, 0.2, -3.0)), [false; 4]);
        assert_eq!(seen(DVec3::new(3.0, 0.2, 0.1)), [false; 4], "too oblique");
    }

    #[test]
    fn an_occluder_hides_a_face_even_in_part() {
        let eye = DVec3::new(0.0, 0.0, 3.0);
        for shift in [0.0, 0.4, -0.4] {
            let (corners, hull) = squares(0.4, shift);
            let seen = paintable(&hull, &corners, eye);
            assert!(!(seen[0] && seen[1]), "hidden by shift {shift}: {seen:?}");
            assert!(seen[2] && seen[3], "the one in front: {seen:?}");
        }
        // Far enough aside it hides nothing.
        let (corners, hull) = squares(0.4, 2.0);
        assert!(paintable(&hull, &corners, eye)[..2].iter().all(|&s| s));
    }

    #[test]
    fn something_of_the_original_in_front_of_the_surface_point_hides_the_face() {
        let (corners, mut hull) = squares(0.0, 0.0);
        let eye = DVec3::new(0.0, 0.0, 3.0);
        assert_eq!(paintable(&hull, &corners, eye), [true; 4]);
        // P(v) half a radius behind the visible surface.
        for p in hull.surface_corners[1].iter_mut() {
            p.z -= 0.5;
        }
        assert_eq!(paintable(&hull, &corners, eye), [true, false, true, true]);
    }
}
