//! The greedy sequence of collapses.
//!
//! Edges wait in a queue by the cost they had when last looked at. An edge whose surroundings changed since is looked at
//! again when its turn comes: costs mostly rise as the mesh shrinks, so the order hardly differs from that of an always
//! fresh queue, at a third of the linear programs.

use glam::DVec3;
use silmap_geometry::bvh::{Bvh, closest_weights};
use silmap_geometry::{CostQueue, TriangleMesh, Watch};

use super::inside::Inside;
use super::placement::{FaceShape, Guards, Neighbourhood, Placement};
use super::self_crossing::FaceTree;
use super::surface::{Contraction, Surface};
use super::{HullError, HullParams, STAGE};

/// Collapses between two words of progress: a few milliseconds.
const WATCH_STRIDE: usize = 512;

/// From this many faces on, every edge whose surroundings changed is looked at again at once: the last collapses add most
/// of the volume, and a stale queue costs a sixth of it. Independent of the goal, so that a coarser hull continues a finer.
const EAGER_FACES: usize = 3000;

/// Most volume that one collapse may add, in volumes of the model per face of the hull: more is a spike, not a hull.
const STEP_SHARE: f64 = 6.0;

/// One collapse, with what is needed to split the vertex again.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) contraction: Contraction,
    /// The half-edges that started at the removed vertex, as a range of [`Collapsed::moved`].
    pub(super) moved: std::ops::Range<usize>,
    /// P of the kept and the removed vertex before.
    pub(super) surface_points: [DVec3; 2],
    /// Volume added.
    pub(super) added_volume: f64,
    /// Largest distance of any vertex placed so far from the original surface.
    pub(super) distance: f64,
}

/// The mesh after all collapses, and how it got there.
#[derive(Clone, Debug)]
pub(super) struct Collapsed {
    /// Three vertices a face of the model; [`super::surface::GONE`] for faces that are no more.
    pub(super) origin: Vec<u32>,
    pub(super) positions: Vec<DVec3>,
    /// P of each vertex.
    pub(super) surface_points: Vec<DVec3>,
    pub(super) steps: Vec<Step>,
    pub(super) moved: Vec<u32>,
}

impl Collapsed {
    /// Splits a vertex again, as far as faces go.
    pub(super) fn undo(&self, step: &Step, origin: &mut [u32]) {
        let contraction = &step.contraction;
        for &h in &self.moved[step.moved.clone()] {
            origin[h as usize] = contraction.removed;
        }
        for (face, corners) in contraction.faces {
            let first = face as usize * 3;
            origin[first..first + 3].copy_from_slice(&corners);
        }
    }
}

/// The mesh while it shrinks.
struct State {
    surface: Surface,
    surface_points: Vec<DVec3>,
    steps: Vec<Step>,
    moved: Vec<u32>,
}

/// An edge in the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    edge: u32,
    /// How often the edge had been looked at by then: an entry of an earlier look is void.
    look: u32,
}

struct Collapser<'a> {
    params: &'a HullParams,
    guards: Guards,
    original: &'a Bvh,
    state: State,
    queue: CostQueue<Entry>,
    /// Per half-edge: whether the edge of that name is in the queue.
    is_queued: Vec<bool>,
    /// Per half-edge: how often the edge of that name was looked at.
    looks: Vec<u32>,
    /// Per half-edge: number of collapses at the last look.
    last_look: Vec<u32>,
    /// Per half-edge: where the vertex would go, as last looked at.
    placements: Vec<Placement>,
    /// Scratch of a collapse: half-edges around its vertex, and around a neighbour of it.
    spokes: Vec<u32>,
    beside: Vec<u32>,
    /// Per vertex: number of the last collapse that changed a face at it.
    changed_at: Vec<u32>,
    /// Per face; stale for faces that are gone.
    shapes: Vec<FaceShape>,
    neighbourhood: Neighbourhood,
    /// What an inner hull may not leave.
    inside: Option<Inside<'a>>,
    /// Where the hull may not pass through itself.
    tree: Option<FaceTree>,
    face_count: usize,
    volume: f64,
    original_volume: f64,
    distance: f64,
}

/// What stops the sequence before nothing is allowed any more.
pub(super) struct Limits {
    pub(super) faces: usize,
    /// Volume to stay within, in the surface's units.
    pub(super) volume: f64,
    /// Distance to stay within, in the surface's units.
    pub(super) distance: f64,
}

/// What is collapsed: in the surface's units and orientation.
pub(super) struct Model<'a> {
    pub(super) mesh: &'a TriangleMesh,
    pub(super) tree: &'a Bvh,
    pub(super) volume: f64,
}

pub(super) fn collapse(
    surface: Surface,
    model: &Model<'_>,
    limits: &Limits,
    params: &HullParams,
    watch: &Watch<'_>,
) -> Result<Collapsed, HullError> {
    let half_edges = surface.origin.len();
    let mut collapser = Collapser {
        params,
        guards: Guards::LADDER[0],
        original: model.tree,
        queue: CostQueue::with_capacity(half_edges / 2),
        is_queued: vec![false; half_edges],
        looks: vec![0; half_edges],
        last_look: vec![0; half_edges],
        placements: vec![Placement::default(); half_edges],
        spokes: Vec::new(),
        beside: Vec::new(),
        changed_at: vec![0; surface.positions.len()],
        shapes: (0..half_edges as u32 / 3)
            .map(|face| FaceShape::of(&surface, face))
            .collect(),
        neighbourhood: Neighbourhood::default(),
        inside: (params.inner).then_some(Inside {
            model: model.mesh,
            tree: model.tree,
        }),
        tree: (params.no_self_intersections).then(|| FaceTree::new(&surface)),
        face_count: half_edges / 3,
        volume: model.volume,
        original_volume: model.volume.abs(),
        distance: 0.0,
        state: State {
            surface_points: surface.positions.clone(),
            steps: Vec::with_capacity(half_edges / 6),
            moved: Vec::with_capacity(half_edges / 2),
            surface,
        },
    };
    for guards in Guards::LADDER {
        if collapser.face_count <= limits.faces {
            break;
        }
        collapser.guards = guards;
        collapser.fill_queue(watch)?;
        collapser.run(limits, watch)?;
    }
    let State {
        surface,
        surface_points,
        steps,
        moved,
    } = collapser.state;
    Ok(Collapsed {
        origin: surface.origin,
        positions: surface.positions,
        surface_points,
        steps,
        moved,
    })
}

impl Guards {
    /// Strict at first; when no collapse is left, looser, as reaching the count matters more than shape.
    const LADDER: [Self; 3] = [
        Self {
            max_valence: 12,
            min_compactness: 0.05,
            min_turn_cosine: 0.2,
            max_reach: 1.0,
        },
        Self {
            max_valence: 20,
            min_compactness: 0.01,
            min_turn_cosine: 0.0,
            max_reach: 1.5,
        },
        Self {
            max_valence: 40,
            min_compactness: 1e-3,
            min_turn_cosine: -0.5,
            max_reach: 2.0,
        },
    ];
}

impl Collapser<'_> {
    fn fill_queue(&mut self, watch: &Watch<'_>) -> Result<(), HullError> {
        self.queue.clear();
        self.is_queued.fill(false);
        for h in 0..self.is_queued.len() as u32 {
            if (h as usize).is_multiple_of(WATCH_STRIDE * 64) {
                watch.check()?;
            }
            if !self.state.surface.is_gone(h) && self.state.surface.edge(h) == h {
                self.look_at(h);
            }
        }
        Ok(())
    }

    /// Puts an edge into the queue if it may be collapsed.
    fn look_at(&mut self, edge: u32) {
        self.is_queued[edge as usize] = false;
        self.looks[edge as usize] += 1;
        self.last_look[edge as usize] = self.state.steps.len() as u32;
        let surface = &mut self.state.surface;
        let ends = [surface.start(edge), surface.end(edge)];
        let valence = surface.valence(ends[0]) + surface.valence(ends[1]) - 4;
        if valence > self.guards.max_valence || !surface.can_contract(edge) {
            return;
        }
        self.neighbourhood.gather(surface, &self.shapes, edge);
        if let Some(placement) = self.neighbourhood.place(surface, &self.guards, self.params) {
            self.is_queued[edge as usize] = true;
            self.placements[edge as usize] = placement;
            let look = self.looks[edge as usize];
            self.queue.push(placement.priority, Entry { edge, look });
        }
    }

    fn run(&mut self, limits: &Limits, watch: &Watch<'_>) -> Result<(), HullError> {
        while self.face_count > limits.faces {
            watch.check()?;
            let Some((_, entry)) = self.queue.pop() else {
                break;
            };
            let surface = &mut self.state.surface;
            // A name may have died, or passed to another half-edge of the same edge, which then is in the queue itself.
            if surface.is_gone(entry.edge)
                || surface.edge(entry.edge) != entry.edge
                || self.looks[entry.edge as usize] != entry.look
            {
                continue;
            }
            let ends = [surface.start(entry.edge), surface.end(entry.edge)];
            let is_fresh = ends
                .iter()
                .all(|&v| self.changed_at[v as usize] <= self.last_look[entry.edge as usize]);
            if !is_fresh {
                self.look_at(entry.edge);
                continue;
            }
            self.is_queued[entry.edge as usize] = false;
            // A neighbour of the edge may have lost faces although the edge's own faces are as they were.
            let most = STEP_SHARE * self.original_volume / self.face_count as f64;
            let placement = self.placements[entry.edge as usize];
            if !surface.can_contract(entry.edge)
                || placement.added_volume > most
                || self.volume + placement.added_volume > limits.volume
                || !self.is_near(placement.position, limits.distance)
                || self.would_leave(entry.edge, placement.position)
                || self.would_cross_itself(entry.edge, placement.position)
            {
                continue;
            }
            self.contract(entry.edge, placement);
            let done = self.state.steps.len();
            if done.is_multiple_of(WATCH_STRIDE) {
                watch.advance(STAGE, 2 * WATCH_STRIDE as u64);
            }
        }
        Ok(())
    }

    /// Whether a part of an inner hull would be outside the model.
    fn would_leave(&self, edge: u32, position: DVec3) -> bool {
        let surface = &self.state.surface;
        let ring = (surface.ring(edge))
            .map(|h| [surface.start(h), surface.end(h)].map(|v| surface.position(v)));
        (self.inside).is_some_and(|inside| !inside.holds(ring, position))
    }

    fn would_cross_itself(&mut self, edge: u32, position: DVec3) -> bool {
        let surface = &self.state.surface;
        (self.tree.as_mut()).is_some_and(|tree| tree.would_cross(surface, edge, position))
    }

    fn is_near(&self, position: DVec3, limit: f64) -> bool {
        limit == f64::INFINITY
            || self
                .original
                .closest_point_within(position, limit)
                .is_some()
    }

    fn contract(&mut self, edge: u32, placement: Placement) {
        let Placement {
            position,
            added_volume,
            ..
        } = placement;
        let state = &mut self.state;
        self.neighbourhood
            .gather(&state.surface, &self.shapes, edge);
        let surface_point = surface_point_at(state, self.neighbourhood.faces(), position);
        let first_moved = state.moved.len();
        let contraction = state.surface.contract(edge, position, &mut state.moved);
        let (kept, removed) = (contraction.kept as usize, contraction.removed as usize);
        if let Some(tree) = &mut self.tree {
            tree.update_around(&state.surface, kept as u32, contraction.faces.map(|f| f.0));
        }
        self.distance = self.distance.max(position.distance(surface_point));
        self.volume += added_volume;
        self.face_count -= 2;
        state.steps.push(Step {
            surface_points: [state.surface_points[kept], state.surface_points[removed]],
            contraction,
            moved: first_moved..state.moved.len(),
            added_volume,
            distance: self.distance,
        });
        state.surface_points[kept] = surface_point;

        let now = state.steps.len() as u32;
        let mut spokes = std::mem::take(&mut self.spokes);
        let mut beside = std::mem::take(&mut self.beside);
        spokes.clear();
        spokes.extend(state.surface.leaving(kept as u32));
        self.changed_at[kept] = now;
        for &spoke in &spokes {
            self.shapes[(spoke / 3) as usize] = FaceShape::of(&self.state.surface, spoke / 3);
            self.changed_at[self.state.surface.end(spoke) as usize] = now;
        }
        let is_eager = self.face_count <= EAGER_FACES;
        // Edges that were refused before may be allowed now.
        for &spoke in &spokes {
            let end = self.state.surface.end(spoke);
            // Its other edges have three faces or more at their other ends: all of them are refused, and to look at each whenever
            // something beside such a vertex changes would take the square of their number.
            if self.state.surface.valence(end) > self.guards.max_valence + 1 {
                continue;
            }
            beside.clear();
            beside.extend(self.state.surface.leaving(end));
            #[cfg(test)]
            BESIDE.set(BESIDE.get() + beside.len());
            for &h in &beside {
                let edge = self.state.surface.edge(h);
                // Each edge once: those between two vertices of the ring would come up twice.
                let is_old = self.last_look[edge as usize] < now;
                if (is_eager && is_old) || !self.is_queued[edge as usize] {
                    self.look_at(edge);
                }
            }
        }
        self.spokes = spokes;
        self.beside = beside;
    }
}

#[cfg(test)]
thread_local! {
    /// How many edges beside collapsed ones were gone through on this thread.
    pub(super) static BESIDE: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// P of a new vertex: P of the old surface, interpolated at its point closest to the vertex.
fn surface_point_at(state: &State, faces: &[[u32; 3]], position: DVec3) -> DVec3 {
    let mut best = (f64::INFINITY, position);
    for face in faces {
        let corners = face.map(|v| state.surface.position(v));
        let weights = closest_weights(position, corners);
        let mix = |[a, b, c]: [DVec3; 3]| a + (b - a) * weights[1] + (c - a) * weights[2];
        let squared = mix(corners).distance_squared(position);
        if squared < best.0 {
            best = (squared, mix(face.map(|v| state.surface_points[v as usize])));
        }
    }
    best.1
}
