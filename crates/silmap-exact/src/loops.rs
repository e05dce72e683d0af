//! From directed edges to closed loops, in the mesh and in the image.
//!
//! Silhouette edges are a boundary, so every vertex has as many that end as start and they fall into closed loops, however
//! they meet. Projected, the loops wind about an image point once for each front-facing layer of the mesh behind it: the
//! covered region is where the winding number is not zero.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 6.
//! Deviation: where loops touch in a vertex they are cut apart there, which keeps them short; the paper leaves the
//! decomposition open.

use glam::{DVec2, DVec3};
use silmap_geometry::camera::in_short;
use silmap_geometry::polygon::Loop;
use silmap_geometry::{Camera, TriangleMesh};
use thiserror::Error;

use crate::{DirectedEdge, silhouette_edges};

/// Why edges do not chain into closed loops.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChainError {
    /// More edges start in a vertex than end there, or the reverse: not a silhouette.
    #[error(
        "{starting} edges start in vertex {vertex} but {ending} end there, so they form no closed loops"
    )]
    Unbalanced {
        /// The first such vertex.
        vertex: u32,
        /// Edges that start there.
        starting: usize,
        /// Edges that end there.
        ending: usize,
    },
}

/// Why a mesh has no outline in an image.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum OutlineError {
    /// Part of the silhouette is beside or behind the eye, where there is no image.
    #[error(
        "silhouette vertex {vertex} has depth {}: move the eye until the whole model lies in front of it",
        in_short(*.depth)
    )]
    BehindEye {
        /// A vertex of the silhouette.
        vertex: u32,
        /// Its distance along the viewing direction, not positive.
        depth: f64,
    },
    /// Part of the silhouette is seen so far beside the image that its coordinates there mean nothing.
    #[error(
        "silhouette vertex {vertex} is seen {distance_px:.0e} pixels beside the image: move the eye away from it or look towards the model"
    )]
    FarBesideImage {
        /// A vertex of the silhouette.
        vertex: u32,
        /// How far out, pixels; may be infinite.
        distance_px: f64,
    },
}

/// Points farther out than this, pixels, are refused: a crossing of two edges is no longer known to a pixel there, and the union of
/// loops that falls back on integers cannot represent much larger coordinates.
pub(crate) const FARTHEST_PX: f64 = 1e9;

/// Where a vertex is seen, pixels: in front of the eye, and at a number that can be counted with.
pub(crate) fn image_of_vertex(
    vertex: u32,
    positions: &[DVec3],
    camera: &Camera,
) -> Result<DVec2, OutlineError> {
    let position = positions[vertex as usize];
    let depth = camera.depth(position);
    if depth <= 0.0 || depth.is_nan() {
        return Err(OutlineError::BehindEye { vertex, depth });
    }
    let point = camera.image_from_object(position);
    let distance_px = point.abs().max_element();
    if point.is_finite() && distance_px <= FARTHEST_PX {
        Ok(point)
    } else {
        Err(OutlineError::FarBesideImage {
            vertex,
            distance_px,
        })
    }
}

/// Joins directed edges into closed loops of vertex ids; each edge is used once, and no loop visits a vertex twice.
///
/// Loops come in the order of their first edge in `edges` that no earlier loop uses up.
///
/// # Errors
/// When some vertex has not as many starting as ending edges.
pub fn chain_loops(edges: &[DirectedEdge]) -> Result<Vec<Vec<u32>>, ChainError> {
    let starting = sorted_by_start(edges);
    check_balance(edges, &starting)?;
    Ok(chain_balanced(edges, &starting))
}

/// Indices of the edges, sorted by the vertex that they start in.
fn sorted_by_start(edges: &[DirectedEdge]) -> Vec<u32> {
    let mut starting: Vec<u32> = (0..edges.len() as u32).collect();
    starting.sort_by_key(|&e| (edges[e as usize].from, e));
    starting
}

/// [`chain_loops`] of edges that are known to balance at every vertex.
fn chain_balanced(edges: &[DirectedEdge], starting: &[u32]) -> Vec<Vec<u32>> {
    let first_from = |v: u32| starting.partition_point(|&e| edges[e as usize].from < v);
    // Per edge, in the order of `starting`; per vertex, found by its first edge: how many of its edges are used.
    let mut used_from = vec![0_usize; edges.len()];
    let mut is_used = vec![false; edges.len()];
    // Where a vertex is on the current path, by its first edge.
    let mut place_on_path: Vec<Option<usize>> = vec![None; edges.len()];
    let mut loops = Vec::new();
    let mut path: Vec<u32> = Vec::new();
    for seed in 0..edges.len() {
        if is_used[seed] {
            continue;
        }
        let mut at = edges[seed].from;
        loop {
            let slot = first_from(at);
            if let Some(place) = place_on_path[slot] {
                for &v in &path[place..] {
                    place_on_path[first_from(v)] = None;
                }
                loops.push(path.split_off(place));
            }
            let edge = starting[slot + used_from[slot]..]
                .first()
                .map(|&e| e as usize)
                .filter(|&e| edges[e].from == at);
            // Balance: only the path's start can run out of edges, and then the path is empty.
            let Some(edge) = edge else { break };
            used_from[slot] += 1;
            is_used[edge] = true;
            place_on_path[slot] = Some(path.len());
            path.push(at);
            at = edges[edge].to;
        }
    }
    loops
}

fn check_balance(edges: &[DirectedEdge], starting: &[u32]) -> Result<(), ChainError> {
    let mut ends: Vec<u32> = edges.iter().map(|e| e.to).collect();
    ends.sort_unstable();
    let count = |v: u32| {
        let from = |e: &u32| edges[*e as usize].from;
        let starts =
            starting.partition_point(|e| from(e) <= v) - starting.partition_point(|e| from(e) < v);
        let ending = ends.partition_point(|&e| e <= v) - ends.partition_point(|&e| e < v);
        (starts, ending)
    };
    let unbalanced = edges
        .iter()
        .flat_map(|e| [e.from, e.to])
        .filter(|&v| count(v).0 != count(v).1)
        .min();
    match unbalanced {
        None => Ok(()),
        Some(vertex) => {
            let (starting, ending) = count(vertex);
            Err(ChainError::Unbalanced {
                vertex,
                starting,
                ending,
            })
        }
    }
}

/// The silhouette of `mesh` in the image of `camera`, pixels, as closed loops.
///
/// The winding number about a point is the number of front-facing layers there, counted positive in image coordinates
/// (x right, y down), so outer loops have positive area. Loops may cross themselves and each other: fill them with
/// [`silmap_geometry::polygon::fill_non_zero`].
///
/// # Errors
/// When a silhouette vertex does not lie in front of the eye.
pub fn outline_loops(mesh: &TriangleMesh, camera: &Camera) -> Result<Vec<Loop>, OutlineError> {
    let edges = silhouette_edges(mesh, camera.eye);
    // A boundary balances at every vertex.
    let loops = chain_balanced(&edges, &sorted_by_start(&edges));
    image_loops(&loops, &mesh.positions, camera)
}

/// Loops of vertex ids, as [`chain_loops`] gives them, in the image of `camera`, pixels; turned so that outer loops have
/// positive area.
///
/// # Errors
/// When a vertex does not lie in front of the eye, or is seen too far beside the image.
pub fn image_loops(
    loops: &[Vec<u32>],
    positions: &[DVec3],
    camera: &Camera,
) -> Result<Vec<Loop>, OutlineError> {
    let project = |&vertex: &u32| image_of_vertex(vertex, positions, camera);
    // Front faces run counter-clockwise as seen, which is negative where y points down.
    (loops.iter())
        .map(|ids| ids.iter().rev().map(project).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, shaken_torus, torus};
    use glam::DVec2;
    use proptest::prelude::*;
    use silmap_geometry::polygon::{edges as loop_edges, signed_area};

    fn directed(pairs: &[(u32, u32)]) -> Vec<DirectedEdge> {
        pairs
            .iter()
            .map(|&(from, to)| DirectedEdge { from, to })
            .collect()
    }

    #[test]
    fn touching_loops_come_apart() {
        let eight = directed(&[(5, 1), (1, 2), (2, 5), (5, 3), (3, 4), (4, 5)]);
        let loops = chain_loops(&eight).expect("balanced");
        assert_eq!(loops, [vec![5, 1, 2], vec![5, 3, 4]]);
        let through = directed(&[(1, 5), (5, 3), (3, 4), (4, 5), (5, 1)]);
        let lengths: Vec<_> = chain_loops(&through)
            .expect("balanced")
            .iter()
            .map(Vec::len)
            .collect();
        assert_eq!(lengths, [3, 2]);
    }

    #[test]
    fn open_chains_are_refused() {
        let open = directed(&[(1, 2), (2, 3), (3, 4)]);
        let error = chain_loops(&open);
        assert_eq!(
            error,
            Err(ChainError::Unbalanced {
                vertex: 1,
                starting: 1,
                ending: 0
            })
        );
        assert_eq!(chain_loops(&[]), Ok(vec![]));
    }

    proptest! {
        #[test]
        fn loops_hold_every_edge_once(
            mesh in shaken_torus(),
            eye in prop::array::uniform3(-6_i32..6),
        ) {
            let mut wanted = silhouette_edges(&mesh, DVec3::from(eye.map(f64::from)));
            let loops = chain_loops(&wanted).expect("a silhouette is balanced");
            let mut got: Vec<_> = loops
                .iter()
                .flat_map(|l| (0..l.len()).map(|k| (l[k], l[(k + 1) % l.len()])))
                .map(|(from, to)| DirectedEdge { from, to })
                .collect();
            got.sort();
            wanted.sort();
            prop_assert_eq!(got, wanted);
            for l in &loops {
                let mut ids = l.clone();
                ids.sort_unstable();
                ids.dedup();
                prop_assert_eq!(ids.len(), l.len(), "a vertex twice");
            }
        }
    }

    fn winding_about(loops: &[Loop], p: DVec2) -> i32 {
        let mut winding = 0;
        for (a, b) in loops.iter().flat_map(|l| loop_edges(l)) {
            let side = (b - a).perp_dot(p - a);
            if a.y <= p.y && b.y > p.y && side > 0.0 {
                winding += 1;
            }
            if b.y <= p.y && a.y > p.y && side < 0.0 {
                winding -= 1;
            }
        }
        winding
    }

    /// Front-facing triangles whose projection holds an image point.
    fn front_layers(mesh: &TriangleMesh, camera: &Camera, p: DVec2) -> i32 {
        (0..mesh.faces.len())
            .filter(|&f| (camera.eye - mesh.corners(f)[0]).dot(mesh.face_cross(f)) > 0.0)
            .filter(|&f| {
                let [a, b, c] = mesh.corners(f).map(|q| camera.image_from_object(q));
                [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|&(s, t)| (t - s).perp_dot(p - s) < 0.0)
            })
            .count() as i32
    }

    #[test]
    fn winding_number_counts_front_layers() {
        let mesh = torus(40, 20);
        let mut most = 0;
        for (k, direction) in [
            (0, DVec3::new(1.0, 0.05, 0.2)),
            (1, DVec3::new(0.3, 0.4, 1.0)),
            (2, DVec3::new(0.9, 0.1, 0.4)),
        ] {
            let bounds = mesh.bounds();
            let camera = Camera::fit_sphere(
                direction * 4.0,
                bounds.center,
                bounds.radius,
                None,
                (64, 64),
            )
            .expect("the eye is outside");
            let loops = outline_loops(&mesh, &camera).expect("all in front");
            let layers_at = |i: u32| {
                let p = DVec2::new(f64::from(i % 64) + 0.31, f64::from(i / 64) + 0.47);
                (p, front_layers(&mesh, &camera, p))
            };
            for (p, layers) in (0..64 * 64).map(layers_at) {
                assert_eq!(winding_about(&loops, p), layers, "eye {k}, point {p}");
                most = most.max(layers);
            }
            let dropped = &loops[1..];
            assert!(
                (0..64 * 64)
                    .map(layers_at)
                    .any(|(p, layers)| winding_about(dropped, p) != layers),
                "a dropped loop must be noticed"
            );
        }
        assert!(most > 1, "some view must show two layers");
    }

    #[test]
    fn outer_loop_has_positive_area() {
        let cube = cube();
        let camera = Camera::fit_sphere(
            DVec3::new(4.0, 5.0, 6.0),
            DVec3::splat(0.5),
            0.9,
            None,
            (100, 80),
        )
        .expect("the eye is outside");
        let loops = outline_loops(&cube, &camera).expect("all in front");
        assert_eq!(loops.len(), 1);
        assert!(signed_area(&loops[0]) > 500.0);
    }

    #[test]
    fn a_model_about_the_eye_is_refused() {
        let camera = Camera::look_at(
            DVec3::new(0.5, 0.5, 1.5),
            DVec3::new(0.5, 3.0, 1.5),
            Some(DVec3::Z),
            1.0,
            (8, 8),
        )
        .expect("a plain camera");
        assert!(matches!(
            outline_loops(&cube(), &camera),
            Err(OutlineError::BehindEye { .. })
        ));
    }
}
