//! The plots of the comparison: time over resolution, over the silhouette's complexity, and resolutions drawn in the same time.

use super::printed::CLIPPING;
use super::{BRUTE, Comparison, Extracted, Motion, PARALLEL};
use crate::palette;
use crate::plot::{Axis, Look, Scale, Series, drawn};

const FACES: Axis<'static> = Axis {
    name: "faces",
    unit: "",
    scale: Scale::Log,
};
const TIME: Axis<'static> = Axis {
    name: "time",
    unit: " µs",
    scale: Scale::Log,
};

fn series(method: &str, points: Vec<(f64, f64)>) -> Series {
    Series {
        // Names above the plot have little space.
        name: if method == PARALLEL {
            "parallel"
        } else {
            method
        }
        .to_owned(),
        colour: palette::of_method(method),
        points,
        look: Look::Dotted,
    }
}

/// Time of extraction over the model's faces, and that of interpolation, which does not depend on them.
pub(super) fn crossover(comparison: &Comparison, motion: Motion) -> String {
    let mut all: Vec<Series> = (comparison.telling_methods().into_iter())
        .map(|method| {
            let of_level = |level: &super::ComparisonLevel| {
                let seconds = level.of(method)?.on(motion).seconds_median;
                Some((level.faces as f64, 1e6 * seconds))
            };
            series(
                method,
                comparison.levels.iter().filter_map(of_level).collect(),
            )
        })
        .collect();
    let ends = [comparison.levels.first(), comparison.levels.last()];
    all.extend(comparison.contours.last().map(|contour| {
        let points = ends.into_iter().flatten();
        Series {
            look: Look::Dashed,
            ..series(
                &contour.method,
                points
                    .map(|level| (level.faces as f64, 1e6 * contour.seconds_median))
                    .collect(),
            )
        }
    }));
    drawn("Time of extraction over resolution", (FACES, TIME), &all)
}

/// Time of extraction over the number of silhouette edges, with the printed points of the bunny (figure 9).
pub(super) fn complexity(comparison: &Comparison) -> String {
    let point = |found: &Extracted| (found.silhouette_edges, 1e6 * found.seconds_median);
    let mut all: Vec<Series> = (comparison.telling_methods().into_iter())
        .map(|method| {
            let found = comparison
                .levels
                .iter()
                .filter_map(|level| level.of(method));
            series(method, found.map(|r| point(&r.scattered)).collect())
        })
        .collect();
    let [bunny, ..] = CLIPPING;
    for (method, milliseconds) in [(BRUTE, bunny.brute_ms), ("cones", bunny.tree_ms)] {
        all.push(Series {
            name: format!("{method}, 2000"),
            look: Look::Labelled,
            ..series(
                method,
                vec![(f64::from(bunny.silhouette_edges), 1e3 * milliseconds)],
            )
        });
    }
    let edges = Axis {
        name: "silhouette edges",
        ..FACES
    };
    drawn("Time of extraction over complexity", (edges, TIME), &all)
}

/// Faces of a mesh that is drawn as it is in the same time as the hull clipped to a silhouette, over the faces that the silhouette is
/// extracted from (figure 11).
pub(super) fn same_time(comparison: &Comparison) -> String {
    let mut all: Vec<Series> = (comparison.telling_methods().into_iter())
        .map(|method| {
            let measured = comparison.same_time(method).into_iter();
            let points = measured.filter_map(|(x, y)| Some((x as f64, y?)));
            series(method, points.collect())
        })
        .collect();
    let ends = [comparison.levels.first(), comparison.levels.last()];
    let ends: Vec<f64> = ends.into_iter().flatten().map(|l| l.faces as f64).collect();
    if let Some(frames) = &comparison.frames
        && let Some((method, seconds)) = &frames.interpolated
        && let Some(faces) = frames.faces_drawn_in(*seconds)
    {
        all.push(Series {
            look: Look::Dashed,
            ..series(method, ends.iter().map(|&x| (x, faces)).collect())
        });
    }
    let star = comparison.same_time("cones").pop();
    all.extend(
        star.and_then(|(x, y)| Some((x as f64, y?)))
            .map(|at| Series {
                name: String::new(),
                look: Look::Star,
                ..series("cones", vec![at])
            }),
    );
    all.push(Series {
        name: "as many faces".to_owned(),
        colour: palette::OTHER,
        points: ends.iter().map(|&x| (x, x)).collect(),
        look: Look::Dashed,
    });
    all.push(Series {
        name: "2000, table 1".to_owned(),
        colour: palette::OTHER,
        points: (CLIPPING.iter())
            .map(|c| (f64::from(c.faces), c.faces_in_the_same_time()))
            .collect(),
        look: Look::Dots,
    });
    let x = Axis {
        name: "faces that the silhouette is extracted from",
        ..FACES
    };
    let y = Axis {
        name: "faces drawn unclipped",
        ..FACES
    };
    drawn("Faces drawn in the same time", (x, y), &all)
}
