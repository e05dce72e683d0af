//! Which pieces of a carved surface are the object.
//!
//! Masks leave more than the object: specks by accident, and what lies beside most images, where nothing says that it is outside. The
//! object is what most cameras look at.

use silmap_geometry::{Topology, TriangleMesh};

use crate::view::CaptureView;

/// Pieces with less than this share of the object's volume are left out...
const LEAST_PIECE: f64 = 0.01;

/// ... and those that lie in the images of fewer views than this share of what the object does.
const LEAST_LOOKED_AT: f64 = 0.6;

/// Vertices of a piece that are looked at.
const SAMPLES: usize = 64;

/// Leaves out all pieces but the object's, and walls of cavities, which no silhouette shows. Returns how many pieces there were. The
/// views are in the coordinates of the mesh.
pub(crate) fn keep_object(mesh: &mut TriangleMesh, views: &[&CaptureView]) -> usize {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let (part_of, count) = topology.parts();
    let mut pieces = vec![Piece::default(); count];
    let middle = mesh.bounds().center;
    for (face, &part) in part_of.iter().enumerate() {
        let [a, b, c] = mesh.corners(face).map(|p| p - middle);
        let piece = &mut pieces[part as usize];
        piece.volume += a.dot(b.cross(c)) / 6.0;
        piece.faces.push(face);
    }
    for piece in &mut pieces {
        piece.looked_at = looked_at(mesh, &piece.faces, views);
    }
    // Of pieces that as many look at, the largest.
    let most = pieces.iter().map(|p| p.looked_at).fold(0.0, f64::max);
    let is_looked_at = |p: &&Piece| p.looked_at >= LEAST_LOOKED_AT * most;
    let largest = pieces
        .iter()
        .filter(is_looked_at)
        .map(|p| p.volume)
        .fold(0.0, f64::max);
    let is_kept = |p: &Piece| is_looked_at(&p) && p.volume >= LEAST_PIECE * largest;
    let left_out = pieces.iter().filter(|p| p.volume > 0.0 && !is_kept(p));
    let left_out = left_out.count();
    mesh.retain_faces(|face| is_kept(&pieces[part_of[face] as usize]));
    mesh.drop_unused_vertices();
    left_out
}

#[derive(Clone, Default)]
struct Piece {
    volume: f64,
    faces: Vec<usize>,
    /// In how many images it is, parts of it by their share.
    looked_at: f64,
}

fn looked_at(mesh: &TriangleMesh, faces: &[usize], views: &[&CaptureView]) -> f64 {
    let stride = faces.len().div_ceil(SAMPLES).max(1);
    let points: Vec<_> = (faces.iter().step_by(stride))
        .map(|&face| mesh.corners(face)[0])
        .collect();
    let shown = |view: &CaptureView| {
        let is_shown = |point: &&glam::DVec3| {
            (view.camera.project(**point)).is_some_and(|(image, _)| view.camera.shows(image))
        };
        points.iter().filter(is_shown).count() as f64
    };
    let all: f64 = views.iter().map(|view| shown(view)).sum();
    all / points.len().max(1) as f64
}
