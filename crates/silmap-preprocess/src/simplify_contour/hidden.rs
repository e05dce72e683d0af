//! Thinning out what no eye sees.
//!
//! A vertex with room may go where the edge across it stays within the room of all that it stands for. Loops cross neither themselves nor each
//! other, as before. In outward mode only concave vertices go.

use silmap_geometry::Loop;
use silmap_geometry::polygon::distance_squared_to_segment;

use super::outline::{Proposal, SimplifiedLoops, turn};
use super::{SimplifyContourParams, remove_vertices};

/// Removes vertices of `loops` that have room: per vertex, how far the outline may move there, pixels. Says of each vertex that is left whether it
/// had room.
pub(crate) fn thin_hidden(
    loops: &[Loop],
    room: &[Vec<f64>],
    outward_only: bool,
) -> Vec<(Loop, Vec<bool>)> {
    let uncut = SimplifyContourParams {
        tolerance_px: 0.0,
        outward_only,
    };
    let points: Vec<_> = loops.iter().flatten().copied().collect();
    let room: Vec<f64> = room.iter().flatten().copied().collect();
    let mut loop_of = Vec::with_capacity(points.len());
    for l in loops {
        let first = loop_of.len() as u32;
        loop_of.resize(loop_of.len() + l.len(), [first, first + l.len() as u32]);
    }
    let mut outline = SimplifiedLoops::new(loops, &uncut);
    // The largest distance from an edge of what it stands for, over the room there, squared.
    let worst = |from: u32, to: u32| {
        let [first, end] = loop_of[from as usize];
        let (a, b) = (points[from as usize], points[to as usize]);
        let next = |v: u32| if v + 1 == end { first } else { v + 1 };
        let mut worst = 0.0_f64;
        let mut v = next(from);
        while v != to {
            let k = v as usize;
            if room[k] <= 0.0 {
                return None;
            }
            let off = distance_squared_to_segment(points[k], a, b);
            worst = worst.max(off / (room[k] * room[k]));
            v = next(v);
        }
        (worst <= 1.0).then_some(worst)
    };
    let cost = |outline: &SimplifiedLoops, v: u32| {
        let [_, p, n, _] = outline.neighbourhood(v)?;
        let [a, b, c] = [p, v, n].map(|v| points[v as usize]);
        if outward_only && turn(a, b, c) > 0.0 {
            return None;
        }
        worst(p, n)
    };
    let propose = |outline: &SimplifiedLoops, v: u32| {
        let [_, p, n, _] = outline.neighbourhood(v)?;
        let [a, b, c] = [p, v, n].map(|v| points[v as usize]);
        Some(Proposal {
            before: a,
            after: c,
            takes_place: false,
            swept: [Some([a, b, c]), None, None, None, None],
        })
    };
    remove_vertices(&mut outline, cost, propose);
    let mut at = 0_u32;
    let thinned = loops.iter().map(|l| {
        let (first, end) = (at, at + l.len() as u32);
        at = end;
        let kept = (first..end).filter(|&v| !outline.is_gone(v));
        kept.map(|v| (points[v as usize], room[v as usize] > 0.0))
            .unzip()
    });
    thinned.collect()
}
