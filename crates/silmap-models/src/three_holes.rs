//! A smooth surface of genus 3: three tori in a triangle, blended.

use glam::{DVec2, DVec3};

use super::field::{smooth_min, torus_distance};
use super::polygonise::Field;

/// Three tori about axes parallel to z whose centres form an equilateral triangle.
pub(super) struct ThreeHoles;

/// Radius of each torus's core circle.
const RING: f64 = 0.46;
/// Radius of each torus's tube.
const TUBE: f64 = 0.2;
/// Distance of the tori's centres from the origin; less than `RING` + `TUBE`, so that they meet in the middle.
const SPREAD: f64 = 0.56;
/// Width of the blend where tori meet.
const BLEND: f64 = 0.12;

impl Field for ThreeHoles {
    fn value(&self, point: DVec3) -> f64 {
        (0..3).fold(f64::INFINITY, |nearest, k| {
            let angle = std::f64::consts::FRAC_PI_2 + std::f64::consts::TAU * f64::from(k) / 3.0;
            let center = (DVec2::from_angle(angle) * SPREAD).extend(0.0);
            let distance = torus_distance(point - center, RING, TUBE);
            smooth_min(nearest, distance, BLEND)
        })
    }

    fn extent(&self) -> f64 {
        1.1 * (SPREAD + RING + TUBE)
    }

    fn slope_bound(&self) -> f64 {
        // Distances have slope 1, and the blend weighs slopes by positive weights that add up to 1.
        1.0
    }
}
