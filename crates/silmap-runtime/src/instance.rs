//! One thing to draw: an asset somewhere in the world.

use glam::{DMat3, DMat4, DQuat, DVec3};
use thiserror::Error;

use crate::LoadedAsset;

/// Where an instance is: rotated, scaled alike in all directions, and moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    pub(crate) rotation: DQuat,
    pub(crate) scale: f64,
    pub(crate) translation: DVec3,
}

/// Why something is no [`Transform`].
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TransformError {
    /// A number is NaN or infinite.
    #[error("a number of the transform is not finite")]
    NotFinite,
    /// It shears, mirrors, or scales differently in different directions.
    #[error(
        "an instance can be rotated, moved and scaled by one positive factor: its outline is not known otherwise"
    )]
    NotSimilar,
}

/// How much the columns of a matrix may differ from a rotation's.
const SIMILAR_REL: f64 = 1e-4;

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        scale: 1.0,
        translation: DVec3::ZERO,
    };

    /// First scaled, then rotated, then moved.
    ///
    /// # Errors
    /// When a number is not finite, the scale is not positive, or the rotation is zero.
    pub fn new(scale: f64, rotation: DQuat, translation: DVec3) -> Result<Self, TransformError> {
        if !(scale.is_finite() && rotation.is_finite() && translation.is_finite()) {
            return Err(TransformError::NotFinite);
        }
        let length = rotation.length();
        if scale <= 0.0 || (length - 1.0).abs() > SIMILAR_REL {
            return Err(TransformError::NotSimilar);
        }
        Ok(Self {
            rotation: rotation.normalize(),
            scale,
            translation,
        })
    }

    /// The transform that a matrix is.
    ///
    /// # Errors
    /// When a number is not finite, or the matrix does anything but rotate, move and scale by one positive factor.
    pub fn from_matrix(matrix: DMat4) -> Result<Self, TransformError> {
        if !matrix.is_finite() {
            return Err(TransformError::NotFinite);
        }
        let linear = DMat3::from_mat4(matrix);
        let scale = linear.determinant().cbrt();
        let is_affine = matrix.row(3) == glam::DVec4::W;
        if !is_affine || scale <= 0.0 {
            return Err(TransformError::NotSimilar);
        }
        let rotation = linear * (1.0 / scale);
        let off = rotation.transpose() * rotation - DMat3::IDENTITY;
        let is_rotation = off.to_cols_array().iter().all(|x| x.abs() <= SIMILAR_REL);
        if !is_rotation {
            return Err(TransformError::NotSimilar);
        }
        Self::new(
            scale,
            DQuat::from_mat3(&rotation).normalize(),
            matrix.w_axis.truncate(),
        )
    }

    /// Where a point of the object is in the world.
    #[must_use]
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.rotation * (point * self.scale) + self.translation
    }

    /// Where a point of the world is in the object.
    #[must_use]
    pub fn object_point(&self, point: DVec3) -> DVec3 {
        self.rotation.inverse() * (point - self.translation) / self.scale
    }

    /// A unit direction of the world in the object.
    #[must_use]
    pub fn object_direction(&self, direction: DVec3) -> DVec3 {
        self.rotation.inverse() * direction
    }

    /// The matrix from the object, whose points are relative to `origin`.
    #[must_use]
    pub fn matrix(&self, origin: DVec3) -> DMat4 {
        DMat4::from_scale_rotation_translation(
            DVec3::splat(self.scale),
            self.rotation,
            self.point(origin),
        )
    }
}

/// What the hull shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Paint {
    /// The texture views nearest to the eye, blended so that nothing pops; tiles of the atlas where no view sees the face.
    Blended,
    /// The paper's: the one nearest texture view that sees the face; tiles where none does.
    Nearest,
    /// The blended texture views alone; lit where none sees the face.
    Views,
    /// The atlas alone, as in any glTF viewer.
    Tiles,
    /// No texture: one colour in a studio light.
    Lit,
    /// The model's surface within the hull, as depths of the texture views have it: its colours, at its place and with its depth. Where the
    /// asset has no such depths, or [`RendererOptions::relief`](crate::RendererOptions::relief) says so, as [`Paint::Blended`].
    #[default]
    Relief,
}

/// Loops in the space of an asset's object, as an outline of one's own: seen from the eye that draws, they hold the points about which
/// they wind a number of times other than zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpaceLoops {
    /// Closed loops of three or more points each; others are left out. Where none is left nothing is drawn.
    pub loops: Vec<Vec<DVec3>>,
}

/// What an instance is clipped by.
#[derive(Clone, Copy, Debug, Default)]
pub enum Outline<'a> {
    /// The outline that its asset has for the eye. Within the model's bounding sphere there is none, and the hull is drawn whole.
    #[default]
    OfAsset,
    /// Another one, for this frame.
    Given(&'a SpaceLoops),
    /// None: the whole hull.
    Whole,
}

/// One thing to draw.
#[derive(Clone, Copy, Debug)]
pub struct Instance<'a> {
    /// What it is.
    pub asset: &'a LoadedAsset,
    /// Where it is.
    pub transform: Transform,
    /// What it shows.
    pub paint: Paint,
    /// What clips it.
    pub outline: Outline<'a>,
    /// The direction in the world to a light that shines on it instead of its own, of any length: the studio light that its pictures were
    /// made by is divided out by the model's normals, and a surface gets [`AMBIENT`](silmap_geometry::lighting::AMBIENT) of light from
    /// everywhere and the rest by Lambert's cosine. It needs an asset that was [loaded](crate::Renderer::load) with
    /// [`RendererOptions::relight`](crate::RendererOptions::relight) and that [can be relit](LoadedAsset::can_relight); others keep their
    /// own light.
    pub light: Option<DVec3>,
}

impl<'a> Instance<'a> {
    /// An asset in a place.
    #[must_use]
    pub fn new(asset: &'a LoadedAsset, transform: Transform) -> Self {
        Self {
            asset,
            transform,
            paint: Paint::default(),
            outline: Outline::default(),
            light: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_matrix_of_a_transform_is_that_transform(
            axis in (-1.0..1.0_f64, -1.0..1.0_f64, 0.1..1.0_f64), angle in -3.0..3.0_f64,
            scale in 1e-6..1e6_f64, x in -1e6..1e6_f64,
        ) {
            let rotation = DQuat::from_axis_angle(DVec3::from(axis).normalize_or_zero(), angle);
            let transform = Transform::new(scale, rotation, DVec3::new(x, 1.0, -x)).unwrap();
            let again = Transform::from_matrix(transform.matrix(DVec3::ZERO)).unwrap();
            let p = DVec3::new(0.3, -0.2, 0.9);
            let there = transform.point(p);
            prop_assert!(there.distance(again.point(p)) <= 1e-9 * there.length());
            prop_assert!(transform.object_point(there).distance(p) < 1e-6 * (1.0 + x.abs() / scale));
        }
    }

    #[test]
    fn what_changes_the_shape_is_refused() {
        let stretched = DMat4::from_scale(DVec3::new(1.0, 1.0, 1.01));
        let mirrored = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let projected = glam::dcamera::rh::proj::directx::perspective(1.0, 1.0, 0.1, 9.0);
        for matrix in [stretched, mirrored, projected, DMat4::ZERO] {
            let refused = Transform::from_matrix(matrix);
            assert_eq!(refused, Err(TransformError::NotSimilar), "{matrix}");
        }
        let broken = DMat4::from_translation(DVec3::new(0.0, f64::NAN, 0.0));
        assert_eq!(
            Transform::from_matrix(broken),
            Err(TransformError::NotFinite)
        );
        let backwards = Transform::new(-1.0, DQuat::IDENTITY, DVec3::ZERO);
        assert_eq!(backwards, Err(TransformError::NotSimilar));
    }
}
