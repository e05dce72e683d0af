//! Making the outlines that a frame needs and does not have, on all cores where there are threads.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use silmap_map::{Detail, Interpolation, Method, Transfer};

use crate::ClipBy;
use crate::asset::AssetData;
use crate::bands::BandParams;
use crate::cells::{Cell, ReuseError};
use crate::curve::{CurveBuilder, CurveRequest, Frame, Sorting, Texel};

/// An outline to be made.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    pub(crate) asset: Arc<AssetData>,
    pub(crate) cell: Cell,
    /// How far off what there is would be, in pixels; infinite where there is nothing.
    pub(crate) urgency_px: f64,
}

/// An outline that was made: where its texels are, and how many points it has; no points where there is no outline.
#[derive(Clone, Debug)]
pub(crate) struct Made {
    pub(crate) cell: Cell,
    pub(crate) texels: Range<usize>,
    pub(crate) points: u32,
}

/// Buffers of one thread.
#[derive(Debug, Default)]
pub(crate) struct Worker {
    pub(crate) builder: CurveBuilder,
    pub(crate) texels: Vec<Texel>,
    pub(crate) made: Vec<Made>,
}

/// What all outlines are made by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HowToMake {
    pub(crate) clip: ClipBy,
    pub(crate) method: Option<Method>,
    pub(crate) error: ReuseError,
}

/// Fewest outlines that are worth waking a thread for.
#[cfg(not(target_arch = "wasm32"))]
const FEWEST_A_THREAD: usize = 4;

/// Pixels beyond the outline that coverage and rounding reach.
const BEYOND_PX: f64 = 1.5;

/// Up to this radius in pixels an outline is interpolated for the point of the polytope that faces the eye alone: on the bunny it is off
/// by 0.06 pixels on average then, for 0.03, in a fifth of the time.
const FACING_PX: f64 = 16.0;

/// How far points that are left out may be from the outline, pixels, where it need not be exact.
const THINNED_PX: f64 = 0.1;

/// How finely a cell's outline is sorted: it may move by as much as the eye does within twice the cell, and pictures may be half as
/// large as the largest.
pub(crate) fn sorting_of(cell: &Cell, error: &ReuseError) -> Sorting {
    let turn = if error.allowed_px > 0.0 {
        let twice = ReuseError {
            allowed_px: 2.0 * error.allowed_px,
        };
        twice.reach(cell.radius_px).sin()
    } else {
        0.0
    };
    let smallest_px = 0.5 * cell.radius_px;
    Sorting {
        bands: BandParams::for_size(2.0 * cell.radius_px, turn + BEYOND_PX / smallest_px),
        tolerance: THINNED_PX.min(0.5 * error.allowed_px) / cell.radius_px,
        turn,
    }
}

impl Worker {
    /// Makes outlines, one after the other.
    pub(crate) fn make(&mut self, wanted: &[Wanted], how: &HowToMake) {
        let mut at = 0;
        while at < wanted.len() {
            let asset = &wanted[at].asset;
            let same = wanted[at..].iter().take_while(|w| w.asset.id == asset.id);
            let end = at + same.count();
            if let Some(mut reader) = asset.take_reader() {
                for one in &wanted[at..end] {
                    self.make_one(&mut reader, one, how);
                }
                asset.give_reader_back(reader);
            }
            at = end;
        }
    }

    /// Appends the texels of the outline that was built: fans need no bands. Returns the number of its points.
    pub(crate) fn encode(
        &mut self,
        clip: ClipBy,
        frame: &Frame,
        origin: DVec3,
        sorting: &Sorting,
    ) -> Option<u32> {
        let (builder, texels) = (&mut self.builder, &mut self.texels);
        match clip {
            ClipBy::Stencil => Some(builder.encode_fans(frame, origin, sorting, texels)),
            ClipBy::Coverage => builder.encode(frame, origin, sorting, texels),
        }
    }

    fn make_one(&mut self, reader: &mut silmap_map::MapReader, wanted: &Wanted, how: &HowToMake) {
        let (asset, cell) = (&wanted.asset, &wanted.cell);
        let map = &asset.map;
        let eye = cell.middle.eye(map.center, map.radius);
        let request = CurveRequest {
            map,
            eye,
            radius_px: cell.radius_px,
            how: Interpolation {
                method: how.method.unwrap_or(asset.method),
                transfer: if cell.radius_px <= FACING_PX {
                    Transfer::FacingPoint
                } else {
                    Transfer::Depths
                },
                detail: Detail::OnScreen,
            },
        };
        let start = self.texels.len();
        let is_made = self.builder.interpolate(reader, &request).is_ok();
        let points = is_made.then(|| {
            let frame = Frame::new(eye.extend(1.0), map.center, map.radius);
            let sorting = sorting_of(cell, &how.error);
            self.encode(how.clip, &frame, asset.origin, &sorting)
        });
        self.made.push(Made {
            cell: *cell,
            texels: start..self.texels.len(),
            points: points.flatten().unwrap_or(0),
        });
    }
}

/// Makes outlines with all workers.
pub(crate) fn make_all(workers: &mut [Worker], wanted: &[Wanted], how: &HowToMake) {
    #[cfg(not(target_arch = "wasm32"))]
    {
        use rayon::prelude::*;
        let count = workers.len().min(wanted.len() / FEWEST_A_THREAD);
        if count > 1 {
            let chunk = wanted.len().div_ceil(count);
            let parts = wanted.par_chunks(chunk);
            (workers.par_iter_mut().zip(parts)).for_each(|(worker, part)| worker.make(part, how));
            return;
        }
    }
    if let Some(worker) = workers.first_mut() {
        worker.make(wanted, how);
    }
}

/// One worker for each thread.
pub(crate) fn worker_count() -> usize {
    #[cfg(not(target_arch = "wasm32"))]
    {
        rayon::current_num_threads().max(1)
    }
    #[cfg(target_arch = "wasm32")]
    {
        1
    }
}
