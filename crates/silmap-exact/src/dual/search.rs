//! Searching a tree of regions for the points in a double wedge.
//!
//! A region whose box lies all within the wedge turns as a whole. Edges between two faces of it change nothing, so only
//! the edges to faces outside are reported, which belong to the faces of L_out in the source; the others, L_in, are
//! passed over.
//!
//! Source: as for the parent module, section 2.1.
//! Deviations: the search is level by level and tests both planes of the wedge for four regions at a time. The source also
//! leaves out the L_out of a region whose neighbours all lie in another region that turns (its pointer A); here such edges
//! are toggled by both.

use glam::Vec4;

use super::partition::{EdgeFace, Partition, Region};
use crate::Viewpoint;
use crate::edge_mesh::EdgeMesh;
use crate::level_order::write_range;
use crate::plane_block::{LANES, mask_of, transposed};
use crate::viewpoint::Query;

/// Error of a viewpoint's value at a box in single precision, for coordinates and query at most 1: eight roundings of
/// sums below 4, and the rounding of the box.
const BOX_ROOM: f32 = 24.0 * f32::EPSILON;
/// Regions that are tested at once.
const AT_ONCE: usize = 4;
/// Regions that are tested before what is below them is noted.
const CHUNK: usize = 64;

/// A viewpoint as a plane of dual space.
#[derive(Clone, Copy, Debug)]
struct Dual {
    normal: [f32; 4],
    sizes: [f32; 4],
}

/// Where a region lies against a viewpoint's dual plane: which way all of its faces look, if all look one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facing {
    Front,
    Back,
    Both,
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
        let value = Vec4::from_array(self.normal).dot(region.middle);
        let reach = Vec4::from_array(self.sizes).dot(region.half);
        value.abs() > reach + BOX_ROOM + limit * (1.0 + BOX_ROOM)
    }

    fn facing_of(&self, region: &Region) -> Facing {
        if !self.is_beyond(region, 0.0) {
            Facing::Both
        } else if Vec4::from_array(self.normal).dot(region.middle) > 0.0 {
            Facing::Front
        } else {
            Facing::Back
        }
    }

    /// One bit for each of four boxes, given coordinate by coordinate, all of whose points are in front; and behind.
    #[inline(always)]
    fn facings_of(&self, middle: &[Vec4; 4], half: &[Vec4; 4]) -> (u8, u8) {
        let sum = |of: &[Vec4; 4], by: &[f32; 4]| {
            of[0] * by[0] + of[1] * by[1] + of[2] * by[2] + of[3] * by[3]
        };
        let value = sum(middle, &self.normal);
        let reach = sum(half, &self.sizes) + BOX_ROOM;
        let both = mask_of(value.cmpgt(reach), (-value).cmpgt(reach));
        (both & 15, both >> 4)
    }
}

impl Partition {
    /// Finds the faces that look another way from the new viewpoint than from the last, and of their edges those that may
    /// join or leave the silhouette, as the side that is in front if they join; returns the number of regions tested.
    pub(super) fn find_turned(
        &mut self,
        mesh: &EdgeMesh,
        old: &Query,
        view: (&Viewpoint, &Query),
        turned: &mut Vec<EdgeFace>,
    ) -> usize {
        for k in 0..self.unknown.len() {
            let is_front = mesh.is_front(self.unknown[k], view.0, view.1);
            if std::mem::replace(&mut self.unknown_fronts[k], is_front) != is_front {
                let sides = self.sides_of(mesh, self.unknown[k]);
                turned.extend(sides.map(|side| side.in_front(is_front)));
            }
        }
        let (tested, visited) = self.search((&Dual::new(old), &Dual::new(view.1)), turned);
        self.test_blocks(mesh, tested, view, turned);
        visited
    }

    /// Notes the blocks that are to be tested; returns their number and that of regions visited.
    fn search(&mut self, (old, new): (&Dual, &Dual), turned: &mut Vec<EdgeFace>) -> (usize, usize) {
        let (mut tested, mut visited, mut noted) = (0, 0, 0);
        write_range(&mut self.visited, &mut noted, 0, self.root_count);
        while visited < noted {
            let count = (noted - visited).min(CHUNK);
            let mut kept = [0; CHUNK + AT_ONCE];
            let mut kept_count = 0;
            for first in (visited..visited + count).step_by(AT_ONCE) {
                // Behind the last there are numbers of some regions or other.
                let ids: [u32; AT_ONCE] = std::array::from_fn(|k| self.visited[first + k]);
                let regions = ids.map(|id| &self.regions[id as usize]);
                let middle = transposed(regions.map(|r| r.middle));
                let half = transposed(regions.map(|r| r.half));
                let (front, back) = new.facings_of(&middle, &half);
                let (old_front, old_back) = old.facings_of(&middle, &half);
                let is_there = 15 >> AT_ONCE.saturating_sub(visited + count - first);
                let turning = (front & old_back | back & old_front) & is_there;
                let kept_mask = !((front | back) & (old_front | old_back)) & is_there;
                if turning != 0 {
                    for (lane, id) in ids.into_iter().enumerate() {
                        if turning >> lane & 1 == 1 {
                            self.turn(id, front >> lane & 1 == 1, turned);
                        }
                    }
                }
                for (lane, id) in ids.into_iter().enumerate() {
                    kept[kept_count] = id;
                    kept_count += usize::from(kept_mask >> lane & 1);
                }
            }
            visited += count;
            for &id in &kept[..kept_count] {
                let region = &self.regions[id as usize];
                let (child, children) = (region.first_child, region.child_count);
                write_range(&mut self.visited, &mut noted, child, children);
                let (block, blocks) = (region.first_block, region.own_block_count);
                write_range(&mut self.tested, &mut tested, block, blocks);
            }
        }
        (tested, visited)
    }

    /// All of a region turns.
    fn turn(&mut self, region: u32, is_front: bool, turned: &mut Vec<EdgeFace>) {
        let region = &self.regions[region as usize];
        let outer = self.outer_sides[region.outer()].iter();
        turned.extend(outer.map(|side| side.in_front(is_front)));
        for fronts in &mut self.fronts[region.blocks()] {
            fronts[0] = if is_front { 0xff } else { 0 };
        }
    }

    fn test_blocks(
        &mut self,
        mesh: &EdgeMesh,
        tested: usize,
        (viewpoint, query): (&Viewpoint, &Query),
        turned: &mut Vec<EdgeFace>,
    ) {
        let mut changed_count = 0;
        for (place, &block) in self.tested[..tested].iter().enumerate() {
            let (fronts, unsure) = self.blocks[block as usize].fronts(query);
            let [before, present] = self.fronts[block as usize];
            self.found[place] = (fronts, unsure);
            self.changed[changed_count] = place as u32;
            changed_count += usize::from((fronts ^ before | unsure) & present != 0);
        }
        for &place in &self.changed[..changed_count] {
            let block = self.tested[place as usize] as usize;
            let (mut fronts, unsure) = self.found[place as usize];
            if unsure != 0 {
                for (lane, &face) in self.block_faces[block].iter().enumerate() {
                    if unsure >> lane & 1 == 1 {
                        let is_front = mesh.is_front(face, viewpoint, query);
                        fronts = fronts & !(1 << lane) | u8::from(is_front) << lane;
                    }
                }
            }
            let [before, present] = self.fronts[block];
            let mut changed = (fronts ^ before) & present;
            self.fronts[block][0] = fronts;
            while changed != 0 {
                let lane = changed.trailing_zeros() as usize % LANES;
                let is_front = fronts >> lane & 1 == 1;
                let sides = self.block_sides[block][lane];
                turned.extend(sides.map(|side| side.in_front(is_front)));
                changed &= changed - 1;
            }
        }
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
                    Facing::Front if is_one => Some(true),
                    Facing::Back if is_one => Some(false),
                    _ => None,
                }
            },
            visit,
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
                let normal = (region.middle.abs() + region.half).truncate();
                let longest = normal.length() * (1.0 + BOX_ROOM);
                let is_far = dual.is_beyond(region, (reach * f64::from(longest)) as f32);
                is_far.then_some(true)
            },
            |is_far, faces| {
                if is_far.is_none() {
                    visit(faces);
                }
            },
        )
    }

    /// Walks down to regions of which `decide` says something, and to leaves.
    fn walk(
        &self,
        decide: impl Fn(&Region) -> Option<bool>,
        mut visit: impl FnMut(Option<bool>, &mut dyn Iterator<Item = u32>),
    ) -> usize {
        let mut next: Vec<u32> = (0..self.root_count).collect();
        let mut visited = 0;
        while let Some(id) = next.pop() {
            let region = &self.regions[id as usize];
            visited += 1;
            let decided = decide(region);
            if decided.is_none() && region.child_count > 0 {
                next.extend(region.first_child..region.first_child + region.child_count);
                continue;
            }
            let blocks = self.block_faces[region.blocks()].iter();
            let fronts = self.fronts[region.blocks()].iter();
            let mut faces = blocks.zip(fronts).flat_map(|(faces, &[_, present])| {
                (0..LANES)
                    .filter(move |lane| present >> lane & 1 == 1)
                    .map(|lane| faces[lane])
            });
            visit(decided, &mut faces);
        }
        visited
    }
}
