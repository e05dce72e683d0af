//! Views of lights, for passes that draw the depths of shadow casters.

use glam::{DMat4, DVec3, DVec4};
use silmap_geometry::{Camera, CameraError};
use silmap_map::BoundingSphere;
use thiserror::Error;

use crate::{DepthDirection, View};

/// Room before and behind the sphere, as a factor on its radius.
const DEPTH_ROOM: f64 = 1.01;

/// Texels left free at each side of the picture, so that what is read beside the sphere is lit.
const FREE_TEXELS: f64 = 2.0;

/// Why a light has no view.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LightError {
    /// The direction to the light is zero or not finite.
    #[error("the direction to the light is zero or not finite")]
    NoDirection,
    /// The sphere that is to be seen has no radius, or a number that is not finite.
    #[error("the light has nothing to fall on: a sphere of radius {radius}")]
    NoSphere {
        /// Its radius.
        radius: f64,
    },
    /// A spot in the sphere, or one that is not a place.
    #[error("the light's place cannot be used: {0}")]
    Spot(#[from] CameraError),
}

impl View {
    /// What a light infinitely far away sees: a sphere, such as that about all instances, fills a square picture, but for two texels at each
    /// side. `to_light` is the direction to the light, of any length.
    ///
    /// # Errors
    /// When the direction is zero, or a number is not finite.
    pub fn directional(
        to_light: DVec3,
        sphere: BoundingSphere,
        side_px: u32,
        depth: DepthDirection,
    ) -> Result<Self, LightError> {
        let scale = to_light.abs().max_element();
        let direction = (to_light / scale).try_normalize();
        let forward = -direction.ok_or(LightError::NoDirection)?;
        check(&sphere)?;
        let right = forward.any_orthonormal_vector();
        let up = right.cross(forward);
        let row = |axis: DVec3, middle: f64, reach: f64| {
            (axis / reach).extend(middle - axis.dot(sphere.center) / reach)
        };
        let across = sphere.radius * room(side_px);
        let deep = 2.0 * DEPTH_ROOM * sphere.radius;
        let matrix = DMat4::from_cols(
            row(right, 0.0, across),
            row(up, 0.0, across),
            row(forward, 0.5, deep),
            DVec4::W,
        );
        Ok(Self::of_light(matrix.transpose(), side_px, depth))
    }

    /// What a light at a place outside of a sphere sees of it, as [`View::directional`].
    ///
    /// # Errors
    /// When the place is in the sphere, or a number is not finite.
    pub fn spot(
        place: DVec3,
        sphere: BoundingSphere,
        side_px: u32,
        depth: DepthDirection,
    ) -> Result<Self, LightError> {
        check(&sphere)?;
        let size_px = (side_px.max(1), side_px.max(1));
        let mut camera = Camera::fit_sphere(place, sphere.center, sphere.radius, None, size_px)?;
        camera.half_tangent *= room(side_px) / silmap_geometry::camera::FIT_MARGIN;
        let distance = place.distance(sphere.center);
        // What the sphere leaves between it and the light, whatever the rounding.
        let near = (distance - DEPTH_ROOM * sphere.radius).max(0.5 * (distance - sphere.radius));
        let matrix = camera.clip_from_object(near, distance + DEPTH_ROOM * sphere.radius);
        Ok(Self::of_light(matrix, side_px, depth))
    }

    fn of_light(matrix: DMat4, side_px: u32, depth: DepthDirection) -> Self {
        let clip_from_world = match depth {
            DepthDirection::Forward => matrix,
            DepthDirection::Reversed => {
                let [x, y, z, w] = [0, 1, 2, 3].map(|i| matrix.row(i));
                DMat4::from_cols(x, y, w - z, w).transpose()
            }
        };
        Self {
            clip_from_world,
            size_px: (side_px, side_px),
        }
    }
}

/// How much larger than the sphere the picture is.
fn room(side_px: u32) -> f64 {
    let side = f64::from(side_px);
    side / (side - 2.0 * FREE_TEXELS).max(0.5 * side).max(1.0)
}

fn check(sphere: &BoundingSphere) -> Result<(), LightError> {
    let radius = sphere.radius;
    let is_sphere = sphere.center.is_finite() && radius.is_finite() && radius > 0.0;
    if is_sphere {
        Ok(())
    } else {
        Err(LightError::NoSphere { radius })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4Swizzles;
    use proptest::prelude::*;

    const SIDE_PX: u32 = 256;

    proptest! {
        /// The sphere is in the picture, fills it but for the room, and lies between the planes; the eye is the light.
        #[test]
        fn a_light_sees_the_whole_sphere(
            to_light in (-1.0..1.0_f64, -1.0..1.0_f64, 0.1..1.0_f64), x in -1e4..1e4_f64, radius in 1e-3..1e3_f64,
            distance_rel in 1.01..1e3_f64, turn in 0.0..6.2_f64, is_spot: bool, is_reversed: bool,
        ) {
            let direction = DVec3::from(to_light).normalize_or_zero();
            let sphere = BoundingSphere { center: DVec3::new(x, -0.4 * x, 3.0), radius };
            let depth = if is_reversed { DepthDirection::Reversed } else { DepthDirection::Forward };
            let place = sphere.center + direction * radius * distance_rel;
            let view = if is_spot {
                View::spot(place, sphere, SIDE_PX, depth)
            } else {
                View::directional(direction * 7.0, sphere, SIDE_PX, depth)
            };
            let view = view.unwrap();
            let eye = view.eye(depth).unwrap().place;
            let wanted = if is_spot { place.extend(1.0) } else { direction.extend(0.0) };
            prop_assert_eq!(eye.w, wanted.w);
            prop_assert!(eye.xyz().distance(wanted.xyz()) < 1e-6 * (1.0 + x.abs() + radius * distance_rel));
            let seen = |p: DVec3| view.clip_from_world.project_point3(p);
            let nearest = seen(sphere.center + direction * radius).z;
            let farthest = seen(sphere.center - direction * radius).z;
            prop_assert!((0.0..=1.0).contains(&nearest) && (0.0..=1.0).contains(&farthest));
            prop_assert_eq!(nearest > farthest, is_reversed);
            let sine = if is_spot { 1.0 / distance_rel } else { 0.0 };
            let across = direction.any_orthonormal_vector();
            let around = across * turn.cos() + direction.cross(across) * turn.sin();
            let rim = sphere.center + radius * (direction * sine + around * (1.0 - sine * sine).sqrt());
            let reach_px = seen(rim).truncate().length() * 0.5 * f64::from(SIDE_PX);
            let wanted_px = 0.5 * f64::from(SIDE_PX) - FREE_TEXELS;
            prop_assert!((reach_px - wanted_px).abs() < 1e-3, "{reach_px}");
        }
    }

    #[test]
    fn what_is_no_light_is_refused() {
        let sphere = BoundingSphere {
            center: DVec3::ZERO,
            radius: 1.0,
        };
        let forward = DepthDirection::Forward;
        for direction in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            let refused = View::directional(direction, sphere, 64, forward);
            assert_eq!(refused, Err(LightError::NoDirection), "{direction}");
        }
        let inside = View::spot(DVec3::splat(0.1), sphere, 64, forward);
        assert!(matches!(inside, Err(LightError::Spot(_))), "{inside:?}");
        for radius in [0.0, -1.0, f64::NAN] {
            let nothing = BoundingSphere { radius, ..sphere };
            let refused = View::directional(DVec3::Y, nothing, 64, forward);
            assert!(
                matches!(refused, Err(LightError::NoSphere { .. })),
                "{radius}"
            );
        }
    }
}
