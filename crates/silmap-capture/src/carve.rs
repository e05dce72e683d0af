//! Carving: the visual hull of all masks but a few bad ones, as a closed mesh.
//!
//! How many votes may be wrong is found by trying: more are allowed as long as the median overlap with the masks becomes better by
//! [`WORTH`]. Before that, a view that alone carves away much of what all others keep is left out: its mask or its camera is wrong.
//! Noise carves away what one view in a hundred does not show; votes that are not needed make the hull larger than most masks.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{Bvh, ClosedMesh, MeshDefects};
use thiserror::Error;

use crate::bounds;
use crate::field::{Field, FieldView};
use crate::octree::{Grid, leaves, root_count};
use crate::pieces::keep_object;
use crate::pinhole::Pinhole;
use crate::reading::Misread;
use crate::residual::{Residual, disagreeing, median, residuals};
use crate::surface::surface;
use crate::view::{Capture, CaptureView, CaptureWarning};

/// Finding how many votes may be wrong.
pub const VOTES: Stage = Stage("weighing masks");
/// Carving itself.
pub const CARVE: Stage = Stage("carving");
/// The carved surface.
pub const SURFACE: Stage = Stage("meshing the carved hull");

/// How to carve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarveParams {
    /// Voxels along the longest side of the object. The surface lies between them to a part of a voxel.
    pub voxels: u32,
    /// So many views may see a point beside their mask, and it is kept. `None`: found from the masks.
    pub outvoted: Option<u32>,
}

impl Default for CarveParams {
    fn default() -> Self {
        Self {
            voxels: 160,
            outvoted: None,
        }
    }
}

/// Voxels along the longest side: what is of use, and what fits into memory.
const VOXELS: std::ops::RangeInclusive<u32> = 16..=1024;

/// Why nothing was carved.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CarveError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A parameter is out of range.
    #[error("{value} voxels cannot be: it must be between {} and {}", VOXELS.start(), VOXELS.end())]
    Voxels {
        /// The value.
        value: u32,
    },
    /// As many votes may be wrong as there are.
    #[error("{value} of {views} views cannot be outvoted: at most {} can", views / 2)]
    Outvoted {
        /// Views that may be wrong.
        value: u32,
        /// Views.
        views: u32,
    },
    /// The cameras look along parallel lines.
    #[error(
        "all {views} views look in the same direction, so that they do not bound the object along it: take some from other sides"
    )]
    Parallel {
        /// Views.
        views: usize,
    },
    /// Nothing is inside enough masks.
    #[error(
        "nothing is left: no point is inside the masks of all but {outvoted} of {views} views; if the masks are right, the cameras are \
         read by a convention that is not theirs (direction of the pose, axes, order of rotation)"
    )]
    Empty {
        /// Views that may be wrong.
        outvoted: usize,
        /// Views.
        views: usize,
    },
    /// A hull that has little to do with the masks.
    #[error(
        "the masks do not agree with each other: the hull that they leave overlaps them by {overlap:.2} in the median; the cameras are \
         probably read by a convention that is not theirs (direction of the pose, axes, order of rotation, mirrored pictures)"
    )]
    Incoherent {
        /// Median of intersection over union.
        overlap: f64,
    },
    /// Another reading of the cameras agrees with the masks.
    #[error("{error}; {misread}")]
    Misread {
        /// What came of the cameras as they stand.
        error: Box<CarveError>,
        /// The other reading.
        misread: Misread,
    },
    /// A camera in the object.
    #[error("view {view}: its camera is inside the object that the other masks leave")]
    EyeInside {
        /// The first such view.
        view: String,
    },
    /// The surface is no closed mesh, which it always should be.
    #[error("the carved surface is not closed: {0}")]
    NotClosed(MeshDefects),
}

/// A carved hull.
#[derive(Clone, Debug)]
pub struct Carved {
    /// Its surface, in coordinates about [`ClosedMesh::origin`].
    pub mesh: ClosedMesh,
    /// So many views could be outvoted.
    pub outvoted: u32,
    /// The numbers of views that had no vote.
    pub left_out: Vec<usize>,
    /// Side of a voxel, length units of the cameras.
    pub voxel: f64,
    /// How the hull agrees with each view.
    pub residuals: Vec<Option<Residual>>,
    /// What was odd.
    pub warnings: Vec<CaptureWarning>,
}

/// A point must be seen by this share of the views, and by two.
const LEAST_SEEN: f64 = 0.25;

/// With fewer views none is outvoted: each bounds the object where no other does.
const VOTES_FROM: usize = 12;

/// With fewer views none is left out.
const SPOILED_FROM: usize = 6;

/// A view is suspect when a hull that may outvote one reaches so much farther beside its mask than beside the others', in shares of the mask...
const LEAST_SPOILED: f64 = 0.03;

/// ... and in usual deviations of that share.
const DEVIATIONS: f64 = 6.0;

/// So many are looked at, those first that reach farthest.
const MOST_SUSPECTS: usize = 8;

/// A suspect is left out when so much more of the others' masks is covered without it, on average.
const WORTH_LEAVING_OUT: f64 = 0.004;

/// At most this share of the views is outvoted unless the caller says so.
const MOST_OUTVOTED: f64 = 1.0 / 12.0;

/// Voxels along the longest side while votes are weighed.
const TRIAL_VOXELS: u32 = 80;

/// So many views are compared with the hull then, at most.
const MOST_WEIGHED: usize = 48;

/// By how much the median overlap must become better for one more step.
const WORTH: f64 = 0.001;

/// Masks and cameras that overlap less, in the median, do not belong together.
const LEAST_OVERLAP: f64 = 0.6;

/// Real sets with good cameras reach 0.97 to 0.99; this little is said.
const POOR_OVERLAP: f64 = 0.93;

/// Room around the box that blocks leave, in shares of its longest side.
const MARGIN: f64 = 0.01;

/// An object this much shorter than the box around all pieces is carved again, in a box of its own...
const ALONE: f64 = 0.8;

/// ... with this room around it, cells.
const ROOM_CELLS: f64 = 2.0;

/// An object farther from the origin than so many of its own sizes gets an origin of its own.
const FAR: f64 = 64.0;

/// Carves the hull of a capture's masks.
///
/// The result depends on the arguments alone, not on the number of threads.
///
/// # Errors
/// When interrupted, a parameter is out of range, nothing is left, or a camera is inside what is left.
pub(crate) fn carve_as_read(
    capture: &Capture,
    params: &CarveParams,
    watch: &Watch<'_>,
) -> Result<Carved, CarveError> {
    let count = capture.views.len();
    if !VOXELS.contains(&params.voxels) {
        let value = params.voxels;
        return Err(CarveError::Voxels { value });
    }
    if let Some(value) = params.outvoted.filter(|&k| k as usize > count / 2) {
        let views = count as u32;
        return Err(CarveError::Outvoted { value, views });
    }
    let middle = bounds::middle_of(&capture.views).ok_or(CarveError::Parallel { views: count })?;
    let around = match capture.object_bounds {
        Some([low, high]) if low.cmplt(high).all() => [low, high],
        _ => bounds::first_box(middle),
    };
    let origin = origin_for(around);
    let at_origin: Vec<CaptureView> = (capture.views.iter())
        .map(|view| CaptureView {
            camera: view.camera.moved(-origin),
            ..view.clone()
        })
        .collect();
    let voting: Vec<FieldView> = (at_origin.par_iter()).map(FieldView::new).collect();
    let mut carver = Carver {
        views: at_origin.iter().collect(),
        voting: voting.iter().collect(),
        around: around.map(|corner| corner - origin),
        outward: 0.0,
    };
    let (mut warnings, mut left_out) = (Vec::new(), Vec::new());
    let outvoted = match params.outvoted {
        Some(k) => k as usize,
        None => {
            let spoiled = carver.spoiled(watch)?;
            carver.leave_out(&spoiled);
            warnings.extend(spoiled.iter().map(|&v| CaptureWarning::LeftOut {
                view: at_origin[v].name.clone(),
            }));
            left_out = spoiled;
            carver.weigh(watch)?
        }
    };
    let (mesh, grid) = carver.carve((outvoted, params.voxels), &mut warnings, watch)?;
    let residuals = residuals(&mesh, &at_origin);
    // A view that the hull reaches behind agrees with nothing.
    let overlap = median(residuals.iter().map(|r| r.map_or(0.0, |r| r.overlap))).unwrap_or(0.0);
    if overlap < LEAST_OVERLAP {
        return Err(CarveError::Incoherent { overlap });
    }
    if overlap < POOR_OVERLAP {
        warnings.push(CaptureWarning::PoorOverlap { median: overlap });
    }
    let tree = Bvh::new(mesh.mesh());
    if let Some(view) = (at_origin.iter()).find(|v| tree.winding_number(v.camera.eye) != 0) {
        let view = view.name.clone();
        return Err(CarveError::EyeInside { view });
    }
    let middle = median(residuals.iter().flatten().map(|r| r.overlap));
    for view in disagreeing(&residuals) {
        let overlap = residuals[view].map_or(0.0, |r| r.overlap);
        warnings.push(CaptureWarning::Disagrees {
            view: capture.views[view].name.clone(),
            overlap,
            median: middle.unwrap_or(overlap),
        });
    }
    Ok(Carved {
        mesh: mesh.with_origin(origin),
        outvoted: outvoted as u32,
        left_out,
        voxel: grid.cell,
        residuals,
        warnings,
    })
}

/// As a capture was carved, with room for what strays beyond: a point is inside of a view's cone if it is no farther than `outward` from
/// it, in length units.
///
/// # Errors
/// When interrupted, or nothing is left.
pub fn carve_wider(
    capture: &Capture,
    carved: &Carved,
    (outward, voxels): (f64, u32),
    watch: &Watch<'_>,
) -> Result<ClosedMesh, CarveError> {
    let origin = carved.mesh.origin();
    let at_origin: Vec<CaptureView> = (capture.views.iter().enumerate())
        .filter(|(k, _)| !carved.left_out.contains(k))
        .map(|(_, view)| CaptureView {
            camera: view.camera.moved(-origin),
            ..view.clone()
        })
        .collect();
    let voting: Vec<FieldView> = (at_origin.par_iter()).map(FieldView::new).collect();
    let bounds = carved.mesh.bounds();
    let room = DVec3::splat(4.0 * (outward + carved.voxel));
    let carver = Carver {
        views: at_origin.iter().collect(),
        voting: voting.iter().collect(),
        around: [bounds.min - room, bounds.max + room],
        outward,
    };
    let (mesh, _) = carver.carve((carved.outvoted as usize, voxels), &mut Vec::new(), watch)?;
    Ok(mesh.with_origin(origin))
}

/// Zero, or a point near the box where that is far from the origin of its coordinates.
fn origin_for([low, high]: [DVec3; 2]) -> DVec3 {
    let (middle, size) = (0.5 * (low + high), (high - low).max_element());
    match middle.abs().max_element() > FAR * size {
        true => middle.round(),
        false => DVec3::ZERO,
    }
}

/// Views and their votes, in coordinates about the origin.
struct Carver<'a> {
    views: Vec<&'a CaptureView>,
    voting: Vec<&'a FieldView>,
    around: [DVec3; 2],
    /// As of [`Field`].
    outward: f64,
}

impl Carver<'_> {
    fn field(&self, outvoted: usize) -> Field<'_> {
        let count = self.voting.len();
        Field {
            views: &self.voting,
            outvoted,
            least_seen: ((LEAST_SEEN * count as f64).ceil() as usize)
                .max(2)
                .max(outvoted + 1),
            outward: self.outward,
        }
    }

    /// The views that alone carve away much of what all others keep.
    fn spoiled(&self, watch: &Watch<'_>) -> Result<Vec<usize>, CarveError> {
        let count = self.views.len();
        if count < SPOILED_FROM {
            return Ok(Vec::new());
        }
        // What one view alone carves away is there when one may be wrong.
        let (mesh, _) = match self.carve((1, TRIAL_VOXELS), &mut Vec::new(), &watch.quiet()) {
            Err(CarveError::Empty { .. }) => return Ok(Vec::new()),
            other => other?,
        };
        let beside: Vec<f64> = residuals(&mesh, self.views.iter().copied())
            .iter()
            .map(|r| r.map_or(0.0, |r| r.outvoted))
            .collect();
        let usual = median(beside.iter().copied()).unwrap_or(0.0);
        let spread = median(beside.iter().map(|b| (b - usual).abs())).unwrap_or(0.0);
        let most = usual + (DEVIATIONS * spread).max(LEAST_SPOILED);
        let mut suspects: Vec<usize> = (0..count).filter(|&v| beside[v] > most).collect();
        suspects.sort_by(|&a, &b| beside[b].total_cmp(&beside[a]));
        suspects.truncate(MOST_SUSPECTS.min(count / 5));
        if suspects.is_empty() {
            return Ok(suspects);
        }
        // A view may be alone in bounding the object, and right. Then the others' masks are covered with it and without.
        let with = self.missing(watch)?;
        let mut spoiled = Vec::new();
        for view in suspects {
            let mut others = Carver {
                views: self.views.clone(),
                voting: self.voting.clone(),
                around: self.around,
                outward: self.outward,
            };
            others.leave_out(&[view]);
            let without = others.missing(watch)?;
            let of_others = |k: &usize| *k != view;
            let with: f64 = (0..count).filter(of_others).map(|k| with[k]).sum();
            if with - without.iter().sum::<f64>() > WORTH_LEAVING_OUT * (count - 1) as f64 {
                spoiled.push(view);
            }
        }
        spoiled.sort_unstable();
        Ok(spoiled)
    }

    /// The share of each mask that a hull which outvotes none does not cover.
    fn missing(&self, watch: &Watch<'_>) -> Result<Vec<f64>, CarveError> {
        let (mesh, _) = match self.carve((0, TRIAL_VOXELS), &mut Vec::new(), &watch.quiet()) {
            Err(CarveError::Empty { .. }) => return Ok(vec![1.0; self.views.len()]),
            other => other?,
        };
        let found = residuals(&mesh, self.views.iter().copied());
        Ok(found.iter().map(|r| r.map_or(0.0, |r| r.missing)).collect())
    }

    /// Takes the votes of some views away.
    fn leave_out(&mut self, views: &[usize]) {
        for &view in views.iter().rev() {
            self.views.remove(view);
            self.voting.remove(view);
        }
    }

    /// The number of votes that may be wrong.
    fn weigh(&self, watch: &Watch<'_>) -> Result<usize, CarveError> {
        let count = self.voting.len();
        if count < VOTES_FROM {
            return Ok(0);
        }
        let most = (MOST_OUTVOTED * count as f64) as usize;
        let mut steps = vec![0];
        while let Some(&last) = steps.last() {
            let next = last + (last / 3).max(1);
            if next > most {
                break;
            }
            steps.push(next);
        }
        let stride = count.div_ceil(MOST_WEIGHED);
        let weighed = || self.views.iter().step_by(stride).copied();
        watch.start(VOTES, steps.len() as u64);
        let (mut best, mut best_overlap) = (0, 0.0);
        for outvoted in steps {
            let tried = self.carve((outvoted, TRIAL_VOXELS), &mut Vec::new(), &watch.quiet());
            watch.advance(VOTES, 1);
            let mesh = match tried {
                Ok((mesh, _)) => mesh,
                Err(CarveError::Empty { .. }) => continue,
                Err(error) => return Err(error),
            };
            let found = residuals(&mesh, weighed());
            let overlap = median(found.iter().flatten().map(|r| r.overlap)).unwrap_or(0.0);
            if overlap > best_overlap + WORTH {
                (best, best_overlap) = (outvoted, overlap);
            } else if overlap < best_overlap {
                break;
            }
        }
        watch.finish(VOTES);
        Ok(best)
    }

    fn carve(
        &self,
        (outvoted, voxels): (usize, u32),
        warnings: &mut Vec<CaptureWarning>,
        watch: &Watch<'_>,
    ) -> Result<(ClosedMesh, Grid), CarveError> {
        let field = self.field(outvoted);
        let empty = || CarveError::Empty {
            outvoted,
            views: self.voting.len(),
        };
        let mut found = bounds::shrink(&field, self.around, (CARVE, watch))?.ok_or_else(empty)?;
        let mut pieces = 0;
        let (mesh, grid) = loop {
            let longest = (found[1] - found[0]).max_element();
            let margin = DVec3::splat(MARGIN * longest);
            let grid = Grid::over([found[0] - margin, found[1] + margin], voxels);
            watch.start(CARVE, root_count(&grid));
            let leaves = leaves(&field, &grid, (CARVE, watch))?;
            watch.finish(CARVE);
            watch.start(SURFACE, leaves.len() as u64);
            let mut mesh = surface(&field, &grid, &leaves, (SURFACE, watch))?;
            watch.finish(SURFACE);
            if mesh.faces.is_empty() {
                return Err(empty());
            }
            let beside = keep_object(&mut mesh, &self.views);
            pieces = pieces.max(beside);
            // What lies beside the object took voxels from it.
            let object = mesh.bounds();
            if beside == 0 || (object.max - object.min).max_element() > ALONE * longest {
                break (mesh, grid);
            }
            let room = DVec3::splat(ROOM_CELLS * grid.cell);
            found = [object.min - room, object.max + room];
        };
        if pieces > 0 {
            warnings.push(CaptureWarning::Pieces { count: pieces });
        }
        let mesh = ClosedMesh::try_from(mesh).map_err(CarveError::NotClosed)?;
        let reached = mesh.bounds();
        let is_cut = (reached.min - self.around[0]).min_element() < -0.5 * grid.cell
            || (self.around[1] - reached.max).min_element() < -0.5 * grid.cell;
        if is_cut {
            warnings.push(CaptureWarning::AtBounds);
        }
        Ok((mesh, grid))
    }
}

/// Voxels along the longest side, and views, of coarse hulls.
const COARSE_VOXELS: u32 = 64;
const MOST_TRIED: usize = 24;

/// With so many views one may be wrong in a coarse hull.
const ONE_WRONG_FROM: usize = 20;

/// Some views of a capture, for coarse hulls by other cameras.
#[derive(Debug)]
pub(crate) struct Trial {
    views: Vec<(CaptureView, FieldView)>,
}

impl Trial {
    pub(crate) fn new(views: &[CaptureView]) -> Self {
        let stride = views.len().div_ceil(MOST_TRIED).max(1);
        let tried: Vec<&CaptureView> = views.iter().step_by(stride).collect();
        let with_distances = |view: &&CaptureView| {
            // Votes by the mask of the straight image, which any camera may have.
            let straight = CaptureView {
                lens: None,
                taken: None,
                ..(*view).clone()
            };
            let field = FieldView::new(&straight);
            (straight, field)
        };
        Self {
            views: tried.par_iter().map(with_distances).collect(),
        }
    }

    /// The median overlap of the masks with a coarse hull by other cameras; zero where there is none.
    pub(crate) fn overlap(
        &self,
        change: impl Fn(&Pinhole) -> Pinhole,
        watch: &Watch<'_>,
    ) -> Result<f64, Interrupted> {
        let changed: Vec<CaptureView> = (self.views.iter())
            .map(|(view, _)| CaptureView {
                camera: change(&view.camera),
                ..view.clone()
            })
            .collect();
        let Some((middle, distance)) = bounds::middle_of(&changed) else {
            return Ok(0.0);
        };
        let about = |camera: &Pinhole| camera.moved(-middle);
        let changed: Vec<CaptureView> = (changed.into_iter())
            .map(|view| CaptureView {
                camera: about(&view.camera),
                ..view
            })
            .collect();
        let voting: Vec<FieldView> = (self.views.iter().zip(&changed))
            .map(|((_, field), view)| field.with_camera(view.camera))
            .collect();
        let carver = Carver {
            views: changed.iter().collect(),
            voting: voting.iter().collect(),
            around: bounds::first_box((DVec3::ZERO, distance)),
            outward: 0.0,
        };
        let outvoted = usize::from(changed.len() >= ONE_WRONG_FROM);
        let size = (outvoted, COARSE_VOXELS);
        let mesh = match carver.carve(size, &mut Vec::new(), &watch.quiet()) {
            Ok((mesh, _)) => mesh,
            Err(CarveError::Interrupted(error)) => return Err(error),
            Err(_) => return Ok(0.0),
        };
        let found = residuals(&mesh, &changed);
        // A view that the hull reaches behind agrees with nothing.
        Ok(median(found.iter().map(|r| r.map_or(0.0, |r| r.overlap))).unwrap_or(0.0))
    }
}
