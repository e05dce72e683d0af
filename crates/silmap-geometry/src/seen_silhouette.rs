//! The outline of an object as somebody saw it: what a capture hands to those who make maps of it.

use glam::{DMat3, DVec2, DVec3};

use crate::Loop;

/// The outline of an object as somebody saw it.
#[derive(Clone, Debug)]
pub struct SeenSilhouette {
    /// What it is called.
    pub name: String,
    /// Where the eye was, in the object's coordinates.
    pub eye: DVec3,
    /// Outer loops and holes of the whole object, in pixels of the image, which they may leave.
    pub outline: Vec<Loop>,
    /// Takes an image point with a 1 appended to the direction of its ray.
    pub ray_from_image: DMat3,
    /// Share of the outline's length that was really seen, between 0 and 1.
    pub photographed: f64,
}

impl SeenSilhouette {
    /// The direction of the ray through an image point.
    #[must_use]
    pub fn ray(&self, image: DVec2) -> DVec3 {
        self.ray_from_image * image.extend(1.0)
    }
}
