//! Faces as points of dual space, partitioned by a tree.
//!
//! A plane of normal n and offset d is the direction (n, d) of four-space. Its largest coordinate says which of eight
//! charts it lies in, and the other three over the largest where in the chart: dual space in eight cubes, none of which
//! reaches to infinity. In a chart a viewpoint is still a plane.
//!
//! How a chart is divided is up to the [`Division`]; here is what any tree of regions needs.
//!
//! Source: as for the parent module, section 2.1.
//! Deviation: a region's box is that of its points, not the part of space that the division gives it; it is smaller.

use std::ops::Range;

use glam::Vec4;

use super::points::{Draft, Point};
use super::{bar, octree};
use crate::edge_mesh::EdgeMesh;
use crate::level_order::{LevelOrder, SPARE, level_order};
use crate::plane_block::{LANES, PlaneBlock};

/// How dual space is divided into regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Division {
    /// Cubes into eight.
    Octree,
    /// Fat regions in two, with a share of the points in each.
    Bar,
}

/// A region of dual space with points in it.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Region {
    /// Middle and half extent of the points' box, with the chart's own axis among the four: there the middle is ±1 and the
    /// extent 0.
    pub(super) middle: Vec4,
    pub(super) half: Vec4,
    /// Its first child and how many there are.
    pub(super) first_child: u32,
    pub(super) child_count: u32,
    /// Its blocks of points, and how many of them are in no child.
    pub(super) first_block: u32,
    pub(super) block_count: u32,
    pub(super) own_block_count: u32,
    /// Its part of the list of edges to faces outside.
    pub(super) first_outer: u32,
    pub(super) outer_count: u32,
}

impl Region {
    pub(super) fn blocks(&self) -> Range<usize> {
        let first = self.first_block as usize;
        first..first + self.block_count as usize
    }

    pub(super) fn outer(&self) -> Range<usize> {
        let first = self.first_outer as usize;
        first..first + self.outer_count as usize
    }
}

/// An edge, by its number here, and which of its faces is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EdgeFace(u32);

impl EdgeFace {
    fn new(number: u32, is_left: bool) -> Self {
        Self(2 * number + u32::from(is_left))
    }

    pub(super) fn number(self) -> u32 {
        self.0 / 2
    }

    pub(super) fn is_left(self) -> bool {
        self.0 % 2 == 1
    }

    /// This side when its face is in front, and else the other: the one in front, when the other face looks the other way.
    #[inline(always)]
    pub(super) fn in_front(self, is_front: bool) -> Self {
        Self(self.0 ^ u32::from(!is_front))
    }
}

/// The tree, and what is known for the last viewpoint.
#[derive(Clone, Debug)]
pub(super) struct Partition {
    /// Level by level; some more at the end are looked at, but count for nothing.
    pub(super) regions: Vec<Region>,
    pub(super) root_count: u32,
    pub(super) blocks: Vec<PlaneBlock>,
    /// The faces in the blocks; places beyond the last face repeat the first.
    pub(super) block_faces: Vec<[u32; LANES]>,
    /// The edges of the blocks' faces.
    pub(super) block_sides: Vec<[[EdgeFace; 3]; LANES]>,
    pub(super) outer_sides: Vec<EdgeFace>,
    /// Of each edge of the mesh its number here, which follows the order of points: what turns together lies together.
    numbers: Vec<u32>,
    /// Faces whose planes are not known well enough to be points.
    pub(super) unknown: Vec<u32>,
    /// For the last viewpoint: one bit for each face of each block that shows its front, beside one for each that is there.
    pub(super) fronts: Vec<[u8; 2]>,
    pub(super) unknown_fronts: Vec<bool>,
    /// Buffers: regions to be visited, blocks to be tested, what is found in them, and those in which something turned.
    pub(super) visited: Vec<u32>,
    pub(super) tested: Vec<u32>,
    pub(super) found: Vec<(u8, u8)>,
    pub(super) changed: Vec<u32>,
}

impl Partition {
    pub(super) fn new(mesh: &EdgeMesh, division: Division) -> Self {
        let mut unknown = Vec::new();
        let mut points: Vec<Point> = Vec::with_capacity(mesh.faces().len());
        for face in 0..mesh.faces().len() as u32 {
            match mesh.exact_plane(face as usize) {
                Some(plane) => points.push(point_of(face, plane)),
                None => unknown.push(face),
            }
        }
        let drafts = divide(&mut points, division);
        let order: Vec<u32> = points.iter().map(|p| p.face).collect();
        let mut partition = Self {
            regions: Vec::with_capacity(drafts.len()),
            root_count: 0,
            blocks: Vec::new(),
            block_faces: Vec::new(),
            block_sides: Vec::new(),
            outer_sides: Vec::new(),
            numbers: vec![u32::MAX; mesh.edges().len()],
            unknown,
            fronts: Vec::new(),
            unknown_fronts: Vec::new(),
            visited: vec![0; drafts.len() + SPARE],
            tested: Vec::new(),
            found: Vec::new(),
            changed: Vec::new(),
        };
        partition.number_edges(mesh, &order);
        // Where the blocks of a leaf begin that begins with this point.
        let mut block_at = vec![0_u32; points.len() + 1];
        for leaf in drafts.iter().filter(|d| d.child_count == 0) {
            block_at[leaf.points.start] = partition.blocks.len() as u32;
            for faces in order[leaf.points.clone()].chunks(LANES) {
                partition.push_block(mesh, faces);
            }
        }
        block_at[points.len()] = partition.blocks.len() as u32;
        partition.push_regions(mesh, &drafts, &points, &block_at);
        let block_count = partition.blocks.len();
        partition.tested = vec![0; block_count + SPARE];
        partition.found = vec![(0, 0); block_count];
        partition.changed = vec![0; block_count];
        partition
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.regions)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.block_faces)
            + size_of_val(&*self.block_sides)
            + size_of_val(&*self.outer_sides)
            + size_of_val(&*self.numbers)
            + size_of_val(&*self.unknown)
            + size_of_val(&*self.fronts)
    }

    /// Of each edge of the mesh its number here.
    pub(super) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// The edges of a face.
    pub(super) fn sides_of(&self, mesh: &EdgeMesh, face: u32) -> [EdgeFace; 3] {
        mesh.face_edges()[face as usize].map(|edge| {
            let is_left = mesh.edge_faces()[edge as usize][0] == face;
            EdgeFace::new(self.numbers[edge as usize], is_left)
        })
    }

    /// Notes which faces show their front.
    pub(super) fn start(&mut self, is_front: impl Fn(u32) -> bool) {
        for (fronts, faces) in self.fronts.iter_mut().zip(&self.block_faces) {
            fronts[0] = 0;
            for (lane, &face) in faces.iter().enumerate() {
                fronts[0] |= u8::from(is_front(face)) << lane;
            }
        }
        self.unknown_fronts.clear();
        self.unknown_fronts
            .extend(self.unknown.iter().map(|&face| is_front(face)));
    }

    /// Numbers the edges in the order in which points use them.
    fn number_edges(&mut self, mesh: &EdgeMesh, order: &[u32]) {
        let mut next = 0;
        for &face in order.iter().chain(&self.unknown) {
            for edge in mesh.face_edges()[face as usize] {
                let number = &mut self.numbers[edge as usize];
                if *number == u32::MAX {
                    *number = next;
                    next += 1;
                }
            }
        }
    }

    fn push_block(&mut self, mesh: &EdgeMesh, faces: &[u32]) {
        let ids = std::array::from_fn(|lane| faces.get(lane).copied().unwrap_or(faces[0]));
        self.blocks.push(PlaneBlock::new(mesh, &ids));
        self.block_faces.push(ids);
        self.block_sides
            .push(ids.map(|face| self.sides_of(mesh, face)));
        self.fronts
            .push([0, (0xff_u16 >> (LANES - faces.len())) as u8]);
    }

    /// Lays out the regions, with the edges of each one's faces whose other face is outside.
    fn push_regions(
        &mut self,
        mesh: &EdgeMesh,
        drafts: &[Draft],
        points: &[Point],
        block_at: &[u32],
    ) {
        let child_counts: Vec<u32> = drafts.iter().map(|d| d.child_count).collect();
        let LevelOrder {
            nodes,
            first_children,
            root_count,
        } = level_order(&child_counts, |_| 0);
        self.root_count = root_count as u32;
        let mut place_of = vec![usize::MAX; mesh.faces().len()];
        for (place, point) in points.iter().enumerate() {
            place_of[point.face as usize] = place;
        }
        for (&k, &first_child) in nodes.iter().zip(&first_children) {
            let Draft {
                points: range,
                child_count,
            } = drafts[k].clone();
            let first_outer = self.outer_sides.len() as u32;
            for point in &points[range.clone()] {
                let edges = mesh.face_edges()[point.face as usize];
                for (side, edge) in self.sides_of(mesh, point.face).into_iter().zip(edges) {
                    let [left, right] = mesh.edge_faces()[edge as usize];
                    let across = if side.is_left() { right } else { left };
                    if !range.contains(&place_of[across as usize]) {
                        self.outer_sides.push(side);
                    }
                }
            }
            let (middle, half) = box_of(&points[range.clone()]);
            let first_block = block_at[range.start];
            let block_count = block_at[range.end] - first_block;
            self.regions.push(Region {
                middle,
                half,
                first_child,
                child_count,
                first_block,
                block_count,
                own_block_count: if child_count == 0 { block_count } else { 0 },
                first_outer,
                outer_count: self.outer_sides.len() as u32 - first_outer,
            });
        }
        if let Some(&last) = self.regions.last() {
            self.regions.extend([last; SPARE]);
        }
    }
}

/// Puts points into the order of regions and returns these, in depth-first order.
pub(super) fn divide(points: &mut [Point], division: Division) -> Vec<Draft> {
    points.sort_by_key(|p| (p.chart, p.face));
    let mut drafts = Vec::new();
    let mut first = 0;
    for chart in points.chunk_by_mut(|a, b| a.chart == b.chart) {
        match division {
            Division::Octree => octree::divide(chart, first, &mut drafts),
            Division::Bar => bar::divide(chart, first, &mut drafts),
        }
        first += chart.len();
    }
    drafts
}

fn point_of(face: u32, plane: [f64; 4]) -> Point {
    let axis = (0..4)
        .max_by(|&a, &b| plane[a].abs().total_cmp(&plane[b].abs()))
        .unwrap_or(0);
    let largest = plane[axis].abs();
    Point {
        face,
        chart: (2 * axis) as u8 + u8::from(plane[axis] < 0.0),
        at: plane.map(|c| c / largest),
    }
}

/// Middle and half extent of the box of points.
fn box_of(points: &[Point]) -> (Vec4, Vec4) {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for p in points {
        for k in 0..4 {
            low[k] = low[k].min(p.at[k]);
            high[k] = high[k].max(p.at[k]);
        }
    }
    let with = |of: fn(f64, f64) -> f64| {
        Vec4::from_array(std::array::from_fn(|k| of(low[k], high[k]) as f32))
    };
    (with(|a, b| 0.5 * (a + b)), with(|a, b| 0.5 * (b - a)))
}
