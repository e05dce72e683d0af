//! The border of the region with non-zero winding number about directed segments, followed along the segments.
//!
//! Where segments cross is found cell by cell of a grid. Crossing one, the winding number changes by one, so it is known
//! along all segments that hang together, by their ends or by crossings, when it is known in one place; there a ray counts it. The border is what has
//! nothing on its outer side: it goes along a segment to the next crossing or end, and on along what starts there.
//!
//! Nothing is moved: the crossings are decided by exact signs. What is not decided so (three segments through one point, an
//! end on another segment, an overlap, a touch of the border with itself) is refused, and left to a method that rounds.
//!
//! Source: none; the winding numbers are those of Sander et al., Silhouette Clipping, SIGGRAPH 2000, section 6.

mod grid;

use glam::DVec2;
use silmap_geometry::polygon::Loop;
use silmap_geometry::predicates::orient2d;

use self::grid::Grid;

/// A segment between two numbered points. Winding numbers are larger by one where points of it look counter-clockwise in
/// a frame with y up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// Crossings nearer to each other than this part of their segment are not distinguished.
const CLOSEST_CROSSINGS: f64 = 1e-9;
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
    let (found, positions) = find_crossings(&grid, &lines, segments)?;
    let (events, first_event) = by_segment(&found, segments.len());
    let too_close = |pair: &[Event]| {
        pair[0].segment == pair[1].segment && pair[1].at - pair[0].at < CLOSEST_CROSSINGS
    };
    if events.windows(2).any(too_close) {
        return None;
    }
    let joints = Joints::new(points.len(), segments);
    let mut others = vec![u32::MAX; events.len()];
    let mut first_of = vec![u32::MAX; positions.len()];
    let mut steps_before = Vec::with_capacity(events.len());
    for (k, event) in (0..).zip(&events) {
        match std::mem::replace(&mut first_of[event.crossing as usize], k) {
            u32::MAX => {}
            first => {
                others[k as usize] = first;
                others[first as usize] = k;
            }
        }
        let is_first = first_event[event.segment as usize] == k;
        steps_before.push(if is_first {
            0
        } else {
            steps_before[k as usize - 1] + events[k as usize - 1].step
        });
    }
    let mut walker = Walker {
        lines: &lines,
        segments,
        events: &events,
        others: &others,
        steps_before: &steps_before,
        first_event: &first_event,
        positions: &positions,
        joints: &joints,
        outside: Vec::new(),
    };
    walker.outside = walker.wind(&grid)?;
    walker.walk()
}

/// Events segment by segment, and along it; and where those of each segment begin.
fn by_segment(found: &[Event], segment_count: usize) -> (Vec<Event>, Vec<u32>) {
    let mut first_event = vec![0_u32; segment_count + 1];
    for event in found {
        first_event[event.segment as usize + 1] += 1;
    }
    for s in 0..segment_count {
        first_event[s + 1] += first_event[s];
    }
    let mut events = found.to_vec();
    let mut next = first_event.clone();
    for &event in found {
        let place = &mut next[event.segment as usize];
        events[*place as usize] = event;
        *place += 1;
    }
    for range in first_event.windows(2) {
        events[range[0] as usize..range[1] as usize].sort_unstable_by(|a, b| a.at.total_cmp(&b.at));
    }
    (events, first_event)
}

/// All crossings, as both segments see them, and where they are. `None` where segments meet otherwise.
fn find_crossings(
    grid: &Grid,
    lines: &[[DVec2; 2]],
    segments: &[Segment],
) -> Option<(Vec<Event>, Vec<DVec2>)> {
    let mut events = Vec::new();
    let mut positions = Vec::new();
    let boxes: Vec<[DVec2; 2]> = (lines.iter())
        .map(|[a, b]| [a.min(*b), a.max(*b)])
        .collect();
    let mut boxes_here = Vec::new();
    let mut meeting = Vec::new();
    for (cell, range) in grid.cell_starts.windows(2).enumerate() {
        let here = &grid.of_cells[range[0] as usize..range[1] as usize];
        // Side by side, as each is compared with all the others.
        boxes_here.clear();
        boxes_here.extend(here.iter().map(|&i| boxes[i as usize]));
        meeting.resize(meeting.len().max(here.len()), 0);
        for (k, &i) in here.iter().enumerate() {
            let [low, high] = boxes_here[k];
            let mut count = 0;
            for (&j, [other_low, other_high]) in here[k + 1..].iter().zip(&boxes_here[k + 1..]) {
                // Without a guess whether they meet.
                meeting[count] = j;
                let (low, high) = (low.max(*other_low), high.min(*other_high));
                count += usize::from((low.x <= high.x) & (low.y <= high.y));
            }
            for &j in &meeting[..count] {
                let corner = low.max(boxes[j as usize][0]);
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

/// A winding number that is not known yet.
const UNKNOWN: i32 = i32::MIN;

/// Notes the winding number at a segment's start; `None` when it is known to be another.
fn spread(outside: &mut [i32], next: &mut Vec<u32>, segment: u32, number: i32) -> Option<()> {
    let known = &mut outside[segment as usize];
    if *known == UNKNOWN {
        *known = number;
        next.push(segment);
    }
    (*known == number).then_some(())
}

struct Walker<'a> {
    lines: &'a [[DVec2; 2]],
    segments: &'a [Segment],
    /// By segment, and along it.
    events: &'a [Event],
    /// Of each event the one of the other segment there, and what is added to the winding number on the way to it.
    others: &'a [u32],
    steps_before: &'a [i32],
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

    /// The winding number on the outer side of each segment's start: counted for one segment of those that hang together, and
    /// carried along them, from one to the other where they cross.
    fn wind(&self, grid: &Grid) -> Option<Vec<i32>> {
        let mut outside = vec![UNKNOWN; self.segments.len()];
        let mut next = Vec::new();
        // The only segment that ends where a segment starts, itself where there are more.
        let mut previous: Vec<u32> = (0..self.segments.len() as u32).collect();
        for (k, segment) in (0..).zip(self.segments) {
            if let [only] = *self.joints.starting(segment.to) {
                previous[only as usize] = k;
            }
        }
        for seed in 0..self.segments.len() as u32 {
            if outside[seed as usize] != UNKNOWN {
                continue;
            }
            outside[seed as usize] = self.count_at(grid, seed)?;
            next.push(seed);
            while let Some(at) = next.pop() {
                let mut number = outside[at as usize];
                let before = previous[at as usize];
                if before != at {
                    let steps: i32 = self.events_of(before).iter().map(|e| e.step).sum();
                    spread(&mut outside, &mut next, before, number - steps)?;
                }
                let range = self.first_event[at as usize]..self.first_event[at as usize + 1];
                for k in range {
                    let (event, other) = (self.events[k as usize], self.others[k as usize]);
                    let across = self.events[other as usize];
                    // To the right of both it is the same number, whichever comes from there.
                    let right_of_both = number - i32::from(event.step < 0);
                    let there = right_of_both + i32::from(across.step < 0);
                    let start = there - self.steps_before[other as usize];
                    spread(&mut outside, &mut next, across.segment, start)?;
                    number += event.step;
                }
                // Where several segments start, others may pass between.
                if let [only] = *self.joints.starting(self.segments[at as usize].to) {
                    spread(&mut outside, &mut next, only, number)?;
                }
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
        // Of each event the outer winding number behind it.
        let behind: Vec<i32> = (self.events.iter().zip(self.steps_before))
            .map(|(event, before)| self.outside[event.segment as usize] + before + event.step)
            .collect();
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
                piece = self.next_piece(piece, &behind)?;
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
        behind: &[i32],
    ) -> Option<(u32, Option<u32>)> {
        let next = event.map_or(self.first_event[segment as usize], |k| k + 1);
        if next < self.first_event[segment as usize + 1] {
            let other = self.others[next as usize];
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
