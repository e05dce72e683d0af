//! Colours and texture coordinates of face corners during edge collapses.
//!
//! Corners at one vertex share a look where colour and texture coordinates run on from face to face. Where they do not, the edge
//! between is a seam, and texture coordinates must never be mixed across it. So a vertex on a seam only slides along it, and the end
//! of a seam stays where it is, as long as there is anything else to collapse.
//!
//! Source: H. Hoppe. New Quadric Metric for Simplifying Meshes with Appearance Attributes. IEEE Visualization 1999, section 4 (wedges).
//! Deviation: looks are no part of the error; they are read off the faces around the edge where its new vertex lies.

use std::collections::HashMap;

use glam::DVec3;
use silmap_geometry::{Appearance, TriangleMesh};

use super::shrinking::Shrinking;

/// Of one corner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Look {
    uv: [f32; 2],
    colour: [f32; 3],
}

impl Look {
    fn mixed(looks: [Self; 3], weights: [f64; 3]) -> Self {
        let mix = |values: [f32; 3]| {
            (0..3)
                .map(|k| f64::from(values[k]) * weights[k])
                .sum::<f64>() as f32
        };
        Self {
            uv: [0, 1].map(|a| mix(looks.map(|l| l.uv[a]))),
            colour: [0, 1, 2].map(|c| mix(looks.map(|l| l.colour[c]))),
        }
    }
}

/// The looks of all corners. Empty for a mesh that has none.
#[derive(Clone, Debug, Default)]
pub(super) struct Looks {
    /// Per face: the look of each corner.
    corners: Vec<[u32; 3]>,
    looks: Vec<Look>,
    has_uvs: bool,
    has_colours: bool,
}

/// What a collapse does to the looks: from the ends' to the new vertex's. Those not named stay.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Change {
    /// Of each side of the edge: the looks at its two ends.
    sides: [[u32; 2]; 2],
    /// How many corners keep a look that was made for another place.
    pub(super) stretched: u32,
}

impl Looks {
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let paint = &mesh.appearance;
        let (has_uvs, has_colours) = (
            !paint.corner_uvs.is_empty(),
            !paint.corner_colours.is_empty(),
        );
        if !has_uvs && !has_colours && paint.face_materials.is_empty() {
            return Self::default();
        }
        let mut known = HashMap::new();
        let mut looks = Vec::new();
        let mut corners = Vec::with_capacity(mesh.faces.len());
        for (f, face) in mesh.faces.iter().enumerate() {
            let material = paint.face_materials.get(f);
            corners.push([0, 1, 2].map(|k| {
                let look = Look {
                    uv: paint.corner_uvs.get(f).map_or([0.0; 2], |uvs| uvs[k]),
                    colour: (paint.corner_colours.get(f)).map_or([1.0; 3], |colours| colours[k]),
                };
                let bits = (look.uv.map(f32::to_bits), look.colour.map(f32::to_bits));
                *known.entry((face[k], material, bits)).or_insert_with(|| {
                    looks.push(look);
                    looks.len() as u32 - 1
                })
            }));
        }
        Self {
            corners,
            looks,
            has_uvs,
            has_colours,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The look of a face at a vertex of it.
    fn at(&self, work: &Shrinking, face: u32, vertex: u32) -> u32 {
        let corner = work.corner(face, vertex);
        self.corners[face as usize][corner]
    }

    /// The looks at the ends of an edge on both its sides.
    fn sides(&self, work: &Shrinking, ends: [u32; 2]) -> Option<[[u32; 2]; 2]> {
        let mut sides = work
            .faces_of(ends[0])
            .filter(|&f| work.face(f).contains(&ends[1]))
            .map(|f| ends.map(|v| self.at(work, f, v)));
        Some([sides.next()?, sides.next()?])
    }

    /// Whether looks do not run on across an edge.
    pub(super) fn is_seam(&self, work: &Shrinking, ends: [u32; 2]) -> bool {
        self.sides(work, ends).is_some_and(|[one, two]| one != two)
    }

    /// What happens when the edge is collapsed to `p`; nothing when a seam would be torn. `is_forced` allows that too.
    pub(super) fn change(
        &self,
        work: &Shrinking,
        ends: [u32; 2],
        p: DVec3,
        is_forced: bool,
    ) -> Option<Change> {
        if self.is_empty() {
            return Some(Change::default());
        }
        let sides = self.sides(work, ends)?;
        let stays = ends.map(|v| work.position(v) == p);
        let mut stretched = 0;
        for (end, &v) in ends.iter().enumerate() {
            // Of a face that has another look there than those along the edge, or one of two that were one.
            let of_edge = sides.map(|side| side[end]);
            let other = 1 - end;
            let parts_here = of_edge[0] == of_edge[1] && sides[0][other] != sides[1][other];
            if stays[end] {
                continue;
            }
            stretched += work
                .faces_of(v)
                .filter(|&f| !work.face(f).contains(&ends[other]))
                .filter(|&f| parts_here || !of_edge.contains(&self.at(work, f, v)))
                .count() as u32;
        }
        let is_seam = sides[0] != sides[1];
        let on_edge = stays[0] || stays[1] || p == work.middle(ends);
        let is_kept = stretched == 0 && (!is_seam || on_edge);
        (is_kept || is_forced).then_some(Change { sides, stretched })
    }

    /// Gives the corners at the new vertex their looks; called before the faces change.
    pub(super) fn apply(&mut self, work: &Shrinking, ends: [u32; 2], p: DVec3, change: &Change) {
        if self.is_empty() {
            return;
        }
        let new = change.sides.map(|side| self.look_at(work, ends, p, side));
        for (end, &v) in ends.iter().enumerate() {
            for f in work.faces_of(v) {
                let look = &mut self.corners[f as usize][work.corner(f, v)];
                if let Some(side) = (0..2).find(|&s| change.sides[s][end] == *look) {
                    *look = new[side];
                }
            }
        }
    }

    /// The look at `p` on the side of the edge whose ends look like `side`.
    fn look_at(&mut self, work: &Shrinking, ends: [u32; 2], p: DVec3, side: [u32; 2]) -> u32 {
        for (&v, look) in ends.iter().zip(side) {
            if work.position(v) == p {
                return look;
            }
        }
        let mut nearest = (f64::INFINITY, None);
        for (&v, look) in ends.iter().zip(side) {
            for f in work.faces_of(v) {
                if self.at(work, f, v) != look {
                    continue;
                }
                let (weights, distance) = closest(work.face(f).map(|v| work.position(v)), p);
                if distance < nearest.0 {
                    nearest = (distance, Some((f, weights)));
                }
            }
        }
        let Some((f, weights)) = nearest.1 else {
            return side[0];
        };
        let looks = self.corners[f as usize].map(|look| self.looks[look as usize]);
        self.looks.push(Look::mixed(looks, weights));
        self.looks.len() as u32 - 1
    }

    /// The looks of the faces that are left, as the original has them.
    pub(super) fn into_appearance(self, faces: &[u32], original: &Appearance) -> Appearance {
        let of_faces = |is_there: bool| {
            let faces = if is_there { faces } else { &[] };
            (faces.iter()).map(|&f| self.corners[f as usize].map(|l| self.looks[l as usize]))
        };
        Appearance {
            corner_uvs: of_faces(self.has_uvs).map(|c| c.map(|l| l.uv)).collect(),
            corner_colours: of_faces(self.has_colours)
                .map(|c| c.map(|l| l.colour))
                .collect(),
            face_materials: if original.face_materials.is_empty() {
                Vec::new()
            } else {
                let of_face = |&f: &u32| original.face_materials[f as usize];
                faces.iter().map(of_face).collect()
            },
            materials: original.materials.clone(),
        }
    }
}

/// The barycentric weights of a triangle's point nearest to `p`, and its squared distance.
///
/// Source: C. Ericson. Real-Time Collision Detection. 2005, section 5.1.5.
fn closest([a, b, c]: [DVec3; 3], p: DVec3) -> ([f64; 3], f64) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (bp, cp) = (p - b, p - c);
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let share = |x: f64, y: f64| if x + y > 0.0 { x / (x + y) } else { 0.0 };
    let weights = if d1 <= 0.0 && d2 <= 0.0 {
        [1.0, 0.0, 0.0]
    } else if d3 >= 0.0 && d4 <= d3 {
        [0.0, 1.0, 0.0]
    } else if d6 >= 0.0 && d5 <= d6 {
        [0.0, 0.0, 1.0]
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = share(d1, -d3);
        [1.0 - t, t, 0.0]
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = share(d2, -d6);
        [1.0 - t, 0.0, t]
    } else if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = share(d4 - d3, d5 - d6);
        [0.0, 1.0 - t, t]
    } else {
        let sum = va + vb + vc;
        [va / sum, vb / sum, vc / sum]
    };
    let at = a * weights[0] + b * weights[1] + c * weights[2];
    (weights, at.distance_squared(p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle() {
        let triangle = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0];
        for (p, weights) in [
            ([0.5, 0.5, 3.0], [0.5, 0.25, 0.25]),
            ([-1.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
            ([5.0, -1.0, 1.0], [0.0, 1.0, 0.0]),
            ([-1.0, 7.0, 0.0], [0.0, 0.0, 1.0]),
            ([1.0, -4.0, 0.0], [0.5, 0.5, 0.0]),
            ([-4.0, 1.0, 0.0], [0.5, 0.0, 0.5]),
            ([2.0, 2.0, 0.0], [0.0, 0.5, 0.5]),
        ] {
            let (found, distance) = closest(triangle, DVec3::from(p));
            assert_eq!(found, weights, "{p:?}");
            let at: DVec3 = (0..3).map(|k| triangle[k] * weights[k]).sum();
            assert!((at.distance_squared(DVec3::from(p)) - distance).abs() < 1e-12);
        }
    }
}
