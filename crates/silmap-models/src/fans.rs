//! Models with vertices of very high valence, on which whatever takes the square of a vertex's faces shows.

use glam::DVec3;
use silmap_geometry::TriangleMesh;

/// Two cones base to base about the z axis: `sides` faces meet in each apex.
#[must_use]
pub fn bicone(sides: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh {
        positions: vec![DVec3::Z, -DVec3::Z],
        ..TriangleMesh::default()
    };
    for i in 0..sides {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
        mesh.positions.push(DVec3::new(cos, sin, 0.0));
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        mesh.faces.extend([[0, a, b], [1, b, a]]);
    }
    mesh
}

/// A cylinder whose flat caps are fans of `sides` faces.
#[must_use]
pub fn flat_drum(sides: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh {
        positions: vec![DVec3::Z, -DVec3::Z],
        ..TriangleMesh::default()
    };
    for i in 0..sides {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
        let rim = [1.0, -1.0].map(|z| DVec3::new(cos, sin, z));
        mesh.positions.extend(rim);
        let (a, b) = (2 + 2 * i, 2 + 2 * ((i + 1) % sides));
        let (below_a, below_b) = (a + 1, b + 1);
        mesh.faces.extend([[0, a, b], [1, below_b, below_a]]);
        mesh.faces.extend([[a, below_a, below_b], [a, below_b, b]]);
    }
    mesh
}
