//! What was odd about a file, or changed, where reading and writing went on.

use silmap_geometry::camera::in_short;

/// Something odd that did not stop the reading or writing of a mesh.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshWarning {
    /// The mesh was changed to make it closed and oriented.
    Repaired {
        /// One sentence on what was done.
        what: String,
    },
    /// The file's numbers are coarse for the model, as far from the origin as it is.
    CoarseCoordinates {
        /// How far they lie apart, model units.
        step: f64,
        /// The same over the radius of its bounding sphere.
        step_rel: f64,
    },
    /// Part of the file was not understood and left out.
    Ignored {
        /// One sentence on what was left out.
        what: String,
    },
}

impl std::fmt::Display for MeshWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::CoarseCoordinates { step, step_rel } => {
                write!(
                    f,
                    "its coordinates lie in steps of {}, {step_rel:.1e} of its radius: it is far from the origin for its size",
                    in_short(*step)
                )
            }
            Self::Repaired { what } | Self::Ignored { what } => f.write_str(what),
        }
    }
}
