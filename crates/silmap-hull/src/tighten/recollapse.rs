//! Collapses against the model: as in the greedy sequence, the cheapest edge goes first.
//!
//! An edge that a collapse only brushed keeps its place in the queue and is looked at again when its turn comes; edges
//! at the new vertex are looked at at once.

use glam::DVec3;

use super::Tightener;
use crate::HullError;
use silmap_geometry::{CostQueue, Watch};

/// Most faces at a vertex after a collapse.
const MAX_VALENCE: u32 = 14;

/// An edge in the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    edge: u32,
    look: u32,
}

/// What is known of an edge, by its name.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// How often it was looked at: entries of earlier looks are void.
    look: u32,
    is_queued: bool,
    /// Whether its surroundings changed since.
    is_stale: bool,
    /// Where its vertex goes when it is collapsed.
    position: DVec3,
}

struct Queue {
    /// By the volume that their collapse adds.
    entries: CostQueue<Entry>,
    known: Vec<Known>,
}

impl Tightener<'_> {
    /// Collapses edges, the cheapest first, down to `faces`, or as far as it goes.
    pub(super) fn collapse_to(&mut self, faces: usize, watch: &Watch<'_>) -> Result<(), HullError> {
        let mut queue = Queue {
            entries: CostQueue::default(),
            known: vec![Known::default(); self.surface.origin.len()],
        };
        if self.face_count > faces {
            for h in 0..queue.known.len() as u32 {
                if !self.surface.is_gone(h) && self.surface.edge(h) == h {
                    self.look_at(h, &mut queue);
                }
            }
        }
        let mut moved = Vec::new();
        while self.face_count > faces {
            watch.check()?;
            let Some((_, entry)) = queue.entries.pop() else {
                break;
            };
            let edge = entry.edge;
            let known = &mut queue.known[edge as usize];
            if self.surface.is_gone(edge)
                || self.surface.edge(edge) != edge
                || known.look != entry.look
            {
                continue;
            }
            known.is_queued = false;
            let position = known.position;
            if known.is_stale {
                self.look_at(edge, &mut queue);
                continue;
            }
            if !self.surface.can_contract(edge) {
                continue;
            }
            let surface = &self.surface;
            if let Some(tree) = &mut self.tree
                && tree.would_cross(surface, edge, position)
            {
                continue;
            }
            moved.clear();
            let contraction = self.surface.contract(edge, position, &mut moved);
            if let Some(tree) = &mut self.tree {
                let gone = contraction.faces.map(|f| f.0);
                tree.update_around(&self.surface, contraction.kept, gone);
            }
            self.face_count -= 2;
            self.mark_due(contraction.kept);
            self.look_around(contraction.kept, &mut queue);
        }
        Ok(())
    }

    /// Brings the queue up to date with a vertex that changed.
    fn look_around(&mut self, vertex: u32, queue: &mut Queue) {
        let spokes: Vec<u32> = self.surface.leaving(vertex).collect();
        let mut edges: Vec<u32> = spokes
            .iter()
            .flat_map(|&spoke| self.surface.leaving(self.surface.end(spoke)))
            .map(|h| self.surface.edge(h))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        for edge in edges {
            let ends = [self.surface.start(edge), self.surface.end(edge)];
            let known = &mut queue.known[edge as usize];
            if ends.contains(&vertex) || !known.is_queued {
                self.look_at(edge, queue);
            } else {
                known.is_stale = true;
            }
        }
    }

    /// Puts an edge into the queue if it may be collapsed.
    fn look_at(&mut self, edge: u32, queue: &mut Queue) {
        let known = &mut queue.known[edge as usize];
        *known = Known {
            look: known.look + 1,
            is_queued: false,
            is_stale: false,
            position: DVec3::ZERO,
        };
        let ends = [self.surface.start(edge), self.surface.end(edge)];
        let valence = self.surface.valence(ends[0]) + self.surface.valence(ends[1]) - 4;
        if valence > MAX_VALENCE || !self.surface.can_contract(edge) {
            return;
        }
        self.patch.around_edge(&self.surface, edge);
        if self.is_patch_frozen() {
            return;
        }
        let Some(at) = self.model.place(&self.patch) else {
            return;
        };
        if self.is_allowed(at) {
            known.is_queued = true;
            known.position = self.patch.origin + at;
            let entry = Entry {
                edge,
                look: known.look,
            };
            queue.entries.push(self.patch.added_volume(at), entry);
        }
    }
}
