//! Sections of the page: how large the asset is and how long things take.

use maud::{Markup, PreEscaped, html};

use super::swatch;
use crate::numbers::contour_counts;
use crate::words::{grouped, millis, significant};
use crate::{Report, charts};

pub(super) fn sizes(report: &Report<'_>) -> Markup {
    let map = &report.asset.map;
    let counts: Vec<usize> = map.contour_vertex_counts().collect();
    let summary = contour_counts(report);
    let map_bytes = report.measured.bytes.first().map_or(0, |b| b.1) as f64;
    let total = report.measured.bytes.last().map_or(0, |b| b.1).max(1) as f64;
    html! {
        section {
            h2 { "Sizes" }
            div.plots {
                div {
                    div.scroll {
                        table {
                            thead { tr { th { "part" } th { "bytes" } th { "of the file, %" } } }
                            tbody {
                                @for (name, bytes) in &report.measured.bytes {
                                    tr {
                                        th scope="row" { (name) }
                                        td { (grouped(*bytes)) }
                                        td { (format!("{:.1}", 100.0 * *bytes as f64 / total)) }
                                    }
                                }
                            }
                        }
                    }
                    div.scroll {
                        table {
                            thead { tr { th { "silhouettes" } th { "" } } }
                            tbody {
                                (row("views", map.views.len().to_string()))
                                (row("captured at", format!("{}²", map.resolution_px)))
                                (row("contours", map.views.iter().map(|v| v.contours.len()).sum::<usize>().to_string()))
                                (row("contour vertices", grouped(summary.total as u64)))
                                (row("per view: least", summary.least.to_string()))
                                (row("median", significant(summary.median)))
                                (row("mean", format!("{:.1}", summary.mean)))
                                (row("most", summary.most.to_string()))
                                (row("bytes per view", format!("{:.0}", map_bytes / counts.len().max(1) as f64)))
                                (row("bytes per vertex", format!("{:.2}", map_bytes / summary.total.max(1) as f64)))
                                (row("depths", if map.has_depth() { "yes" } else { "no" }.to_owned()))
                            }
                        }
                    }
                }
                figure {
                    (PreEscaped(charts::histogram(&counts)))
                    figcaption { "How many contour vertices the views have." }
                }
            }
        }
    }
}

fn row(name: &str, value: String) -> Markup {
    html! { tr { th scope="row" { (name) } td { (value) } } }
}

pub(super) fn times(report: &Report<'_>) -> Markup {
    let conditions = &report.measured.conditions;
    html! {
        section {
            h2 { "Times" }
            div.plots {
                @if !report.measured.contour_times.is_empty() {
                    div.scroll {
                        table {
                            caption { "An outline, by method" }
                            thead { tr { th { "method" } th { "median, ms" } th { "95 % below, ms" } th { "calls" } } }
                            tbody {
                                @for time in &report.measured.contour_times {
                                    tr {
                                        th scope="row" { (swatch(&time.method)) (time.method) }
                                        td { (millis(time.median)) }
                                        td { (millis(time.most)) }
                                        td { (time.calls) }
                                    }
                                }
                            }
                        }
                    }
                }
                @if !report.seconds.is_empty() {
                    div.scroll {
                        table {
                            caption { "Making the asset" }
                            thead { tr { th { "stage" } th { "seconds" } } }
                            tbody {
                                @for (name, seconds) in &report.seconds { (row(name, format!("{seconds:.2}"))) }
                            }
                        }
                    }
                }
            }
            p {
                "Measured on " (conditions.machine)
                @if conditions.is_optimised { "" } @else { ", in a program that is not optimised" }
                ". Outlines: one thread, the eye on a smooth walk around the model, buffers warm, each call timed by itself. Errors: "
                (conditions.threads) @if conditions.threads == 1 { " thread" } @else { " threads" } ", "
                (format!("{:.0}", conditions.seconds)) " s for all that is on this page."
            }
        }
    }
}
