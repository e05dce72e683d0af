//! Separating sheets that touch at edges and vertices, and orienting each.

use glam::DVec3;

use super::{RepairError, RepairReport};
use crate::defects::DisjointSets;
use crate::mesh::TriangleMesh;
use crate::topology::{EdgeUse, Topology};

/// A face's edge without a partner.
const ALONE: u32 = u32::MAX;

/// Rounds of taking apart; each leaves fewer crowded edges, and one or two are the rule.
const MOST_ROUNDS: usize = 64;

/// Joins faces in pairs at every edge, gives every sheet its own vertices, and makes orientation consistent.
pub(super) fn take_apart(
    mesh: &mut TriangleMesh,
    report: &mut RepairReport,
) -> Result<(), RepairError> {
    let vertices_before = mesh.positions.len();
    for round in 0..MOST_ROUNDS {
        let topology = Topology::new(&mesh.faces, mesh.positions.len());
        let joined = join_faces(mesh, &topology)?;
        if round == 0 {
            report.crowded_edges = joined.crowded_edges;
        }
        report.flipped += joined.flips.iter().filter(|&&flips| flips).count();
        split_vertices(mesh, &joined.partner, &mut report.vertex_of);
        flip(mesh, &joined.flips);
        if !split_crowded_edges(mesh, report) {
            break;
        }
    }
    report.added_vertices = mesh.positions.len() - vertices_before;
    Ok(())
}

/// Which faces belong together.
struct Joined {
    /// For edge k of face f, at 3 f + k: the same of the face on the other side, or [`ALONE`].
    partner: Vec<u32>,
    flips: Vec<bool>,
    crowded_edges: usize,
}

fn slot(used: EdgeUse) -> u32 {
    used.face * 3 + u32::from(used.corner)
}

fn join_faces(mesh: &TriangleMesh, topology: &Topology) -> Result<Joined, RepairError> {
    let face_count = mesh.faces.len();
    let mut partner = vec![ALONE; face_count * 3];
    let mut sides = Sides::new(face_count);
    let mut join = |sides: &mut Sides, a: EdgeUse, b: EdgeUse| {
        let has_joined = sides.unite(a.face, b.face, a.is_forward == b.is_forward);
        if has_joined {
            partner[slot(a) as usize] = slot(b);
            partner[slot(b) as usize] = slot(a);
        }
        has_joined
    };
    let mut crowded = Vec::new();
    for edge in 0..topology.edges().len() {
        match topology.edge_uses(edge) {
            [_] => {}
            &[a, b] => {
                if !join(&mut sides, a, b) {
                    let edge = topology.edges()[edge];
                    return Err(RepairError::NotOrientable { edge });
                }
            }
            _ => crowded.push(edge),
        }
    }
    let flips = sides.minority_flips();
    for &edge in &crowded {
        for [a, b] in pair_around(mesh, topology, edge, &flips).pairs {
            // A pair that would make the surface one-sided stays open.
            join(&mut sides, a, b);
        }
    }
    Ok(Joined {
        partner,
        flips: sides.minority_flips(),
        crowded_edges: crowded.len(),
    })
}

/// Pairs the faces of a crowded edge around the solid between them.
///
/// Going around the edge (counter-clockwise about its direction from the lower to the higher vertex), solid begins at a
/// face that walks the edge backward and ends at one that walks it forward, so pairs are found like matching brackets.
/// Faces left over all walk in one direction; they are paired as they follow each other.
fn pair_around(mesh: &TriangleMesh, topology: &Topology, edge: usize, flips: &[bool]) -> Around {
    let [low, high] = topology.edges()[edge].map(|v| mesh.positions[v as usize]);
    let axis = (high - low).normalize_or(DVec3::X);
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    let mut around: Vec<(f64, EdgeUse)> = topology
        .edge_uses(edge)
        .iter()
        .map(|&used| {
            let face = mesh.faces[used.face as usize];
            let third = face[(usize::from(used.corner) + 2) % 3];
            let out = mesh.positions[third as usize] - low;
            (out.dot(up).atan2(out.dot(right)), used)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut pairs = Vec::new();
    let (mut opened, mut unmatched) = (Vec::new(), Vec::new());
    for &(_, used) in &around {
        let is_forward = used.is_forward != flips[used.face as usize];
        if !is_forward {
            opened.push(used);
        } else if let Some(begin) = opened.pop() {
            pairs.push([begin, used]);
        } else {
            unmatched.push(used);
        }
    }
    // Around the end: what is still open begins the solid that the first unmatched faces end.
    let wrapped = opened.len().min(unmatched.len());
    for &end in unmatched.iter().take(wrapped) {
        if let Some(begin) = opened.pop() {
            pairs.push([begin, end]);
        }
    }
    let left: Vec<EdgeUse> = opened
        .into_iter()
        .chain(unmatched.into_iter().skip(wrapped))
        .collect();
    let (twos, alone) = left.as_chunks::<2>();
    pairs.extend(twos);
    Around {
        pairs,
        alone: alone.first().copied(),
    }
}

/// The faces of an edge, in pairs.
struct Around {
    pairs: Vec<[EdgeUse; 2]>,
    /// The one left over where their number is odd.
    alone: Option<EdgeUse>,
}

/// Gives every fan of joined faces its own copy of their common vertex; the first fan keeps the old one.
fn split_vertices(mesh: &mut TriangleMesh, partner: &[u32], vertex_of: &mut Vec<u32>) {
    let mut corners = DisjointSets::new(mesh.faces.len() * 3);
    let vertex_at = |c: u32| mesh.faces[c as usize / 3][c as usize % 3];
    let next = |c: u32| c - c % 3 + (c + 1) % 3;
    for (c, &p) in (0_u32..).zip(partner) {
        if p == ALONE || p < c {
            continue;
        }
        if vertex_at(c) == vertex_at(p) {
            corners.unite(c, p);
            corners.unite(next(c), next(p));
        } else {
            corners.unite(c, next(p));
            corners.unite(next(c), p);
        }
    }
    let mut is_taken = vec![false; mesh.positions.len()];
    let mut vertex_of_fan = vec![0; mesh.faces.len() * 3];
    for c in 0..mesh.faces.len() as u32 * 3 {
        let (face, k) = (c as usize / 3, c as usize % 3);
        let fan = corners.find(c);
        if fan == c {
            let old = mesh.faces[face][k];
            vertex_of_fan[c as usize] = old;
            if std::mem::replace(&mut is_taken[old as usize], true) {
                vertex_of_fan[c as usize] = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[old as usize]);
                vertex_of.push(vertex_of[old as usize]);
            }
        }
        // The first corner of a fan comes before its others, and no other fan reads this corner's old vertex.
        mesh.faces[face][k] = vertex_of_fan[fan as usize];
    }
}

fn flip(mesh: &mut TriangleMesh, flips: &[bool]) {
    for (face, _) in flips.iter().enumerate().filter(|(_, flips)| **flips) {
        mesh.flip_face(face);
    }
}

/// Two sheets may share both ends of an edge even after their vertices are split, when they hang together elsewhere. All
/// but the first pair of such an edge, and a face left alone there, then get a vertex of their own in its middle. Whether
/// there was any.
fn split_crowded_edges(mesh: &mut TriangleMesh, report: &mut RepairReport) -> bool {
    let topology = Topology::new(&mesh.faces, mesh.positions.len());
    let no_flips = vec![false; mesh.faces.len()];
    let mut is_touched = vec![false; mesh.faces.len()];
    let mut has_split = false;
    for edge in 0..topology.edges().len() {
        if topology.edge_uses(edge).len() <= 2 {
            continue;
        }
        let around = pair_around(mesh, &topology, edge, &no_flips);
        let groups = around.pairs.iter().map(|pair| pair.to_vec());
        let groups = groups.chain(around.alone.map(|used| vec![used]));
        for group in groups.skip(1) {
            if group.iter().any(|u| is_touched[u.face as usize]) {
                continue;
            }
            let [a, b] = topology.edges()[edge];
            let middle = mesh.positions.len() as u32;
            let position = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5;
            mesh.positions.push(position);
            report.vertex_of.push(report.vertex_of[a as usize]);
            for used in &group {
                is_touched[used.face as usize] = true;
                mesh.split_face_edge(used.face as usize, usize::from(used.corner), middle);
                report.face_of.push(report.face_of[used.face as usize]);
            }
            has_split = true;
        }
    }
    has_split
}

/// Sets of faces with a known relation between any two: same side, or one of them turned over.
struct Sides {
    parent: Vec<u32>,
    /// Whether a face is turned over against its parent.
    is_turned: Vec<bool>,
}

impl Sides {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
            is_turned: vec![false; count],
        }
    }

    /// The root of a face's set, and whether the face is turned over against it.
    fn find(&mut self, face: u32) -> (u32, bool) {
        let mut path = Vec::new();
        let mut at = face;
        while self.parent[at as usize] != at {
            path.push(at);
            at = self.parent[at as usize];
        }
        let mut turned = false;
        for &step in path.iter().rev() {
            turned ^= self.is_turned[step as usize];
            self.parent[step as usize] = at;
            self.is_turned[step as usize] = turned;
        }
        (at, turned)
    }

    /// Joins two sets such that `a` and `b` lie on the same side, or, if `turns`, on opposite ones; `false` if the
    /// contrary is known already.
    fn unite(&mut self, a: u32, b: u32, turns: bool) -> bool {
        let ((root_a, turned_a), (root_b, turned_b)) = (self.find(a), self.find(b));
        let relation = turned_a ^ turned_b ^ turns;
        if root_a == root_b {
            return !relation;
        }
        let (low, high) = (root_a.min(root_b), root_a.max(root_b));
        self.parent[high as usize] = low;
        self.is_turned[high as usize] = relation;
        true
    }

    /// Which faces to turn over so that every set agrees, turning as few as possible, the later ones on a tie.
    fn minority_flips(&mut self) -> Vec<bool> {
        let count = self.parent.len();
        let found: Vec<(u32, bool)> = (0..count as u32).map(|f| self.find(f)).collect();
        let mut turned_more = vec![0_i64; count];
        for &(root, turned) in &found {
            turned_more[root as usize] += if turned { 1 } else { -1 };
        }
        found
            .iter()
            .map(|&(root, turned)| turned != (turned_more[root as usize] > 0))
            .collect()
    }
}
