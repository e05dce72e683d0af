//! The mesh while it shrinks: flat half-edge arrays, and the edge collapse on them.
//!
//! Half-edge `h` belongs to face `h / 3` and runs from `origin[h]` to the origin of the next one in the same face.
//!
//! Source: the link condition is that of T. K. Dey, H. Edelsbrunner, S. Guha, D. V. Nekhayev. Topology Preserving Edge
//! Contraction. Publications de l'Institut Mathématique (Beograd) 66, 1999.

use glam::DVec3;
use silmap_geometry::topology::Topology;

/// Stands for "no half-edge": the face or vertex is gone.
pub(super) const GONE: u32 = u32::MAX;

/// Half-edge arrays of a closed, oriented manifold.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Vertex positions.
    pub(super) positions: Vec<DVec3>,
    /// Per half-edge: the vertex it starts at; [`GONE`] when its face was removed.
    pub(super) origin: Vec<u32>,
    /// Per half-edge: the one along the same edge in the other face.
    twin: Vec<u32>,
    /// Per vertex: a half-edge that starts there; [`GONE`] when the vertex was removed.
    outgoing: Vec<u32>,
    valence: Vec<u32>,
    /// Scratch of the link condition: the last question a vertex was marked in.
    marks: Vec<u32>,
    question: u32,
}

pub(super) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

pub(super) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// What a collapse changed, to be undone by a vertex split.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contraction {
    /// The vertex that stays and moves.
    pub(super) kept: u32,
    /// The vertex that goes.
    pub(super) removed: u32,
    /// The two removed faces, with their corners before.
    pub(super) faces: [(u32, [u32; 3]); 2],
    /// Where the two vertices were.
    pub(super) positions: [DVec3; 2],
}

impl Contraction {
    /// The two vertices, and where they were.
    pub(super) fn ends(&self) -> [(u32, DVec3); 2] {
        [
            (self.kept, self.positions[0]),
            (self.removed, self.positions[1]),
        ]
    }
}

impl Surface {
    /// Links up the faces of a closed, oriented manifold.
    pub(super) fn new(positions: Vec<DVec3>, faces: &[[u32; 3]]) -> Self {
        let topology = Topology::new(faces, positions.len());
        let twin = (0..faces.len() * 3)
            .map(|h| {
                let used = topology
                    .neighbour(h / 3, h % 3)
                    .expect("every edge of a closed manifold has two faces");
                used.face * 3 + u32::from(used.corner)
            })
            .collect();
        let origin: Vec<u32> = faces.iter().flatten().copied().collect();
        let mut outgoing = vec![GONE; positions.len()];
        let mut valence = vec![0; positions.len()];
        for (h, &v) in origin.iter().enumerate() {
            outgoing[v as usize] = h as u32;
            valence[v as usize] += 1;
        }
        Self {
            marks: vec![0; positions.len()],
            question: 0,
            positions,
            origin,
            twin,
            outgoing,
            valence,
        }
    }

    pub(super) fn position(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    pub(super) fn start(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    pub(super) fn end(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    pub(super) fn twin(&self, h: u32) -> u32 {
        self.twin[h as usize]
    }

    pub(super) fn valence(&self, vertex: u32) -> u32 {
        self.valence[vertex as usize]
    }

    pub(super) fn is_gone(&self, h: u32) -> bool {
        self.origin[h as usize] == GONE
    }

    /// The name of the edge that a half-edge lies on.
    pub(super) fn edge(&self, h: u32) -> u32 {
        h.min(self.twin(h))
    }

    pub(super) fn is_vertex_gone(&self, vertex: u32) -> bool {
        self.outgoing[vertex as usize] == GONE
    }

    pub(super) fn corners(&self, face: u32) -> [u32; 3] {
        [0, 1, 2].map(|k| self.origin[(face * 3 + k) as usize])
    }

    /// The next half-edge around the start of `h`, counter-clockwise from outside.
    pub(super) fn turn(&self, h: u32) -> u32 {
        self.twin(previous(h))
    }

    /// The half-edges that start where `h` starts, from `h` counter-clockwise.
    pub(super) fn around(&self, h: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = Some(h);
        std::iter::from_fn(move || {
            let current = at?;
            let following = self.turn(current);
            at = (following != h).then_some(following);
            Some(current)
        })
    }

    /// The half-edges that start at a vertex.
    pub(super) fn leaving(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.around(self.outgoing[vertex as usize])
    }

    /// The faces that stay when the edge of `h` is collapsed, in order around it: each as its half-edge that lies
    /// opposite to the edge's vertex (so from one ring vertex to the next).
    pub(super) fn ring(&self, h: u32) -> impl Iterator<Item = u32> + '_ {
        // Of the faces around either end, the first and the last hold the edge itself.
        let side = |h: u32| {
            let kept = self.valence(self.start(h)) as usize - 2;
            self.around(h).skip(1).take(kept).map(next)
        };
        side(h).chain(side(self.twin(h)))
    }

    /// Whether collapsing the edge leaves a closed manifold: its ends have no common neighbours but the two beside it,
    /// and those keep three faces.
    pub(super) fn can_contract(&mut self, h: u32) -> bool {
        let twin = self.twin(h);
        let beside = [self.start(previous(h)), self.start(previous(twin))];
        if beside.iter().any(|&v| self.valence(v) < 4) {
            return false;
        }
        self.question += 1;
        let question = self.question;
        let mut spoke = h;
        loop {
            let end = self.end(spoke);
            self.marks[end as usize] = question;
            spoke = self.turn(spoke);
            if spoke == h {
                break;
            }
        }
        self.around(twin)
            .filter(|&spoke| self.marks[self.end(spoke) as usize] == question)
            .count()
            == 2
    }

    /// Collapses the edge of `h` to a vertex at `position`; the half-edges that then start at the other vertex than
    /// before are appended to `moved`.
    pub(super) fn contract(
        &mut self,
        h: u32,
        position: DVec3,
        moved: &mut Vec<u32>,
    ) -> Contraction {
        let twin = self.twin(h);
        let (kept, removed) = (self.start(h), self.start(twin));
        let beside = [self.start(previous(h)), self.start(previous(twin))];
        let faces = [h / 3, twin / 3];
        let contraction = Contraction {
            kept,
            removed,
            faces: faces.map(|f| (f, self.corners(f))),
            positions: [self.position(kept), self.position(removed)],
        };
        let first_moved = moved.len();
        moved.extend(
            self.around(twin)
                .filter(|spoke| !faces.contains(&(spoke / 3))),
        );
        for &spoke in &moved[first_moved..] {
            self.origin[spoke as usize] = kept;
        }
        for h in [h, twin] {
            let (a, b) = (self.twin(next(h)), self.twin(previous(h)));
            self.twin[a as usize] = b;
            self.twin[b as usize] = a;
        }
        // The twins of the sides of a removed face start at the vertex beside and at the one that stays.
        for (h, side) in [(h, beside[0]), (twin, beside[1])] {
            let (a, b) = (self.twin(next(h)), self.twin(previous(h)));
            for spoke in [a, b] {
                let start = self.start(spoke);
                self.outgoing[start as usize] = spoke;
            }
            self.valence[side as usize] -= 1;
        }
        self.valence[kept as usize] =
            self.valence[kept as usize] + self.valence[removed as usize] - 4;
        for f in faces {
            for k in 0..3 {
                self.origin[(f * 3 + k) as usize] = GONE;
            }
        }
        self.outgoing[removed as usize] = GONE;
        self.positions[kept as usize] = position;
        contraction
    }
}
