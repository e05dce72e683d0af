//! A closed mesh under edge collapses.

use glam::DVec3;

/// Least cosine between the normals of a face before and after.
const LEAST_TURN_COSINE: f64 = 0.2;

/// Least area of a face over its longest side squared.
const LEAST_SHAPE: f64 = 1e-4;

#[cfg(test)]
thread_local! {
    /// How many faces at vertices this thread has looked at.
    pub(super) static LOOKED_AT: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Faces by vertex, and what became of both.
#[derive(Clone, Debug)]
pub(super) struct Shrinking {
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    is_gone: Vec<bool>,
    /// Per vertex: the faces at it, and some that are gone; how many are not.
    faces_at: Vec<Vec<u32>>,
    valences: Vec<u32>,
    /// Per vertex: how often it changed.
    versions: Vec<u32>,
    face_count: usize,
}

impl Shrinking {
    pub(super) fn new(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        let mut faces_at = vec![Vec::new(); positions.len()];
        for (f, face) in (0..).zip(&faces) {
            for &v in face {
                faces_at[v as usize].push(f);
            }
        }
        Self {
            versions: vec![0; positions.len()],
            valences: faces_at.iter().map(|at| at.len() as u32).collect(),
            is_gone: vec![false; faces.len()],
            face_count: faces.len(),
            positions,
            faces,
            faces_at,
        }
    }

    pub(super) fn face_count(&self) -> usize {
        self.face_count
    }

    pub(super) fn position(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    pub(super) fn version(&self, v: u32) -> u32 {
        self.versions[v as usize]
    }

    /// The vertices of a face.
    pub(super) fn face(&self, f: u32) -> [u32; 3] {
        self.faces[f as usize]
    }

    /// Which corner of a face a vertex of it is.
    pub(super) fn corner(&self, f: u32, v: u32) -> usize {
        let face = self.faces[f as usize];
        (0..3).find(|&k| face[k] == v).unwrap_or(0)
    }

    /// The middle of an edge.
    pub(super) fn middle(&self, [a, b]: [u32; 2]) -> DVec3 {
        self.position(a).midpoint(self.position(b))
    }

    /// How many faces are at a vertex.
    pub(super) fn valence(&self, v: u32) -> u32 {
        self.valences[v as usize]
    }

    /// The faces at a vertex.
    pub(super) fn faces_of(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        #[cfg(test)]
        LOOKED_AT.set(LOOKED_AT.get() + self.faces_at[v as usize].len());
        let faces = self.faces_at[v as usize].iter().copied();
        faces.filter(|&f| !self.is_gone[f as usize])
    }

    /// One face less at a vertex. The list is cleaned up when half of it is gone: to look for the face each time would take the square
    /// of the faces at a vertex of many.
    fn lose_face(&mut self, v: u32) {
        let (faces, valence) = (
            &mut self.faces_at[v as usize],
            &mut self.valences[v as usize],
        );
        *valence -= 1;
        if faces.len() > 2 * *valence as usize + 8 {
            #[cfg(test)]
            LOOKED_AT.set(LOOKED_AT.get() + faces.len());
            faces.retain(|&f| !self.is_gone[f as usize]);
        }
    }

    /// The vertices that share an edge with `v`, ascending.
    pub(super) fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut others: Vec<u32> = (self.faces_of(v))
            .flat_map(|f| self.faces[f as usize])
            .filter(|&w| w != v)
            .collect();
        others.sort_unstable();
        others.dedup();
        others
    }

    /// Whether collapsing the edge leaves a closed manifold: its ends have no common neighbours but the two beside it, and those
    /// keep three faces.
    pub(super) fn can_collapse(&self, [a, b]: [u32; 2]) -> bool {
        let of_b = self.neighbours(b);
        let of_a = self.neighbours(a);
        let common: Vec<u32> = of_a
            .into_iter()
            .filter(|v| of_b.binary_search(v).is_ok())
            .collect();
        let is_edge = of_b.binary_search(&a).is_ok();
        let keeps = |&v: &u32| self.valence(v) > 3;
        is_edge && common.len() == 2 && common.iter().all(keeps)
    }

    /// Whether no face turns over or loses its shape when the ends of an edge both move to `p`.
    pub(super) fn is_sound(&self, ends: [u32; 2], p: DVec3) -> bool {
        let mut at_ends = ends.iter().flat_map(|&v| self.faces_of(v));
        at_ends.all(|f| {
            let face = self.faces[f as usize];
            if ends.iter().all(|v| face.contains(v)) {
                return true;
            }
            let old = face.map(|v| self.position(v));
            let new = face.map(|v| {
                if ends.contains(&v) {
                    p
                } else {
                    self.position(v)
                }
            });
            let cross = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
            let (before, after) = (cross(old), cross(new));
            let [a, b, c] = new;
            let longest = (a.distance_squared(b))
                .max(b.distance_squared(c))
                .max(c.distance_squared(a));
            let turn = before.normalize_or_zero().dot(after.normalize_or_zero());
            after.length() > LEAST_SHAPE * longest
                && (turn > LEAST_TURN_COSINE || before == DVec3::ZERO)
        })
    }

    /// Moves both ends of an edge to `p` and makes them one, the first.
    pub(super) fn collapse(&mut self, [kept, removed]: [u32; 2], p: DVec3) {
        self.positions[kept as usize] = p;
        for f in std::mem::take(&mut self.faces_at[removed as usize]) {
            if self.is_gone[f as usize] {
                continue;
            }
            let face = &mut self.faces[f as usize];
            if face.contains(&kept) {
                let corners = *face;
                self.is_gone[f as usize] = true;
                self.face_count -= 1;
                for v in corners.into_iter().filter(|&v| v != removed) {
                    self.lose_face(v);
                }
            } else {
                for v in face.iter_mut().filter(|v| **v == removed) {
                    *v = kept;
                }
                self.faces_at[kept as usize].push(f);
                self.valences[kept as usize] += 1;
            }
        }
        self.valences[removed as usize] = 0;
        self.versions[kept as usize] += 1;
        self.versions[removed as usize] += 1;
    }

    /// The vertices, those of no face too, the faces that are left, and which of the first faces these were.
    pub(super) fn into_parts(self) -> (Vec<DVec3>, Vec<[u32; 3]>, Vec<u32>) {
        let left: Vec<u32> = (0..)
            .zip(&self.is_gone)
            .filter_map(|(f, &is_gone)| (!is_gone).then_some(f))
            .collect();
        let faces = left.iter().map(|&f| self.faces[f as usize]).collect();
        (self.positions, faces, left)
    }
}
