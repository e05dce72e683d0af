//! The interpolation methods, and everything in which they differ beside the rule itself.

use crate::SilhouetteMap;

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

    /// How many regions are interpolated, all of which hold the outline: one for each order of a triangle's views.
    pub(crate) fn region_count(self) -> usize {
        if self == Self::Hull { 3 } else { 1 }
    }

    /// Into how many sectors the picture is divided off the polytope, if it is. By `hull` each takes longer, and less is lost by wide
    /// ones.
    pub(crate) fn sector_count(self) -> Option<usize> {
        match self {
            Self::Paper => None,
            Self::Hull => Some(4),
            Self::Tight => Some(6),
        }
    }

    /// Whether hairs, slits and crumbs that no view shows are left out.
    pub(crate) fn is_tidied(self) -> bool {
        self == Self::Tight
    }
}
