//! The state of loops during simplification: remaining vertices, traced vertices, and the reach of a change.

use glam::DVec2;
use robust::{Coord, orient2d};
use silmap_geometry::Loop;
use silmap_geometry::polygon::{distance_squared_to_segment, signed_area};

use super::SimplifyContourParams;
use super::grid::EdgeGrid;
use super::moments::{Line, Moments};

/// How far along each edge from a corner it is cut off, pixels; at most half of the edge.
const CUT_PX: f64 = 0.5;
/// Largest distance of a right-angled corner's cut from its edges, pixels: corners are cut when the tolerance is no less.
const CUT_DEPTH_PX: f64 = CUT_PX / 2.0;

/// A long edge between two unit edges in the same direction is a step of a staircase and may start as a single vertex in its middle: the line
/// from there to the middle of a unit edge is nowhere this far from the two.
const STEP_PX: f64 = 0.5;

/// A vertex of the simplified outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) position: DVec2,
    pub(super) previous: u32,
    pub(super) next: u32,
    /// The loop it belongs to.
    owner: u32,
    /// Rises with every change nearby, so that stale proposals are known.
    version: u32,
    /// The place on the traced outline that divides what the two edges stand for.
    pub(super) place: Place,
    /// The line fitted to what the edge to the next vertex stands for.
    pub(super) line: Line,
}

/// A place on the traced outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The vertex that began here.
    start: u32,
    /// The traced edge it lies on; both ends are the same corner where it lies on that.
    pub(super) leg: (DVec2, DVec2),
    /// Where on the leg.
    pub(super) position: DVec2,
    /// The first traced corner at or after it.
    corner_from: u32,
    /// The first traced corner after it.
    corner_after: u32,
}

/// A corner of the traced outline, prepared for measuring how far an edge across it strays.
#[derive(Clone, Copy, Debug)]
struct Corner {
    position: DVec2,
    /// Points of equal distance from both legs are `position + s · bisector`, with s > 0 between the legs.
    bisector: DVec2,
    /// At s = 1: distance from the legs' lines.
    height: f64,
    /// At s = 1: how far along each leg the nearest point is.
    advance: f64,
    /// Length of the shorter leg.
    leg: f64,
}

impl Corner {
    fn new(before: DVec2, position: DVec2, after: DVec2) -> Self {
        let arriving = (position - before).normalize_or_zero();
        let leaving = (after - position).normalize_or_zero();
        Self {
            position,
            bisector: leaving - arriving,
            height: arriving.perp_dot(leaving).abs(),
            advance: 1.0 - arriving.dot(leaving),
            leg: before.distance(position).min(position.distance(after)),
        }
    }

    /// A squared bound on the distance from both legs of some point of the segment from `a` to `b`.
    ///
    /// Such points, one per corner, divide the segment into parts that run along one leg each; distance from a leg is
    /// convex, so no point of a part is farther from it than the part's ends.
    fn stray_squared(&self, a: DVec2, b: DVec2) -> f64 {
        let (along, offset) = (b - a, self.position - a);
        let s = along.perp_dot(offset) / self.bisector.perp_dot(along);
        let at = (offset + self.bisector * s).dot(along);
        if s >= 0.0 && at >= 0.0 && at <= along.length_squared() {
            let beyond = (s * self.advance - self.leg).max(0.0);
            return (s * self.height) * (s * self.height) + beyond * beyond;
        }
        distance_squared_to_segment(self.position, a, b)
    }
}

/// The corners, the starting vertices and the present state of one loop.
#[derive(Clone, Copy, Debug)]
struct LoopState {
    corner_first: u32,
    corner_end: u32,
    vertex_first: u32,
    vertex_end: u32,
    /// Vertices left.
    kept: u32,
    /// One of them.
    any_vertex: u32,
    area: f64,
}

/// What becomes of the path of five vertices around `v` when `v` goes: the two next to it move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proposal {
    /// New position of the vertex before.
    pub(super) before: DVec2,
    /// New position of the vertex after.
    pub(super) after: DVec2,
    /// Whether the vertex after takes over the removed one's place on the traced outline.
    pub(super) takes_place: bool,
    /// Triangles that together hold everything the path sweeps over.
    pub(super) swept: [Option<[DVec2; 3]>; 5],
}

/// All loops of an image.
#[derive(Debug)]
pub(super) struct SimplifiedLoops {
    corners: Vec<Corner>,
    loops: Vec<LoopState>,
    vertices: Vec<Vertex>,
    /// Moments of the starting polyline from its loop's beginning to each vertex, and to the end: one more per loop.
    moments: Vec<Moments>,
    grid: EdgeGrid,
    pub(super) tolerance_squared: f64,
}

impl SimplifiedLoops {
    pub(super) fn new(loops: &[Loop], params: &SimplifyContourParams) -> Self {
        let cuts_corners = !params.outward_only && params.tolerance_px >= CUT_DEPTH_PX;
        let mut outline = Self {
            corners: Vec::new(),
            loops: Vec::with_capacity(loops.len()),
            vertices: Vec::new(),
            moments: Vec::new(),
            grid: EdgeGrid::new(loops),
            tolerance_squared: params.tolerance_px * params.tolerance_px,
        };
        for points in loops {
            outline.add_loop(points, cuts_corners);
        }
        for v in 0..outline.vertex_count() {
            let next = outline.vertices[v as usize].next;
            outline.vertices[v as usize].line = outline.moments_between(v, next).fit();
            outline.insert_edge(v);
        }
        outline
    }

    fn add_loop(&mut self, points: &Loop, cuts_corners: bool) {
        let n = points.len();
        let corner_first = self.corners.len() as u32;
        let corner_end = corner_first + n as u32;
        let vertex_first = self.vertices.len() as u32;
        let owner = self.loops.len() as u32;
        let vertices = &mut self.vertices;
        let mut add = |position, leg, corner_from, corner_after| {
            let v = vertices.len() as u32;
            vertices.push(Vertex {
                position,
                previous: v.wrapping_sub(1),
                next: v + 1,
                owner,
                version: 0,
                place: Place {
                    start: v,
                    leg,
                    position,
                    corner_from,
                    corner_after,
                },
                line: Line::default(),
            });
        };
        for (k, &a) in points.iter().enumerate() {
            let after = corner_first + ((k + 1) % n) as u32;
            if !cuts_corners {
                add(a, (a, a), corner_first + k as u32, after);
                continue;
            }
            let b = points[(k + 1) % n];
            let (before, beyond) = (points[(k + n - 1) % n], points[(k + 2) % n]);
            let is_step = self.tolerance_squared >= STEP_PX * STEP_PX
                && before.distance(a) <= 2.0 * CUT_PX
                && b.distance(beyond) <= 2.0 * CUT_PX
                && turn(before, a, b) * turn(a, b, beyond) < 0.0;
            let length = a.distance(b);
            if is_step || length <= 2.0 * CUT_PX {
                add((a + b) * 0.5, (a, b), after, after);
            } else {
                let cut = (b - a) * (CUT_PX / length);
                add(a + cut, (a, b), after, after);
                add(b - cut, (a, b), after, after);
            }
        }
        let vertex_end = self.vertices.len() as u32;
        if vertex_end > vertex_first {
            self.vertices[vertex_first as usize].previous = vertex_end - 1;
            self.vertices[vertex_end as usize - 1].next = vertex_first;
        }
        let own = &self.vertices[vertex_first as usize..];
        let mut sum = Moments::default();
        self.moments.push(sum);
        for (k, vertex) in own.iter().enumerate() {
            sum = sum + Moments::of_segment(vertex.position, own[(k + 1) % own.len()].position);
            self.moments.push(sum);
        }
        self.corners.extend(
            (0..n).map(|k| Corner::new(points[(k + n - 1) % n], points[k], points[(k + 1) % n])),
        );
        let positions: Loop = own.iter().map(|v| v.position).collect();
        self.loops.push(LoopState {
            corner_first,
            corner_end,
            vertex_first,
            vertex_end,
            kept: vertex_end - vertex_first,
            any_vertex: vertex_first,
            area: signed_area(&positions),
        });
    }

    pub(super) fn vertex_count(&self) -> u32 {
        self.vertices.len() as u32
    }

    /// Whether a vertex was removed.
    pub(super) fn is_gone(&self, v: u32) -> bool {
        self.vertex(v).next == u32::MAX
    }

    pub(super) fn version(&self, v: u32) -> u32 {
        self.vertices[v as usize].version
    }

    pub(super) fn vertex(&self, v: u32) -> &Vertex {
        &self.vertices[v as usize]
    }

    /// The vertices two before, before, after and two after `v`; `None` when too few are left for `v` to go.
    pub(super) fn neighbourhood(&self, v: u32) -> Option<[u32; 4]> {
        let vertex = self.vertex(v);
        let (p, n) = (vertex.previous, vertex.next);
        let can_go = self.loops[vertex.owner as usize].kept > 3;
        can_go.then(|| [self.vertex(p).previous, p, n, self.vertex(n).next])
    }

    /// Moments of the starting polyline between the places of two vertices of a loop.
    pub(super) fn moments_between(&self, from: u32, to: u32) -> Moments {
        let (from, to) = (self.vertex(from), self.vertex(to));
        let state = &self.loops[from.owner as usize];
        // Each loop before this one has one more sum than vertices.
        let at = |v: u32| self.moments[(v + from.owner) as usize];
        if from.place.start < to.place.start {
            at(to.place.start) - at(from.place.start)
        } else {
            at(state.vertex_end) - at(from.place.start) + at(to.place.start)
                - at(state.vertex_first)
        }
    }

    /// Whether the segment from `a` to `b` stays within the tolerance of the traced outline between two places of a loop.
    pub(super) fn is_near(&self, (from, a): (u32, DVec2), (to, b): (Place, DVec2)) -> bool {
        self.corners_between(from, to)
            .all(|corner| corner.stray_squared(a, b) <= self.tolerance_squared)
    }

    /// The corner between two places of a loop that the segment from `a` to `b` strays from most: the squared stray and
    /// where the corner is.
    pub(super) fn worst_stray(
        &self,
        (from, a): (u32, DVec2),
        (to, b): (Place, DVec2),
    ) -> (f64, DVec2) {
        self.corners_between(from, to)
            .fold((0.0, a), |worst, corner| {
                let stray = corner.stray_squared(a, b);
                if stray > worst.0 {
                    (stray, corner.position)
                } else {
                    worst
                }
            })
    }

    /// The traced corners between the place of a vertex and another place of its loop.
    fn corners_between(&self, from: u32, to: Place) -> impl Iterator<Item = &Corner> {
        let vertex = self.vertex(from);
        let state = &self.loops[vertex.owner as usize];
        let (first, end) = (vertex.place.corner_after, to.corner_from);
        let (head, tail) = if first <= end {
            (first..end, 0..0)
        } else {
            (first..state.corner_end, state.corner_first..end)
        };
        let range = |r: std::ops::Range<u32>| &self.corners[r.start as usize..r.end as usize];
        range(head).iter().chain(range(tail))
    }

    /// Whether a change keeps all loops simple, apart, and on their sides of each other.
    ///
    /// Nothing changes sides when no vertex lies where the path sweeps; nothing crosses when the new edges do not.
    pub(super) fn is_clear(&self, v: u32, proposal: &Proposal) -> bool {
        let Some([pp, p, n, nn]) = self.neighbourhood(v) else {
            return false;
        };
        let (first, last) = (self.vertex(pp).position, self.vertex(nn).position);
        let (before, after) = (proposal.before, proposal.after);
        let path = [(first, before), (before, after), (after, last)];
        let folds =
            |a: DVec2, b: DVec2, c: DVec2| turn(a, b, c) == 0.0 && (b - a).dot(c - b) <= 0.0;
        if folds(first, before, after) || folds(before, after, last) {
            return false;
        }
        let owner = self.vertex(v).owner as usize;
        if (self.loops[owner].area + self.area_gain(v, proposal)) * self.loops[owner].area <= 0.0 {
            return false;
        }
        if pp != nn && segments_meet(path[0], path[2]) {
            return false;
        }
        let is_swept = |q: DVec2| {
            let mut triangles = proposal.swept.iter().flatten();
            triangles.any(|t| !t.contains(&q) && is_in_triangle(q, *t))
        };
        if is_swept(first) || is_swept(last) {
            return false;
        }
        let swept = proposal.swept.iter().flatten().flatten();
        let corners = || swept.clone().copied().chain([first, before, after, last]);
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
        !self.grid.any_edge(low, high, |e| {
            let edge = self.vertex(e);
            if edge.next == u32::MAX || [pp, p, v, n].contains(&e) {
                return false;
            }
            let (a, b) = (edge.position, self.vertex(edge.next).position);
            if a.max(b).cmplt(low).any() || a.min(b).cmpgt(high).any() {
                return false;
            }
            let is_corner = e == nn;
            let covers_start = !is_corner && {
                let mut triangles = proposal.swept.iter().flatten();
                triangles.any(|t| is_in_triangle(a, *t))
            };
            covers_start
                || path.iter().enumerate().any(|(k, &side)| {
                    if k == 0 && edge.next == pp {
                        folds(a, b, side.1)
                    } else if k == 2 && e == nn {
                        folds(side.0, a, b)
                    } else {
                        segments_meet((a, b), side)
                    }
                })
        })
    }

    fn area_gain(&self, v: u32, proposal: &Proposal) -> f64 {
        let Some([pp, p, n, nn]) = self.neighbourhood(v) else {
            return 0.0;
        };
        let at = |v: u32| self.vertex(v).position;
        signed_area(&[at(pp), proposal.before, proposal.after, at(nn)])
            - signed_area(&[at(pp), at(p), at(v), at(n), at(nn)])
    }

    /// Carries a proposal out; gives back the vertices whose own proposals may have changed.
    pub(super) fn apply(&mut self, v: u32, proposal: &Proposal) -> [u32; 4] {
        let Some([pp, p, n, nn]) = self.neighbourhood(v) else {
            return [v; 4];
        };
        let owner = self.vertex(v).owner as usize;
        self.loops[owner].area += self.area_gain(v, proposal);
        self.loops[owner].kept -= 1;
        self.loops[owner].any_vertex = p;
        let removed = self.vertices[v as usize].place;
        let after = &mut self.vertices[n as usize];
        after.position = proposal.after;
        after.previous = p;
        if proposal.takes_place {
            after.place = removed;
        }
        let before = &mut self.vertices[p as usize];
        before.position = proposal.before;
        before.next = n;
        // A removed vertex leads nowhere.
        self.vertices[v as usize].next = u32::MAX;
        self.vertices[v as usize].version += 1;
        self.vertices[p as usize].line = self.moments_between(p, n).fit();
        if proposal.takes_place {
            self.vertices[n as usize].line = self.moments_between(n, nn).fit();
        }
        for changed in [pp, p, n] {
            self.insert_edge(changed);
        }
        for changed in [pp, p, n, nn] {
            self.vertices[changed as usize].version += 1;
        }
        [pp, p, n, nn]
    }

    fn insert_edge(&mut self, v: u32) {
        let vertex = self.vertex(v);
        let (a, b) = (vertex.position, self.vertex(vertex.next).position);
        self.grid.insert(v, a, b);
    }

    /// The loops that are left. Each begins with its vertex of lowest id.
    pub(super) fn into_loops(self) -> Vec<Loop> {
        self.loops
            .iter()
            .map(|state| {
                let kept = state.kept as usize;
                let mut points = Vec::with_capacity(kept);
                let mut v = state.any_vertex;
                let mut lowest = (u32::MAX, 0);
                for k in 0..kept {
                    lowest = lowest.min((v, k));
                    points.push(self.vertex(v).position);
                    v = self.vertex(v).next;
                }
                points.rotate_left(lowest.1);
                points
            })
            .collect()
    }
}

/// Positive where the path a, b, c turns towards the inside of the region, zero where it runs straight on; the sign is exact.
pub(super) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Whether `p` lies in a triangle (of any orientation, or flat) or on its border.
pub(super) fn is_in_triangle(p: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    let low = a.min(b).min(c);
    let high = a.max(b).max(c);
    if p.cmplt(low).any() || p.cmpgt(high).any() {
        return false;
    }
    let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

/// Whether two closed segments share a point.
pub(super) fn segments_meet((a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)) -> bool {
    if a.max(b).cmplt(c.min(d)).any() || c.max(d).cmplt(a.min(b)).any() {
        return false;
    }
    // Boxes that meet and ends that lie on no common side: this holds for segments in one line, too.
    turn(a, b, c) * turn(a, b, d) <= 0.0 && turn(c, d, a) * turn(c, d, b) <= 0.0
}
