//! Editing faces together with their colours and texture coordinates.

use crate::mesh::TriangleMesh;

impl TriangleMesh {
    /// Keeps the faces for which `keep` holds, with what they look like.
    pub fn retain_faces(&mut self, mut keep: impl FnMut(usize) -> bool) {
        let kept: Vec<u32> = (0..self.faces.len())
            .filter(|&f| keep(f))
            .map(|f| f as u32)
            .collect();
        self.select_faces(&kept);
    }

    /// Replaces the faces by the listed ones, in that order; one may be listed several times.
    ///
    /// # Panics
    /// If a listed face does not exist.
    pub fn select_faces(&mut self, chosen: &[u32]) {
        fn select<T: Copy>(all: &mut Vec<T>, chosen: &[u32]) {
            if !all.is_empty() {
                *all = chosen.iter().map(|&f| all[f as usize]).collect();
            }
        }
        select(&mut self.faces, chosen);
        select(&mut self.appearance.corner_uvs, chosen);
        select(&mut self.appearance.corner_colours, chosen);
        select(&mut self.appearance.face_materials, chosen);
    }

    /// Turns a face over.
    pub fn flip_face(&mut self, face: usize) {
        self.faces[face].swap(1, 2);
        if let Some(uvs) = self.appearance.corner_uvs.get_mut(face) {
            uvs.swap(1, 2);
        }
        if let Some(colours) = self.appearance.corner_colours.get_mut(face) {
            colours.swap(1, 2);
        }
    }

    /// Cuts a face in two from the middle of its edge after corner `from`, where vertex `middle` lies, to the corner beyond;
    /// the half at `from` keeps the face's number, the other one becomes the last face.
    pub fn split_face_edge(&mut self, face: usize, from: usize, middle: u32) {
        let (to, opposite) = ((from + 1) % 3, (from + 2) % 3);
        let corners = self.faces[face];
        self.push_face([middle, corners[to], corners[opposite]], {
            [(face, from), (face, to), (face, opposite)]
        });
        self.faces[face][to] = middle;
        // Both halves show the edge's colours; in the middle, those of its ends' mean.
        let added = self.faces.len() - 1;
        let look = &mut self.appearance;
        if let Some(&uvs) = look.corner_uvs.get(face) {
            let mean = [0, 1].map(|i| 0.5 * (uvs[from][i] + uvs[to][i]));
            look.corner_uvs[face][to] = mean;
            look.corner_uvs[added][0] = mean;
        }
        if let Some(&colours) = look.corner_colours.get(face) {
            let mean = [0, 1, 2].map(|i| 0.5 * (colours[from][i] + colours[to][i]));
            look.corner_colours[face][to] = mean;
            look.corner_colours[added][0] = mean;
        }
    }

    /// Adds a face whose corners look like the given corners `(face, corner)` of faces that exist; it takes the material
    /// of the first one's face.
    pub fn push_face(&mut self, corners: [u32; 3], like: [(usize, usize); 3]) {
        self.faces.push(corners);
        let look = &mut self.appearance;
        if !look.corner_uvs.is_empty() {
            let material = |face: usize| look.face_materials.get(face);
            // Texture coordinates only mean something in their own texture.
            let uvs = like.map(|(face, corner)| {
                if material(face) == material(like[0].0) {
                    look.corner_uvs[face][corner]
                } else {
                    look.corner_uvs[like[0].0][like[0].1]
                }
            });
            look.corner_uvs.push(uvs);
        }
        if !look.corner_colours.is_empty() {
            let colours = like.map(|(face, corner)| look.corner_colours[face][corner]);
            look.corner_colours.push(colours);
        }
        if let Some(&material) = look.face_materials.get(like[0].0) {
            look.face_materials.push(material);
        }
    }

    /// Removes the vertices that no face uses and returns, for every vertex left, which one it was.
    pub fn drop_unused_vertices(&mut self) -> Vec<u32> {
        let mut is_used = vec![false; self.positions.len()];
        for &v in self.faces.iter().flatten() {
            is_used[v as usize] = true;
        }
        let kept: Vec<u32> = (0..self.positions.len() as u32)
            .filter(|&v| is_used[v as usize])
            .collect();
        if kept.len() < self.positions.len() {
            let mut new_of_old = vec![u32::MAX; self.positions.len()];
            for (new, &old) in kept.iter().enumerate() {
                new_of_old[old as usize] = new as u32;
            }
            self.positions = kept.iter().map(|&v| self.positions[v as usize]).collect();
            for v in self.faces.iter_mut().flatten() {
                *v = new_of_old[*v as usize];
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::mesh::{Appearance, TriangleMesh};

    fn coloured() -> TriangleMesh {
        TriangleMesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            faces: vec![[0, 1, 2], [0, 1, 3]],
            appearance: Appearance {
                corner_uvs: vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 2],
                face_materials: vec![4, 5],
                ..Appearance::default()
            },
        }
    }

    #[test]
    fn colours_follow_their_faces() {
        let mut mesh = coloured();
        mesh.retain_faces(|f| f == 1);
        mesh.flip_face(0);
        assert_eq!(mesh.faces, [[0, 3, 1]]);
        assert_eq!(
            mesh.appearance.corner_uvs,
            [[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]]
        );
        assert_eq!(mesh.appearance.face_materials, [5]);
        mesh.push_face([1, 3, 0], [(0, 2), (0, 1), (0, 0)]);
        assert_eq!(mesh.appearance.corner_uvs[1][0], [1.0, 0.0]);
        assert_eq!(mesh.appearance.face_materials, [5, 5]);
        assert_eq!(mesh.drop_unused_vertices(), [0, 1, 3]);
        assert_eq!(mesh.faces, [[0, 2, 1], [1, 2, 0]]);
    }
}
