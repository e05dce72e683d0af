//! What an outline is interpolated by: the method, how it is carried to the eye, and from what contours.

use silmap_geometry::Camera;

use crate::{SilhouetteMap, ViewContour};

/// How silhouettes are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// The 1999 paper's: nearest edge first, cliques by tracking frontier points.
    Paper,
    /// All pairs of intervals in all three orders, intersected: conservative and tighter than any one order.
    Hull,
    /// Ends joined by the arc that touches both views' rays where the object does, and linked by depth, along a line through the
    /// eye from edge to edge. Needs contours with depths.
    #[default]
    Tight,
}

impl Method {
    /// All methods, in the order of their names in reports.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Hull, Self::Tight];

    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Hull => "hull",
            Self::Tight => "tight",
        }
    }

    /// The methods that a map allows.
    pub fn all_for(map: &SilhouetteMap) -> impl Iterator<Item = Self> {
        let has_depth = map.has_depth();
        let is_there = move |method: &Self| has_depth || !method.needs_depth();
        Self::ALL.into_iter().filter(is_there)
    }

    /// The method with the smallest error that a map allows.
    #[must_use]
    pub fn best_for(map: &SilhouetteMap) -> Self {
        if map.has_depth() {
            Self::Tight
        } else {
            Self::Hull
        }
    }

    /// Whether contours without depths are of no use to it.
    #[must_use]
    pub fn needs_depth(self) -> bool {
        self == Self::Tight
    }
}

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

/// How fine the contours are that an outline is interpolated from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// The coarsest level that stays within [`DETAIL_BOUND_PX`] of the traced outlines on the screen.
    #[default]
    OnScreen,
    /// That level, or the coarsest there is.
    Level(u8),
}

impl Detail {
    /// The level of the contours of `map` that it asks for in the picture of `camera`.
    #[must_use]
    pub fn level(self, map: &SilhouetteMap, camera: &Camera) -> u8 {
        match self {
            _ if !map.has_levels() => 0,
            Self::OnScreen => map.level_for(camera, DETAIL_BOUND_PX),
            Self::Level(level) => level.min(ViewContour::COARSEST_LEVEL),
        }
    }
}

/// How far the contours that are used may be from the traced ones, pixels of the picture. Where levels change the outline then
/// moves by about 0.03 pixels on average.
pub const DETAIL_BOUND_PX: f64 = 0.25;

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
