//! Groups of up to eight edges with up to eight faces, tested together.

use glam::Vec4;

use crate::edge_mesh::EdgeMesh;
use crate::plane_block::{LANES, mask_of};
use crate::viewpoint::Query;
use crate::{DirectedEdge, Viewpoint};

/// So many edges are looked at for the one that needs the fewest further faces.
const WINDOW: usize = 24;

/// The planes of the faces of a group, a cache line: coordinate by coordinate in steps of 1 / [`PLANE_SCALE`]. Lanes
/// beyond the last face repeat the first.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct GroupPlanes([[i16; LANES]; 4]);

/// Which faces each edge of a group lies between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GroupSides {
    /// In the byte of each edge, the bit of its left face, and of its right; no bit beyond the last edge.
    left: u64,
    right: u64,
    /// The place of its first edge among those of all groups.
    first_edge: u32,
    /// How many edges it has.
    edge_count: u32,
}

/// The faces of a group; lanes beyond the last repeat the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GroupFaces([u32; LANES]);

/// A coordinate of a plane, at most 1, as 16 bits.
const PLANE_SCALE: f32 = 32767.0;
/// The same of a query: so much smaller that the sum of products, at most 2 and as the upper 16 of 32 bits, does not overflow.
const QUERY_SCALE: f32 = 32000.0;
/// Sums beyond this, which are whole, have the right sign. Four products lose less than 1 each, which [`ROUNDING`] makes up for
/// half of; half a unit of a factor is worth a fourth of the other one, and those of a plane, and of a query, are at most
/// √3 + 1 together. So the error is below 3.4.
const ROUNDED_ERROR: i16 = 3;
const ROUNDING: i16 = 2;

/// A viewpoint in 16 bits for each coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedQuery {
    /// Every factor once for each lane, as one instruction has it.
    factors: [[i16; LANES]; 4],
    error: f32,
}

impl RoundedQuery {
    pub(crate) fn new(query: &Query) -> Self {
        let is_known = query.value_error.is_finite();
        let coordinates = [query.point.x, query.point.y, query.point.z, query.weight];
        Self {
            factors: coordinates.map(|c| [(c * QUERY_SCALE).round() as i16; LANES]),
            error: if is_known {
                f32::from(ROUNDED_ERROR)
            } else {
                f32::INFINITY
            },
        }
    }
}

const LOW_BITS: u64 = 0x0101_0101_0101_0101;
const HIGH_BITS: u64 = LOW_BITS << 7;

/// The highest bit of every byte that is not zero.
#[inline(always)]
fn nonzero_bytes(word: u64) -> u64 {
    // No byte has more than one bit, so nothing is carried over.
    (((word & !HIGH_BITS) + !HIGH_BITS) | word) & HIGH_BITS
}

impl GroupPlanes {
    /// Some coordinate.
    #[inline(always)]
    pub(crate) fn first(&self) -> i16 {
        self.0[0][0]
    }

    /// One bit for each face that shows its front, and for each of which this is too coarse to know.
    #[inline(always)]
    pub(crate) fn fronts(&self, query: &RoundedQuery) -> (u8, u8) {
        let product = |k: usize| -> [i16; LANES] {
            std::array::from_fn(|lane| {
                let of = [self.0[k][lane], query.factors[k][lane]].map(i32::from);
                ((of[0] * of[1]) >> 16) as i16
            })
        };
        let sum = |a: [i16; LANES], b: [i16; LANES]| -> [i16; LANES] {
            std::array::from_fn(|lane| a[lane].wrapping_add(b[lane]))
        };
        let products = sum(sum(product(0), product(1)), sum(product(2), product(3)));
        let sums = sum(products, [ROUNDING; LANES]);
        let [first, second] =
            [0, 4].map(|k| Vec4::from_array(std::array::from_fn(|lane| f32::from(sums[k + lane]))));
        let error = Vec4::splat(query.error);
        (
            mask_of(first.cmpgt(Vec4::ZERO), second.cmpgt(Vec4::ZERO)),
            mask_of(first.abs().cmple(error), second.abs().cmple(error)),
        )
    }
}

impl GroupSides {
    /// How many edges it has.
    #[inline(always)]
    pub(crate) fn edge_count(&self) -> usize {
        self.edge_count as usize
    }

    /// Writes the edges of which one face is among the `fronts` to the place `at` of a list with space for eight more, and
    /// moves the place behind them: twice the place of the edge among those of all groups, and one more when its left face
    /// is in front.
    #[inline(always)]
    pub(crate) fn find(&self, fronts: u8, list: &mut [u32], at: &mut usize) {
        let fronts = u64::from(fronts) * LOW_BITS;
        let left = nonzero_bytes(fronts & self.left);
        let mut found = left ^ nonzero_bytes(fronts & self.right);
        let mut emit_first = |found: &mut u64| {
            let bit = (*found | 1 << 63).trailing_zeros();
            list[*at] = 2 * (self.first_edge + bit / 8) + (left >> bit & 1) as u32;
            *at += usize::from(*found != 0);
            *found &= found.wrapping_sub(1);
        };
        // Mostly none to three: no guess how many.
        for _ in 0..3 {
            emit_first(&mut found);
        }
        while found != 0 {
            emit_first(&mut found);
        }
    }
}

impl GroupFaces {
    /// Puts right the bits of those faces that show their fronts that are `unsure`.
    pub(crate) fn decide(
        &self,
        (fronts, unsure): (u8, u8),
        (mesh, viewpoint, query): (&EdgeMesh, &Viewpoint, &Query),
    ) -> u8 {
        let mut fronts = fronts & !unsure;
        for (lane, &face) in self.0.iter().enumerate() {
            if unsure >> lane & 1 == 1 {
                fronts |= u8::from(mesh.is_front(face, viewpoint, query)) << lane;
            }
        }
        fronts
    }
}

/// A group in its parts; the last are the ends of its edges.
pub(crate) type Group = (GroupPlanes, GroupSides, GroupFaces, Vec<DirectedEdge>);

/// Puts edges into groups, those with common faces together if they can be.
///
/// Edges are numbered from `first_edge` on.
pub(crate) fn groups_of(mesh: &EdgeMesh, edges: &[u32], first_edge: u32) -> Vec<Group> {
    let mut left = edges.to_vec();
    let mut groups = Vec::new();
    while !left.is_empty() {
        let (mut faces, mut members): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        while members.len() < LANES {
            let missing = |faces: &[u32], edge: u32| {
                let sides = mesh.edge_faces()[edge as usize];
                sides.iter().filter(|f| !faces.contains(f)).count()
            };
            // At the end, as that is where taking out costs nothing.
            let window = left.len().saturating_sub(WINDOW)..left.len();
            let best = window.rev().min_by_key(|&k| missing(&faces, left[k]));
            let Some(best) = best.filter(|&k| faces.len() + missing(&faces, left[k]) <= LANES)
            else {
                break;
            };
            let edge = left.remove(best);
            members.push(edge);
            for side in mesh.edge_faces()[edge as usize] {
                if !faces.contains(&side) {
                    faces.push(side);
                }
            }
        }
        let done = edges.len() - left.len() - members.len();
        groups.push(group_of(mesh, &faces, &members, first_edge + done as u32));
    }
    groups
}

fn group_of(mesh: &EdgeMesh, faces: &[u32], edges: &[u32], first_edge: u32) -> Group {
    let ids: [u32; LANES] =
        std::array::from_fn(|lane| faces.get(lane).copied().unwrap_or(faces[0]));
    let coordinate =
        |k: usize| ids.map(|face| (mesh.planes()[face as usize][k] * PLANE_SCALE).round() as i16);
    let mut sides = GroupSides {
        left: 0,
        right: 0,
        first_edge,
        edge_count: edges.len() as u32,
    };
    for (k, &edge) in edges.iter().enumerate() {
        let bit = |face: u32| {
            let lane = ids.iter().position(|&f| f == face).unwrap_or(0);
            1_u64 << (8 * k + lane)
        };
        let [left, right] = mesh.edge_faces()[edge as usize];
        sides.left |= bit(left);
        sides.right |= bit(right);
    }
    (
        GroupPlanes(std::array::from_fn(coordinate)),
        sides,
        GroupFaces(ids),
        (edges.iter())
            .map(|&edge| mesh.edges()[edge as usize])
            .collect(),
    )
}
