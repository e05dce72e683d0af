//! What parts cover together, as simple loops.
//!
//! Each part of the model has an outline of its own, and parts lie before each other: the model's outline is that of all of them together.
//! Between two rows every side is linear, and only where sides cross is anything found anew (see [`coverage`](super::coverage)).

use glam::DVec3;

use crate::loops::{DeepLoops, SeenLoops};
use crate::sweep::coverage::CoverageSweep;
use crate::sweep::cursor::SweepCursor;
use crate::sweep::loop_builder::LoopBuilder;
use crate::sweep::monotone_chain::MonotoneChains;
use crate::sweep::sleeve::Slack;
use crate::tidy::is_speck;

/// Coordinates are pixels here: this is about what contours are rounded to.
const SLACK_PX: f64 = 0.05;

/// The union of the outlines of parts, with its buffers.
#[derive(Clone, Debug, Default)]
pub(crate) struct PartUnion {
    /// Of each part, in the order of the parts.
    parts: Vec<(MonotoneChains, SweepCursor)>,
    is_bent: Vec<bool>,
    cover: CoverageSweep,
    builder: LoopBuilder,
    loops: DeepLoops,
}

impl PartUnion {
    /// Writes the loops that bound what any part of `seen` covers (each part even-odd, without crossings) to `output`, with the inverse depths of
    /// what bounds it. Slits and hairs narrower than `hair_px` are left out.
    pub(crate) fn unite(&mut self, seen: &SeenLoops, hair_px: f64, output: &mut SeenLoops) {
        let count = self.assign(seen);
        self.builder.clear();
        self.sweep(count);
        self.cover.finish(&mut self.builder);
        let slack = Slack {
            line: SLACK_PX,
            depth: f64::INFINITY,
            hair: hair_px,
        };
        self.loops.clear();
        self.builder.finish(slack, &mut self.loops);
        output.clear();
        for points in self.loops.iter() {
            for p in points {
                output.push(p.truncate());
            }
            output.close_unless(is_speck);
        }
    }

    /// Cuts the outlines of all parts into chains; says how many parts there are.
    fn assign(&mut self, seen: &SeenLoops) -> usize {
        let (mut count, mut last) = (0, None);
        for (part, points) in seen.of_parts() {
            if last != Some(part) {
                if self.parts.len() == count {
                    self.parts.push(<(MonotoneChains, SweepCursor)>::default());
                }
                let (chains, cursor) = &mut self.parts[count];
                chains.clear();
                cursor.restart();
                (count, last) = (count + 1, Some(part));
            }
            let (chains, _) = &mut self.parts[count - 1];
            points.iter().for_each(|&p| chains.push(p));
            chains.close(SLACK_PX);
        }
        for (chains, _) in &mut self.parts[..count] {
            chains.seal();
        }
        count
    }

    fn sweep(&mut self, count: usize) {
        let parts = &mut self.parts[..count];
        let mut y = (parts.iter()).fold(f64::INFINITY, |y, (c, _)| y.min(c.first_y()));
        while y.is_finite() {
            let mut end = f64::INFINITY;
            for (chains, cursor) in self.parts[..count].iter_mut() {
                cursor.enter(chains, y);
                end = end.min(cursor.end(chains));
            }
            if !end.is_finite() {
                return;
            }
            self.visit_rows(count, (y, end));
            y = end;
        }
    }

    /// Unites row by row between two heights where no chain ends.
    fn visit_rows(&mut self, count: usize, (y_top, y_bottom): (f64, f64)) {
        let parts = &mut self.parts[..count];
        let n_ends = parts.iter().map(|(_, w)| w.chain_cursors().len()).sum();
        if n_ends == 0 {
            return;
        }
        self.cover.begin(1, n_ends);
        let mut y = y_top;
        loop {
            self.is_bent.clear();
            let sides = parts.iter().flat_map(|(_, w)| w.chain_cursors());
            for (end, side) in self.cover.next_row().iter_mut().zip(sides) {
                let place = side.place(y);
                *end = DVec3::new(place.x, place.y, 0.0);
                self.is_bent.push(side.next_y() <= y);
            }
            let is_bent = |end: usize| self.is_bent[end];
            self.cover.step(y, is_bent, &mut self.builder);
            if y >= y_bottom {
                break;
            }
            let mut next = y_bottom;
            for (chains, cursor) in parts.iter_mut() {
                cursor.advance(chains, y);
                next = next.min(cursor.next_vertex());
            }
            y = next;
        }
        self.cover.end();
    }
}
