//! The model's colours at the vertices of a hull.
//!
//! A vertex has the colour of the model at P(v). A texture may change much between two vertices: there it is the mean of that
//! and of places on the model near the parts of the faces that are the vertex's own.

use glam::DVec3;
use silmap_geometry::{Appearance, Bvh, Material, TriangleMesh};

use super::HullLevel;

/// Weights of a face's corners at the middle of what is nearest to the first.
const NEAR_FIRST: [f64; 3] = [11.0 / 18.0, 7.0 / 36.0, 7.0 / 36.0];

impl HullLevel {
    /// What the hull looks like: a colour for every vertex if `model`, which it was made from, has colours of any kind.
    #[must_use]
    pub fn appearance(&self, model: &TriangleMesh) -> Appearance {
        let of_model = &model.appearance;
        let is_tinted = |m: &Material| m.texture.is_some() || m.base_colour != [1.0; 3];
        if of_model.corner_colours.is_empty() && !of_model.materials.iter().any(is_tinted) {
            return Appearance::default();
        }
        let tree = Bvh::new(model);
        let colour_at = |p: DVec3| {
            let (_, face, weights) = tree.closest_point(p);
            of_model.albedo(face as usize, weights.map(|w| w as f32))
        };
        let mut colours: Vec<[f32; 3]> =
            self.surface_points.iter().map(|&p| colour_at(p)).collect();
        if of_model.materials.iter().any(|m| m.texture.is_some()) {
            self.spread(&mut colours, colour_at);
        }
        let of_corners = |face: &[u32; 3]| face.map(|v| colours[v as usize]);
        Appearance {
            corner_colours: self.mesh.faces.iter().map(of_corners).collect(),
            ..Appearance::default()
        }
    }

    /// Mixes each vertex's colour with those found around it, by the faces' areas.
    fn spread(&self, colours: &mut [[f32; 3]], colour_at: impl Fn(DVec3) -> [f32; 3]) {
        let mut sums = vec![([0.0_f64; 3], 0.0_f64); colours.len()];
        for (f, face) in self.mesh.faces.iter().enumerate() {
            let corners = self.mesh.corners(f);
            let area = self.mesh.face_cross(f).length();
            for k in 0..3 {
                let at = (0..3).map(|i| corners[(k + i) % 3] * NEAR_FIRST[i]).sum();
                let colour = colour_at(at);
                let (sum, weight) = &mut sums[face[k] as usize];
                (0..3).for_each(|c| sum[c] += area * f64::from(colour[c]));
                *weight += area;
            }
        }
        for (colour, (sum, weight)) in colours.iter_mut().zip(sums) {
            if weight > 0.0 {
                *colour = std::array::from_fn(|c| {
                    (0.5 * (f64::from(colour[c]) + sum[c] / weight)) as f32
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HullParams, build};
    use silmap_geometry::Watch;
    use silmap_geometry::{ClosedMesh, ColourImage};
    use silmap_models as models;

    fn level_of(mesh: &TriangleMesh) -> HullLevel {
        let mesh = ClosedMesh::try_from(mesh.clone()).unwrap();
        let params = HullParams {
            target_faces: 200,
            ..HullParams::default()
        };
        build(&mesh, &params, &Watch::silent()).unwrap().level(200)
    }

    /// A torus, red where x is positive and blue elsewhere, by `paint` from a face's corners.
    fn two_halves(paint: impl Fn(&mut Appearance, [bool; 3])) -> TriangleMesh {
        let mut mesh = models::torus(2000);
        let is_right = |v: u32| mesh.positions[v as usize].x > 0.0;
        let sides: Vec<[bool; 3]> = mesh.faces.iter().map(|f| f.map(is_right)).collect();
        mesh.appearance = Appearance::default();
        for side in sides {
            paint(&mut mesh.appearance, side);
        }
        mesh
    }

    fn assert_two_halves(level: &HullLevel, appearance: &Appearance) {
        assert_eq!(appearance.corner_colours.len(), level.mesh.faces.len());
        let mut seen = [0; 2];
        for (face, colours) in level.mesh.faces.iter().zip(&appearance.corner_colours) {
            for (&v, colour) in face.iter().zip(colours) {
                let x = level.mesh.positions[v as usize].x;
                if x.abs() > 0.6 {
                    let wanted = if x > 0.0 { [1.0, 0.0] } else { [0.0, 1.0] };
                    let found = [colour[0], colour[2]];
                    assert!(
                        (0..2).all(|k| (found[k] - wanted[k]).abs() < 0.02),
                        "{x}: {colour:?}"
                    );
                    seen[usize::from(x > 0.0)] += 1;
                }
            }
        }
        assert!(seen.iter().all(|&n| n > 50), "{seen:?}");
    }

    #[test]
    fn colours_of_vertices_materials_and_textures_stay_where_they_were() {
        let red_or_blue = |is_right: bool| {
            if is_right {
                [1.0, 0.0, 0.0]
            } else {
                [0.0, 0.0, 1.0]
            }
        };
        let by_vertex = two_halves(|a, side| a.corner_colours.push(side.map(red_or_blue)));
        let mut by_material = two_halves(|a, side| a.face_materials.push(u16::from(side[0])));
        by_material.appearance.materials = [false, true]
            .map(|is_right| Material {
                base_colour: red_or_blue(is_right),
                ..Material::default()
            })
            .to_vec();
        let mut by_texture = two_halves(|a, side| {
            a.face_materials.push(0);
            a.corner_uvs
                .push(side.map(|is_right| [if is_right { 0.75 } else { 0.25 }, 0.5]));
        });
        by_texture.appearance.materials = vec![Material {
            base_colour: [1.0; 3],
            texture: Some(ColourImage {
                width: 2,
                height: 1,
                rgba: vec![0, 0, 255, 255, 255, 0, 0, 255],
            }),
            ..Material::default()
        }];
        for mesh in [by_vertex, by_material, by_texture] {
            let level = level_of(&mesh);
            assert_two_halves(&level, &level.appearance(&mesh));
        }
    }

    #[test]
    fn a_model_without_colours_has_a_hull_without() {
        let mut mesh = models::torus(1000);
        mesh.appearance = Appearance::default();
        let level = level_of(&mesh);
        assert_eq!(level.appearance(&mesh), Appearance::default());
        mesh.appearance.face_materials = vec![0; mesh.faces.len()];
        mesh.appearance.materials = vec![Material {
            base_colour: [1.0; 3],
            ..Material::default()
        }];
        assert_eq!(level.appearance(&mesh), Appearance::default());
    }
}
