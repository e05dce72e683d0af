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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loops::FlatLoops;
    use glam::DVec2;
    use proptest::prelude::*;
    use silmap_geometry::Mask;
    use silmap_geometry::polygon::{fill_even_odd, fill_non_zero, signed_area};

    /// Polygons about points, with a hole in some.
    fn part() -> impl Strategy<Value = Vec<Vec<DVec2>>> {
        let radii = prop::collection::vec(6.0..30.0_f64, 3..14);
        (35.0..93.0_f64, 35.0..93.0_f64, radii, any::<bool>()).prop_map(
            |(x, y, radii, has_hole)| {
                let n = radii.len() as f64;
                let ring = |share: f64| -> Vec<DVec2> {
                    let place = |(k, r): (usize, &f64)| {
                        let angle = std::f64::consts::TAU * k as f64 / n;
                        DVec2::new(x, y) + DVec2::from_angle(angle) * *r * share
                    };
                    radii.iter().enumerate().map(place).collect()
                };
                let mut loops = vec![ring(1.0)];
                if has_hole {
                    loops.push(ring(0.5).into_iter().rev().collect());
                }
                loops
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// What any part covers is inside, once: even-odd filling of the union is non-zero filling of all parts, and depths come along.
        #[test]
        fn the_union_is_what_any_part_covers(parts in prop::collection::vec(part(), 1..7)) {
            let mut seen = SeenLoops::default();
            for (number, loops) in (0_u16..).zip(&parts) {
                seen.set_part(number);
                for points in loops {
                    points.iter().for_each(|p| seen.push(p.extend(0.25)));
                    seen.close();
                }
            }
            let (mut all, mut united) = (Mask::new(128, 128), Mask::new(128, 128));
            fill_non_zero(parts.iter().flatten(), &mut all);
            let mut output = SeenLoops::default();
            PartUnion::default().unite(&seen, 0.0, &mut output);
            let mut flat = FlatLoops::default();
            output.flatten_to(&mut flat);
            fill_even_odd(flat.iter(), &mut united);
            // Thinning moves sides by a twentieth of a pixel.
            let off = all.count_different(&united);
            prop_assert!(off <= 12, "{off} pixels differ");
            let area: f64 = flat.iter().map(signed_area).sum();
            prop_assert!(area > 0.0 && (area - all.count() as f64).abs() < 0.05 * area + 20.0);
            prop_assert!(output.iter().flatten().all(|p| (p.z - 0.25).abs() < 1e-9));
            prop_assert!(!output.may_overlap());
        }
    }
}
