//! All numbers of the page as JSON: `report.json`.

use glam::DVec3;
use serde_json::{Map, Value, json};
use silmap_measure::{ErrorSample, MethodErrors, PlaceErrors, TextureFigures};

use crate::Report;

/// The numbers as one object.
pub(crate) fn numbers(report: &Report<'_>) -> Value {
    let asset = report.asset;
    let (record, map) = (&asset.record, &asset.map);
    let origin = asset.placement.in_scene;
    let counts = contour_counts(report);
    json!({
        "title": report.title,
        "model": {
            "name": record.name,
            "faces": record.model_faces,
            "vertices": record.model_vertices,
            "center": (map.center + origin).to_array(),
            "radius": map.radius,
        },
        "made_by": record.generator,
        "options": record.options,
        "map": {
            "views": map.views.len(),
            "captured_views": record.captured_views,
            "triangles": map.triangles.len(),
            "resolution": map.resolution_px,
            "tolerance": map.tolerance_px,
            "has_depth": map.has_depth(),
        },
        "contours": {
            "vertices_min": counts.least,
            "vertices_median": counts.median,
            "vertices_mean": counts.mean,
            "vertices_max": counts.most,
            "vertices_total": counts.total,
        },
        "views": map.views.iter().zip(map.contour_vertex_counts()).map(|(view, vertices)| json!({
            "eye": (view.camera.eye + origin).to_array(),
            "contours": view.contours.len(),
            "contour_vertices": vertices,
        })).collect::<Vec<_>>(),
        "bytes": by_name(&report.measured.bytes),
        "curve": {
            "kept": record.error_curve,
            "uniform": report.measured.uniform_curve,
        },
        "polytopes": report.measured.polytopes.iter().map(|level| json!({
            "label": level.label,
            "views": level.eyes.len(),
            "triangles": level.triangles.len(),
        })).collect::<Vec<_>>(),
        "places": report.measured.places.iter()
            .map(|p| (p.place.clone(), place(p, origin)))
            .collect::<Map<_, _>>(),
        "directions": report.measured.directions.iter().map(|d| json!({
            "method": d.method,
            "samples": d.samples.iter().map(|(direction, share)| json!({
                "direction": direction.to_array(),
                "misclassified": share,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "worst": report.measured.worst.iter().map(|w| sample(&w.sample, origin)).collect::<Vec<_>>(),
        "textures": report.measured.textures.as_ref().map(textures),
        "seconds": {
            "build": by_name(&report.seconds),
            "contour": report.measured.contour_times.iter().map(|t| (t.method.clone(), json!({
                "median": t.median,
                "percentile_95": t.most,
                "calls": t.calls,
            }))).collect::<Map<_, _>>(),
            "measuring": report.measured.conditions.seconds,
        },
        "comparison": report.comparison.as_ref().map(crate::comparison::numbers),
        "scenes": report.scenes,
        "conditions": {
            "machine": report.measured.conditions.machine,
            "threads": report.measured.conditions.threads,
            "is_optimised": report.measured.conditions.is_optimised,
            "resolution": report.measured.conditions.resolution_px,
            "seed": report.measured.conditions.seed,
        },
        "notes": report.notes,
    })
}

/// With the names that `silmap inspect` and `evaluate` have.
fn textures(figures: &TextureFigures) -> Value {
    json!({
        "views": figures.views,
        "seen_share": figures.seen_share,
        "atlas_share": figures.atlas_share,
        "merit": figures.merit,
        "views_per_face": figures.views_per_face,
        "view_texels_per_radius": figures.view_texels_per_radius,
        "atlas_texels_per_radius": figures.atlas_texels_per_radius,
        "picture_bytes": figures.bytes,
        "discontinuities_per_1000": by_name(&figures.discontinuities),
        "viewpoints": figures.viewpoints,
        "colour_difference": figures.colours.iter().map(|row| (row.paint.clone(), json!({
            "mean": row.mean,
            "largest_channel": row.mean.into_iter().fold(0.0, f64::max),
            "worst_viewpoint": row.worst,
        }))).collect::<Map<_, _>>(),
    })
}

fn by_name<T: Copy + Into<Value>>(pairs: &[(String, T)]) -> Map<String, Value> {
    pairs
        .iter()
        .map(|(name, value)| (name.clone(), (*value).into()))
        .collect()
}

fn place(errors: &PlaceErrors, origin: DVec3) -> Value {
    json!({
        "viewpoints": errors.viewpoints,
        "methods": errors.methods.iter()
            .map(|m| (m.method.clone(), summary(m)))
            .collect::<Map<_, _>>(),
        "per_viewpoint": errors.samples.iter().map(|s| sample(s, origin)).collect::<Vec<_>>(),
    })
}

/// With the names that `silmap evaluate --json` has.
fn summary(errors: &MethodErrors) -> Value {
    let [mean, median, max] = errors.misclassified;
    json!({
        "misclassified_mean": mean,
        "misclassified_median": median,
        "misclassified_max": max,
        "escaped_mean": errors.escaped[0],
        "escaped_max": errors.escaped[1],
        "deviation_px": errors.straying,
    })
}

fn sample(s: &ErrorSample, origin: DVec3) -> Value {
    json!({
        "eye": (s.eye + origin).to_array(),
        "method": s.method,
        "misclassified": s.misclassified,
        "escaped": s.escaped,
        "deviation_px": s.straying.map(|off| json!({
            "mean": off.mean_px,
            "p99": off.p99_px,
            "largest": off.largest_px,
            "at": off.place.to_array(),
            "nearest": off.nearest.to_array(),
        })),
    })
}

/// How many vertices the contours of the views have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContourCounts {
    pub(crate) least: usize,
    pub(crate) median: f64,
    pub(crate) mean: f64,
    pub(crate) most: usize,
    pub(crate) total: usize,
}

/// Counts over the views of the asset; zeros when it has none.
pub(crate) fn contour_counts(report: &Report<'_>) -> ContourCounts {
    let mut counts: Vec<usize> = report.asset.map.contour_vertex_counts().collect();
    counts.sort_unstable();
    let n = counts.len();
    let at = |k: usize| counts.get(k).copied().unwrap_or(0);
    let total = counts.iter().sum();
    ContourCounts {
        least: at(0),
        median: f64::midpoint(at(n.saturating_sub(1) / 2) as f64, at(n / 2) as f64),
        mean: total as f64 / n.max(1) as f64,
        most: at(n.saturating_sub(1)),
        total,
    }
}
