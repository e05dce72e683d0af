//! Fewer vertices for the same outline: greedy vertex removal within a tolerance.
//!
//! A traced outline is a staircase. Its corners lie on both sides of the true outline, the middles of its steps mostly on
//! it, so first every corner is cut off half a step away (when the tolerance allows that). Then the vertex whose removal
//! strays least from the traced outline goes, again and again. Every corner of the traced outline stays within
//! the tolerance of the edge that stands for it, and every edge within the tolerance of the traced outline. Loops
//! neither cross themselves nor each other, and none changes sides with another: a vertex goes only if no other vertex
//! lies in the triangle it leaves.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. TR-1-99, Harvard University, 1999, section 4.
//! Deviations: the paper removes corners of the staircase; cutting the corners first halves the bias.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec2;
use robust::{Coord, orient2d};
use silmap_geometry::Loop;

/// How far to simplify.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplifyContourParams {
    /// Largest distance of the simplified from the traced outline and of the traced from the simplified, pixels. With 0
    /// only vertices on straight lines go.
    pub tolerance_px: f64,
    /// Whether the simplified region must contain the traced one.
    pub outward_only: bool,
}

impl Default for SimplifyContourParams {
    fn default() -> Self {
        Self {
            tolerance_px: 0.5,
            outward_only: false,
        }
    }
}

/// How far along each edge from a corner it is cut off, pixels; at most half of the edge.
const CUT_PX: f64 = 0.5;
/// Distance of a right-angled corner from its cut, pixels: corners are cut when the tolerance is no less.
const CUT_DEPTH_PX: f64 = CUT_PX * std::f64::consts::FRAC_1_SQRT_2;

/// Simplifies the loops of one image together, in their order; each keeps its orientation and at least three vertices.
///
/// The loops must not cross, as [`crate::trace::trace_contours`] returns them.
#[must_use]
pub fn simplify_contours(loops: &[Loop], params: &SimplifyContourParams) -> Vec<Loop> {
    let mut chains = Chains::new(loops, params);
    chains.remove_vertices();
    chains.into_loops()
}

/// A vertex of the simplified outline.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: DVec2,
    previous: u32,
    next: u32,
    /// The loop it belongs to.
    owner: u32,
    /// The first traced corner at or after the place on the traced outline where this vertex began.
    corner_from: u32,
    /// The first traced corner after that place.
    corner_after: u32,
    /// Rises whenever a neighbour changes, so that stale candidates are known.
    version: u32,
    is_kept: bool,
}

/// The traced corners of a loop in `Chains::corners`, and how many of its vertices are left.
#[derive(Clone, Copy, Debug)]
struct LoopRange {
    first: u32,
    end: u32,
    kept: u32,
    first_vertex: u32,
}

/// All loops while they are being simplified.
struct Chains {
    corners: Vec<DVec2>,
    ranges: Vec<LoopRange>,
    vertices: Vec<Vertex>,
    grid: VertexGrid,
    tolerance_squared: f64,
    outward_only: bool,
}

impl Chains {
    fn new(loops: &[Loop], params: &SimplifyContourParams) -> Self {
        let cuts_corners = !params.outward_only && params.tolerance_px >= CUT_DEPTH_PX;
        let mut corners = Vec::new();
        let mut ranges = Vec::with_capacity(loops.len());
        let mut vertices: Vec<Vertex> = Vec::new();
        for (owner, points) in loops.iter().enumerate() {
            let first = corners.len() as u32;
            let end = first + points.len() as u32;
            let first_vertex = vertices.len();
            let mut add = |position, corner_from, corner_after| {
                let k = vertices.len() as u32;
                vertices.push(Vertex {
                    position,
                    previous: k.wrapping_sub(1),
                    next: k + 1,
                    owner: owner as u32,
                    corner_from,
                    corner_after,
                    version: 0,
                    is_kept: true,
                });
            };
            for (k, &a) in (first..).zip(points) {
                let after = if k + 1 == end { first } else { k + 1 };
                if !cuts_corners {
                    add(a, k, after);
                    continue;
                }
                let b = points[(after - first) as usize];
                let length = a.distance(b);
                if length > 2.0 * CUT_PX {
                    add(a + (b - a) * (CUT_PX / length), after, after);
                    add(b - (b - a) * (CUT_PX / length), after, after);
                } else {
                    add((a + b) * 0.5, after, after);
                }
            }
            let last_vertex = vertices.len();
            if last_vertex > first_vertex {
                vertices[first_vertex].previous = last_vertex as u32 - 1;
                vertices[last_vertex - 1].next = first_vertex as u32;
            }
            corners.extend_from_slice(points);
            ranges.push(LoopRange {
                first,
                end,
                kept: (last_vertex - first_vertex) as u32,
                first_vertex: first_vertex as u32,
            });
        }
        let grid = VertexGrid::new(&vertices);
        Self {
            corners,
            ranges,
            vertices,
            grid,
            tolerance_squared: params.tolerance_px * params.tolerance_px,
            outward_only: params.outward_only,
        }
    }

    fn position(&self, vertex: u32) -> DVec2 {
        self.vertices[vertex as usize].position
    }

    /// Removes vertices, the least harmful first, until none may go.
    fn remove_vertices(&mut self) {
        let mut queue = BinaryHeap::with_capacity(self.vertices.len());
        for v in 0..self.vertices.len() as u32 {
            self.offer(v, &mut queue);
        }
        while let Some(Reverse((_, v, version))) = queue.pop() {
            let vertex = self.vertices[v as usize];
            let owner = vertex.owner as usize;
            if !vertex.is_kept
                || vertex.version != version
                || self.ranges[owner].kept <= 3
                || self.is_blocked(v)
            {
                continue;
            }
            let (p, n) = (vertex.previous, vertex.next);
            self.vertices[v as usize].is_kept = false;
            self.vertices[p as usize].next = n;
            self.vertices[n as usize].previous = p;
            self.ranges[owner].kept -= 1;
            self.ranges[owner].first_vertex = p;
            for neighbour in [p, n] {
                self.vertices[neighbour as usize].version += 1;
                self.offer(neighbour, &mut queue);
            }
        }
    }

    /// Puts the removal of a vertex into the queue if it keeps within the tolerance.
    fn offer(&self, v: u32, queue: &mut BinaryHeap<Reverse<(u64, u32, u32)>>) {
        let vertex = self.vertices[v as usize];
        let (a, b) = (self.position(vertex.previous), self.position(vertex.next));
        if self.outward_only && turn(a, vertex.position, b) > 0.0 {
            return;
        }
        if let Some(stray) = self.stray_squared(vertex.previous, vertex.next) {
            // Non-negative floats sort as their bits do.
            queue.push(Reverse((stray.to_bits(), v, vertex.version)));
        }
    }

    /// Largest squared distance of the traced corners between two vertices from the segment between them; `None` beyond
    /// the tolerance.
    fn stray_squared(&self, from: u32, to: u32) -> Option<f64> {
        let (a, b) = (self.position(from), self.position(to));
        let range = self.ranges[self.vertices[from as usize].owner as usize];
        let mut corner = self.vertices[from as usize].corner_after;
        let end = self.vertices[to as usize].corner_from;
        let mut worst = 0.0_f64;
        while corner != end {
            worst = worst.max(distance_squared(self.corners[corner as usize], a, b));
            if worst > self.tolerance_squared {
                return None;
            }
            corner += 1;
            if corner == range.end {
                corner = range.first;
            }
        }
        Some(worst)
    }

    /// Whether a vertex other than its neighbours lies in the triangle that removing `v` sweeps over.
    fn is_blocked(&self, v: u32) -> bool {
        let vertex = self.vertices[v as usize];
        let (p, n) = (vertex.previous, vertex.next);
        let triangle = [self.position(p), vertex.position, self.position(n)];
        self.grid.any_in(triangle, |other| {
            other != v
                && other != p
                && other != n
                && self.vertices[other as usize].is_kept
                && is_in_triangle(self.position(other), triangle)
        })
    }

    fn into_loops(self) -> Vec<Loop> {
        self.ranges
            .iter()
            .map(|range| {
                // The smallest vertex left comes first, wherever removal ended.
                let kept = range.kept as usize;
                let mut points = Vec::with_capacity(kept);
                let mut v = range.first_vertex;
                let mut smallest = (u32::MAX, 0);
                for k in 0..kept {
                    smallest = smallest.min((v, k));
                    points.push(self.position(v));
                    v = self.vertices[v as usize].next;
                }
                points.rotate_left(smallest.1);
                points
            })
            .collect()
    }
}

/// Positive where the path a, b, c turns towards the inside of the region, zero where it runs straight on; the sign is exact.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Whether `p` lies in a triangle (of any orientation, or flat) or on its border.
fn is_in_triangle(p: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    let low = a.min(b).min(c);
    let high = a.max(b).max(c);
    if p.cmplt(low).any() || p.cmpgt(high).any() {
        return false;
    }
    let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

/// Squared distance of `p` from the segment between `a` and `b`.
fn distance_squared(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (along, offset) = (b - a, p - a);
    let length_squared = along.length_squared();
    let t = offset.dot(along);
    if t <= 0.0 {
        offset.length_squared()
    } else if t >= length_squared {
        p.distance_squared(b)
    } else {
        let across = along.perp_dot(offset);
        across * across / length_squared
    }
}

/// Vertices by square cells of the image.
struct VertexGrid {
    low: DVec2,
    columns: usize,
    rows: usize,
    /// Where each cell's vertices begin in `members`; one more than there are cells.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl VertexGrid {
    /// Side of a cell, pixels: a few staircase corners in each.
    const CELL_PX: f64 = 4.0;

    fn new(vertices: &[Vertex]) -> Self {
        let (low, high) = vertices
            .iter()
            .map(|v| v.position)
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
                (low.min(p), high.max(p))
            });
        if vertices.is_empty() {
            return Self {
                low: DVec2::ZERO,
                columns: 0,
                rows: 0,
                starts: vec![0],
                members: Vec::new(),
            };
        }
        let size = ((high - low) / Self::CELL_PX).floor();
        let (columns, rows) = (size.x as usize + 1, size.y as usize + 1);
        let mut grid = Self {
            low,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            members: vec![0; vertices.len()],
        };
        // Counting sort: count, sum up, then fill each cell from its end.
        for vertex in vertices {
            let cell = grid.cell(vertex.position);
            grid.starts[cell] += 1;
        }
        let mut sum = 0;
        for start in &mut grid.starts {
            sum += *start;
            *start = sum;
        }
        for v in (0..vertices.len() as u32).rev() {
            let cell = grid.cell(vertices[v as usize].position);
            grid.starts[cell] -= 1;
            grid.members[grid.starts[cell] as usize] = v;
        }
        grid
    }

    fn column_row(&self, p: DVec2) -> (usize, usize) {
        let place = ((p - self.low) / Self::CELL_PX).max(DVec2::ZERO);
        (
            (place.x as usize).min(self.columns.saturating_sub(1)),
            (place.y as usize).min(self.rows.saturating_sub(1)),
        )
    }

    fn cell(&self, p: DVec2) -> usize {
        let (column, row) = self.column_row(p);
        row * self.columns + column
    }

    /// Whether `test` holds for a vertex in the cells around a triangle.
    fn any_in(&self, [a, b, c]: [DVec2; 3], test: impl Fn(u32) -> bool) -> bool {
        let (first_column, first_row) = self.column_row(a.min(b).min(c));
        let (last_column, last_row) = self.column_row(a.max(b).max(c));
        (first_row..=last_row).any(|row| {
            let from = self.starts[row * self.columns + first_column] as usize;
            let to = self.starts[row * self.columns + last_column + 1] as usize;
            self.members[from..to].iter().any(|&v| test(v))
        })
    }
}

#[cfg(test)]
mod tests;
