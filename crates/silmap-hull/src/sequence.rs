//! The sequence as a file: base mesh and vertex splits, from which every level comes out again, the model included.
//!
//! All numbers are little-endian, all lengths in the collapsed surface's coordinates:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | 4 | CRC-32 of all that follows |
//! | 4 + 4 | sum of 1 for an inner hull, 2 where collapses kept it from passing through itself and 4 for a model far from its file's origin; faces of the model |
//! | 8 + 8 | object lengths per length; distance from the model that no vertex may exceed |
//! | 24 | for a model far from its file's origin: where the origin of object coordinates lies in the file's |
//! | 4 + 4 + 4 | vertices of the model; faces of the base mesh; vertex splits |
//! | 16 a face | the base mesh: place of the face in the model, then its vertices |
//! | 48 a vertex | of the model's count: position and P in the base mesh, of no meaning where it has no such vertex |
//! | 152 + 4 k a split | from coarse to fine: vertex kept and vertex added; the two faces added, each its place and its vertices; positions, then P, of the two vertices; volume that the split takes away; largest distance with all coarser splits undone; k; the k corners (three a face) that pass to the added vertex |
//!
//! A reader verifies all of it: the splits are made, which gives the model, and the collapses done again from there.

use std::ops::Range;

use glam::DVec3;
use silmap_geometry::{Bvh, ClosedMesh, TriangleMesh};
use thiserror::Error;

use super::ProgressiveHull;
use super::collapse::{Collapsed, Step};
use super::surface::{Contraction, GONE, Surface};

/// What a file begins with.
pub const MAGIC: [u8; 8] = *b"SILMAPPH";
/// Version of the layout.
const VERSION: u32 = 2;

/// Why a file is no sequence.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SequenceError {
    /// It begins otherwise.
    #[error("this is no sequence of hulls")]
    NotASequence,
    /// It comes from another version of the program.
    #[error("the sequence of hulls has version {found}, and only {VERSION} can be read")]
    UnknownVersion {
        /// What it says.
        found: u32,
    },
    /// It was cut short or changed.
    #[error("the sequence of hulls is damaged: {what}")]
    Damaged {
        /// What does not fit, and where.
        what: String,
    },
}

/// Largest coordinate that is read, in the collapsed surface's lengths, of which the model takes about one: the cube of a
/// larger one is no number.
const LARGEST_COORDINATE: f64 = 1e100;

/// By which the volumes of all splits may miss the volume between base mesh and model, as a share of both.
const VOLUME_SLACK_REL: f64 = 1e-3;

fn damaged<T>(what: impl Into<String>) -> Result<T, SequenceError> {
    Err(SequenceError::Damaged { what: what.into() })
}

impl ProgressiveHull {
    /// The sequence as the bytes of a file; the layout is the module's.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let Collapsed {
            origin,
            positions,
            surface_points,
            steps,
            moved,
        } = &self.collapsed;
        let mut body = Writer(Vec::with_capacity(steps.len() * 170 + positions.len() * 48));
        let is_far = self.origin != DVec3::ZERO;
        body.number(
            u32::from(self.is_inner)
                + 2 * u32::from(!self.may_cross_itself)
                + 4 * u32::from(is_far),
        );
        body.number(self.original_faces as u32);
        body.real(self.unit);
        body.real(self.distance_limit);
        if is_far {
            body.point(self.origin);
        }
        let base: Vec<(usize, &[u32])> = (origin.chunks_exact(3).enumerate())
            .filter(|(_, f)| f[0] != GONE)
            .collect();
        body.number(positions.len() as u32);
        body.number(base.len() as u32);
        body.number(steps.len() as u32);
        for (place, corners) in base {
            body.number(place as u32);
            corners.iter().for_each(|&v| body.number(v));
        }
        for (&p, &q) in positions.iter().zip(surface_points) {
            body.points(&[p, q]);
        }
        for step in steps.iter().rev() {
            let contraction = &step.contraction;
            body.number(contraction.kept);
            body.number(contraction.removed);
            for (face, corners) in contraction.faces {
                body.number(face);
                corners.iter().for_each(|&v| body.number(v));
            }
            body.points(&contraction.positions);
            body.points(&step.surface_points);
            body.real(step.added_volume);
            body.real(step.distance);
            body.number(step.moved.len() as u32);
            for &h in &moved[step.moved.clone()] {
                body.number(h);
            }
        }
        let mut file = Writer(Vec::with_capacity(body.0.len() + 16));
        file.0.extend(MAGIC);
        file.number(VERSION);
        file.number(crc32fast::hash(&body.0));
        file.0.extend(body.0);
        file.0
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// When the bytes are something else, of another version, or do not fit together.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SequenceError> {
        let Some(rest) = bytes.strip_prefix(&MAGIC) else {
            return Err(SequenceError::NotASequence);
        };
        let mut head = Reader(rest);
        let found = head.number()?;
        if found != VERSION {
            return Err(SequenceError::UnknownVersion { found });
        }
        // A fuzzer is to get past the checksum, to what must hold without it.
        if head.number()? != crc32fast::hash(head.0) && !cfg!(fuzzing) {
            return damaged("its checksum does not fit");
        }
        let mut body = Reader(head.0);
        let kind = body.number()?;
        if kind > 7 {
            return damaged(format!("its kind is {kind}, and 7 is the largest"));
        }
        let (is_inner, may_cross_itself) = (kind & 1 != 0, kind & 2 == 0);
        let original_faces = body.number()? as usize;
        let (unit, distance_limit) = (body.real()?, body.real()?);
        let origin = if kind & 4 != 0 {
            body.point()?
        } else {
            DVec3::ZERO
        };
        if !origin.is_finite() {
            return damaged("its origin is not finite".to_owned());
        }
        if !(unit.is_normal() && unit == unit.log2().round().exp2()) {
            return damaged(format!("its scale is {unit:e}, which is no power of two"));
        }
        if distance_limit.is_nan() || distance_limit < 0.0 {
            return damaged(format!("its limit on distance is {distance_limit}"));
        }
        let collapsed = read_collapsed(&mut body, original_faces, unit)?;
        let (scaled, ends) = undo(&collapsed)?;
        let outward = TriangleMesh {
            faces: (scaled.faces.iter())
                .map(|&[a, b, c]| if is_inner { [a, c, b] } else { [a, b, c] })
                .collect(),
            positions: scaled.positions.clone(),
            ..TriangleMesh::default()
        };
        if let Err(defects) = ClosedMesh::try_from(outward) {
            return damaged(format!("its model is no closed mesh: {defects}"));
        }
        redo(&scaled, &collapsed, &ends)?;
        let original_volume = scaled.volume();
        check_volumes(&collapsed, original_volume)?;
        Ok(Self {
            original: Bvh::new(&scaled),
            original_volume,
            collapsed,
            scaled,
            original_faces,
            unit,
            origin,
            is_inner,
            may_cross_itself,
            distance_limit,
        })
    }

    /// The model that the sequence was made from, as far as the sequence knows it: without its colours.
    #[must_use]
    pub fn model(&self) -> TriangleMesh {
        TriangleMesh {
            positions: self
                .scaled
                .positions
                .iter()
                .map(|&p| p * self.unit)
                .collect(),
            faces: self.scaled.faces.iter().map(|&f| self.outward(f)).collect(),
            ..TriangleMesh::default()
        }
    }
}

fn read_collapsed(
    body: &mut Reader<'_>,
    faces: usize,
    unit: f64,
) -> Result<Collapsed, SequenceError> {
    let vertices = body.number()?;
    let base_faces = body.number()? as usize;
    let splits = body.number()? as usize;
    // Before memory is allocated for them.
    let least = base_faces as u64 * 16 + u64::from(vertices) * 48 + splits as u64 * 156;
    if (body.0.len() as u64) < least || faces as u64 != base_faces as u64 + 2 * splits as u64 {
        return damaged(format!(
            "its counts ({faces} faces, {vertices} vertices, {base_faces} faces of the base mesh, {splits} splits) do not fit \
             together or its length"
        ));
    }
    let face = |id: u32, by: Element| {
        let is_known = (id as usize) < faces;
        if is_known {
            Ok(id)
        } else {
            damaged(format!("{by} names face {id} of {faces}"))
        }
    };
    let vertex = |id: u32, by: Element| {
        let is_known = id < vertices;
        if is_known {
            Ok(id)
        } else {
            damaged(format!("{by} names vertex {id} of {vertices}"))
        }
    };
    let right = |points: [DVec3; 2], of: Element| {
        let is_wrong = |c: &f64| !(c.abs() <= LARGEST_COORDINATE && (c * unit).is_finite());
        match points.iter().flat_map(DVec3::to_array).find(is_wrong) {
            None => Ok(points),
            Some(c) => damaged(format!("{of} has the coordinate {c:e}")),
        }
    };
    let mut origin = vec![GONE; faces * 3];
    for place in 0..base_faces {
        let by = Element::Face(place);
        let first = face(body.number()?, by)? as usize * 3;
        for k in 0..3 {
            origin[first + k] = vertex(body.number()?, by)?;
        }
    }
    let (mut positions, mut surface_points) = (Vec::new(), Vec::new());
    for place in 0..vertices {
        let [p, q] = right(body.points()?, Element::Vertex(place))?;
        positions.push(p);
        surface_points.push(q);
    }
    let (mut steps, mut moved) = (Vec::with_capacity(splits), Vec::new());
    for place in 0..splits {
        let by = Element::Split(place);
        let (kept, removed) = (vertex(body.number()?, by)?, vertex(body.number()?, by)?);
        let mut faces_of_step = [(0, [0; 3]); 2];
        for (id, corners) in &mut faces_of_step {
            *id = face(body.number()?, by)?;
            for corner in corners {
                *corner = vertex(body.number()?, by)?;
            }
        }
        let (ends, points) = (right(body.points()?, by)?, right(body.points()?, by)?);
        let (added_volume, distance) = (body.real()?, body.real()?);
        let possible = 0.0..=LARGEST_COORDINATE;
        if !possible.contains(&added_volume) {
            return damaged(format!("{by} takes away a volume of {added_volume:e}"));
        }
        if !(possible.contains(&distance) && (distance * unit).is_finite()) {
            return damaged(format!("{by} has a distance of {distance:e}"));
        }
        let first = moved.len();
        for _ in 0..body.number()? {
            let h = body.number()?;
            face(h / 3, by)?;
            moved.push(h);
        }
        steps.push(Step {
            contraction: Contraction {
                kept,
                removed,
                faces: faces_of_step,
                positions: ends,
            },
            moved: Range {
                start: first,
                end: moved.len(),
            },
            surface_points: points,
            added_volume,
            distance,
        });
    }
    if !body.0.is_empty() {
        return damaged(format!("{} bytes follow its end", body.0.len()));
    }
    steps.reverse();
    Ok(Collapsed {
        origin,
        positions,
        surface_points,
        steps,
        moved,
    })
}

/// A part of the file, numbered from zero in the order of the file.
#[derive(Clone, Copy, Debug)]
enum Element {
    /// A face of the base mesh.
    Face(usize),
    Vertex(u32),
    Split(usize),
}

impl std::fmt::Display for Element {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Face(place) => write!(f, "face {place} of its base mesh"),
            Self::Vertex(place) => write!(f, "vertex {place}"),
            Self::Split(place) => write!(f, "split {place}"),
        }
    }
}

/// Makes all splits: the model, and where each collapse had put its vertex.
fn undo(collapsed: &Collapsed) -> Result<(TriangleMesh, Vec<DVec3>), SequenceError> {
    let mut origin = collapsed.origin.clone();
    let mut positions = collapsed.positions.clone();
    let mut ends = Vec::with_capacity(collapsed.steps.len());
    for step in collapsed.steps.iter().rev() {
        ends.push(positions[step.contraction.kept as usize]);
        collapsed.undo(step, &mut origin);
        for (vertex, position) in step.contraction.ends() {
            positions[vertex as usize] = position;
        }
    }
    ends.reverse();
    if let Some(h) = origin.iter().position(|&v| v == GONE) {
        let face = h / 3;
        return damaged(format!("no split leads to face {face} of the model"));
    }
    let faces = origin.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
    Ok((
        TriangleMesh {
            positions,
            faces,
            ..TriangleMesh::default()
        },
        ends,
    ))
}

/// Whether the splits take away what lies between the base mesh and the model.
fn check_volumes(collapsed: &Collapsed, original_volume: f64) -> Result<(), SequenceError> {
    let base = TriangleMesh {
        positions: collapsed.positions.clone(),
        faces: (collapsed.origin.chunks_exact(3))
            .filter(|f| f[0] != GONE)
            .map(|f| [f[0], f[1], f[2]])
            .collect(),
        ..TriangleMesh::default()
    };
    let between = base.volume() - original_volume;
    let taken: f64 = collapsed.steps.iter().map(|s| s.added_volume).sum();
    if (taken - between).abs() <= VOLUME_SLACK_REL * (original_volume.abs() + between.abs()) {
        return Ok(());
    }
    damaged(format!(
        "its splits take away a volume of {taken:e}, but {between:e} lies between base mesh and model"
    ))
}

/// Does all collapses again from the model on, which must be closed: whether they are what the splits undo.
fn redo(model: &TriangleMesh, collapsed: &Collapsed, ends: &[DVec3]) -> Result<(), SequenceError> {
    let mut surface = Surface::new(model.positions.clone(), &model.faces);
    let mut moved = Vec::new();
    for (place, (step, &end)) in collapsed.steps.iter().zip(ends).enumerate() {
        let split = collapsed.steps.len() - 1 - place;
        let wanted = &step.contraction;
        let first = wanted.faces[0].0 * 3;
        let Some(edge) = (first..first + 3).find(|&h| {
            !surface.is_gone(h)
                && [surface.start(h), surface.end(h)] == [wanted.kept, wanted.removed]
        }) else {
            return damaged(format!("split {split} has no edge"));
        };
        if !surface.can_contract(edge) {
            return damaged(format!("split {split} does not leave a closed mesh"));
        }
        moved.clear();
        let done = surface.contract(edge, end, &mut moved);
        if done != *wanted || moved != collapsed.moved[step.moved.clone()] {
            return damaged(format!("split {split} is not what a collapse undoes"));
        }
    }
    Ok(())
}

struct Writer(Vec<u8>);

impl Writer {
    fn number(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    fn real(&mut self, value: f64) {
        self.0.extend(value.to_le_bytes());
    }

    fn points(&mut self, points: &[DVec3; 2]) {
        points.iter().for_each(|&p| self.point(p));
    }

    fn point(&mut self, point: DVec3) {
        point.to_array().into_iter().for_each(|c| self.real(c));
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], SequenceError> {
        let Some((first, rest)) = self.0.split_first_chunk() else {
            return damaged("it ends too early");
        };
        self.0 = rest;
        Ok(*first)
    }

    fn number(&mut self) -> Result<u32, SequenceError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn real(&mut self) -> Result<f64, SequenceError> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    fn points(&mut self) -> Result<[DVec3; 2], SequenceError> {
        Ok([self.point()?, self.point()?])
    }

    fn point(&mut self) -> Result<DVec3, SequenceError> {
        Ok(DVec3::new(self.real()?, self.real()?, self.real()?))
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
