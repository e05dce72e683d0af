//! The border of what directed segments wind about, found along the segments themselves.
//!
//! Where segments cross is found cell by cell of a grid. Crossing one, the winding number changes by one, so it is known
//! along a whole chain of segments when it is known in one place of it; there a ray counts it. The border is what has
//! nothing on its outer side: it goes along a segment to the next crossing or end, and on along what starts there.
//!
//! Nothing is moved: the crossings are decided by exact signs. What is not decided so (three segments through one point, an
//! end on another segment, an overlap, a touch of the border with itself) is refused, and left to a method that rounds.
//!
//! Source: none; the winding numbers are those of Sander et al., Silhouette Clipping, SIGGRAPH 2000, section 6.

use glam::DVec2;
use silmap_geometry::polygon::Loop;
use silmap_geometry::predicates::orient2d;

/// A segment between two numbered points. Winding numbers are larger by one where points of it look counter-clockwise in
/// a frame with y up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// Crossings nearer to each other than this part of their segment are not told apart.
const CLOSEST_CROSSINGS: f64 = 1e-9;
/// Grid cells along one side, for each root of the number of segments.
const CELLS_PER_ROOT: f64 = 1.2;
const MOST_CELLS: usize = 512;
/// Rows for rays, for each row of cells.
const ROWS_PER_CELL: usize = 4;

/// A crossing as one of its two segments sees it.
#[derive(Clone, Copy, Debug)]
struct Event {
    segment: u32,
    /// Where along the segment, 0 to 1.
    at: f64,
    /// What is added to the winding number on the way.
    step: i32,
    crossing: u32,
}

/// The loops of the border, positive about what is wound about; `None` when a special case is in the way.
///
/// `points` are by number; segments start as often as they end in every point, and wind about nothing a negative number of
/// times.
pub(crate) fn border(points: &[DVec2], segments: &[Segment]) -> Option<Vec<Loop>> {
    if segments.is_empty() {
        return Some(Vec::new());
    }
    let ends = |s: &Segment| [points[s.from as usize], points[s.to as usize]];
    let lines: Vec<[DVec2; 2]> = segments.iter().map(ends).collect();
    let grid = Grid::new(&lines)?;
    let (mut events, positions) = find_crossings(&grid, &lines, segments)?;
    events.sort_unstable_by(|a, b| (a.segment.cmp(&b.segment)).then(a.at.total_cmp(&b.at)));
    let too_close = |pair: &[Event]| {
        pair[0].segment == pair[1].segment && pair[1].at - pair[0].at < CLOSEST_CROSSINGS
    };
    if events.windows(2).any(too_close) {
        return None;
    }
    let mut first_event = vec![0_u32; segments.len() + 1];
    for event in &events {
        first_event[event.segment as usize + 1] += 1;
    }
    for s in 0..segments.len() {
        first_event[s + 1] += first_event[s];
    }
    let joints = Joints::new(points.len(), segments);
    let mut walker = Walker {
        lines: &lines,
        segments,
        events: &events,
        first_event: &first_event,
        positions: &positions,
        joints: &joints,
        outside: Vec::new(),
    };
    walker.outside = walker.wind(&grid)?;
    walker.walk()
}

/// Which segments may meet.
struct Grid {
    origin: DVec2,
    cells_per_unit: DVec2,
    side: usize,
    /// Of each cell the range of its segments in `of_cells`; likewise of each of the finer rows.
    cell_starts: Vec<u32>,
    of_cells: Vec<u32>,
    row_starts: Vec<u32>,
    of_rows: Vec<u32>,
}

impl Grid {
    fn new(lines: &[[DVec2; 2]]) -> Option<Self> {
        let (low, high) = lines
            .as_flattened()
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            });
        let side = ((lines.len() as f64).sqrt() * CELLS_PER_ROOT) as usize;
        let side = side.clamp(1, MOST_CELLS);
        let cells_per_unit = DVec2::splat(side as f64) / (high - low);
        if !cells_per_unit.is_finite() {
            return None;
        }
        let mut grid = Self {
            origin: low,
            cells_per_unit,
            side,
            cell_starts: vec![0; side * side + 1],
            of_cells: Vec::new(),
            row_starts: vec![0; side * ROWS_PER_CELL + 1],
            of_rows: Vec::new(),
        };
        let rows: Vec<[usize; 2]> = lines
            .iter()
            .map(|[a, b]| [a.y.min(b.y), a.y.max(b.y)].map(|y| grid.row_of(y)))
            .collect();
        for &[first, last] in &rows {
            for count in &mut grid.row_starts[first + 1..=last + 1] {
                *count += 1;
            }
        }
        let boxes: Vec<[usize; 4]> = lines
            .iter()
            .map(|&[a, b]| {
                let (x0, y0) = grid.cell_of(a.min(b));
                let (x1, y1) = grid.cell_of(a.max(b));
                [x0, y0, x1, y1]
            })
            .collect();
        for &[x0, y0, x1, y1] in &boxes {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    grid.cell_starts[y * side + x + 1] += 1;
                }
            }
        }
        let sum_up = |starts: &mut [u32]| {
            for k in 1..starts.len() {
                starts[k] += starts[k - 1];
            }
            starts[starts.len() - 1] as usize
        };
        grid.of_cells = vec![0; sum_up(&mut grid.cell_starts)];
        grid.of_rows = vec![0; sum_up(&mut grid.row_starts)];
        let mut cell_next = grid.cell_starts.clone();
        let mut row_next = grid.row_starts.clone();
        for (segment, &[first, last]) in (0..).zip(&rows) {
            for next in &mut row_next[first..=last] {
                grid.of_rows[*next as usize] = segment;
                *next += 1;
            }
        }
        for (segment, &[x0, y0, x1, y1]) in (0..).zip(&boxes) {
            for y in y0..=y1 {
                for next in &mut cell_next[y * side + x0..=y * side + x1] {
                    grid.of_cells[*next as usize] = segment;
                    *next += 1;
                }
            }
        }
        Some(grid)
    }

    fn row_of(&self, y: f64) -> usize {
        let at = (y - self.origin.y) * self.cells_per_unit.y * ROWS_PER_CELL as f64;
        (at as usize).min(self.side * ROWS_PER_CELL - 1)
    }

    fn cell_of(&self, p: DVec2) -> (usize, usize) {
        let at = (p - self.origin) * self.cells_per_unit;
        let last = self.side - 1;
        ((at.x as usize).min(last), (at.y as usize).min(last))
    }
}

/// All crossings, as both segments see them, and where they are. `None` where segments meet otherwise.
fn find_crossings(
    grid: &Grid,
    lines: &[[DVec2; 2]],
    segments: &[Segment],
) -> Option<(Vec<Event>, Vec<DVec2>)> {
    let mut events = Vec::new();
    let mut positions = Vec::new();
    let lows: Vec<DVec2> = lines.iter().map(|[a, b]| a.min(*b)).collect();
    let highs: Vec<DVec2> = lines.iter().map(|[a, b]| a.max(*b)).collect();
    for (cell, range) in grid.cell_starts.windows(2).enumerate() {
        let here = &grid.of_cells[range[0] as usize..range[1] as usize];
        for (k, &i) in here.iter().enumerate() {
            let (low, high) = (lows[i as usize], highs[i as usize]);
            for &j in &here[k + 1..] {
                let corner = low.max(lows[j as usize]);
                if corner.cmpgt(high.min(highs[j as usize])).any() {
                    continue;
                }
                // Each pair once: in the cell where both boxes begin to overlap.
                let (x, y) = grid.cell_of(corner);
                if y * grid.side + x != cell {
                    continue;
                }
                if let Some([first, second]) = cross(lines, segments, (i, j))? {
                    let crossing = positions.len() as u32;
                    let [a, b] = lines[i as usize];
                    positions.push(a + (b - a) * first.at);
                    events.push(Event { crossing, ..first });
                    events.push(Event { crossing, ..second });
                }
            }
        }
    }
    Some((events, positions))
}

/// How two segments cross, if they do; `None` when they touch or overlap other than by a common end.
#[inline]
fn cross(
    lines: &[[DVec2; 2]],
    segments: &[Segment],
    (i, j): (u32, u32),
) -> Option<Option<[Event; 2]>> {
    let ([a, b], [c, d]) = (lines[i as usize], lines[j as usize]);
    let (s, t) = (segments[i as usize], segments[j as usize]);
    let (c_side, d_side) = (orient2d(a, b, c), orient2d(a, b, d));
    if s.from == t.from || s.from == t.to || s.to == t.from || s.to == t.to {
        // With one end in common they overlap when the other lies on the line too.
        return (c_side != 0.0 || d_side != 0.0).then_some(None);
    }
    if c_side * d_side > 0.0 {
        return Some(None);
    }
    let (a_side, b_side) = (orient2d(c, d, a), orient2d(c, d, b));
    if a_side * b_side > 0.0 {
        return Some(None);
    }
    if [a_side, b_side, c_side, d_side].contains(&0.0) {
        return None;
    }
    let event = |segment: u32, from_side: f64, to_side: f64| Event {
        segment,
        at: from_side / (from_side - to_side),
        step: if to_side > 0.0 { 1 } else { -1 },
        crossing: 0,
    };
    Some(Some([event(i, a_side, b_side), event(j, c_side, d_side)]))
}

/// The segments that start in each point.
struct Joints {
    starts: Vec<u32>,
    segments: Vec<u32>,
}

impl Joints {
    fn new(point_count: usize, segments: &[Segment]) -> Self {
        let mut starts = vec![0_u32; point_count + 1];
        for s in segments {
            starts[s.from as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut of_points = vec![0; segments.len()];
        for (k, s) in (0..).zip(segments) {
            of_points[next[s.from as usize] as usize] = k;
            next[s.from as usize] += 1;
        }
        Self {
            starts,
            segments: of_points,
        }
    }

    fn starting(&self, point: u32) -> &[u32] {
        let range = self.starts[point as usize]..self.starts[point as usize + 1];
        &self.segments[range.start as usize..range.end as usize]
    }
}

struct Walker<'a> {
    lines: &'a [[DVec2; 2]],
    segments: &'a [Segment],
    /// By segment, and along it.
    events: &'a [Event],
    first_event: &'a [u32],
    positions: &'a [DVec2],
    joints: &'a Joints,
    /// The winding number on the outer side of each segment's start.
    outside: Vec<i32>,
}

impl Walker<'_> {
    fn events_of(&self, segment: u32) -> &[Event] {
        let range = self.first_event[segment as usize]..self.first_event[segment as usize + 1];
        &self.events[range.start as usize..range.end as usize]
    }

    /// The winding number on the outer side of each segment's start.
    fn wind(&self, grid: &Grid) -> Option<Vec<i32>> {
        const UNKNOWN: i32 = i32::MIN;
        let mut outside = vec![UNKNOWN; self.segments.len()];
        for seed in 0..self.segments.len() as u32 {
            if outside[seed as usize] != UNKNOWN {
                continue;
            }
            let (mut at, mut number) = (seed, self.count_at(grid, seed)?);
            loop {
                outside[at as usize] = number;
                number += self.events_of(at).iter().map(|e| e.step).sum::<i32>();
                // Where several segments start, others may pass between.
                let [next] = *self.joints.starting(self.segments[at as usize].to) else {
                    break;
                };
                if outside[next as usize] != UNKNOWN {
                    if outside[next as usize] != number {
                        return None;
                    }
                    break;
                }
                at = next;
            }
        }
        Some(outside)
    }

    /// The winding number on the outer side of a segment's start, by a ray from the middle of its longest free piece.
    fn count_at(&self, grid: &Grid, segment: u32) -> Option<i32> {
        let [a, b] = self.lines[segment as usize];
        if a.y == b.y {
            return None;
        }
        let (mut from, mut steps, mut longest) = (0.0, 0, (0.0, 0.0, 0));
        let last = (1.0, 0);
        let stops = self.events_of(segment).iter().map(|e| (e.at, e.step));
        for (to, step) in stops.chain([last]) {
            if to - from > longest.0 {
                longest = (to - from, 0.5 * (from + to), steps);
            }
            from = to;
            steps += step;
        }
        let p = a + (b - a) * longest.1;
        let row = grid.row_of(p.y);
        let range = grid.row_starts[row] as usize..grid.row_starts[row + 1] as usize;
        // A ray towards +x, from the outer side: of itself it meets the segment when this goes down.
        let mut count = if b.y > a.y { 0 } else { -1 };
        for &other in &grid.of_rows[range] {
            let [c, d] = self.lines[other as usize];
            let is_beside = (c.y <= p.y) == (d.y <= p.y) || c.x.max(d.x) <= p.x;
            if is_beside || other == segment {
                continue;
            }
            let is_upward = d.y > c.y;
            // Only where the ray starts within the segment's box does the sign matter.
            if c.x.min(d.x) > p.x || (orient2d(c, d, p) > 0.0) == is_upward {
                count += if is_upward { 1 } else { -1 };
            }
        }
        Some(count - longest.2)
    }

    /// Follows the border.
    fn walk(&self) -> Option<Vec<Loop>> {
        // Of each crossing its two events, and of each event the outer winding number behind it.
        let mut pairs = vec![[u32::MAX; 2]; self.positions.len()];
        let mut behind = Vec::with_capacity(self.events.len());
        for (k, event) in (0..).zip(self.events) {
            let pair = &mut pairs[event.crossing as usize];
            pair[usize::from(pair[0] != u32::MAX)] = k;
            let is_first = self.first_event[event.segment as usize] == k;
            let before = if is_first {
                self.outside[event.segment as usize]
            } else {
                behind[k as usize - 1]
            };
            behind.push(before + event.step);
        }
        let mut is_start_used: Vec<bool> = self.outside.iter().map(|&n| n != 0).collect();
        let mut is_event_used: Vec<bool> = behind.iter().map(|&n| n != 0).collect();
        let mut loops = Vec::new();
        // A loop of the border may lie on one segment's middle pieces only, so that both kinds of start are tried.
        let starts = (0..self.segments.len() as u32).map(|s| (s, None));
        let crossings = (0..).zip(self.events).map(|(k, e)| (e.segment, Some(k)));
        for (segment, event) in starts.chain(crossings) {
            let mut piece = (segment, event);
            let mut points = Loop::new();
            loop {
                let (segment, event) = piece;
                let (is_used, point) = match event {
                    None => (
                        &mut is_start_used[segment as usize],
                        self.lines[segment as usize][0],
                    ),
                    Some(k) => (
                        &mut is_event_used[k as usize],
                        self.positions[self.events[k as usize].crossing as usize],
                    ),
                };
                if std::mem::replace(is_used, true) {
                    break;
                }
                points.push(point);
                piece = self.next_piece(piece, &pairs, &behind)?;
            }
            if !points.is_empty() {
                if piece != (segment, event) {
                    return None;
                }
                loops.push(points);
            }
        }
        Some(loops)
    }

    /// The piece of the border that starts where a piece ends.
    fn next_piece(
        &self,
        (segment, event): (u32, Option<u32>),
        pairs: &[[u32; 2]],
        behind: &[i32],
    ) -> Option<(u32, Option<u32>)> {
        let next = event.map_or(self.first_event[segment as usize], |k| k + 1);
        if next < self.first_event[segment as usize + 1] {
            let pair = pairs[self.events[next as usize].crossing as usize];
            let other = if pair[0] == next { pair[1] } else { pair[0] };
            let turned = (self.events[other as usize].segment, Some(other));
            return (behind[other as usize] == 0).then_some(turned);
        }
        let starting = self.joints.starting(self.segments[segment as usize].to);
        let mut free = starting.iter().filter(|&&s| self.outside[s as usize] == 0);
        match (free.next(), free.next()) {
            (Some(&only), None) => Some((only, None)),
            _ => None,
        }
    }
}
