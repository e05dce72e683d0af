//! Hulls tighter than the greedy sequence: vertices are placed anew against the model itself.
//!
//! A level of the sequence lies outside every finer one, so each collapse adds to what all before it gave away. Here
//! only the model counts: vertices go where the hull's volume is least while the faces around them stay clear of the
//! model (see `model`), and edges are collapsed in the same way. The result is no level of the sequence: it encloses the
//! model, and need not enclose finer levels.
//!
//! Source: the linear program is that of section 7 of the 1999 paper, with the model's points in place of the faces.
//! Deviation: P(v) is the point of the model closest to the vertex, as a vertex placed anew has no history.

mod model;
mod patch;
mod recollapse;

use glam::DVec3;
use silmap_geometry::{Bvh, TriangleMesh};

use super::inside::Inside;
use super::self_crossing::FaceTree;
use super::surface::Surface;
use super::{HullError, HullLevel, ProgressiveHull, VerifyParams, verify, verify_inner};
use model::Model;
use patch::Patch;
use silmap_geometry::Watch;

/// A vertex whose move gains less than this share of the model's volume stays.
const LEAST_GAIN_REL: f64 = 1e-8;
/// Sweeps end when one gains less than this share of the model's volume.
const LEAST_SWEEP_GAIN_REL: f64 = 1e-5;
/// Random points of the model that the result is checked with, beside all its vertices and crossings.
const CHECK_SAMPLES: u32 = 2000;

/// How much work goes into making a level tighter than the sequence has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tightening {
    /// None: the level of the sequence.
    #[default]
    Off,
    /// Its vertices are placed anew: about as long again as the sequence took.
    Fast,
    /// Starts from twice the faces, places vertices anew and collapses edges against the model: some ten times as long.
    Best,
}

/// What is done, in this order.
struct Schedule {
    /// Faces to start from, over those wanted.
    start: usize,
    /// Most sweeps over all vertices before the collapses, and after them.
    sweeps: [usize; 2],
}

/// Vertices alone.
const PLACING: Schedule = Schedule {
    start: 1,
    sweeps: [0, 5],
};
/// Vertices and collapses. More faces to start from hardly help, and take longer.
const COLLAPSING: Schedule = Schedule {
    start: 2,
    sweeps: [2, 10],
};

impl Tightening {
    /// The ways to go: the best result counts, as none is the best for every shape.
    fn schedules(self) -> &'static [Schedule] {
        match self {
            Self::Off => &[],
            Self::Fast => &[PLACING],
            Self::Best => &[PLACING, COLLAPSING],
        }
    }
}

impl ProgressiveHull {
    /// A hull of at most `faces` faces that is tighter than [`Self::level`], as far as `tightening` goes.
    ///
    /// It is checked that the hull encloses the model (an inner one: the other way about); the level of the sequence is
    /// the answer where it should not, or where nothing tighter was found.
    ///
    /// # Errors
    /// When the caller asks to stop.
    pub fn tightened_level(
        &self,
        faces: usize,
        tightening: Tightening,
        watch: &Watch<'_>,
    ) -> Result<HullLevel, HullError> {
        self.tightened_within(faces, tightening, f64::INFINITY, watch)
    }

    /// The same, with no vertex placed farther than `distance` from the model, in its units.
    ///
    /// # Errors
    /// When the caller asks to stop.
    pub fn tightened_within(
        &self,
        faces: usize,
        tightening: Tightening,
        distance: f64,
        watch: &Watch<'_>,
    ) -> Result<HullLevel, HullError> {
        let distance = self.distance_limit.min(distance / self.unit);
        let mut best = self.level(faces);
        for schedule in tightening.schedules() {
            // What goes wrong, does so where the hull passes through itself: then once more without that.
            for may_cross_itself in [true, false] {
                if may_cross_itself && !self.may_cross_itself {
                    continue;
                }
                let level = self.tightened(faces, schedule, may_cross_itself, distance, watch)?;
                if !self.is_right(&level) {
                    continue;
                }
                let is_smaller = (level.volume < best.volume) != self.is_inner;
                let is_coarse = level.mesh.faces.len() <= best.mesh.faces.len();
                if is_smaller && is_coarse {
                    best = level;
                }
                break;
            }
        }
        Ok(best)
    }

    fn tightened(
        &self,
        faces: usize,
        schedule: &Schedule,
        may_cross_itself: bool,
        distance: f64,
        watch: &Watch<'_>,
    ) -> Result<HullLevel, HullError> {
        let (surface, face_count) = self.surface_at(faces.saturating_mul(schedule.start));
        let model = Model::new(&self.scaled, &self.original);
        let is_frozen = (0..surface.origin.len() as u32 / 3)
            .map(|f| model.is_crossed_by(surface.corners(f).map(|v| surface.position(v))))
            .collect();
        let mut tightener = Tightener {
            is_due: vec![true; surface.positions.len()],
            is_frozen,
            tree: (!may_cross_itself).then(|| FaceTree::new(&surface)),
            surface,
            model,
            patch: Patch::default(),
            face_count,
            volume: self.original_volume.abs(),
            distance,
            inside: (self.is_inner).then_some(Inside {
                model: &self.scaled,
                tree: &self.original,
            }),
        };
        tightener.sweep_until_done(schedule.sweeps[0], watch)?;
        tightener.collapse_to(faces, watch)?;
        tightener.sweep_until_done(schedule.sweeps[1], watch)?;
        Ok(self.level_of(&tightener.surface))
    }

    /// Whether a level encloses the model, or the model an inner one, and is nowhere inside out.
    fn is_right(&self, level: &HullLevel) -> bool {
        let hull = TriangleMesh {
            positions: level
                .mesh
                .positions
                .iter()
                .map(|&p| p / self.unit)
                .collect(),
            faces: level.mesh.faces.clone(),
            ..TriangleMesh::default()
        };
        let model = TriangleMesh {
            positions: self.scaled.positions.clone(),
            faces: self.scaled.faces.iter().map(|&f| self.outward(f)).collect(),
            ..TriangleMesh::default()
        };
        let params = VerifyParams {
            samples: CHECK_SAMPLES,
            ..VerifyParams::default()
        };
        if self.is_inner {
            return verify_inner(&hull, &model, &params).encloses;
        }
        verify(&model, &hull, &params).encloses && !is_inside_out(&hull)
    }
}

/// How far beside a face its winding number is asked for, in the collapsed surface's coordinates, where the model is about one.
const BESIDE: f64 = 1e-9;

/// Whether a hull winds around some part of space the wrong way: such a part would count as negative volume.
fn is_inside_out(hull: &TriangleMesh) -> bool {
    let tree = Bvh::new(hull);
    (0..hull.faces.len()).any(|face| {
        let [a, b, c] = hull.corners(face);
        let normal = hull.face_cross(face).normalize_or_zero();
        tree.winding_number((a + b + c) / 3.0 + normal * BESIDE) < 0
    })
}

struct Tightener<'a> {
    surface: Surface,
    model: Model<'a>,
    patch: Patch,
    /// Where the hull may not pass through itself.
    tree: Option<FaceTree>,
    /// Per face: whether it crosses the model, as it may where the hull overlaps itself; it then stays as it is.
    is_frozen: Vec<bool>,
    /// Per vertex: whether something around it changed since it was last placed.
    is_due: Vec<bool>,
    face_count: usize,
    /// Of the model.
    volume: f64,
    /// Farthest that a vertex may be from the model.
    distance: f64,
    /// What an inner hull may not leave.
    inside: Option<Inside<'a>>,
}

impl Tightener<'_> {
    fn sweep_until_done(&mut self, most: usize, watch: &Watch<'_>) -> Result<(), HullError> {
        for _ in 0..most {
            if self.sweep(watch)? < LEAST_SWEEP_GAIN_REL * self.volume {
                break;
            }
        }
        Ok(())
    }

    /// Places every vertex anew around which something changed; returns the volume gained.
    fn sweep(&mut self, watch: &Watch<'_>) -> Result<f64, HullError> {
        let mut gained = 0.0;
        for v in 0..self.surface.positions.len() as u32 {
            if !std::mem::take(&mut self.is_due[v as usize]) || self.surface.is_vertex_gone(v) {
                continue;
            }
            watch.check()?;
            if let Some(gain) = self.move_vertex(v) {
                self.mark_due(v);
                gained += gain;
            }
        }
        Ok(gained)
    }

    /// The vertex and those around it are worth another look.
    fn mark_due(&mut self, v: u32) {
        self.is_due[v as usize] = true;
        for spoke in self.surface.leaving(v) {
            self.is_due[self.surface.end(spoke) as usize] = true;
        }
    }

    /// Places a vertex anew; returns the volume gained, if any.
    fn move_vertex(&mut self, v: u32) -> Option<f64> {
        self.patch.around_vertex(&self.surface, v);
        if self.is_patch_frozen() {
            return None;
        }
        let at = self.model.place(&self.patch)?;
        // Part of the way where the whole is not sound: the old place is.
        for share in [1.0, 0.5, 0.25] {
            let position = self.patch.origin + at * share;
            let at = position - self.patch.origin;
            let gain = -self.patch.added_volume(at);
            if gain <= LEAST_GAIN_REL * self.volume {
                return None;
            }
            if self.is_allowed(at)
                && (share == 1.0 || self.model.is_clear(&self.patch, at))
                && !self.would_cross_itself(v, position)
            {
                self.surface.positions[v as usize] = position;
                if let Some(tree) = &mut self.tree {
                    tree.update_around(&self.surface, v, []);
                }
                return Some(gain);
            }
        }
        None
    }

    fn would_cross_itself(&mut self, vertex: u32, position: DVec3) -> bool {
        let surface = &self.surface;
        (self.tree.as_mut()).is_some_and(|t| t.would_cross_moved(surface, vertex, position))
    }

    fn is_patch_frozen(&self) -> bool {
        let mut faces = self.patch.face_ids.iter();
        faces.any(|&f| self.is_frozen[f as usize])
    }

    fn is_allowed(&self, at: DVec3) -> bool {
        let position = self.patch.origin + at;
        self.patch.is_sound(at)
            && self.model.is_near(position, self.distance)
            && (self.inside)
                .is_none_or(|inside| inside.holds(self.patch.ring_places.iter().copied(), position))
    }
}

#[cfg(test)]
mod tests;
