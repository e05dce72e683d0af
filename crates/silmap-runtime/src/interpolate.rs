//! Making the outlines that a frame needs and does not have, on all cores where there are threads.

use std::sync::Arc;

use silmap_curve::of_cell::camera_of;
use silmap_map::MapReader;

use crate::asset::AssetData;
use crate::polytope_cache::{Aim, PolytopeCache};
use crate::worker::{HowToMake, Wanted, Worker, how_of};

/// Fewest outlines that are worth waking a thread for.
#[cfg(not(target_arch = "wasm32"))]
const FEWEST_A_THREAD: usize = 4;

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
                let how = how_of(asset, &self.how);
                // Where no error is allowed, each outline looks from its own.
                if self.how.error.allowed_px > 0.0
                    && let Ok(camera) = camera_of(&map.bounding_sphere(), cell)
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
