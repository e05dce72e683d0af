//! A camera that flies: keys move it, the mouse turns it.

use glam::dcamera::rh::proj::directx::perspective_infinite_reverse;
use glam::dcamera::rh::view::look_to_mat4;
use glam::{DMat4, DVec3};
use winit::keyboard::KeyCode;

const FOV_Y_RAD: f64 = 0.9;
/// Distance of the near plane; the far one is infinitely far.
const NEAR: f64 = 0.1;
/// Radii of a model a second.
const SPEED: f64 = 6.0;
const RAD_PER_PX: f64 = 0.004;
/// By how much it turns in a frame where it walks by itself.
const STEP_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// A place, a direction, and the keys that are held.
#[derive(Debug)]
pub(crate) struct FlyCamera {
    eye: DVec3,
    /// Angles of the direction: about the upright, from −z to the left; and up.
    yaw_rad: f64,
    pitch_rad: f64,
    held: Vec<KeyCode>,
}

impl Default for FlyCamera {
    fn default() -> Self {
        Self {
            eye: DVec3::new(0.0, 5.0, 24.0),
            yaw_rad: 0.0,
            pitch_rad: -0.25,
            held: Vec::new(),
        }
    }
}

impl FlyCamera {
    pub(crate) fn key(&mut self, code: KeyCode, is_pressed: bool) {
        self.held.retain(|&held| held != code);
        if is_pressed {
            self.held.push(code);
        }
    }

    pub(crate) fn release_all(&mut self) {
        self.held.clear();
    }

    /// Turns by a move of the mouse, in pixels.
    pub(crate) fn look(&mut self, x_px: f64, y_px: f64) {
        self.yaw_rad -= x_px * RAD_PER_PX;
        self.pitch_rad = (self.pitch_rad - y_px * RAD_PER_PX).clamp(-1.5, 1.5);
    }

    /// Moves as the keys say.
    pub(crate) fn fly(&mut self, seconds: f64) {
        let is_held = |code| self.held.contains(&code);
        let axis = |more, less| f64::from(i8::from(is_held(more)) - i8::from(is_held(less)));
        let forward = self.forward();
        let right = forward.cross(DVec3::Y).normalize_or_zero();
        let way = forward * axis(KeyCode::KeyW, KeyCode::KeyS)
            + right * axis(KeyCode::KeyD, KeyCode::KeyA)
            + DVec3::Y * axis(KeyCode::KeyE, KeyCode::KeyQ);
        let is_fast = is_held(KeyCode::ShiftLeft) || is_held(KeyCode::ShiftRight);
        let speed = if is_fast { 5.0 * SPEED } else { SPEED };
        self.eye += way.normalize_or_zero() * speed * seconds;
        self.eye.y = self.eye.y.max(2.0 * NEAR);
    }

    /// Goes one step around the middle of the scene.
    pub(crate) fn walk(&mut self) {
        self.yaw_rad += STEP_RAD;
        let (sin, cos) = STEP_RAD.sin_cos();
        let DVec3 { x, y, z } = self.eye;
        self.eye = DVec3::new(x * cos + z * sin, y, z * cos - x * sin);
    }

    /// From the world to clip space, with reversed depth.
    pub(crate) fn clip_from_world(&self, aspect: f64) -> DMat4 {
        perspective_infinite_reverse(FOV_Y_RAD, aspect, NEAR)
            * look_to_mat4(self.eye, self.forward(), DVec3::Y)
    }

    fn forward(&self) -> DVec3 {
        let (sin, cos) = self.yaw_rad.sin_cos();
        let level = self.pitch_rad.cos();
        DVec3::new(-sin * level, self.pitch_rad.sin(), -cos * level)
    }
}
