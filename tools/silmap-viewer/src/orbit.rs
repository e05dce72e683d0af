//! The camera that turns about a target: orbit, pan, zoom, roll, and the standard views.

use glam::{DQuat, DVec2, DVec3};
use silmap_geometry::Camera;
use silmap_map::BoundingSphere;

/// The vertical field of view that a scene is first seen by, radians.
pub const FOV_Y_RAD: f64 = 35.0 * std::f64::consts::PI / 180.0;

/// The narrowest field of view that zooming leads to, radians.
const LEAST_FOV_RAD: f64 = 0.4 * std::f64::consts::PI / 180.0;

/// The eye stays this far from the model's middle, in radii of its sphere: silhouettes are those that are seen from outside.
const LEAST_DISTANCE_REL: f64 = 1.05;

/// As far as the eye goes, in radii.
const MOST_DISTANCE_REL: f64 = 200.0;

/// Room around a model that is framed.
const FRAME_MARGIN: f64 = 1.08;

/// A camera on a sphere about a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// What is looked at, object space.
    pub target: DVec3,
    /// From the target to the eye, model units.
    pub distance: f64,
    /// The unit direction that is upwards where nothing is rolled. The axes of angles are turned with it from y the shortest way.
    pub upwards: DVec3,
    /// About the y axis, from +z towards +x, radians.
    pub azimuth_rad: f64,
    /// Above the plane y = 0, −π/2 to π/2.
    pub elevation_rad: f64,
    /// Of the camera about its line of sight, clockwise, radians.
    pub roll_rad: f64,
    /// Vertical field of view, radians.
    pub fov_y_rad: f64,
}

/// A side to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From +z.
    Front,
    /// From −z.
    Back,
    /// From −x.
    Left,
    /// From +x.
    Right,
    /// From +y.
    Top,
    /// From −y.
    Bottom,
}

impl StandardView {
    /// All, in the order of the keys 1 to 6.
    pub const ALL: [Self; 6] = [
        Self::Front,
        Self::Back,
        Self::Left,
        Self::Right,
        Self::Top,
        Self::Bottom,
    ];

    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Back => "Back",
            Self::Left => "Left",
            Self::Right => "Right",
            Self::Top => "Top",
            Self::Bottom => "Bottom",
        }
    }

    /// Azimuth and elevation, radians.
    fn angles(self) -> (f64, f64) {
        use std::f64::consts::{FRAC_PI_2, PI};
        match self {
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Left => (-FRAC_PI_2, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Top => (0.0, FRAC_PI_2),
            Self::Bottom => (0.0, -FRAC_PI_2),
        }
    }
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            target: DVec3::ZERO,
            distance: 4.0,
            upwards: DVec3::Y,
            azimuth_rad: 0.46,
            elevation_rad: 0.3,
            roll_rad: 0.0,
            fov_y_rad: FOV_Y_RAD,
        }
    }
}

impl Orbit {
    /// The unit direction from the target to the eye.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        let (sin_a, cos_a) = self.azimuth_rad.sin_cos();
        let (sin_e, cos_e) = self.elevation_rad.sin_cos();
        self.basis() * DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)
    }

    /// From the axes of the angles to those of space.
    fn basis(&self) -> DQuat {
        DQuat::from_rotation_arc(DVec3::Y, self.upwards)
    }

    /// The eye, object space.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.target + self.direction() * self.distance
    }

    /// Right and up of the picture, unit vectors. They are known over the poles too.
    #[must_use]
    pub fn frame_axes(&self) -> (DVec3, DVec3) {
        let (sin_a, cos_a) = self.azimuth_rad.sin_cos();
        let (sin_e, cos_e) = self.elevation_rad.sin_cos();
        let basis = self.basis();
        let right = basis * DVec3::new(cos_a, 0.0, -sin_a);
        let up = basis * DVec3::new(-sin_a * sin_e, cos_e, -cos_a * sin_e);
        let (sin_r, cos_r) = self.roll_rad.sin_cos();
        (right * cos_r - up * sin_r, right * sin_r + up * cos_r)
    }

    /// The camera of a picture; its size is at least a pixel.
    #[must_use]
    pub fn camera(&self, (width_px, height_px): (u32, u32)) -> Camera {
        let (right, up) = self.frame_axes();
        let (width_px, height_px) = (width_px.max(1), height_px.max(1));
        let tangent = (self.fov_y_rad / 2.0).tan();
        Camera {
            eye: self.eye(),
            right,
            up,
            forward: -self.direction(),
            half_tangent: DVec2::new(
                tangent * f64::from(width_px) / f64::from(height_px),
                tangent,
            ),
            center_offset: DVec2::ZERO,
            width_px,
            height_px,
        }
    }

    /// The same upwards, of an eye that looks at a target with `up` upwards in the picture, as nearly as may be.
    #[must_use]
    pub fn looking(&self, eye: DVec3, target: DVec3, up: Option<DVec3>, fov_y_rad: f64) -> Self {
        let arm = eye - target;
        let distance = arm.length();
        let Some(direction) = arm.try_normalize() else {
            return Self { target, ..*self };
        };
        let direction = self.basis().inverse() * direction;
        let mut orbit = Self {
            target,
            distance,
            upwards: self.upwards,
            azimuth_rad: direction.x.atan2(direction.z),
            elevation_rad: direction.y.clamp(-1.0, 1.0).asin(),
            roll_rad: 0.0,
            fov_y_rad,
        };
        if let Some(up) = up {
            let (right, own_up) = orbit.frame_axes();
            let (x, y) = (up.dot(right), up.dot(own_up));
            if x.hypot(y) > 1e-9 * up.length() {
                orbit.roll_rad = x.atan2(y);
            }
        }
        orbit
    }

    /// Turns about the target as the picture is dragged by so many pixels of `height_px`.
    pub fn orbit(&mut self, drag_px: DVec2, height_px: f64) {
        // Half a turn for the height of the picture.
        let by = drag_px * std::f64::consts::PI / height_px.max(1.0);
        let (sin_r, cos_r) = self.roll_rad.sin_cos();
        let (x, y) = (by.x * cos_r - by.y * sin_r, by.y * cos_r + by.x * sin_r);
        let pole = std::f64::consts::FRAC_PI_2;
        self.azimuth_rad = wrapped(self.azimuth_rad - x);
        self.elevation_rad = (self.elevation_rad + y).clamp(-pole, pole);
    }

    /// Moves the target with the picture, so that what is at its depth stays under the pointer.
    pub fn pan(&mut self, drag_px: DVec2, height_px: f64) {
        let (right, up) = self.frame_axes();
        let per_px = 2.0 * (self.fov_y_rad / 2.0).tan() * self.distance / height_px.max(1.0);
        self.target += (up * drag_px.y - right * drag_px.x) * per_px;
    }

    /// Turns the picture about its middle.
    pub fn roll(&mut self, by_rad: f64) {
        self.roll_rad = wrapped(self.roll_rad + by_rad);
    }

    /// Makes what is seen larger by a factor: the eye comes nearer as far as it may, and then the field of view narrows.
    pub fn zoom(&mut self, factor: f64, sphere: BoundingSphere) {
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let mut rest = factor;
        // The way back is the same: first the field of view widens again.
        if rest < 1.0 && self.fov_y_rad < FOV_Y_RAD {
            let tangent = (self.fov_y_rad / 2.0).tan();
            let wide = (FOV_Y_RAD / 2.0).tan();
            let widened = (tangent / rest).min(wide);
            rest *= widened / tangent;
            self.fov_y_rad = 2.0 * widened.atan();
        }
        let wanted = self.distance / rest;
        self.distance = wanted;
        self.keep_outside(sphere);
        if self.distance > wanted && rest > 1.0 {
            let tangent = (self.fov_y_rad / 2.0).tan() * wanted / self.distance;
            self.fov_y_rad = (2.0 * tangent.atan()).max(LEAST_FOV_RAD);
        }
    }

    /// Moves the eye back, where it is too near to the sphere, and the target, where it is out of reach.
    pub fn keep_outside(&mut self, sphere: BoundingSphere) {
        let reach = MOST_DISTANCE_REL * sphere.radius;
        let off = self.target - sphere.center;
        if off.length() > reach {
            self.target = sphere.center + off.normalize_or_zero() * reach;
        }
        self.distance = self.distance.min(2.0 * reach).max(1e-6 * sphere.radius);
        let least = LEAST_DISTANCE_REL * sphere.radius;
        if self.eye().distance(sphere.center) < least {
            // Where the ray from the target through the eye leaves the sphere.
            let off = self.target - sphere.center;
            let along = off.dot(self.direction());
            let inside = along * along - off.length_squared() + least * least;
            self.distance = (-along + inside.max(0.0).sqrt()) * (1.0 + 1e-9);
        }
    }

    /// Looks at the whole sphere from where the camera is turned to.
    pub fn frame(&mut self, sphere: BoundingSphere, aspect: f64) {
        self.target = sphere.center;
        self.fov_y_rad = FOV_Y_RAD;
        let tangent = (self.fov_y_rad / 2.0).tan() * aspect.clamp(1e-3, 1.0);
        let sine = tangent / tangent.hypot(1.0);
        self.distance = FRAME_MARGIN * sphere.radius / sine;
        self.keep_outside(sphere);
    }

    /// Looks from a side, without roll.
    pub fn look_from(&mut self, view: StandardView) {
        (self.azimuth_rad, self.elevation_rad) = view.angles();
        self.roll_rad = 0.0;
    }
}

/// An angle between −π and π.
fn wrapped(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let once = (angle_rad + std::f64::consts::PI).rem_euclid(turn);
    once - std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: BoundingSphere = BoundingSphere {
        center: DVec3::new(1.0, 2.0, -3.0),
        radius: 2.0,
    };

    #[test]
    fn a_camera_is_orthonormal_over_the_poles_too() {
        for view in StandardView::ALL {
            let mut orbit = Orbit::default();
            orbit.look_from(view);
            orbit.roll(0.7);
            let camera = orbit.camera((640, 480));
            let cross = camera.right.cross(camera.up);
            assert!(cross.distance(-camera.forward) < 1e-12, "{view:?}");
            assert!((camera.right.length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_upwards_is_up_in_the_picture() {
        for upwards in [DVec3::Y, DVec3::Z, DVec3::NEG_Y, DVec3::new(0.6, 0.0, -0.8)] {
            let mut orbit = Orbit {
                upwards,
                ..Orbit::default()
            };
            let (right, up) = orbit.frame_axes();
            assert!(right.dot(upwards).abs() < 1e-12 && up.dot(upwards) > 0.9);
            orbit.look_from(StandardView::Top);
            assert!(orbit.direction().distance(upwards) < 1e-12);
        }
    }

    #[test]
    fn an_orbit_is_the_same_after_it_was_told_by_eye_target_and_up() {
        let mut orbit = Orbit {
            target: DVec3::new(0.5, -1.0, 0.25),
            ..Orbit::default()
        };
        let upwards = [DVec3::Y, DVec3::Z, DVec3::new(0.48, -0.6, 0.64)];
        for ((azimuth_rad, elevation_rad, roll_rad), upwards) in
            [(0.4, 0.3, 0.0), (-2.9, -1.2, 0.8), (3.0, 0.0, -2.5)]
                .into_iter()
                .flat_map(|angles| upwards.map(|upwards| (angles, upwards)))
        {
            orbit = Orbit {
                upwards,
                azimuth_rad,
                elevation_rad,
                roll_rad,
                ..orbit
            };
            let (_, up) = orbit.frame_axes();
            let again = orbit.looking(orbit.eye(), orbit.target, Some(up), orbit.fov_y_rad);
            assert!(again.eye().distance(orbit.eye()) < 1e-12);
            assert!((again.roll_rad - roll_rad).abs() < 1e-9, "{again:?}");
        }
    }

    #[test]
    fn zooming_in_and_out_leads_back_and_never_into_the_model() {
        let mut orbit = Orbit::default();
        orbit.frame(SPHERE, 1.0);
        let before = orbit;
        for _ in 0..60 {
            orbit.zoom(1.2, SPHERE);
            assert!(orbit.eye().distance(SPHERE.center) >= 1.049 * SPHERE.radius);
        }
        assert!(orbit.fov_y_rad <= 2.0 * LEAST_FOV_RAD, "it magnifies");
        for _ in 0..80 {
            orbit.zoom(1.0 / 1.2, SPHERE);
        }
        assert!(orbit.distance > before.distance);
        assert!((orbit.fov_y_rad - FOV_Y_RAD).abs() < 1e-9);
    }

    #[test]
    fn what_is_dragged_stays_under_the_pointer() {
        let mut orbit = Orbit::default();
        orbit.roll(0.5);
        let camera = orbit.camera((400, 300));
        let point = orbit.target;
        orbit.pan(DVec2::new(30.0, -12.0), 300.0);
        let moved = orbit.camera((400, 300)).image_from_object(point);
        let was = camera.image_from_object(point);
        assert!((moved - was - DVec2::new(30.0, -12.0)).length() < 1e-9);
    }

    #[test]
    fn a_drag_to_the_right_turns_the_near_side_to_the_right() {
        for roll in [0.0, 1.0, -2.0] {
            let mut orbit = Orbit {
                elevation_rad: 0.0,
                ..Orbit::default()
            };
            orbit.roll(roll);
            let near = orbit.target + orbit.direction();
            let was = orbit.camera((300, 300)).image_from_object(near);
            orbit.orbit(DVec2::new(5.0, 0.0), 300.0);
            let now = orbit.camera((300, 300)).image_from_object(near);
            assert!(now.x > was.x + 1.0, "{roll}: {was} {now}");
            assert!((now.y - was.y).abs() < 0.5, "{roll}: {was} {now}");
        }
    }

    #[test]
    fn a_framed_sphere_fits_in_wide_and_tall_pictures() {
        for size in [(800, 300), (300, 800), (500, 500)] {
            let mut orbit = Orbit::default();
            orbit.frame(SPHERE, f64::from(size.0) / f64::from(size.1));
            let camera = orbit.camera(size);
            for axis in [camera.right, camera.up, -camera.right, -camera.up] {
                // The outline of the sphere is nearer to the eye than its middle.
                let sine = SPHERE.radius / orbit.distance;
                let rim = axis * (1.0 - sine * sine).sqrt() - camera.forward * sine;
                let p = camera.image_from_object(SPHERE.center + rim * SPHERE.radius);
                let inside = p.x >= 0.0 && p.y >= 0.0;
                assert!(inside && p.x <= f64::from(size.0) && p.y <= f64::from(size.1));
            }
        }
    }
}
