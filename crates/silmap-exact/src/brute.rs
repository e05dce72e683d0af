//! Brute force over precomputed planes: classify every face as front or back, then test every edge.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 5 (definition).
//! Deviation: each face is tested once, not once for each of its edges. The second form works on blocks of planes, so
//! that several faces go through one instruction, and on all cores.

use rayon::prelude::*;

use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;
use crate::{DirectedEdge, Viewpoint, Work};

/// Faces that are tested together in the parallel form; whole blocks of them are shared out.
const LANES: usize = 16;
/// Blocks of faces, and edges, that one thread takes at a time.
const BLOCKS_PER_TASK: usize = 512;
const EDGES_PER_TASK: usize = 8192;

/// Buffers of the scalar form.
#[derive(Clone, Debug, Default)]
pub(crate) struct Brute {
    is_front: Vec<bool>,
    found: Vec<u32>,
}

impl Brute {
    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        self.is_front.clear();
        self.is_front.extend(
            (0..mesh.faces().len() as u32).map(|face| mesh.is_front(face, viewpoint, &query)),
        );
        self.found.resize(mesh.edges().len(), 0);
        let count = gather(mesh.edge_faces(), 0, &self.is_front, &mut self.found);
        out.extend(self.found[..count].iter().map(|&edge| {
            let left = mesh.edge_faces()[edge as usize][0];
            mesh.directed(edge, self.is_front[left as usize])
        }));
        Work::of_edges(mesh.edges().len())
    }

    /// Of each face, for the last viewpoint.
    pub(crate) fn is_front(&self) -> &[bool] {
        &self.is_front
    }

    /// The edges found last, `count` of them.
    pub(crate) fn found(&self, count: usize) -> &[u32] {
        &self.found[..count]
    }
}

/// Writes the edges whose faces disagree, numbered from `first`, to the front of `found`, which has space for all of them;
/// without a branch that could be mispredicted.
fn gather(edge_faces: &[[u32; 2]], first: u32, is_front: &[bool], found: &mut [u32]) -> usize {
    let mut count = 0;
    for (edge, &[left, right]) in (first..).zip(edge_faces) {
        found[count] = edge;
        count += usize::from(is_front[left as usize] != is_front[right as usize]);
    }
    count
}

/// Planes of [`LANES`] faces, coordinate by coordinate.
type PlaneBlock = [[f32; LANES]; 4];

/// The parallel form: planes in blocks, and buffers.
#[derive(Clone, Debug)]
pub(crate) struct BruteParallel {
    blocks: Vec<PlaneBlock>,
    is_front: Vec<[bool; LANES]>,
}

impl BruteParallel {
    pub(crate) fn new(mesh: &EdgeMesh) -> Self {
        let blocks: Vec<PlaneBlock> = mesh
            .planes()
            .chunks(LANES)
            .map(|planes| {
                let mut block = [[0.0; LANES]; 4];
                for (lane, plane) in planes.iter().enumerate() {
                    for k in 0..4 {
                        block[k][lane] = plane[k];
                    }
                }
                block
            })
            .collect();
        Self {
            is_front: vec![[false; LANES]; blocks.len()],
            blocks,
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.blocks)
    }

    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        let face_count = mesh.faces().len();
        self.is_front
            .par_chunks_mut(BLOCKS_PER_TASK)
            .zip(self.blocks.par_chunks(BLOCKS_PER_TASK))
            .enumerate()
            .for_each(|(task, (is_front, blocks))| {
                for (k, (is_front, block)) in is_front.iter_mut().zip(blocks).enumerate() {
                    if !test_block(block, &query, is_front) {
                        let first = (task * BLOCKS_PER_TASK + k) * LANES;
                        for (lane, is_front) in is_front.iter_mut().enumerate() {
                            if first + lane < face_count {
                                *is_front = mesh.is_front((first + lane) as u32, viewpoint, &query);
                            }
                        }
                    }
                }
            });
        let is_front = self.is_front.as_flattened();
        let parts: Vec<Vec<DirectedEdge>> = mesh
            .edge_faces()
            .par_chunks(EDGES_PER_TASK)
            .enumerate()
            .map(|(task, edge_faces)| {
                let first = (task * EDGES_PER_TASK) as u32;
                let mut found = [0; EDGES_PER_TASK];
                let count = gather(edge_faces, first, is_front, &mut found);
                found[..count]
                    .iter()
                    .map(|&edge| {
                        let left = mesh.edge_faces()[edge as usize][0];
                        mesh.directed(edge, is_front[left as usize])
                    })
                    .collect()
            })
            .collect();
        for part in &parts {
            out.extend_from_slice(part);
        }
        Work::of_edges(mesh.edges().len())
    }
}

/// Tests a block of planes; false when some value is too near zero to be trusted.
#[inline(always)]
fn test_block(block: &PlaneBlock, query: &Query, is_front: &mut [bool; LANES]) -> bool {
    let mut is_sure = true;
    for lane in 0..LANES {
        let value = query.value(&[
            block[0][lane],
            block[1][lane],
            block[2][lane],
            block[3][lane],
        ]);
        is_front[lane] = value > 0.0;
        is_sure &= value.abs() > query.value_error;
    }
    is_sure
}
