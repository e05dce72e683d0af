//! Incremental silhouettes of a moving viewpoint, by point-plane duality.
//!
//! In dual space a face's plane is a point and a viewpoint is a plane. When the viewpoint moves, the faces that turn are
//! the points in the double wedge between the old and the new plane, and only their edges can join or leave the
//! silhouette. The first viewpoint is computed in full.
//!
//! Source: Pop, Barequet, Duncan, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and
//! Applications. Symposium on Computational Geometry, 2001, section 2.
//! Deviations: homogeneous coordinates, so that planes through the origin and viewpoints at infinity are nothing special.
//! A face that turns toggles its edges, so that an edge between two of them is toggled twice and no plane need be looked
//! up; the source inspects every reported edge. What toggles an edge also says which of its faces is in front now.

mod bar;
mod octree;
mod partition;
mod points;
mod queries;
mod search;

pub(crate) use self::partition::Division;
pub use self::queries::DualSpace;

use self::partition::{EdgeFace, Partition};
use crate::brute::Brute;
use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;
use crate::{DirectedEdge, Viewpoint, Work};

/// The place of an edge that is not on the silhouette.
const NOT_ON_SILHOUETTE: u32 = u32::MAX;

/// The faces in dual space, and the silhouette of the last viewpoint.
#[derive(Clone, Debug)]
pub(crate) struct MovingSilhouette {
    partition: Partition,
    brute: Brute,
    /// The viewpoint that the rest belongs to.
    last: Option<Query>,
    /// Of each edge, by the partition's number: its ends, and its place in `silhouette` or [`NOT_ON_SILHOUETTE`].
    edges: Vec<(DirectedEdge, u32)>,
    /// The silhouette and, of the same edges, their numbers.
    silhouette: Vec<DirectedEdge>,
    silhouette_numbers: Vec<u32>,
    /// Buffer: places in `silhouette` of edges that left it.
    holes: Vec<u32>,
    /// Buffer: what turned.
    turned: Vec<EdgeFace>,
}

impl MovingSilhouette {
    pub(crate) fn new(mesh: &EdgeMesh, division: Division) -> Self {
        let partition = Partition::new(mesh, division);
        let mut edges =
            vec![(DirectedEdge { from: 0, to: 0 }, NOT_ON_SILHOUETTE); mesh.edges().len()];
        for (&number, &ends) in partition.numbers().iter().zip(mesh.edges()) {
            edges[number as usize].0 = ends;
        }
        Self {
            partition,
            brute: Brute::default(),
            last: None,
            edges,
            holes: Vec::new(),
            silhouette: Vec::new(),
            silhouette_numbers: Vec::new(),
            turned: Vec::new(),
        }
    }

    /// Makes the next viewpoint a first one.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    pub(crate) fn bytes(&self) -> usize {
        self.partition.bytes() + size_of_val(&*self.edges)
    }

    pub(crate) fn extract(
        &mut self,
        mesh: &EdgeMesh,
        viewpoint: &Viewpoint,
        out: &mut Vec<DirectedEdge>,
    ) -> Work {
        let query = mesh.query(viewpoint);
        let is_known = |q: &Query| q.value_error.is_finite();
        let last = self.last.filter(|q| is_known(q) && is_known(&query));
        let work = match last {
            None => self.start(mesh, viewpoint),
            Some(last) => self.follow(mesh, &last, viewpoint, &query),
        };
        self.last = Some(query);
        out.extend_from_slice(&self.silhouette);
        work
    }

    /// The whole silhouette, by brute force.
    fn start(&mut self, mesh: &EdgeMesh, viewpoint: &Viewpoint) -> Work {
        self.silhouette.clear();
        self.silhouette_numbers.clear();
        for (_, place) in &mut self.edges {
            *place = NOT_ON_SILHOUETTE;
        }
        let work = self.brute.extract(mesh, viewpoint, &mut self.silhouette);
        let found = self.brute.found(self.silhouette.len());
        for (place, &edge) in (0..).zip(found) {
            let number = self.partition.numbers()[edge as usize];
            self.edges[number as usize].1 = place;
            self.silhouette_numbers.push(number);
        }
        let is_front = self.brute.is_front();
        self.partition.start(|face| is_front[face as usize]);
        work
    }

    /// The silhouette by what changed since the last viewpoint.
    fn follow(
        &mut self,
        mesh: &EdgeMesh,
        last: &Query,
        viewpoint: &Viewpoint,
        query: &Query,
    ) -> Work {
        self.turned.clear();
        let view = (viewpoint, query);
        let visited_nodes = self
            .partition
            .find_turned(mesh, last, view, &mut self.turned);
        for k in 0..self.turned.len() {
            self.toggle(self.turned[k]);
        }
        self.fill_holes();
        Work {
            tested_edges: self.turned.len(),
            visited_nodes,
        }
    }

    /// One face of an edge turned; given is the side that is in front if the other face looks the other way.
    #[inline(always)]
    fn toggle(&mut self, side: EdgeFace) {
        let (ends, place) = &mut self.edges[side.number() as usize];
        if *place != NOT_ON_SILHOUETTE {
            self.holes.push(*place);
            *place = NOT_ON_SILHOUETTE;
            return;
        }
        let directed = if side.is_left() {
            *ends
        } else {
            ends.reversed()
        };
        match self.holes.pop() {
            Some(hole) => {
                *place = hole;
                self.silhouette[hole as usize] = directed;
                self.silhouette_numbers[hole as usize] = side.number();
            }
            None => {
                *place = self.silhouette.len() as u32;
                self.silhouette.push(directed);
                self.silhouette_numbers.push(side.number());
            }
        }
    }

    /// Moves the last edges to where others left.
    fn fill_holes(&mut self) {
        // From the last on, so that what is moved is never a hole.
        self.holes.sort_unstable();
        while let Some(hole) = self.holes.pop() {
            self.silhouette.swap_remove(hole as usize);
            self.silhouette_numbers.swap_remove(hole as usize);
            if let Some(&moved) = self.silhouette_numbers.get(hole as usize) {
                self.edges[moved as usize].1 = hole;
            }
        }
    }
}
