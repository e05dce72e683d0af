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

#[cfg(test)]
mod tests {
    use super::*;
    use std::slice::from_ref;

    use glam::DVec2;
    use silmap_geometry::polygon::signed_area;

    /// A circle of which one half has room.
    fn circle(room_px: f64) -> (Loop, Vec<f64>) {
        let angles = (0..80).map(|k| std::f64::consts::TAU * f64::from(k) / 80.0);
        let points = angles.map(|a| DVec2::splat(100.0) + DVec2::from_angle(a) * 60.0);
        let room = (0..80).map(|k| if k < 40 { room_px } else { 0.0 });
        (points.collect(), room.collect())
    }

    #[test]
    fn only_what_has_room_goes_and_not_too_far() {
        let (points, room) = circle(9.0);
        let thinned = thin_hidden(from_ref(&points), &[room], false);
        let (left, is_hidden) = &thinned[0];
        assert!(
            points[40..].iter().all(|p| left.contains(p)),
            "seen ones stay"
        );
        let hidden = is_hidden.iter().filter(|h| **h).count();
        assert!((1..8).contains(&hidden), "{hidden} hidden ones are left");
        for p in &points {
            let edges = left.iter().zip(left.iter().cycle().skip(1));
            let off = edges.map(|(&a, &b)| distance_squared_to_segment(*p, a, b));
            assert!(off.fold(f64::INFINITY, f64::min).sqrt() <= 9.0 + 1e-9);
        }
        let (points, room) = circle(0.0);
        assert_eq!(thin_hidden(from_ref(&points), &[room], false)[0].0, points);
    }

    #[test]
    fn outward_nothing_of_the_inside_is_lost() {
        let (points, room) = circle(9.0);
        assert_eq!(
            thin_hidden(from_ref(&points), from_ref(&room), true)[0].0,
            points
        );
        // A hole may fill up.
        let hole: Loop = points.into_iter().rev().collect();
        let room: Vec<f64> = room.into_iter().rev().collect();
        let (left, _) = &thin_hidden(from_ref(&hole), &[room], true)[0];
        assert!(left.len() < hole.len() && signed_area(left) > signed_area(&hole));
    }
}
