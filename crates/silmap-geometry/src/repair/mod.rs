//! Repairing a nearly closed mesh into a closed, oriented manifold.
//!
//! Nothing is moved and nothing is filled (see [`crate::holes`] for that). Faces without content go: those that repeat a
//! corner, copies, and fins (faces with a free edge that stand on a surface, or
//! with nothing but free edges). Faces whose corners lie on one line are replaced by turning an edge. Sheets that touch in edges or vertices come
//! apart there: every sheet gets its own copy of the vertex, at the same place. Then all faces of a part are turned to
//! one side, and parts outward.
//!
//! Source: A. Guéziec, G. Taubin, F. Lazarus, W. Horn. Cutting and Stitching: Converting Sets of Polygons to Manifold
//! Surfaces. IEEE TVCG 7(2), 2001 (cutting at singular edges and vertices).
//! Deviations: at a singular edge, sheets are not only cut but joined again in pairs around the solid between them, so
//! that a closed surface stays closed.

mod faces;
mod outward;
mod sheets;
#[cfg(test)]
mod tests;
mod zero_area;

use thiserror::Error;

pub use self::faces::find_copies;
pub use self::outward::turn_outward;
pub use self::zero_area::replace_zero_area;
use crate::defects::counted;
use crate::mesh::TriangleMesh;

/// Why a mesh cannot be repaired.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RepairError {
    /// A one-sided surface, such as a Möbius strip.
    #[error(
        "the surface has one side only: walking around it turns the faces at edge ({}, {}) over",
        edge[0],
        edge[1]
    )]
    NotOrientable {
        /// The first edge where both sides meet, by the mesh's vertices.
        edge: [u32; 2],
    },
    /// No face is left.
    #[error("no face is left after {removed} degenerate and duplicate faces are removed")]
    NothingLeft {
        /// How many there were.
        removed: usize,
    },
    /// Indices or coordinates that mean nothing.
    #[error("{0}")]
    Meaningless(crate::defects::MeshDefects),
}

/// What was changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RepairReport {
    /// Faces removed because they use a vertex twice.
    pub repeated_corners: usize,
    /// Faces removed because others lie on the same three vertices.
    pub duplicates: usize,
    /// Faces removed because they stand on a surface with a free edge, or touch others in no edge at all.
    pub fins: usize,
    /// Faces whose corners lie on one line, replaced by turning an edge.
    pub zero_areas: usize,
    /// Edges with more than two faces that were taken apart.
    pub crowded_edges: usize,
    /// Vertices added because sheets were taken apart.
    pub added_vertices: usize,
    /// Faces turned over to agree with their neighbours.
    pub flipped: usize,
    /// For every vertex of the result, the vertex it was, or lies beside.
    pub vertex_of: Vec<u32>,
    /// For every face of the result, the face it was, or is a part of.
    pub face_of: Vec<u32>,
}

impl RepairReport {
    /// One sentence for each kind of change.
    pub fn changes(&self) -> impl Iterator<Item = String> {
        [
            (
                self.repeated_corners,
                "face",
                "that use a vertex twice: removed",
            ),
            (
                self.duplicates,
                "face",
                "on the same vertices as others: removed",
            ),
            (
                self.fins,
                "face",
                "with free edges that enclose nothing: removed",
            ),
            (
                self.zero_areas,
                "face",
                "without area: removed by turning an edge",
            ),
            (
                self.crowded_edges,
                "edge",
                "with more than two faces: taken apart",
            ),
            (self.added_vertices, "vertex", "added where sheets touch"),
            (
                self.flipped,
                "face",
                "turned over to agree with the neighbours",
            ),
        ]
        .into_iter()
        .filter(|&(count, ..)| count > 0)
        .map(|(count, noun, what)| format!("{} {what}", counted(count, noun)))
    }
}

/// Repairs a mesh as far as that is safe; the result may still be open, or have no volume.
///
/// # Errors
/// When indices or coordinates are meaningless, nothing is left, or the surface has one side only. The mesh is then left
/// half repaired.
pub fn repair(mesh: &mut TriangleMesh) -> Result<RepairReport, RepairError> {
    faces::check_meaning(mesh)?;
    let mut report = RepairReport {
        vertex_of: (0..mesh.positions.len() as u32).collect(),
        face_of: (0..mesh.faces.len() as u32).collect(),
        ..RepairReport::default()
    };
    report.repeated_corners = faces::remove_repeated_corners(mesh, &mut report.face_of);
    report.duplicates = faces::remove_duplicates(mesh, &mut report.face_of);
    report.fins = faces::remove_fins(mesh, &mut report.face_of);
    sheets::take_apart(mesh, &mut report)?;
    // A face that was left alone at a crowded edge may now stand by itself.
    report.fins += faces::remove_fins(mesh, &mut report.face_of);
    if mesh.faces.is_empty() {
        let removed = report.repeated_corners + report.duplicates + report.fins;
        return Err(RepairError::NothingLeft { removed });
    }
    report.zero_areas = replace_zero_area(mesh, &mut report.face_of, 0);
    Ok(report)
}
