//! The order in which instances are drawn, and the draw calls of a frame.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use silmap_curve::block_cache::KeptRef;
use silmap_curve::cells::CellKey;

use crate::batches::Batches;
use crate::view::Rect;
use crate::{Antialias, ClipBy, RendererOptions};

/// An instance as vertex attributes; `Instance` of `shaders/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Record {
    pub(crate) clip_from_object: [[f32; 4]; 4],
    pub(crate) eye: [f32; 4],
    /// First texel of the outline, its points or 0, the paint, 0.
    pub(crate) outline: [u32; 4],
    pub(crate) sphere: [f32; 4],
    /// Unit direction to a moved light, and 1; or zeros.
    pub(crate) light: [f32; 4],
}

/// A draw call; ranges are of records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Draw {
    /// Outlines of at most so many edges into the stencil.
    Windings { records: Range<u32>, edges: u32 },
    /// The same again, to leave the stencil as it was.
    Clear { records: Range<u32>, edges: u32 },
    /// Hulls of one asset, clipped.
    Hulls { records: Range<u32>, hull: Hull },
    /// The partly covered pixels of the same.
    Borders { records: Range<u32>, hull: Hull },
    /// Hulls of one asset, whole.
    Whole { records: Range<u32>, hull: Hull },
}

/// What instances have in common that share a draw call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Hull {
    pub(crate) asset: usize,
    pub(crate) has_relief: bool,
}

/// An instance in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visible {
    pub(crate) record: Record,
    pub(crate) instance: usize,
    pub(crate) hull: Hull,
    pub(crate) depth: f64,
    pub(crate) rect: Rect,
    /// The cell of its own outline, where that has yet to be made.
    pub(crate) wanted: Option<CellKey>,
    pub(crate) outline: Option<KeptRef>,
    pub(crate) points: u32,
    pub(crate) batch: u32,
    pub(crate) order: u8,
    /// Its turn, of all that are in the picture.
    pub(crate) rank: u32,
}

/// Puts instances into an order.
#[derive(Debug)]
pub(crate) struct DrawOrder {
    clip: ClipBy,
    is_soft: bool,
    has_depth: bool,
    batches: Batches,
}

impl DrawOrder {
    pub(crate) fn new(options: &RendererOptions) -> Self {
        Self {
            clip: options.clip,
            is_soft: options.antialias == Antialias::Soft,
            has_depth: options.formats.depth.is_some(),
            batches: Batches::default(),
        }
    }

    /// Puts instances into an order and makes draw calls of them.
    pub(crate) fn put(&mut self, all: &mut [Visible], size_px: DVec2, draws: &mut Vec<Draw>) {
        // Where there is depth, what is nearer goes first: what it hides need not be shaded. What is blended goes from back to front.
        let is_blended = self.is_soft || !self.has_depth;
        all.sort_unstable_by(|a, b| {
            let by_depth = a.depth.total_cmp(&b.depth);
            let by_depth = if is_blended {
                by_depth.reverse()
            } else {
                by_depth
            };
            by_depth.then(a.instance.cmp(&b.instance))
        });
        for (rank, visible) in (0..).zip(&mut *all) {
            visible.rank = rank;
        }
        match self.clip {
            ClipBy::Stencil => self.put_stencil(all, size_px, draws),
            ClipBy::Coverage => self.put_coverage(all, is_blended, draws),
        }
    }

    fn put_stencil(&mut self, all: &mut [Visible], size_px: DVec2, draws: &mut Vec<Draw>) {
        self.batches.begin(size_px);
        for visible in &mut *all {
            // Whole ones need no stencil.
            visible.batch = if visible.points == 0 {
                0
            } else {
                1 + self.batches.add(&visible.rect)
            };
        }
        let group = |v: &Visible| (v.batch, v.hull, v.order, v.rank);
        all.sort_unstable_by_key(group);
        let mut start = 0;
        for batch in all.chunk_by(|a, b| a.batch == b.batch) {
            let first = start;
            let is_whole = batch[0].batch == 0;
            let mut at = first;
            let runs = batch.chunk_by(|a, b| (a.hull, a.order) == (b.hull, b.order));
            for run in runs.clone().filter(|_| !is_whole) {
                let end = at + run.len() as u32;
                let edges = run.iter().map(|v| v.points).max().unwrap_or(0);
                draws.push(Draw::Windings {
                    records: at..end,
                    edges,
                });
                at = end;
            }
            at = first;
            for run in batch.chunk_by(|a, b| a.hull == b.hull) {
                let (records, hull) = (at..at + run.len() as u32, run[0].hull);
                at = records.end;
                draws.push(if is_whole {
                    Draw::Whole { records, hull }
                } else {
                    Draw::Hulls { records, hull }
                });
            }
            at = first;
            for run in runs.filter(|_| !is_whole) {
                let end = at + run.len() as u32;
                let edges = run.iter().map(|v| v.points).max().unwrap_or(0);
                draws.push(Draw::Clear {
                    records: at..end,
                    edges,
                });
                at = end;
            }
            start = first + batch.len() as u32;
        }
    }

    fn put_coverage(&self, all: &mut [Visible], is_blended: bool, draws: &mut Vec<Draw>) {
        if !is_blended {
            all.sort_unstable_by_key(|v| (v.hull, v.rank));
        }
        let mut start = 0;
        for run in all.chunk_by(|a, b| a.hull == b.hull) {
            let (records, hull) = (start..start + run.len() as u32, run[0].hull);
            start = records.end;
            draws.push(Draw::Hulls {
                records: records.clone(),
                hull,
            });
            if self.is_soft && self.has_depth {
                draws.push(Draw::Borders { records, hull });
            }
        }
    }
}
