//! Simplifying a mesh where its silhouettes, seen from some viewpoints, are not.
//!
//! Edges are collapsed in the order of their quadric error, and the quadrics of vertices on a silhouette, or near one, weigh many
//! times more: what is seen edge-on keeps its vertices, what is seen from the front loses them first.
//!
//! Source: Pop, Duncan, Barequet, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and Applications.
//! SoCG 2001, section 4.2: silhouette edges guide the collapses; the error is that of M. Garland, P. Heckbert. Surface
//! Simplification Using Quadric Error Metrics. SIGGRAPH 1997. Deviation: near-silhouettes count too, the less the farther a face is
//! from being seen edge-on, so that viewpoints between the given ones are served.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec3;
use silmap_geometry::{ClosedMesh, TriangleMesh};
use thiserror::Error;

use crate::{Advance, Watch};

mod nearness;
mod quadric;
mod shrinking;

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
    #[error("the {name} is {value}: {wanted}")]
    BadParameter {
        /// Which one.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// A viewpoint is nowhere.
    #[error("viewpoint {index} is not finite")]
    BadEye {
        /// Which one.
        index: usize,
    },
}

/// An edge that may be collapsed.
#[derive(Clone, Copy, Debug)]
struct Entry {
    cost: f64,
    ends: [u32; 2],
    /// How often each end had changed by then.
    versions: [u32; 2],
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cost
            .total_cmp(&other.cost)
            .then(self.ends.cmp(&other.ends))
            .then(self.versions.cmp(&other.versions))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

/// Collapses edges of `mesh` down to the faces asked for, or as far as it goes, keeping what is on or near its silhouettes from
/// `eyes`. Without eyes this is plain simplification. The result is closed and oriented as the mesh is; colours are dropped.
/// `watch` counts faces, looked at and then removed.
///
/// # Errors
/// When a parameter or an eye makes no sense, or `watch` ends the work.
pub fn simplify(
    mesh: &ClosedMesh,
    eyes: &[DVec3],
    params: &SimplifyParams,
    watch: &mut Watch<'_>,
) -> Result<TriangleMesh, SimplifyError> {
    check(eyes, params)?;
    let bounds = mesh.bounds();
    let mesh = mesh.mesh();
    // In coordinates of the bounding sphere nothing depends on place or scale.
    let unit = bounds.radius;
    let inward = |p: DVec3| (p - bounds.center) / unit;
    let mut work = Shrinking::new(
        mesh.positions.iter().map(|&p| inward(p)).collect(),
        mesh.faces.clone(),
    );
    let looked_at = (1 + eyes.len()) * mesh.faces.len();
    let removed = mesh
        .faces
        .len()
        .saturating_sub(params.target_faces as usize);
    let mut counter = Counter {
        watch,
        total: (looked_at + removed) as u64,
    };
    let nearness = watched_nearness(mesh, eyes, params.band_rad, &mut counter)?;
    let mut quadrics = vec![Quadric::default(); mesh.positions.len()];
    for &face in &mesh.faces {
        let of_face = Quadric::of_face(face.map(|v| inward(mesh.positions[v as usize])));
        for v in face {
            let near = nearness[v as usize];
            quadrics[v as usize].add(&of_face, 1.0 + (params.weight - 1.0) * near * near);
        }
    }
    let mut queue = BinaryHeap::new();
    for v in 0..mesh.positions.len() as u32 {
        if v.is_multiple_of(STEPS_UNWATCHED) {
            // A closed mesh has about two faces for each vertex.
            counter.tell((eyes.len() * mesh.faces.len()) as u64 + 2 * u64::from(v))?;
        }
        for w in work.neighbours(v) {
            if v < w {
                push(&mut queue, &work, &quadrics, [v, w]);
            }
        }
    }
    let mut most_valence = FIRST_VALENCE;
    let mut deferred = Vec::new();
    for step in 0_u32.. {
        if work.face_count() <= params.target_faces as usize {
            break;
        }
        if step.is_multiple_of(STEPS_UNWATCHED) {
            counter.tell((looked_at + mesh.faces.len() - work.face_count()) as u64)?;
        }
        let Some(Reverse(entry)) = queue.pop() else {
            if deferred.is_empty() {
                break;
            }
            most_valence = most_valence.saturating_mul(VALENCE_STEP);
            queue.extend(deferred.drain(..).map(Reverse));
            continue;
        };
        let [kept, removed] = entry.ends;
        if entry.versions != entry.ends.map(|v| work.version(v)) {
            continue;
        }
        let [a, b] = entry.ends.map(|v| work.valence(v));
        if (a + b).saturating_sub(4) > most_valence {
            deferred.push(entry);
            continue;
        }
        if !work.can_collapse(entry.ends) {
            continue;
        }
        let both = quadrics[kept as usize].sum(&quadrics[removed as usize]);
        let Some(position) = best_place(&work, &both, entry.ends) else {
            continue;
        };
        work.collapse(entry.ends, position);
        quadrics[kept as usize] = both;
        for w in work.neighbours(kept) {
            push(&mut queue, &work, &quadrics, [kept.min(w), kept.max(w)]);
        }
    }
    let (positions, faces) = work.into_parts();
    let mut result = TriangleMesh {
        positions: (positions.into_iter())
            .map(|p| p * unit + bounds.center)
            .collect(),
        faces,
        ..TriangleMesh::default()
    };
    result.drop_unused_vertices();
    Ok(result)
}

/// Edges whose vertex would have more faces wait until nothing else is left, and then until [`VALENCE_STEP`] times as many are allowed:
/// each collapse at a vertex looks at all of its faces, so that a vertex of many takes the square of their number if it goes first.
const FIRST_VALENCE: u32 = 64;
const VALENCE_STEP: u32 = 4;

/// Vertices looked at, or edges tried, between one call of the watcher and the next.
const STEPS_UNWATCHED: u32 = 1024;

/// Who is told how far the work is.
struct Counter<'a, 'w> {
    watch: &'a mut Watch<'w>,
    total: u64,
}

impl Counter<'_, '_> {
    fn tell(&mut self, done: u64) -> Result<(), SimplifyError> {
        let advance = Advance {
            done: done.min(self.total),
            total: self.total,
        };
        if (self.watch)(advance) {
            Ok(())
        } else {
            Err(SimplifyError::Interrupted)
        }
    }
}

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
        return bad("band", params.band_rad, "it must lie within a right angle");
    }
    if !(params.weight >= 1.0 && params.weight.is_finite()) {
        return bad("weight", params.weight, "it must be one or more");
    }
    match eyes.iter().position(|eye| !eye.is_finite()) {
        Some(index) => Err(SimplifyError::BadEye { index }),
        None => Ok(()),
    }
}

fn push(
    queue: &mut BinaryHeap<Reverse<Entry>>,
    work: &Shrinking,
    quadrics: &[Quadric],
    ends: [u32; 2],
) {
    let both = quadrics[ends[0] as usize].sum(&quadrics[ends[1] as usize]);
    let cost = places(work, &both, ends)
        .into_iter()
        .flatten()
        .map(|p| both.error(p))
        .fold(f64::INFINITY, f64::min);
    queue.push(Reverse(Entry {
        cost,
        ends,
        versions: ends.map(|v| work.version(v)),
    }));
}

/// Where the vertex of a collapsed edge may go.
fn places(work: &Shrinking, quadric: &Quadric, ends: [u32; 2]) -> [Option<DVec3>; 4] {
    let [a, b] = ends.map(|v| work.position(v));
    let reach = 2.0 * a.distance(b);
    let middle = a.midpoint(b);
    // Far from the edge the optimum is an accident of nearly parallel planes.
    let optimum = quadric.optimum().filter(|p| p.distance(middle) <= reach);
    [optimum, Some(middle), Some(a), Some(b)]
}

/// The place of least error at which no face turns over.
fn best_place(work: &Shrinking, quadric: &Quadric, ends: [u32; 2]) -> Option<DVec3> {
    places(work, quadric, ends)
        .into_iter()
        .flatten()
        .filter(|&p| work.is_sound(ends, p))
        .min_by(|&p, &q| quadric.error(p).total_cmp(&quadric.error(q)))
}

#[cfg(test)]
mod tests;
