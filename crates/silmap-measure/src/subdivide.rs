//! Subdivision without change of the surface, to measure the influence of the number of faces.

use std::collections::HashMap;

use silmap_geometry::TriangleMesh;

/// Cuts each face into four at the middles of its edges, again and again while there are at most `most_faces`. The surface,
/// its colours and the number of its loops stay as they are.
#[must_use]
pub fn subdivide(mesh: &TriangleMesh, most_faces: usize) -> TriangleMesh {
    let mut mesh = mesh.clone();
    while !mesh.faces.is_empty() && mesh.faces.len().saturating_mul(4) <= most_faces {
        mesh = once(&mesh);
    }
    mesh
}

fn once(mesh: &TriangleMesh) -> TriangleMesh {
    let mut fine = TriangleMesh {
        positions: mesh.positions.clone(),
        faces: Vec::with_capacity(4 * mesh.faces.len()),
        ..TriangleMesh::default()
    };
    // Only looked up, never gone through.
    let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
    for face in &mesh.faces {
        let [a, b, c] = *face;
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                let (p, q) = (mesh.positions[p as usize], mesh.positions[q as usize]);
                fine.positions.push(p.midpoint(q));
                fine.positions.len() as u32 - 1
            })
        });
        fine.faces
            .extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let look = &mesh.appearance;
    fine.appearance.materials.clone_from(&look.materials);
    fine.appearance.face_materials = (look.face_materials.iter())
        .flat_map(|&material| [material; 4])
        .collect();
    fine.appearance.corner_uvs = look.corner_uvs.iter().flat_map(quarters).collect();
    fine.appearance.corner_colours = look.corner_colours.iter().flat_map(quarters).collect();
    fine
}

/// What the corners of a face have, for the corners of its four parts.
fn quarters<const N: usize>(corners: &[[f32; N]; 3]) -> [[[f32; N]; 3]; 4] {
    let [a, b, c] = *corners;
    let middle = |p: [f32; N], q: [f32; N]| std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use silmap_geometry::ClosedMesh;
    use silmap_models as models;

    #[test]
    fn the_surface_stays_and_is_closed() {
        let mut mesh = models::torus(400);
        mesh.appearance.corner_colours = vec![[[0.25, 0.5, 1.0]; 3]; mesh.faces.len()];
        let count = mesh.faces.len();
        let same = subdivide(&mesh, 4 * count - 1);
        assert_eq!(same, mesh);
        let fine = subdivide(&mesh, 16 * count + 5);
        assert_eq!(fine.faces.len(), 16 * count);
        assert_eq!(fine.appearance.corner_colours.len(), 16 * count);
        assert!((fine.volume() - mesh.volume()).abs() < 1e-9 * mesh.volume());
        assert!(ClosedMesh::try_from(fine).is_ok());
    }
}
