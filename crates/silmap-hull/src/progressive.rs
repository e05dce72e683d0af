//! The sequence of hulls, and levels taken out of it.

use glam::DVec3;
use silmap_geometry::{Bvh, TriangleMesh};

use super::collapse::Collapsed;
use super::surface::{GONE, Surface};

/// A sequence of nested hulls, from the model itself to the coarsest: a base mesh and vertex splits.
#[derive(Clone, Debug)]
pub struct ProgressiveHull {
    pub(super) collapsed: Collapsed,
    /// The model, in the collapsed surface's coordinates and orientation.
    pub(super) scaled: TriangleMesh,
    pub(super) original: Bvh,
    pub(super) original_faces: usize,
    /// In cubed units; negative for an inner hull, whose surface is turned inside out.
    pub(super) original_volume: f64,
    /// Object lengths per length in the collapsed surface: a power of two.
    pub(super) unit: f64,
    /// Where the origin of object coordinates lies in those of the model's file.
    pub(super) origin: DVec3,
    pub(super) is_inner: bool,
    /// Whether collapses were free to let the hull pass through itself.
    pub(super) may_cross_itself: bool,
    /// Distance from the model that no vertex may exceed, in the collapsed surface's coordinates.
    pub(super) distance_limit: f64,
}

/// A mesh out of the sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct HullLevel {
    /// The hull, in object space, outward.
    pub mesh: TriangleMesh,
    /// P(v): per vertex, the point of the original surface it stands for.
    pub surface_points: Vec<DVec3>,
    /// Its volume.
    pub volume: f64,
    /// Its volume over the original's.
    pub volume_ratio: f64,
    /// Largest distance of a vertex from its P(v), in this and all finer levels; in the model's units.
    pub distance: f64,
    /// Whether the original encloses it, rather than the other way about.
    pub is_inner: bool,
}

/// The numbers of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelSummary {
    /// Its faces.
    pub faces: usize,
    /// Its volume over the original's.
    pub volume_ratio: f64,
    /// As [`HullLevel::distance`].
    pub distance: f64,
}

impl ProgressiveHull {
    /// Faces of the coarsest level.
    #[must_use]
    pub fn least_faces(&self) -> usize {
        self.original_faces - 2 * self.collapsed.steps.len()
    }

    /// Where the origin of the model's and all levels' coordinates lies in those of its file: [`silmap_geometry::ClosedMesh::origin`].
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Whether the model encloses the hulls, rather than the other way about.
    #[must_use]
    pub fn is_inner(&self) -> bool {
        self.is_inner
    }

    /// Whether hulls of the sequence may pass through themselves: [`super::HullParams::no_self_intersections`] was not asked for.
    #[must_use]
    pub fn may_cross_itself(&self) -> bool {
        self.may_cross_itself
    }

    /// All levels, finest first, each with two faces less than the one before.
    pub fn summaries(&self) -> impl Iterator<Item = LevelSummary> + '_ {
        let mut volume = self.original_volume;
        let first = LevelSummary {
            faces: self.original_faces,
            volume_ratio: 1.0,
            distance: 0.0,
        };
        let steps = self.collapsed.steps.iter().enumerate();
        std::iter::once(first).chain(steps.map(move |(i, step)| {
            volume += step.added_volume;
            LevelSummary {
                faces: self.original_faces - 2 * (i + 1),
                volume_ratio: volume / self.original_volume,
                distance: step.distance * self.unit,
            }
        }))
    }

    /// Faces of the coarsest level that keeps to a volume over the model's and a distance from it, in its units; where none
    /// is given, any will do. The model itself keeps to both.
    #[must_use]
    pub fn faces_within(&self, volume_ratio: Option<f64>, distance: Option<f64>) -> usize {
        self.summaries()
            .take_while(|level| {
                let is_far = distance.is_some_and(|d| level.distance > d);
                let is_large = volume_ratio.is_some_and(|most| {
                    if self.is_inner {
                        level.volume_ratio < most
                    } else {
                        level.volume_ratio > most
                    }
                });
                !is_far && !is_large
            })
            .last()
            .map_or(self.original_faces, |level| level.faces)
    }

    /// The finest level of at most `faces` faces; the coarsest of all when none is that small.
    #[must_use]
    pub fn level(&self, faces: usize) -> HullLevel {
        let steps = &self.collapsed.steps;
        let done = self.collapses_to(faces);
        let (origin, positions, surface_points) = self.undone(done);
        let mut mesh = TriangleMesh {
            positions: positions.iter().map(|&p| p * self.unit).collect(),
            faces: origin
                .chunks_exact(3)
                .filter(|f| f[0] != GONE)
                .map(|f| self.outward([f[0], f[1], f[2]]))
                .collect(),
            ..TriangleMesh::default()
        };
        let surface_points = mesh
            .drop_unused_vertices()
            .into_iter()
            .map(|v| self.on_original(positions[v as usize], surface_points[v as usize]))
            .collect();
        let volume = mesh.volume();
        let original_volume = self.original_volume.abs() * self.unit.powi(3);
        HullLevel {
            surface_points,
            volume,
            volume_ratio: volume / original_volume,
            distance: done
                .checked_sub(1)
                .map_or(0.0, |last| steps[last].distance * self.unit),
            is_inner: self.is_inner,
            mesh,
        }
    }

    fn collapses_to(&self, faces: usize) -> usize {
        self.original_faces
            .saturating_sub(faces)
            .div_ceil(2)
            .min(self.collapsed.steps.len())
    }

    /// The collapsed surface after the first `done` collapses: corners of faces, positions, P.
    fn undone(&self, done: usize) -> (Vec<u32>, Vec<DVec3>, Vec<DVec3>) {
        let steps = &self.collapsed.steps;
        let mut origin = self.collapsed.origin.clone();
        let mut positions = self.collapsed.positions.clone();
        let mut surface_points = self.collapsed.surface_points.clone();
        for step in steps[done..].iter().rev() {
            self.collapsed.undo(step, &mut origin);
            for (k, (vertex, position)) in step.contraction.ends().into_iter().enumerate() {
                positions[vertex as usize] = position;
                surface_points[vertex as usize] = step.surface_points[k];
            }
        }
        (origin, positions, surface_points)
    }

    /// The level of at most `faces` faces as a surface of its own, in the collapsed surface's coordinates.
    pub(super) fn surface_at(&self, faces: usize) -> (Surface, usize) {
        let (origin, positions, _) = self.undone(self.collapses_to(faces));
        let mut mesh = TriangleMesh {
            positions,
            faces: origin
                .chunks_exact(3)
                .filter(|f| f[0] != GONE)
                .map(|f| [f[0], f[1], f[2]])
                .collect(),
            ..TriangleMesh::default()
        };
        mesh.drop_unused_vertices();
        let count = mesh.faces.len();
        (Surface::new(mesh.positions, &mesh.faces), count)
    }

    /// A surface in the collapsed surface's coordinates, as a level.
    pub(super) fn level_of(&self, surface: &Surface) -> HullLevel {
        let mut mesh = TriangleMesh {
            positions: surface.positions.clone(),
            faces: surface
                .origin
                .chunks_exact(3)
                .filter(|f| f[0] != GONE)
                .map(|f| self.outward([f[0], f[1], f[2]]))
                .collect(),
            ..TriangleMesh::default()
        };
        mesh.drop_unused_vertices();
        let surface_points: Vec<DVec3> = mesh
            .positions
            .iter()
            .map(|&p| self.original.closest_point(p).0)
            .collect();
        let distance = mesh
            .positions
            .iter()
            .zip(&surface_points)
            .map(|(p, q)| p.distance(*q))
            .fold(0.0, f64::max);
        for p in &mut mesh.positions {
            *p *= self.unit;
        }
        let volume = mesh.volume();
        HullLevel {
            surface_points: surface_points.iter().map(|&p| p * self.unit).collect(),
            volume,
            volume_ratio: volume / (self.original_volume.abs() * self.unit.powi(3)),
            distance: distance * self.unit,
            is_inner: self.is_inner,
            mesh,
        }
    }

    pub(super) fn outward(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.is_inner { [a, c, b] } else { [a, b, c] }
    }

    /// P as it was interpolated, brought back onto the surface; in object space. (Between points of one face an
    /// interpolated point lies on it, between others a little beside.)
    fn on_original(&self, position: DVec3, surface_point: DVec3) -> DVec3 {
        let p = if position == surface_point || self.original.is_empty() {
            surface_point
        } else {
            self.original.closest_point(surface_point).0
        };
        p * self.unit
    }
}
