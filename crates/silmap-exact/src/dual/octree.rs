//! An octree of face planes as points of dual space, and double-wedge queries on it.
//!
//! A plane of normal n and offset d is the direction (n, d) of four-space. Its largest coordinate says which of eight
//! charts it lies in, and the other three over the largest where in the chart: dual space in eight cubes, none of which
//! reaches to infinity. In a chart a viewpoint is still a plane.
//!
//! A region whose box lies all within the wedge turns as a whole. Edges between two faces of it change nothing, so only
//! the edges to faces outside are reported, which belong to the faces of L_out in the source; the others, L_in, are
//! passed over.
//!
//! Source: as for the parent module, section 2.1.
//! Deviations: a region's box is that of its points, not the octant; it is smaller. The source also leaves out the L_out of a
//! region whose neighbours all lie in another region that turns (its pointer A); here such edges are toggled by both.
//! The source's balanced-aspect-ratio tree, which it found slower below a million faces, is not here.

use crate::Viewpoint;
use crate::edge_mesh::EdgeMesh;
use crate::plane_block::{LANES, PlaneBlock, block_of};
use crate::viewpoint::Query;

/// Points of a region that is not divided further.
const LEAF_POINTS: usize = 32;
/// Cubes are halved at most so often: points may coincide.
const MOST_DEPTH: u32 = 24;
/// Error of a viewpoint's value at a box in single precision, for coordinates and query at most 1: eight roundings of
/// sums below 4, and the rounding of the box.
const BOX_ROOM: f32 = 24.0 * f32::EPSILON;

/// A region of dual space with points in it.
#[derive(Clone, Copy, Debug)]
struct Region {
    /// Middle and half extent of the points' box, with the chart's own axis among the four: there the middle is ±1 and the
    /// extent 0.
    middle: [f32; 4],
    half: [f32; 4],
    /// The next region that is not below this one.
    skip: u32,
    /// Its first block of points; they end where those of `skip` begin.
    first_block: u32,
    /// Its first entry in the list of edges to faces outside; they end where the next region's begin.
    first_outer: u32,
}

/// Where a region lies against a viewpoint's dual plane: which way all of its faces look, if all look one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facing {
    Front,
    Back,
    Both,
}

/// An edge, by its number here, and which of its faces is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side(u32);

impl Side {
    pub(super) fn new(number: u32, is_left: bool) -> Self {
        Self(2 * number + u32::from(is_left))
    }

    pub(super) fn number(self) -> u32 {
        self.0 / 2
    }

    pub(super) fn is_left(self) -> bool {
        self.0 % 2 == 1
    }
}

/// What a moving viewpoint changes.
#[derive(Clone, Debug, Default)]
pub(super) struct Turned {
    /// Edges of faces that turned to their front, and to their back.
    pub(super) to_front: Vec<Side>,
    pub(super) to_back: Vec<Side>,
}

impl Turned {
    pub(super) fn clear(&mut self) {
        self.to_front.clear();
        self.to_back.clear();
    }

    fn list(&mut self, is_front: bool) -> &mut Vec<Side> {
        if is_front {
            &mut self.to_front
        } else {
            &mut self.to_back
        }
    }
}

/// The octree: regions in depth-first order with one more at the end, which only says where lists end.
#[derive(Clone, Debug)]
pub(super) struct PointOctree {
    regions: Vec<Region>,
    blocks: Vec<PlaneBlock>,
    block_faces: Vec<[u32; LANES]>,
    /// The edges of the blocks' faces.
    block_sides: Vec<[[Side; 3]; LANES]>,
    outer_sides: Vec<Side>,
    /// Of each edge of the mesh its number here, which follows the order of points: what turns together lies together.
    numbers: Vec<u32>,
    /// Faces whose planes are not known well enough to be points.
    unknown: Vec<u32>,
    /// For the last viewpoint: one bit for each face of each block that shows its front, and the same of unknown faces.
    fronts: Vec<u8>,
    unknown_fronts: Vec<bool>,
}

/// A face's point: its chart, and its homogeneous coordinates over the largest.
#[derive(Clone, Copy, Debug)]
struct Point {
    face: u32,
    chart: u8,
    at: [f64; 4],
}

impl PointOctree {
    pub(super) fn new(mesh: &EdgeMesh) -> Self {
        let mut unknown = Vec::new();
        let mut points: Vec<Point> = Vec::with_capacity(mesh.faces().len());
        for face in 0..mesh.faces().len() as u32 {
            match mesh.exact_plane(face as usize) {
                Some(plane) => points.push(point_of(face, plane)),
                None => unknown.push(face),
            }
        }
        let mut octree = Self {
            regions: Vec::new(),
            blocks: Vec::new(),
            block_faces: Vec::new(),
            block_sides: Vec::new(),
            outer_sides: Vec::new(),
            numbers: vec![u32::MAX; mesh.edges().len()],
            unknown,
            fronts: Vec::new(),
            unknown_fronts: Vec::new(),
        };
        points.sort_by_key(|p| (p.chart, p.face));
        // Of each region, its points' range; of each face, its place among the points.
        let mut order = Order::default();
        for chart in points.chunk_by_mut(|a, b| a.chart == b.chart) {
            octree.push_region(mesh, chart, ([0.0; 4], 1.0), MOST_DEPTH, &mut order);
        }
        octree.regions.push(Region {
            middle: [0.0; 4],
            half: [0.0; 4],
            skip: octree.regions.len() as u32 + 1,
            first_block: octree.blocks.len() as u32,
            first_outer: 0,
        });
        octree.number_edges(mesh, &order);
        octree.list_outer_sides(mesh, &order);
        octree
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.regions)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.block_faces)
            + size_of_val(&*self.block_sides)
            + size_of_val(&*self.outer_sides)
            + size_of_val(&*self.numbers)
            + self.blocks.len()
            + size_of_val(&*self.unknown)
    }

    /// Adds the region of some points, all within `half` of `center` along each axis but the chart's.
    fn push_region(
        &mut self,
        mesh: &EdgeMesh,
        points: &mut [Point],
        (center, half): ([f64; 4], f64),
        depth: u32,
        order: &mut Order,
    ) {
        let place = self.regions.len();
        self.regions.push(region_of(points, self.blocks.len()));
        let start = order.faces.len();
        order.ranges.push(start..start + points.len());
        if points.len() <= LEAF_POINTS || depth == 0 {
            let faces: Vec<u32> = points.iter().map(|p| p.face).collect();
            order.faces.extend(&faces);
            for some in faces.chunks(LANES) {
                let (block, ids) = block_of(mesh, some);
                self.blocks.push(block);
                self.block_faces.push(ids);
            }
        } else {
            let axis = (points[0].chart / 2) as usize;
            let octant = |p: &Point| {
                let above = |k: usize| usize::from(k != axis && p.at[k] >= center[k]);
                above(0) | above(1) << 1 | above(2) << 2 | above(3) << 3
            };
            points.sort_by_key(|p| (octant(p), p.face));
            for part in points.chunk_by_mut(|a, b| octant(a) == octant(b)) {
                let of_part = octant(&part[0]);
                let middle = std::array::from_fn(|k| {
                    let step = if of_part >> k & 1 == 1 { 0.5 } else { -0.5 };
                    center[k] + step * half
                });
                self.push_region(mesh, part, (middle, half * 0.5), depth - 1, order);
            }
        }
        self.regions[place].skip = self.regions.len() as u32;
    }

    /// Numbers the edges in the order in which points use them, and lists those of the blocks' faces.
    fn number_edges(&mut self, mesh: &EdgeMesh, order: &Order) {
        let mut next = 0;
        for &face in order.faces.iter().chain(&self.unknown) {
            for edge in mesh.face_edges()[face as usize] {
                let number = &mut self.numbers[edge as usize];
                if *number == u32::MAX {
                    *number = next;
                    next += 1;
                }
            }
        }
        let sides = |ids: &[u32; LANES]| ids.map(|face| self.sides_of(mesh, face));
        self.block_sides = self.block_faces.iter().map(sides).collect();
    }

    /// Of each edge of the mesh its number here.
    pub(super) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// The edges of a face.
    pub(super) fn sides_of(&self, mesh: &EdgeMesh, face: u32) -> [Side; 3] {
        mesh.face_edges()[face as usize].map(|edge| {
            let is_left = mesh.edge_faces()[edge as usize][0] == face;
            Side::new(self.numbers[edge as usize], is_left)
        })
    }

    /// Lists the edges of each region's faces whose other face is outside.
    fn list_outer_sides(&mut self, mesh: &EdgeMesh, order: &Order) {
        let mut place_of = vec![usize::MAX; mesh.faces().len()];
        for (place, &face) in order.faces.iter().enumerate() {
            place_of[face as usize] = place;
        }
        for (region, range) in order.ranges.iter().enumerate() {
            self.regions[region].first_outer = self.outer_sides.len() as u32;
            for &face in &order.faces[range.clone()] {
                let outer = (self.sides_of(mesh, face).into_iter())
                    .zip(mesh.face_edges()[face as usize])
                    .filter(|&(side, edge)| {
                        let [left, right] = mesh.edge_faces()[edge as usize];
                        let across = if side.is_left() { right } else { left };
                        !range.contains(&place_of[across as usize])
                    })
                    .map(|(side, _)| side);
                self.outer_sides.extend(outer);
            }
        }
        if let Some(end) = self.regions.last_mut() {
            end.first_outer = self.outer_sides.len() as u32;
        }
    }

    /// Notes which faces show their front.
    pub(super) fn start(&mut self, is_front: impl Fn(u32) -> bool) {
        self.fronts.clear();
        let mask = |faces: &[u32; LANES]| mask_of(faces.map(&is_front));
        self.fronts.extend(self.block_faces.iter().map(mask));
        self.unknown_fronts.clear();
        self.unknown_fronts
            .extend(self.unknown.iter().map(|&face| is_front(face)));
    }

    /// Finds the faces that look another way from the new viewpoint than from the last, and of their edges those that may
    /// join or leave the silhouette; returns the number of regions tested.
    pub(super) fn find_turned(
        &mut self,
        mesh: &EdgeMesh,
        old: &Query,
        view: (&Viewpoint, &Query),
        turned: &mut Turned,
    ) -> usize {
        for k in 0..self.unknown.len() {
            let is_front = mesh.is_front(self.unknown[k], view.0, view.1);
            if std::mem::replace(&mut self.unknown_fronts[k], is_front) != is_front {
                let sides = self.sides_of(mesh, self.unknown[k]);
                turned.list(is_front).extend_from_slice(&sides);
            }
        }
        let (old, new) = (Dual::new(old), Dual::new(view.1));
        let (mut at, mut visited) = (0, 0);
        while at + 1 < self.regions.len() {
            let region = &self.regions[at];
            visited += 1;
            // Most regions off the new plane are off the old one too.
            let after = new.facing_of(region);
            let before = if after == Facing::Both {
                Facing::Both
            } else {
                old.facing_of(region)
            };
            let skip = region.skip as usize;
            let blocks = region.first_block as usize..self.regions[skip].first_block as usize;
            if before == Facing::Both || after == Facing::Both {
                at += 1;
                if skip == at {
                    self.test_points(mesh, blocks, view, turned);
                }
                continue;
            }
            if before != after {
                let outer = region.first_outer as usize..self.regions[at + 1].first_outer as usize;
                let is_front = after == Facing::Front;
                turned
                    .list(is_front)
                    .extend_from_slice(&self.outer_sides[outer]);
                self.fronts[blocks].fill(mask_of([is_front; LANES]));
            }
            at = skip;
        }
        visited
    }

    /// Walks down as far as the faces of a region look different ways from some of the viewpoints: `visit` is given faces that all look
    /// one way from all of them, and that way; and faces of which more is not known. Returns the number of regions visited.
    pub(super) fn visit_by_facing(
        &self,
        queries: &[&Query],
        mut visit: impl FnMut(Option<bool>, &mut dyn Iterator<Item = u32>),
    ) -> usize {
        let duals: Vec<Dual> = queries.iter().map(|query| Dual::new(query)).collect();
        visit(None, &mut self.unknown.iter().copied());
        self.walk(
            |region| {
                let facing = duals[0].facing_of(region);
                let is_one = duals[1..].iter().all(|d| d.facing_of(region) == facing);
                match facing {
                    Facing::Front if is_one => Some(Some(true)),
                    Facing::Back if is_one => Some(Some(false)),
                    _ => None,
                }
            },
            |facing, faces| visit(facing, faces),
        )
    }

    /// Visits faces, and some more, whose planes are within `reach` of a viewpoint, in units of the query's value. Returns the number of
    /// regions visited.
    pub(super) fn visit_near(
        &self,
        query: &Query,
        reach: f64,
        mut visit: impl FnMut(&mut dyn Iterator<Item = u32>),
    ) -> usize {
        let dual = Dual::new(query);
        visit(&mut self.unknown.iter().copied());
        self.walk(
            |region| {
                // Points are planes over their largest coordinate: this is the greatest length of a normal then.
                let normal = (0..3).map(|k| region.middle[k].abs() + region.half[k]);
                let longest = normal.map(|c| c * c).sum::<f32>().sqrt() * (1.0 + BOX_ROOM);
                let is_far = dual.is_beyond(region, (reach * f64::from(longest)) as f32);
                is_far.then_some(Some(true))
            },
            |is_far, faces| {
                if is_far.is_none() {
                    visit(faces);
                }
            },
        )
    }

    /// Walks down to regions of which `decide` says something, and to leaves.
    fn walk<T>(
        &self,
        decide: impl Fn(&Region) -> Option<Option<T>>,
        mut visit: impl FnMut(Option<T>, &mut dyn Iterator<Item = u32>),
    ) -> usize {
        let (mut at, mut visited) = (0, 0);
        while at + 1 < self.regions.len() {
            let region = &self.regions[at];
            visited += 1;
            let skip = region.skip as usize;
            let blocks = region.first_block as usize..self.regions[skip].first_block as usize;
            let decided = decide(region);
            let is_leaf = skip == at + 1;
            if decided.is_none() && !is_leaf {
                at += 1;
                continue;
            }
            // Places that no face was left for repeat the first.
            let faces = |&ids: &[u32; LANES]| {
                let is_face = move |&k: &usize| k == 0 || ids[k] != ids[0];
                (0..LANES).filter(is_face).map(move |k| ids[k])
            };
            visit(
                decided.flatten(),
                &mut self.block_faces[blocks].iter().flat_map(faces),
            );
            at = skip;
        }
        visited
    }

    fn test_points(
        &mut self,
        mesh: &EdgeMesh,
        blocks: std::ops::Range<usize>,
        (viewpoint, query): (&Viewpoint, &Query),
        turned: &mut Turned,
    ) {
        let first = blocks.start;
        let fronts = &mut self.fronts[blocks.clone()];
        for (at, (block, front)) in (first..).zip(self.blocks[blocks].iter().zip(fronts)) {
            let values = query.values(block);
            let mut is_front = mask_of(values.map(|v| v > 0.0));
            if mask_of(values.map(|v| v.abs() <= query.value_error)) != 0 {
                let faces = self.block_faces[at];
                is_front = mask_of(faces.map(|f| mesh.is_front(f, viewpoint, query)));
            }
            let changed = std::mem::replace(front, is_front) ^ is_front;
            if changed == 0 {
                continue;
            }
            for lane in 0..LANES {
                // Places that no face was left for repeat the first.
                let is_first = lane == 0 || self.block_faces[at][lane] != self.block_faces[at][0];
                if changed >> lane & 1 == 1 && is_first {
                    turned
                        .list(is_front >> lane & 1 == 1)
                        .extend_from_slice(&self.block_sides[at][lane]);
                }
            }
        }
    }
}

/// One bit for each lane.
#[inline(always)]
fn mask_of(lanes: [bool; LANES]) -> u8 {
    let [a, b, c, d] = lanes.map(u8::from);
    a | b << 1 | c << 2 | d << 3
}

/// The places of points in the depth-first order of regions, while the octree is built.
#[derive(Debug, Default)]
struct Order {
    faces: Vec<u32>,
    ranges: Vec<std::ops::Range<usize>>,
}

/// A viewpoint as a plane of dual space.
struct Dual {
    normal: [f32; 4],
    sizes: [f32; 4],
}

impl Dual {
    fn new(query: &Query) -> Self {
        let normal = [query.point.x, query.point.y, query.point.z, query.weight];
        Self {
            normal,
            sizes: normal.map(f32::abs),
        }
    }

    /// Whether all of a region's points have a value beyond `limit`, of either sign.
    fn is_beyond(&self, region: &Region, limit: f32) -> bool {
        let dot = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let reach = dot(&self.sizes, &region.half) + BOX_ROOM + limit * (1.0 + BOX_ROOM);
        dot(&self.normal, &region.middle).abs() > reach
    }

    #[inline(always)]
    fn facing_of(&self, region: &Region) -> Facing {
        let dot =
            |a: &[f32; 4], b: &[f32; 4]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
        let value = dot(&self.normal, &region.middle);
        let reach = dot(&self.sizes, &region.half) + BOX_ROOM;
        if value > reach {
            Facing::Front
        } else if value < -reach {
            Facing::Back
        } else {
            Facing::Both
        }
    }
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

fn region_of(points: &[Point], first_block: usize) -> Region {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for p in points {
        for k in 0..4 {
            low[k] = low[k].min(p.at[k]);
            high[k] = high[k].max(p.at[k]);
        }
    }
    Region {
        middle: std::array::from_fn(|k| (0.5 * (low[k] + high[k])) as f32),
        half: std::array::from_fn(|k| (0.5 * (high[k] - low[k])) as f32),
        skip: 0,
        first_block: first_block as u32,
        first_outer: 0,
    }
}
