//! What is covered, beside counting at every end.

use super::*;
use crate::loops::DeepLoops;
use crate::sweep::sleeve::Slack;
use proptest::prelude::*;

/// Where a scanline enters and leaves what is covered, by counting at every end.
fn covered_at(rows: &[Vec<f64>], least: usize, y: f64) -> Vec<(f64, f64)> {
    let k = (y as usize).min(rows.len() - 2);
    let at = |end: usize| rows[k][end] + (rows[k + 1][end] - rows[k][end]) * (y - k as f64);
    let intervals: Vec<(f64, f64)> = (0..rows[0].len() / 2)
        .map(|i| (at(2 * i), at(2 * i + 1)))
        .filter(|(enter, exit)| enter < exit)
        .collect();
    let mut xs: Vec<f64> = intervals.iter().flat_map(|&(a, b)| [a, b]).collect();
    xs.sort_by(f64::total_cmp);
    let n_over = |x: f64| intervals.iter().filter(|(a, b)| *a <= x && x < *b).count();
    let mut found: Vec<(f64, f64)> = Vec::new();
    for pair in xs
        .windows(2)
        .filter(|p| n_over(0.5 * (p[0] + p[1])) >= least)
    {
        match found.last_mut() {
            Some(last) if last.1 >= pair[0] => last.1 = pair[1],
            _ => found.push((pair[0], pair[1])),
        }
    }
    found.retain(|(a, b)| b - a > 1e-9);
    found
}

fn followed(rows: &[Vec<f64>], least: u32, cut: Option<usize>) -> DeepLoops {
    let (mut cover, mut builder, mut loops) = <(CoverageSweep, LoopBuilder, DeepLoops)>::default();
    let n_ends = rows[0].len();
    cover.begin(least, n_ends);
    for (k, row) in rows.iter().enumerate() {
        // A sweep that ends at a row is gone on with from that row.
        let n_times = if cut == Some(k) { 2 } else { 1 };
        for time in 0..n_times {
            if time == 1 {
                cover.end();
                cover.begin(least, n_ends);
            }
            for (end, &x) in cover.next_row().iter_mut().zip(row) {
                *end = DVec3::new(x, 1.0, 0.0);
            }
            cover.step(k as f64, |_| true, &mut builder);
        }
    }
    cover.end();
    cover.finish(&mut builder);
    let slack = Slack {
        line: 0.0,
        depth: 0.0,
        hair: 0.0,
    };
    builder.finish(slack, &mut loops);
    loops
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// Places are few, so that ends meet on rows, three at a time, and run along each other; intervals may be left before they
    /// are entered.
    #[test]
    fn what_is_covered_is_found_on_every_scanline(
        (rows, cut) in (1_usize..6, 2_usize..6).prop_flat_map(|(n, m)| {
            let x = (0_u32..7).prop_map(f64::from);
            (prop::collection::vec(prop::collection::vec(x, 2 * n), m), prop::option::of(1..m))
        }),
        least in 1_u32..4, share in 0.0..1.0_f64,
    ) {
        let loops = followed(&rows, least, cut);
        let y = share * (rows.len() - 1) as f64 + 1e-4;
        prop_assume!(y < (rows.len() - 1) as f64);
        let mut xs: Vec<f64> = loops
            .iter()
            .flat_map(|points| {
                let n = points.len();
                (0..n).map(move |k| (points[k], points[(k + 1) % n]))
            })
            .filter(|(a, b)| (a.y <= y) != (b.y <= y))
            .map(|(a, b)| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)))
            .collect();
        xs.sort_by(f64::total_cmp);
        let length = |spans: &[(f64, f64)]| spans.iter().map(|(a, b)| b - a).sum::<f64>();
        let got: Vec<(f64, f64)> = xs.chunks_exact(2).map(|p| (p[0], p[1])).collect();
        let expected = covered_at(&rows, least as usize, y);
        prop_assert_eq!(xs.len() % 2, 0);
        prop_assert!((length(&got) - length(&expected)).abs() < 1e-6, "{got:?} for {expected:?}");
        for (a, b) in &expected {
            let inside: f64 = got.iter().map(|(c, d)| (b.min(*d) - a.max(*c)).max(0.0)).sum();
            prop_assert!((inside - (b - a)).abs() < 1e-6, "{got:?} for {expected:?}");
        }
    }
}
