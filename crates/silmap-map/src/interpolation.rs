//! Options of an interpolation: the method, the transfer to the eye, the level of detail; and its errors.

use silmap_geometry::CameraError;
use thiserror::Error;

use crate::levels::Detail;
use crate::polytope::PolytopeError;
use crate::rule::method::Method;

/// How an outline seen from the polytope is carried to an eye off it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transfer {
    /// Each contour vertex is a point in space: it is seen where it is. The homography where contours have no depths. Well off the
    /// polytope, [`Method::Tight`] and [`Method::Hull`] do so for each sector of the picture.
    #[default]
    Depths,
    /// By the homography of the plane through the center parallel to the polytope's triangle (section 5).
    Homography,
}

/// How an outline is interpolated and carried to the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Interpolation {
    /// Between the views.
    pub method: Method,
    /// From the polytope to the eye.
    pub transfer: Transfer,
    /// From what contours.
    pub detail: Detail,
}

impl From<Method> for Interpolation {
    fn from(method: Method) -> Self {
        Self {
            method,
            ..Self::default()
        }
    }
}

/// Why there is no outline.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InterpolateError {
    /// No camera at this eye sees the whole model.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The map's triangles are not a star-shaped polytope.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// The method needs depths, and the map has none.
    #[error("the silhouettes have no depths, which method {} needs: use hull or paper", .method.name())]
    NoDepths {
        /// The method asked for.
        method: Method,
    },
    /// Two views are too far apart to be rectified.
    #[error("views {one} and {two} of the silhouette map are too far apart to interpolate between")]
    ViewsTooFarApart {
        /// One view.
        one: u32,
        /// The other.
        two: u32,
    },
}
