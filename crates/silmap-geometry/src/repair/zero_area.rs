//! Removing zero-area faces by edge flips.
//!
//! The middle corner of a face whose corners lie on one line touches the face beyond its longest edge. When that edge is
//! exchanged for the one from the middle corner to that face's far corner, the two faces become the two halves of the
//! face beyond: no point of the surface moves, and no colour.
//!
//! Limits: a face with two corners at one place stays. Welding leaves none; they come of sheets that were taken apart and
//! then joined by the filling of a hole, where the two vertices cannot become one again.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::defects::has_corners_on_line;
use crate::mesh::TriangleMesh;
use crate::predicates::are_collinear;
use crate::queue::CostQueue;

/// Replaces the faces from `first_face` on whose corners lie on one line, where an edge can be turned for it; the mesh's
/// coordinates are finite. Of a chain of them, the longest goes first. `face_of` names the faces, as far as it reaches.
/// Returns how many such faces are fewer.
pub fn replace_zero_area(mesh: &mut TriangleMesh, face_of: &mut [u32], first_face: usize) -> usize {
    let mut found: Vec<u32> = (first_face..mesh.faces.len())
        .filter(|&f| has_corners_on_line(mesh.corners(f)))
        .map(|f| f as u32)
        .collect();
    if found.is_empty() {
        return 0;
    }
    let before = found.len();
    let mut turner = Turner::new(mesh, face_of);
    loop {
        let mut has_turned = false;
        // The longest first, of equals the last.
        let entry = |turner: &Turner<'_>, f: u32| (-turner.longest(f), Reverse(f));
        let mut queue: CostQueue<Reverse<u32>> = found.iter().map(|&f| entry(&turner, f)).collect();
        found.clear();
        while let Some((cost, Reverse(face))) = queue.pop() {
            if !turner.is_line(face) || -cost != turner.longest(face) {
                continue;
            }
            let Some(beyond) = turner.turn_longest(face) else {
                found.push(face);
                continue;
            };
            has_turned = true;
            for changed in [face, beyond] {
                if turner.is_line(changed) {
                    queue.extend([entry(&turner, changed)]);
                }
            }
        }
        found.retain(|&f| turner.is_line(f));
        found.sort_unstable();
        found.dedup();
        // What could not be turned may be possible now that its neighbours have changed.
        if found.is_empty() || !has_turned {
            return before.saturating_sub(found.len());
        }
    }
}

/// A mesh whose edges are being turned.
struct Turner<'a> {
    mesh: &'a mut TriangleMesh,
    face_of: &'a mut [u32],
    /// The faces at every edge, its lower vertex first.
    faces_at: BTreeMap<[u32; 2], Vec<u32>>,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [key(a, b), key(b, c), key(c, a)]
}

impl<'a> Turner<'a> {
    fn new(mesh: &'a mut TriangleMesh, face_of: &'a mut [u32]) -> Self {
        let mut faces_at: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (f, &face) in (0..).zip(&mesh.faces) {
            for edge in edges_of(face) {
                faces_at.entry(edge).or_default().push(f);
            }
        }
        Self {
            mesh,
            face_of,
            faces_at,
        }
    }

    fn is_line(&self, face: u32) -> bool {
        has_corners_on_line(self.mesh.corners(face as usize))
    }

    fn length_squared(&self, [a, b]: [u32; 2]) -> f64 {
        let [a, b] = [a, b].map(|v| self.mesh.positions[v as usize]);
        a.distance_squared(b)
    }

    fn longest_squared(&self, face: [u32; 3]) -> f64 {
        let lengths = edges_of(face).map(|e| self.length_squared(e));
        lengths.into_iter().fold(0.0, f64::max)
    }

    /// The squared length of a face's longest edge.
    fn longest(&self, face: u32) -> f64 {
        self.longest_squared(self.mesh.faces[face as usize])
    }

    /// Number of faces without area among two, and the sum of their longest edges: what has to become less, so that
    /// turning comes to an end.
    fn badness(&self, faces: [[u32; 3]; 2]) -> (usize, f64) {
        faces
            .into_iter()
            .filter(|f| are_collinear(f.map(|v| self.mesh.positions[v as usize])))
            .fold((0, 0.0), |(count, sum), f| {
                (count + 1, sum + self.longest_squared(f).sqrt())
            })
    }

    /// Turns the longest edge of a face, if the face beyond allows it, and returns that one.
    fn turn_longest(&mut self, face: u32) -> Option<u32> {
        let corners = self.mesh.faces[face as usize];
        // The last of equal ones, which is as good as any.
        let k = (0..3).max_by(|&i, &j| {
            let length = |k: usize| self.length_squared([corners[k], corners[(k + 1) % 3]]);
            length(i).total_cmp(&length(j))
        })?;
        let [p, q, middle] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
        let &[first, second] = self.faces_at.get(&key(p, q))?.as_slice() else {
            return None;
        };
        let beyond = if first == face { second } else { first };
        let other = self.mesh.faces[beyond as usize];
        // The face beyond walks the edge from q to p.
        let at_q = (0..3).find(|&j| other[j] == q && other[(j + 1) % 3] == p)?;
        let far = other[(at_q + 2) % 3];
        let is_taken = |edge| self.faces_at.get(&edge).is_some_and(|at| !at.is_empty());
        if beyond == face || far == middle || is_taken(key(middle, far)) {
            return None;
        }
        let halves = [[p, far, middle], [far, q, middle]];
        let (old, new) = (self.badness([corners, other]), self.badness(halves));
        if new.0 > old.0 || (new.0 == old.0 && new.1 >= old.1) {
            return None;
        }
        self.paint_halves([face, beyond], at_q, self.share_from(q, p, middle));
        for (f, half) in [face, beyond].into_iter().zip(halves) {
            for edge in edges_of(self.mesh.faces[f as usize]) {
                self.faces_at.entry(edge).or_default().retain(|&g| g != f);
            }
            self.mesh.faces[f as usize] = half;
        }
        for (f, half) in [face, beyond].into_iter().zip(halves) {
            for edge in edges_of(half) {
                self.faces_at.entry(edge).or_default().push(f);
            }
        }
        let name = self.face_of.get(beyond as usize).copied();
        if let (Some(slot), Some(name)) = (self.face_of.get_mut(face as usize), name) {
            *slot = name;
        }
        Some(beyond)
    }

    /// How far along the way from one vertex to another a third one lies.
    fn share_from(&self, from: u32, to: u32, vertex: u32) -> f32 {
        let way = self.length_squared([from, to]).sqrt();
        let part = self.length_squared([from, vertex]).sqrt();
        if way > 0.0 { (part / way) as f32 } else { 0.0 }
    }

    /// Gives both halves of a face its looks: `halves[1]` is that face, cut at `share` of its edge after corner `at_q`.
    fn paint_halves(&mut self, halves: [u32; 2], at_q: usize, share: f32) {
        fn cut<const N: usize>(
            all: &mut [[[f32; N]; 3]],
            [face, beyond]: [usize; 2],
            at_q: usize,
            share: f32,
        ) {
            if all.is_empty() {
                return;
            }
            let [q, p, far] = [0, 1, 2].map(|i| all[beyond][(at_q + i) % 3]);
            let mut middle = q;
            for (m, p) in middle.iter_mut().zip(p) {
                *m += (p - *m) * share;
            }
            all[face] = [p, far, middle];
            all[beyond] = [far, q, middle];
        }
        let [face, beyond] = halves.map(|f| f as usize);
        let look = &mut self.mesh.appearance;
        cut(&mut look.corner_uvs, [face, beyond], at_q, share);
        cut(&mut look.corner_colours, [face, beyond], at_q, share);
        if let Some(&material) = look.face_materials.get(beyond) {
            look.face_materials[face] = material;
        }
    }
}
