//! What long work tells its caller, and how the caller stops it.

use std::sync::atomic::{AtomicBool, Ordering};

use silmap_geometry::HiddenParts;
use silmap_geometry::camera::in_short;
use silmap_geometry::defects::counted;
use thiserror::Error;

/// The stages of a build, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Reading and checking the mesh.
    Load,
    /// Drawing it from all views.
    Capture,
    /// Tracing and simplifying the outlines.
    Contours,
    /// Choosing the views to keep.
    Map,
    /// Moving those that were kept.
    Refine,
    /// Finding out which of them could go next.
    Order,
    /// Collapsing the mesh to the coarse hull.
    Hull,
    /// Taking texture pictures and the atlas.
    Textures,
    /// Writing the file.
    Write,
    /// Measuring errors.
    Evaluate,
}

/// One step of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrepEvent {
    /// A stage begins and will count up to `total`.
    Started {
        /// Which.
        stage: Stage,
        /// Units of work ahead; an estimate.
        total: u64,
    },
    /// `count` more units are done.
    Advanced {
        /// Which.
        stage: Stage,
        /// How many.
        count: u64,
    },
    /// The stage ended.
    Finished {
        /// Which.
        stage: Stage,
    },
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
    /// Parts of the model that no eye outside can see were left out.
    HiddenParts(HiddenParts),
    /// The pictures have more bytes than asked for, as small as they can be.
    TexturesOverBudget {
        /// Bytes asked for.
        wanted: u64,
        /// Bytes reached.
        reached: u64,
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
            Self::CoarseCoordinates { step, step_rel } => {
                write!(
                    f,
                    "its coordinates lie in steps of {}, {step_rel:.1e} of its radius: it is far from the origin for its size",
                    in_short(*step)
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
            Self::Repaired { what } | Self::Ignored { what } => f.write_str(what),
            Self::TexturesOverBudget { wanted, reached } => {
                write!(
                    f,
                    "the textures take {reached} bytes: they cannot be made smaller ({wanted} asked for)"
                )
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

/// The caller asked to stop.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("interrupted")]
pub struct Interrupted;

/// The line between long work and its caller: progress out, a request to stop in.
#[derive(Clone, Copy)]
pub struct Monitor<'a> {
    on_event: &'a (dyn Fn(PrepEvent) + Sync),
    stop: &'a AtomicBool,
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl std::fmt::Debug for Monitor<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Monitor")
            .field("stop", self.stop)
            .finish_non_exhaustive()
    }
}

impl<'a> Monitor<'a> {
    /// Reports to `on_event`, which may be called from any thread, and stops soon after `stop` becomes true.
    #[must_use]
    pub fn new(on_event: &'a (dyn Fn(PrepEvent) + Sync), stop: &'a AtomicBool) -> Self {
        Self { on_event, stop }
    }

    /// Reports to nobody and never stops.
    #[must_use]
    pub fn silent() -> Monitor<'static> {
        Monitor {
            on_event: &|_| {},
            stop: &NEVER,
        }
    }

    /// Stops when this one does, but reports to nobody.
    #[must_use]
    pub fn quiet(&self) -> Self {
        Self {
            on_event: &|_| {},
            stop: self.stop,
        }
    }

    /// Tells of the start of a stage.
    pub fn start(&self, stage: Stage, total: u64) {
        (self.on_event)(PrepEvent::Started { stage, total });
    }

    /// Tells of `count` finished units.
    pub fn advance(&self, stage: Stage, count: u64) {
        (self.on_event)(PrepEvent::Advanced { stage, count });
    }

    /// Tells of the end of a stage.
    pub fn finish(&self, stage: Stage) {
        (self.on_event)(PrepEvent::Finished { stage });
    }

    /// To be called every few milliseconds of work.
    ///
    /// # Errors
    /// When the caller asked to stop.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.stop.load(Ordering::Relaxed) {
            Err(Interrupted)
        } else {
            Ok(())
        }
    }
}
