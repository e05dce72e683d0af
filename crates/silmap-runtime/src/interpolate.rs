//! Making the outlines that a frame needs and does not have, on all cores where there are threads.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use silmap_geometry::{Camera, CameraError};
use silmap_map::{Detail, Interpolation, MapReader, Method, PolytopeOutline, Transfer};

use crate::ClipBy;
use crate::asset::AssetData;
use crate::bands::BandParams;
use crate::cells::{Cell, ReuseError, SIZE_STEP};
use crate::curve::{CurveBuilder, Frame, ROOM, Sorting, Texel};
use crate::polytope_cache::{Aim, PointKey, PolytopeCache};

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
    /// Outlines seen from the polytope that were made, packed.
    rows: Vec<[f32; 4]>,
    made_rows: Vec<(PointKey, Range<usize>)>,
    /// What the sectors of an outline look at.
    sectors: Vec<PolytopeOutline>,
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

/// How finely a cell's outline is sorted: it may move by as much as the eye does within twice the cell, and pictures may be smaller by
/// [`SIZE_STEP`] than the largest.
pub(crate) fn sorting_of(cell: &Cell, error: &ReuseError) -> Sorting {
    let turn = if error.allowed_px > 0.0 {
        let twice = ReuseError {
            allowed_px: 2.0 * error.allowed_px,
        };
        twice.reach(cell.radius_px).sin()
    } else {
        0.0
    };
    let smallest_px = cell.radius_px / SIZE_STEP;
    Sorting {
        bands: BandParams::for_size(2.0 * cell.radius_px, turn + BEYOND_PX / smallest_px),
        tolerance: THINNED_PX.min(0.5 * error.allowed_px) / cell.radius_px,
        turn,
    }
}

/// Makes outlines; what it has made of views it keeps.
#[derive(Debug)]
pub(crate) struct Maker {
    pub(crate) how: HowToMake,
    pub(crate) workers: Vec<Worker>,
    polytope: PolytopeCache,
    aims: Vec<Aim>,
    missing: Vec<Aim>,
}

impl Maker {
    /// With room for so many bytes of outlines seen from the polytope.
    pub(crate) fn new(how: HowToMake, polytope_bytes: u64) -> Self {
        Self {
            how,
            workers: (0..worker_count()).map(|_| Worker::default()).collect(),
            polytope: PolytopeCache::new(polytope_bytes),
            aims: Vec::new(),
            missing: Vec::new(),
        }
    }

    /// Forgets what was made for the frame before.
    pub(crate) fn clear(&mut self) {
        self.polytope.begin_frame();
        for worker in &mut self.workers {
            worker.texels.clear();
            worker.made.clear();
        }
    }

    /// Makes outlines with all workers: first those seen from the polytope that are not there yet, then those that are wanted.
    pub(crate) fn make_all(&mut self, wanted: &[Wanted]) {
        self.aim(wanted);
        self.make_missing(wanted);
        let (how, polytope, aims) = (&self.how, &self.polytope, &self.aims);
        share_out(&mut self.workers, wanted, |worker, first, part| {
            for_each_asset(
                part.len(),
                |k| &part[k].asset,
                |reader, at| {
                    let k = first + at;
                    let start = aims.partition_point(|aim| aim.wanted < k);
                    let count = aims[start..].partition_point(|aim| aim.wanted == k);
                    let sectors = (&aims[start..start + count], polytope);
                    worker.make_one(reader, &wanted[k], sectors, how);
                },
            );
        });
    }

    /// Finds from which points of the polytope outlines are looked at.
    fn aim(&mut self, wanted: &[Wanted]) {
        self.aims.clear();
        for_each_asset(
            wanted.len(),
            |k| &wanted[k].asset,
            |reader, k| {
                let Wanted { asset, cell, .. } = &wanted[k];
                let map = &asset.map;
                let how = how_of(asset, cell, &self.how);
                // Where no error is allowed, each outline looks from its own.
                if self.how.error.allowed_px > 0.0
                    && let Ok(camera) = camera_of(asset, cell)
                    && let Ok(directions) = reader.directions(map, &camera, how)
                    && directions.len() > 1
                {
                    let level = how.detail.level(map, &camera);
                    let aims = directions.map(|d| Aim::near(d, asset.id, level, k));
                    self.aims.extend(aims);
                }
            },
        );
    }

    fn make_missing(&mut self, wanted: &[Wanted]) {
        self.missing.clear();
        for aim in &self.aims {
            if !self.polytope.touch(&aim.key) {
                self.missing.push(*aim);
            }
        }
        // Neighbours one after the other: they read the same views.
        self.missing
            .sort_unstable_by_key(|aim| (aim.key, aim.wanted));
        self.missing.dedup_by_key(|aim| aim.key);
        let how = &self.how;
        share_out(&mut self.workers, &self.missing, |worker, _, part| {
            let asset_of = |k: usize| &wanted[part[k].wanted].asset;
            for_each_asset(part.len(), asset_of, |reader, k| {
                worker.make_sector(reader, asset_of(k), &part[k], how);
            });
        });
        for worker in &mut self.workers {
            for (key, rows) in worker.made_rows.drain(..) {
                self.polytope.keep(key, &worker.rows[rows]);
            }
            worker.rows.clear();
        }
    }
}

/// Calls `work` for each of `count` numbers, with a reader of the map of that one's asset.
fn for_each_asset<'a>(
    count: usize,
    asset_of: impl Fn(usize) -> &'a Arc<AssetData>,
    mut work: impl FnMut(&mut MapReader, usize),
) {
    let mut at = 0;
    while at < count {
        let asset = asset_of(at);
        let end = (at..count).find(|&k| asset_of(k).id != asset.id);
        let end = end.unwrap_or(count);
        if let Some(mut reader) = asset.take_reader() {
            (at..end).for_each(|k| work(&mut reader, k));
            asset.give_reader_back(reader);
        }
        at = end;
    }
}

/// The camera that an outline is interpolated for.
fn camera_of(asset: &AssetData, cell: &Cell) -> Result<Camera, CameraError> {
    let (center, radius) = (asset.map.center, asset.map.radius);
    let side_px = (2.0 * ROOM * cell.radius_px).ceil() as u32;
    let eye = cell.middle.eye(center, radius);
    Camera::fit_sphere(eye, center, radius, None, (side_px, side_px))
}

/// How it is interpolated.
fn how_of(asset: &AssetData, cell: &Cell, how: &HowToMake) -> Interpolation {
    Interpolation {
        method: how.method.unwrap_or(asset.method),
        transfer: if cell.radius_px <= FACING_PX {
            Transfer::FacingPoint
        } else {
            Transfer::Depths
        },
        detail: Detail::OnScreen,
    }
}

impl Worker {
    /// Appends the texels of the outline that was built: the stencil needs no bands. Returns the number of its points.
    pub(crate) fn encode(
        &mut self,
        clip: ClipBy,
        frame: &Frame,
        origin: DVec3,
        sorting: &Sorting,
    ) -> Option<u32> {
        let (builder, texels) = (&mut self.builder, &mut self.texels);
        match clip {
            ClipBy::Stencil => Some(builder.encode_windings(frame, origin, sorting, texels)),
            ClipBy::Coverage => builder.encode(frame, origin, sorting, texels),
        }
    }

    /// Makes and packs the outline seen from a point of the polytope.
    fn make_sector(
        &mut self,
        reader: &mut MapReader,
        asset: &AssetData,
        aim: &Aim,
        how: &HowToMake,
    ) {
        if self.sectors.is_empty() {
            self.sectors.push(PolytopeOutline::default());
        }
        let outline = &mut self.sectors[0];
        let method = how.method.unwrap_or(asset.method);
        let contours = (method, aim.level);
        let made = reader.interpolate_at(&asset.map, aim.direction, contours, outline);
        let start = self.rows.len();
        if made.is_ok() {
            outline.pack(&mut self.rows);
            self.made_rows.push((aim.key, start..self.rows.len()));
        }
    }

    fn make_one(
        &mut self,
        reader: &mut MapReader,
        wanted: &Wanted,
        (aims, polytope): (&[Aim], &PolytopeCache),
        how: &HowToMake,
    ) {
        let start = self.texels.len();
        let points = self.interpolate(reader, wanted, (aims, polytope), how);
        self.made.push(Made {
            cell: wanted.cell,
            texels: start..self.texels.len(),
            points: points.unwrap_or(0),
        });
    }

    /// Appends the texels of an outline; returns the number of its points.
    fn interpolate(
        &mut self,
        reader: &mut MapReader,
        wanted: &Wanted,
        (aims, polytope): (&[Aim], &PolytopeCache),
        how: &HowToMake,
    ) -> Option<u32> {
        let Wanted { asset, cell, .. } = wanted;
        let map = &asset.map;
        let camera = camera_of(asset, cell).ok()?;
        let interpolation = how_of(asset, cell, how);
        if aims.is_empty() {
            reader.interpolate(map, &camera, interpolation).ok()?;
        } else {
            self.read_sectors(reader, asset, (aims, polytope), how)?;
            let sectors = self.sectors[..aims.len()].iter();
            reader.join(map, &camera, interpolation, sectors);
        }
        (self.builder).assign_seen(reader.seen_loops(), &camera, (map.center, map.radius));
        let frame = Frame::new(camera.eye.extend(1.0), map.center, map.radius);
        let sorting = sorting_of(cell, &how.error);
        self.encode(how.clip, &frame, asset.origin, &sorting)
    }

    /// Fetches what the sectors look at; makes what found no room.
    fn read_sectors(
        &mut self,
        reader: &mut MapReader,
        asset: &AssetData,
        (aims, polytope): (&[Aim], &PolytopeCache),
        how: &HowToMake,
    ) -> Option<()> {
        let count = self.sectors.len().max(aims.len());
        (self.sectors).resize_with(count, PolytopeOutline::default);
        for (k, aim) in aims.iter().enumerate() {
            if polytope.read(&aim.key, &mut self.sectors[k]).is_some() {
                continue;
            }
            let outline = &mut self.sectors[k];
            let contours = (how.method.unwrap_or(asset.method), aim.level);
            let made = reader.interpolate_at(&asset.map, aim.direction, contours, outline);
            made.ok()?;
            // As exact as if it had been kept.
            let start = self.rows.len();
            outline.pack(&mut self.rows);
            outline.unpack(&self.rows[start..]);
            self.rows.truncate(start);
        }
        Some(())
    }
}

/// Shares items out to all workers: each gets some that follow each other, and the number of the first one.
#[cfg(not(target_arch = "wasm32"))]
fn share_out<T: Sync>(
    workers: &mut [Worker],
    items: &[T],
    work: impl Fn(&mut Worker, usize, &[T]) + Sync,
) {
    use rayon::prelude::*;
    let count = workers.len().min(items.len() / FEWEST_A_THREAD);
    if count > 1 {
        let chunk = items.len().div_ceil(count);
        let parts = items.par_chunks(chunk).enumerate();
        (workers.par_iter_mut().zip(parts))
            .for_each(|(worker, (k, part))| work(worker, k * chunk, part));
    } else if let Some(worker) = workers.first_mut() {
        work(worker, 0, items);
    }
}

/// In browsers there is one worker.
#[cfg(target_arch = "wasm32")]
fn share_out<T>(workers: &mut [Worker], items: &[T], work: impl Fn(&mut Worker, usize, &[T])) {
    if let Some(worker) = workers.first_mut() {
        work(worker, 0, items);
    }
}

/// One worker for each thread.
fn worker_count() -> usize {
    #[cfg(not(target_arch = "wasm32"))]
    {
        rayon::current_num_threads().max(1)
    }
    #[cfg(target_arch = "wasm32")]
    {
        1
    }
}
