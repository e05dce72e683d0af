//! The frames that the atlas's normals are given in: a smooth normal for each vertex of the hull, and a tangent for each corner
//! of its faces.
//!
//! Frames are not stored beside the hull but follow from it, so that what bakes normals and what writes the glTF mesh agree.
//! A normal (x, y, z) of the picture is x·t + y·b + z·n with t, b = w·(n × t) and n interpolated over the face and brought to unit
//! length, but not made orthogonal again. b points up in the picture, against v, as glTF 2.0 has it.

use glam::DVec3;
use silmap_geometry::TriangleMesh;

use super::CoarseHull;

/// Frames of a hull; see the module.
#[derive(Clone, Debug, PartialEq)]
pub struct TangentFrames {
    /// Unit outward normal of each vertex.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangent of each face and corner, at a right angle to the vertex's normal, and w: 1 or −1.
    pub tangents: Vec<[[f32; 4]; 3]>,
}

impl TangentFrames {
    /// The frames of a hull whose corners have these texture coordinates.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    #[must_use]
    pub fn new(hull: &CoarseHull, corner_uvs: &[[[f32; 2]; 3]]) -> Self {
        let mesh = TriangleMesh {
            positions: (hull.positions.iter())
                .map(|p| DVec3::from_array(p.map(f64::from)))
                .collect(),
            faces: hull.faces.clone(),
            ..TriangleMesh::default()
        };
        // +Z where the faces around give none, because glTF allows no zero.
        let normals: Vec<DVec3> = (mesh.vertex_normals().iter())
            .map(|n| n.try_normalize().unwrap_or(DVec3::Z))
            .collect();
        let tangents = corner_uvs.iter().zip(&mesh.faces).enumerate();
        Self {
            tangents: tangents
                .map(|(f, (uvs, face))| {
                    let (along_u, handedness) = gradient(mesh.corners(f), uvs);
                    face.map(|v| {
                        let tangent = across(along_u, normals[v as usize]).as_vec3();
                        tangent.extend(handedness).to_array()
                    })
                })
                .collect(),
            normals: normals.iter().map(|n| n.as_vec3().to_array()).collect(),
        }
    }
}

/// The direction in which u grows on a face, and w.
fn gradient([a, b, c]: [DVec3; 3], uvs: &[[f32; 2]; 3]) -> (DVec3, f32) {
    let [s, t, r] = uvs.map(|uv| glam::DVec2::from(uv.map(f64::from)));
    let (to_b, to_c) = (t - s, r - s);
    let area = to_b.perp_dot(to_c);
    let along_u = ((b - a) * to_c.y - (c - a) * to_b.y) * area.signum();
    // Against v in the picture is up. On a face whose picture is not mirrored v runs clockwise from u.
    (along_u, if area > 0.0 { -1.0 } else { 1.0 })
}

/// The unit vector at a right angle to `normal` nearest to `direction`; any at a right angle when that is none.
fn across(direction: DVec3, normal: DVec3) -> DVec3 {
    let direction = direction.normalize_or_zero();
    (direction - normal * normal.dot(direction))
        .try_normalize()
        .unwrap_or_else(|| normal.any_orthonormal_vector())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron whose first face lies in the plane z = 0 as seen from below.
    fn tetrahedron() -> CoarseHull {
        CoarseHull {
            positions: vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5, 0.5, 2.0]],
            faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            surface_points: Vec::new(),
            volume_ratio: 1.0,
        }
    }

    #[test]
    fn tangents_follow_u_and_bitangents_go_up_in_the_picture() {
        let hull = tetrahedron();
        let plain = [[0.1, 0.1], [0.6, 0.1], [0.1, 0.6]];
        let mirrored = [[0.1, 0.1], [0.1, 0.6], [0.6, 0.1]];
        let turned = [[0.6, 0.6], [0.1, 0.5], [0.6, 0.1]];
        let uvs = vec![plain, mirrored, turned, plain];
        let frames = TangentFrames::new(&hull, &uvs);
        for (f, face) in hull.faces.iter().enumerate() {
            let corner = |k: usize| DVec3::from(hull.positions[face[k] as usize].map(f64::from));
            for (k, &vertex) in face.iter().enumerate() {
                let normal = DVec3::from(frames.normals[vertex as usize].map(f64::from));
                let [x, y, z, w] = frames.tangents[f][k].map(f64::from);
                let tangent = DVec3::new(x, y, z);
                assert!((tangent.length() - 1.0).abs() < 1e-6);
                assert!(tangent.dot(normal).abs() < 1e-6);
                assert!(w.abs() == 1.0);
                // How u and v change along the frame's axes, by the change along the face's sides.
                let up = w * normal.cross(tangent);
                let face_normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
                let change = |axis: DVec3, coordinate: usize| {
                    let flat =
                        axis - face_normal * axis.dot(face_normal) / face_normal.length_squared();
                    // Barycentric weights of the direction.
                    let weight = |k: usize| {
                        let (b, c) = (corner((k + 1) % 3), corner((k + 2) % 3));
                        (c - b).cross(flat).dot(face_normal) / face_normal.length_squared()
                    };
                    (0..3)
                        .map(|k| weight(k) * f64::from(uvs[f][k][coordinate]))
                        .sum::<f64>()
                };
                assert!(change(tangent, 0) > 0.0, "face {f}: u along the tangent");
                assert!(change(up, 1) < 0.0, "face {f}: v along the bitangent");
            }
        }
    }

    #[test]
    fn a_face_without_a_picture_has_a_frame_all_the_same() {
        let hull = tetrahedron();
        let frames = TangentFrames::new(&hull, &[[[0.5; 2]; 3]; 4]);
        for [x, y, z, w] in frames.tangents.into_flattened() {
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5 && w.abs() == 1.0);
        }
    }
}
