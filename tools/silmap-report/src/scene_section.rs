//! The page's section on frames of many instances: for each scene a table, a plot of time over error, and what to take.

use maud::{Markup, PreEscaped, html};
use silmap_measure::{SceneResults, SceneRow};

use crate::palette::{self, Rgb};
use crate::plot::{Axis, Look, Scale, Series, drawn};
use crate::words::{grouped, millis, significant};

const ERROR: Axis<'static> = Axis {
    name: "mean outline error",
    unit: " px",
    scale: Scale::Log,
};
const TIME: Axis<'static> = Axis {
    name: "device",
    unit: " ms",
    scale: Scale::Log,
};

pub(crate) fn section(scenes: &[SceneResults]) -> Markup {
    let Some(first) = scenes.first() else {
        return html! {};
    };
    html! {
        section {
            h2 { "Frames of many instances" }
            p {
                "Each scene is one pass of " (first.adapter) ", timed by " (first.timing) ". Meshes “lod” are simplified by meshopt and lit, without "
                "textures: to 500 and 5,000 faces, and to as many as have the clipped hull's own outline error. “each-a-pass” has a pass for "
                "each instance. Errors are against exact outlines, in pixels: the mean distance, and the thickest place that only one of both holds."
            }
            @for scene in scenes { (one(scene)) }
        }
    }
}

fn one(scene: &SceneResults) -> Markup {
    html! {
        h3 {
            (grouped(scene.instances as u64)) " of " (significant(scene.pixels)) " pixels on " (scene.side_px) "²"
            @if !scene.is_walking { ", the camera at rest" }
        }
        @if let Some(advice) = scene.advice() { p { (advice) } }
        (table(scene))
        div.plots {
            figure {
                (PreEscaped(plot(scene)))
                figcaption { "Time of a frame over the error of the outline; nearer to the lower left corner is better." }
            }
        }
    }
}

fn table(scene: &SceneResults) -> Markup {
    html! {
        div.scroll {
            table {
                thead {
                    tr {
                        th rowspan="2" { "drawn as" }
                        th rowspan="2" { "faces" }
                        th.group { "device, ms" }
                        th.group colspan="2" { "processor, ms" }
                        th.group colspan="2" { "error, px" }
                        th.group { "KiB" }
                    }
                    tr { th { "median" } th { "mean" } th { "worst" } th { "mean" } th { "thickest" } th { "" } }
                }
                tbody {
                    @for row in &scene.rows {
                        tr {
                            th scope="row" { (row.name) }
                            td { (grouped(row.faces as u64)) }
                            td { (significant(1e3 * row.seconds_median)) }
                            td { (millis(row.cpu_seconds_mean)) }
                            td { (millis(row.cpu_seconds_max)) }
                            @if has_error(row) {
                                td { (format!("{:.3}", row.outline_error_px.mean)) }
                                td { (format!("{:.2}", row.outline_error_px.thickest)) }
                            } @else {
                                td { "" }
                                td { "" }
                            }
                            td { (grouped(row.bytes.div_ceil(1024))) }
                        }
                    }
                }
            }
        }
    }
}

/// Of the full mesh there is none, and of what draws the same outlines it is not measured again.
fn has_error(row: &SceneRow) -> bool {
    row.outline_error_px.mean > 0.0
}

fn plot(scene: &SceneResults) -> String {
    let series: Vec<Series> = (scene.rows.iter().filter(|row| has_error(row)))
        .map(|row| Series {
            // As short as can be: names stand beside points.
            name: row
                .name
                .trim_start_matches("clipped-")
                .replace("equal-error", "equal"),
            colour: colour_of(&row.name),
            points: vec![(row.outline_error_px.mean, 1e3 * row.seconds_median)],
            look: if row.name.starts_with("clipped") {
                Look::Star
            } else {
                Look::Labelled
            },
        })
        .collect();
    drawn("Time of a frame over outline error", (ERROR, TIME), &series)
}

fn colour_of(row: &str) -> Rgb {
    match row {
        "clipped-stencil" => palette::of_method("tight"),
        "clipped-coverage" => palette::of_method("cones"),
        "hull" => palette::of_method("hull"),
        _ => palette::OTHER,
    }
}
