//! The stages of a build, by their descriptions shown to users, and its warnings.

use silmap_geometry::defects::counted;
use silmap_geometry::{HiddenParts, Stage};

/// Drawing the mesh from all views.
pub const CAPTURE: Stage = Stage("capturing silhouettes");
/// Tracing and simplifying the outlines.
pub const CONTOURS: Stage = Stage("tracing contours");
/// Choosing the views to keep.
pub const MAP: Stage = Stage("choosing views");
/// Moving those that were kept.
pub const REFINE: Stage = Stage("moving views");
/// Finding out which of them could go next.
pub const ORDER: Stage = Stage("ordering views");
/// Taking texture pictures and the atlas.
pub const TEXTURES: Stage = Stage("taking textures");

/// Why a silhouette is no view of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unused {
    /// Another one was taken from the same direction.
    SameDirection {
        /// The number of the other one.
        as_view: usize,
    },
    /// Its eye is so near to the model, or so much nearer or farther than those beside it, that the views between could not be looked
    /// at from there.
    Distance,
    /// Its eye is in the model's bounding sphere, or a part of it lies behind the eye, seen as the map's pictures are.
    Behind,
}

impl Unused {
    /// The number of another silhouette that is the reason.
    pub(crate) fn other(self) -> Option<usize> {
        match self {
            Self::SameDirection { as_view } => Some(as_view),
            Self::Distance | Self::Behind => None,
        }
    }
}

/// Something odd that did not stop the work.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PrepWarning {
    /// The hull could not reach the face count asked for.
    HullStalled {
        /// Faces asked for.
        wanted: u32,
        /// Faces reached.
        reached: u32,
    },
    /// The model pokes out of the hull, as it is stored.
    HullLeaks {
        /// Largest distance of a point of the model outside, over the radius of its bounding sphere.
        escaped_rel: f64,
    },
    /// Parts of the model that no eye outside can see were left out.
    HiddenParts(HiddenParts),
    /// The pictures have more bytes than asked for, as small as they can be.
    TexturesOverBudget {
        /// Bytes asked for.
        wanted: u64,
        /// Bytes reached.
        reached: u64,
    },
    /// A photograph's silhouette is no view of the map.
    SilhouetteNotUsed {
        /// The photograph's name.
        name: String,
        /// Why.
        reason: Unused,
        /// The photograph that is used instead, if there is one.
        other: Option<String>,
    },
    /// The map could not be simplified to the number of views asked for.
    MapStalled {
        /// Views asked for.
        wanted: u32,
        /// Views reached.
        reached: u32,
    },
}

impl std::fmt::Display for PrepWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::HullStalled { wanted, reached } => {
                write!(
                    f,
                    "the hull stopped at {reached} faces: no further collapse keeps it outside ({wanted} asked for)"
                )
            }
            Self::HullLeaks { escaped_rel } => {
                write!(
                    f,
                    "the model pokes out of the hull by {escaped_rel:.1e} of its radius: single precision is too coarse so far from the origin"
                )
            }
            Self::HiddenParts(hidden) => {
                let named = [
                    (hidden.cavities, "cavity wall"),
                    (hidden.bodies, "enclosed part"),
                ];
                let named = named.into_iter().filter(|&(count, _)| count > 0);
                let named: Vec<String> = named.map(|(count, noun)| counted(count, noun)).collect();
                write!(
                    f,
                    "{} ({}) cannot be seen from outside: left out (--keep-cavities keeps them)",
                    named.join(" and "),
                    counted(hidden.faces, "face")
                )
            }
            Self::TexturesOverBudget { wanted, reached } => {
                write!(
                    f,
                    "the textures take {reached} bytes: they cannot be made smaller ({wanted} asked for)"
                )
            }
            Self::SilhouetteNotUsed {
                name,
                reason,
                other,
            } => {
                let why = match reason {
                    Unused::SameDirection { .. } => format!(
                        "it was taken from the same direction as {}",
                        other.as_deref().unwrap_or("another")
                    ),
                    Unused::Distance => {
                        "its camera is too near, or its distance too unlike that of its neighbours"
                            .to_owned()
                    }
                    Unused::Behind => "its camera is too near to the object".to_owned(),
                };
                write!(f, "view {name} gives no silhouette to the map: {why}")
            }
            Self::MapStalled { wanted, reached } => {
                write!(
                    f,
                    "the silhouette map stopped at {reached} views: no further collapse is possible ({wanted} asked for)"
                )
            }
        }
    }
}
