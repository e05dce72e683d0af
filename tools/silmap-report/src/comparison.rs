//! Exact extraction and interpolation side by side, as a part of the page and as numbers: `section` writes it down, `plots` draws it,
//! `printed` has the papers' figures.

use serde_json::{Map, Value, json};
use silmap_measure::{
    BRUTE, Comparison, ComparisonLevel, Extracted, ExtractionResult, FrameResults, Motion, PARALLEL,
};

mod plots;
mod printed;
mod section;

pub(crate) use section::section;

/// All of it as JSON.
#[must_use]
pub fn numbers(comparison: &Comparison) -> Value {
    let extracted = |e: &Extracted| {
        json!({
            "viewpoints": e.viewpoints,
            "silhouette_edges": e.silhouette_edges,
            "tested_edges": e.tested_edges,
            "visited_nodes": e.visited_nodes,
            "seconds_median": e.seconds_median,
        })
    };
    let method = |r: &ExtractionResult| {
        json!({
            "walk": extracted(&r.walk),
            "scattered": extracted(&r.scattered),
            "data_bytes": r.data_bytes,
            "build_seconds": r.build_seconds,
            "frame_seconds": r.frame_seconds,
        })
    };
    let fastest = |level: &ComparisonLevel, is_on_one_thread: bool| {
        let name = |motion| level.fastest(motion, is_on_one_thread).map(|r| &r.method);
        json!({ "walk": name(Motion::Walk), "scattered": name(Motion::Scattered) })
    };
    let level = |level: &ComparisonLevel| {
        let methods = level.methods.iter().map(|r| (r.method.clone(), method(r)));
        json!({
            "faces": level.faces,
            "methods": methods.collect::<Map<_, _>>(),
            "fastest": fastest(level, false),
            "fastest_on_one_thread": fastest(level, true),
            "jc_tests_over_cones": level.cones_over_jc(),
        })
    };
    let all = comparison.levels.last().map_or(&[][..], |l| &l.methods);
    let by_method = |value: &dyn Fn(&str) -> Value| -> Map<String, Value> {
        (all.iter())
            .map(|r| (r.method.clone(), value(&r.method)))
            .collect()
    };
    json!({
        "walk_viewpoints": comparison.walk_viewpoints,
        "scattered_viewpoints": comparison.scattered_viewpoints,
        "threads": comparison.threads,
        "levels": comparison.levels.iter().map(level).collect::<Vec<_>>(),
        "contours": comparison.contours.iter().map(|r| (r.method.clone(), json!({
            "seconds_median": r.seconds_median,
            "outline_error": r.error_px,
            "bytes": r.data_bytes,
        }))).collect::<Map<_, _>>(),
        "time_grows_by_power_of_silhouette_edges": by_method(&|m| comparison.growth(m).into()),
        "frames": comparison.frames.as_ref().map(|frames| json!({
            "adapter": frames.adapter,
            "size": frames.size_px,
            "hull_faces": frames.hull_faces,
            "hull_seconds": frames.hull_seconds,
            "full": frames.full,
            "interpolated_seconds": frames.interpolated.as_ref().map(|i| i.1),
            "faces_in_the_same_time": by_method(&|m| json!(comparison.same_time(m))),
        })),
        "printed": printed::numbers(),
    })
}

#[cfg(test)]
mod tests;
