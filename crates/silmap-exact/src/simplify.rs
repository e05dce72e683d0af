//! Mesh simplification that preserves the silhouettes seen from given viewpoints.
//!
//! Edges are collapsed in the order of their quadric error, and the quadrics of vertices on a silhouette, or near one, weigh many
//! times more: what is seen edge-on keeps its vertices, what is seen from the front loses them first.
//!
//! Source: Pop, Duncan, Barequet, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and Applications.
//! SoCG 2001, section 4.2: silhouette edges guide the collapses; the error is that of M. Garland, P. Heckbert. Surface
//! Simplification Using Quadric Error Metrics. SIGGRAPH 1997. Deviation: near-silhouettes count too, the less the farther a face is
//! from being seen edge-on, so that viewpoints between the given ones are served.

use glam::DVec3;
use silmap_geometry::camera::in_short;
use silmap_geometry::{Appearance, ClosedMesh, CostQueue, Interrupted, TriangleMesh, Watch};
use thiserror::Error;

use crate::watch::{Counter, SIMPLIFY};

mod looks;
mod nearness;
mod quadric;
mod shrinking;

use looks::Looks;
pub use nearness::silhouette_nearness;
use nearness::watched_nearness;
use quadric::Quadric;
use shrinking::Shrinking;

/// How a mesh is simplified.
#[derive(Clone, Debug, PartialEq)]
pub struct SimplifyParams {
    /// Faces to stop at.
    pub target_faces: u32,
    /// Faces seen within this angle of edge-on are near a silhouette, radians.
    pub band_rad: f64,
    /// How many times more the error of a silhouette vertex weighs than that of one far from any.
    pub weight: f64,
}

impl Default for SimplifyParams {
    fn default() -> Self {
        Self {
            target_faces: 1000,
            band_rad: 12.0_f64.to_radians(),
            weight: 300.0,
        }
    }
}

/// Why a mesh cannot be simplified.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SimplifyError {
    /// A parameter makes no sense.
    #[error("the {name} is {}: {wanted}", in_short(*.value))]
    BadParameter {
        /// Which one.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A viewpoint is nowhere.
    #[error("viewpoint {index} is not finite")]
    BadEye {
        /// Which one.
        index: usize,
    },
}

/// An edge that may be collapsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    ends: [u32; 2],
    /// How often each end had changed by then.
    versions: [u32; 2],
}

/// A simplified mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// Closed and oriented as the mesh it was made from, with its colours, texture coordinates and materials.
    pub mesh: TriangleMesh,
    /// Collapses that moved a seam of the texture or of colours, which is stretched or squeezed there: nothing else was left to
    /// collapse.
    pub stretched: u32,
}

/// Collapses edges of `mesh` down to the faces asked for, or as far as it goes, keeping what is on or near its silhouettes from
/// `eyes`. Without eyes this is plain simplification. Colours and texture coordinates are interpolated, and seams kept as long as
/// there is anything else to collapse. The stage [`SIMPLIFY`] counts faces, looked at and then removed.
///
/// # Errors
/// When a parameter or an eye makes no sense, or the caller asks to stop.
pub fn simplify(
    mesh: &ClosedMesh,
    eyes: &[DVec3],
    params: &SimplifyParams,
    watch: &Watch<'_>,
) -> Result<Simplified, SimplifyError> {
    check(eyes, params)?;
    let bounds = mesh.bounds();
    let mesh = mesh.mesh();
    // In coordinates of the bounding sphere nothing depends on place or scale.
    let unit = bounds.radius;
    let inward = |p: DVec3| (p - bounds.center) / unit;
    let work = Shrinking::new(
        mesh.positions.iter().map(|&p| inward(p)).collect(),
        mesh.faces.clone(),
    );
    let looked_at = (1 + eyes.len()) * mesh.faces.len();
    let removed = mesh
        .faces
        .len()
        .saturating_sub(params.target_faces as usize);
    let mut counter = Counter::start(watch, SIMPLIFY, (looked_at + removed) as u64, 1);
    let nearness = watched_nearness(mesh, eyes, params.band_rad, &mut counter)?;
    let mut quadrics = vec![Quadric::default(); mesh.positions.len()];
    for &face in &mesh.faces {
        let of_face = Quadric::of_face(face.map(|v| inward(mesh.positions[v as usize])));
        for v in face {
            let near = nearness[v as usize];
            quadrics[v as usize].add(&of_face, 1.0 + (params.weight - 1.0) * near * near);
        }
    }
    let mut looks = Looks::of(mesh);
    if !looks.is_empty() {
        keep_seams(&work, &looks, &mut quadrics);
    }
    let mut collapses = Collapses {
        queue: CostQueue::default(),
        deferred: Vec::new(),
        most_valence: FIRST_VALENCE,
        work,
        quadrics,
        looks: &mut looks,
        is_forced: false,
    };
    let vertex_count = mesh.positions.len() as u32;
    collapses.push_all(vertex_count, &mut |v| {
        // A closed mesh has about two faces for each vertex.
        counter.tell_done((eyes.len() * mesh.faces.len()) as u64 + 2 * u64::from(v))
    })?;
    let mut stretched = 0;
    for step in 0_u32.. {
        let left = collapses.work.face_count();
        if left <= params.target_faces as usize {
            break;
        }
        let done = (looked_at + mesh.faces.len() - left) as u64;
        if step.is_multiple_of(STEPS_UNWATCHED) {
            counter.tell_done(done)?;
        }
        match collapses.step() {
            Some(by_force) => stretched += u32::from(by_force),
            // Only what tears seams is left.
            None if !collapses.is_forced && !collapses.looks.is_empty() => {
                collapses.is_forced = true;
                collapses.push_all(vertex_count, &mut |_| counter.tell_done(done))?;
            }
            None => break,
        }
    }
    counter.finish();
    let (positions, faces, left) = collapses.work.into_parts();
    let appearance = if looks.is_empty() {
        Appearance::default()
    } else {
        looks.into_appearance(&left, &mesh.appearance)
    };
    let mut mesh = TriangleMesh {
        positions: (positions.into_iter())
            .map(|p| p * unit + bounds.center)
            .collect(),
        faces,
        appearance,
    };
    mesh.drop_unused_vertices();
    Ok(Simplified { mesh, stretched })
}

/// Makes leaving a seam an error.
fn keep_seams(work: &Shrinking, looks: &Looks, quadrics: &mut [Quadric]) {
    for v in 0..quadrics.len() as u32 {
        for w in work.neighbours(v) {
            if v > w || !looks.is_seam(work, [v, w]) {
                continue;
            }
            let ends = [v, w].map(|v| work.position(v));
            for f in work.faces_of(v) {
                let face = work.face(f);
                if !face.contains(&w) {
                    continue;
                }
                let [a, b, c] = face.map(|v| work.position(v));
                let of_edge = Quadric::of_edge(ends, (b - a).cross(c - a));
                for v in [v, w] {
                    quadrics[v as usize].add(&of_edge, 1.0);
                }
            }
        }
    }
}

/// A mesh while its edges are collapsed in the order of their error.
struct Collapses<'a> {
    queue: CostQueue<Entry>,
    /// Costs and edges whose vertex would have more than `most_valence` faces.
    deferred: Vec<(f64, Entry)>,
    most_valence: u32,
    work: Shrinking,
    quadrics: Vec<Quadric>,
    looks: &'a mut Looks,
    /// Whether seams may be torn.
    is_forced: bool,
}

impl Collapses<'_> {
    /// Queues every edge; calls `tell` at intervals with the vertex reached.
    fn push_all(
        &mut self,
        vertex_count: u32,
        tell: &mut dyn FnMut(u32) -> Result<(), Interrupted>,
    ) -> Result<(), SimplifyError> {
        for v in 0..vertex_count {
            if v.is_multiple_of(STEPS_UNWATCHED) {
                tell(v)?;
            }
            for w in self.work.neighbours(v) {
                if v < w {
                    self.push([v, w]);
                }
            }
        }
        Ok(())
    }

    fn push(&mut self, ends: [u32; 2]) {
        let both = self.quadric_of(ends);
        let cost = (self.places(&both, ends))
            .map(|p| both.error(p))
            .fold(f64::INFINITY, f64::min);
        // Without a place now it may have one later, and is queued again by what changes it.
        if cost < f64::INFINITY {
            let versions = ends.map(|v| self.work.version(v));
            self.queue.push(cost, Entry { ends, versions });
        }
    }

    fn quadric_of(&self, ends: [u32; 2]) -> Quadric {
        self.quadrics[ends[0] as usize].sum(&self.quadrics[ends[1] as usize])
    }

    /// Takes the next edge from the queue and collapses it if it can be; returns whether a seam was torn.
    fn step(&mut self) -> Option<bool> {
        let Some((cost, entry)) = self.queue.pop() else {
            if self.deferred.is_empty() {
                return None;
            }
            self.most_valence = self.most_valence.saturating_mul(VALENCE_STEP);
            self.queue.extend(self.deferred.drain(..));
            return Some(false);
        };
        let (ends, [kept, _]) = (entry.ends, entry.ends);
        let is_stale = entry.versions != ends.map(|v| self.work.version(v));
        if is_stale {
            return Some(false);
        }
        let [a, b] = ends.map(|v| self.work.valence(v));
        if (a + b).saturating_sub(4) > self.most_valence {
            self.deferred.push((cost, entry));
            return Some(false);
        }
        if !self.work.can_collapse(ends) {
            return Some(false);
        }
        let both = self.quadric_of(ends);
        let position = (self.places(&both, ends))
            .filter(|&p| self.work.is_sound(ends, p))
            .min_by(|&p, &q| both.error(p).total_cmp(&both.error(q)));
        let change = position.and_then(|p| self.looks.change(&self.work, ends, p, self.is_forced));
        let (Some(position), Some(change)) = (position, change) else {
            return Some(false);
        };
        self.looks.apply(&self.work, ends, position, &change);
        self.work.collapse(ends, position);
        self.quadrics[kept as usize] = both;
        for w in self.work.neighbours(kept) {
            self.push([kept.min(w), kept.max(w)]);
        }
        Some(change.stretched > 0)
    }

    /// Where the vertex of a collapsed edge may go.
    fn places(&self, quadric: &Quadric, ends: [u32; 2]) -> impl Iterator<Item = DVec3> {
        let [a, b] = ends.map(|v| self.work.position(v));
        let reach = 2.0 * a.distance(b);
        let middle = self.work.middle(ends);
        // Far from the edge the optimum is an accident of nearly parallel planes.
        let optimum = quadric.optimum().filter(|p| p.distance(middle) <= reach);
        let places = [optimum, Some(middle), Some(a), Some(b)];
        let is_free = self.looks.is_empty() || self.is_forced;
        places
            .into_iter()
            .flatten()
            .filter(move |&p| is_free || self.looks.change(&self.work, ends, p, false).is_some())
    }
}

/// Edges whose vertex would have more faces wait until nothing else is left, and then until [`VALENCE_STEP`] times as many are allowed:
/// each collapse at a vertex looks at all of its faces, so that a vertex of many takes the square of their number if it goes first.
const FIRST_VALENCE: u32 = 64;
const VALENCE_STEP: u32 = 4;

/// Vertices looked at, or edges tried, between one call of the watcher and the next.
const STEPS_UNWATCHED: u32 = 1024;

fn check(eyes: &[DVec3], params: &SimplifyParams) -> Result<(), SimplifyError> {
    let bad = |name, value, wanted| {
        Err(SimplifyError::BadParameter {
            name,
            value,
            wanted,
        })
    };
    if params.target_faces < 4 {
        let faces = f64::from(params.target_faces);
        return bad("face count", faces, "a closed mesh has at least 4");
    }
    if !(params.band_rad > 0.0 && params.band_rad <= std::f64::consts::FRAC_PI_2) {
        let degrees = params.band_rad.to_degrees();
        return bad(
            "band of near-silhouettes in degrees",
            degrees,
            "it must be above 0 and at most 90",
        );
    }
    if !(params.weight >= 1.0 && params.weight.is_finite()) {
        return bad("weight", params.weight, "it must be one or more");
    }
    match eyes.iter().position(|eye| !eye.is_finite()) {
        Some(index) => Err(SimplifyError::BadEye { index }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
