//! Exact extraction and interpolation side by side: a table for the whole model, and how the time of each method grows with
//! the model's resolution, with the papers' own figures beside.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, tables 1 and 2, figure 9 and section 7; Pop,
//! Duncan, Barequet, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and Applications. SCG 2001,
//! table 2.

use maud::{Markup, PreEscaped, html};
use serde_json::{Map, Value, json};

use crate::charts;

/// Methods compared at the same viewpoints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// The model at several resolutions, coarsest first; the last is the model itself.
    pub levels: Vec<ComparisonLevel>,
    /// Interpolation at the same viewpoints.
    pub contours: Vec<ContourResult>,
    /// Viewpoints of the walk.
    pub viewpoints: u32,
}

/// Extraction from the model at one resolution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComparisonLevel {
    /// Faces of the mesh.
    pub faces: usize,
    /// A result for each method.
    pub methods: Vec<ExtractionResult>,
}

/// What one method of extraction did; means over the viewpoints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtractionResult {
    /// The method.
    pub method: String,
    /// Edges found.
    pub silhouette_edges: f64,
    /// Edges tested.
    pub tested_edges: f64,
    /// Nodes tested.
    pub visited_nodes: f64,
    /// Median time, seconds.
    pub seconds_median: f64,
    /// Bytes kept about the mesh.
    pub data_bytes: u64,
    /// Time to build them, seconds.
    pub build_seconds: f64,
}

/// What one method of interpolation did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContourResult {
    /// The method.
    pub method: String,
    /// Median time, seconds.
    pub seconds_median: f64,
    /// Distance to the exact outline: the area between over the length, pixels.
    pub error_px: f64,
    /// Bytes of the silhouettes.
    pub data_bytes: u64,
}

/// Printed figures: what, of which model, found, tested edges, nodes, and milliseconds or times faster than brute force.
const PRINTED: [[&str; 6]; 7] = [
    [
        "anchored cones, 2000, table 2",
        "bunny, 69,674",
        "3,461",
        "10,256",
        "4,282",
        "4.1 ms, 5.0 ×",
    ],
    [
        "brute force, 2000, table 2",
        "bunny, 69,674",
        "3,461",
        "104,511",
        "0",
        "20.4 ms",
    ],
    [
        "anchored cones, 2000, table 2",
        "dragon, 400,000",
        "23,493",
        "67,934",
        "26,291",
        "28.2 ms, 4.2 ×",
    ],
    [
        "anchored cones, 2000, table 2",
        "knot, 185,856",
        "3,291",
        "13,134",
        "7,926",
        "6.4 ms, 7.9 ×",
    ],
    [
        "anchored cones, 2000, table 2",
        "three holes, 188,416",
        "1,737",
        "5,976",
        "4,594",
        "3.3 ms, 15.6 ×",
    ],
    [
        "dual space, 2001, table 2",
        "bunny, 69,451",
        "",
        "",
        "",
        "6.4 ×",
    ],
    [
        "dual space, 2001, table 2",
        "dragon, 871,414",
        "",
        "",
        "",
        "6.1 ×",
    ],
];

/// Cost of testing a node over that of an edge, as the 2000 paper weighs them.
const NODE_COST: f64 = 4.0 / 3.0;

impl ComparisonLevel {
    fn of(&self, method: &str) -> Option<&ExtractionResult> {
        self.methods.iter().find(|m| m.method == method)
    }

    /// How many times less than scalar brute force a method takes.
    fn times_faster(&self, result: &ExtractionResult) -> Option<f64> {
        let brute = self.of("brute")?;
        Some(brute.seconds_median / result.seconds_median.max(f64::MIN_POSITIVE))
    }

    /// Tests of Johannsen and Carter's hierarchy over those of the cones.
    fn cones_over_jc(&self) -> Option<f64> {
        let cost = |r: &ExtractionResult| r.tested_edges + NODE_COST * r.visited_nodes;
        Some(cost(self.of("jc")?) / cost(self.of("cones")?).max(1.0))
    }
}

impl Comparison {
    /// The fewest faces at which `method` is faster than `other`, here and at all finer levels.
    fn crossover(&self, method: &str, other: &str) -> Option<usize> {
        let is_faster = |level: &&ComparisonLevel| {
            let seconds = |name: &str| level.of(name).map(|r| r.seconds_median);
            matches!((seconds(method), seconds(other)), (Some(a), Some(b)) if a < b)
        };
        let faster = self.levels.iter().rev().take_while(is_faster);
        faster.last().map(|level| level.faces)
    }
}

/// The section of the page.
pub(crate) fn section(comparison: &Comparison) -> Markup {
    let Some(model) = comparison.levels.last() else {
        return html! {};
    };
    let ratio = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.1}"));
    html! {
        section {
            h2 { "Exact extraction beside interpolation" }
            p {
                "At " (comparison.viewpoints) " viewpoints 0.5° apart on a circle around the model; " code { "dual" }
                " goes on from the viewpoint before. All methods find the same edges. One thread, but for "
                code { "brute-parallel" } "."
            }
            div.scroll {
                table {
                    caption { "The model, " (model.faces) " faces" }
                    thead { tr {
                        th { "method" } th { "edges" } th { "edges tested" } th { "nodes tested" } th { "median, ms" }
                        th { "times " code { "brute" } } th { "bytes" } th { "build, s" } th { "error, px" }
                    } }
                    tbody {
                        @for r in &model.methods {
                            tr {
                                th scope="row" { (r.method) }
                                td { (format!("{:.0}", r.silhouette_edges)) }
                                td { (format!("{:.0}", r.tested_edges)) }
                                td { (format!("{:.0}", r.visited_nodes)) }
                                td { (format!("{:.4}", 1e3 * r.seconds_median)) }
                                td { (ratio(model.times_faster(r))) }
                                td { (r.data_bytes) }
                                td { (format!("{:.3}", r.build_seconds)) }
                                td { "0" }
                            }
                        }
                        @for r in &comparison.contours {
                            tr {
                                th scope="row" { "interpolated, " (r.method) }
                                td {} td {} td {}
                                td { (format!("{:.4}", 1e3 * r.seconds_median)) }
                                td {}
                                td { (r.data_bytes) }
                                td {}
                                td { (format!("{:.3}", r.error_px)) }
                            }
                        }
                    }
                }
            }
            div.plots {
                figure {
                    (PreEscaped(charts::crossover(comparison)))
                    figcaption {
                        "Time over resolution, as in figure 9 of the 2000 paper: hulls of the model with fewer faces, and the model. "
                        "Dashed: interpolation by the last method of the table, which does not depend on it. "
                        @for (method, other) in [("cones", "brute"), ("cones", "brute-parallel"), ("dual", "brute-parallel")] {
                            @match comparison.crossover(method, other) {
                                Some(faces) => { code { (method) } " is ahead of " code { (other) } " from " (faces) " faces on. " }
                                None => { code { (method) } " is not ahead of " code { (other) } " at the finest. " }
                            }
                        }
                    }
                }
                div.scroll {
                    table {
                        caption { "Tests of " code { "jc" } " over those of " code { "cones" } ", a node counted as 4/3 edges" }
                        thead { tr { th { "faces" } th { "here" } th { "2000 paper, bunny" } } }
                        tbody {
                            @for level in &comparison.levels {
                                tr {
                                    th scope="row" { (level.faces) }
                                    td { (ratio(level.cones_over_jc())) }
                                    td { (printed_over_jc(level.faces)) }
                                }
                            }
                        }
                    }
                }
            }
            div.scroll {
                table {
                    caption { "As printed, on machines of their time (550 MHz in 2000)" }
                    thead { tr {
                        th { "method" } th { "model, faces" } th { "edges" } th { "edges tested" } th { "nodes tested" } th { "time" }
                    } }
                    tbody {
                        @for [method, cells @ ..] in &PRINTED {
                            tr { th scope="row" { (method) } @for cell in cells { td { (cell) } } }
                        }
                    }
                }
            }
        }
    }
}

/// The 2000 paper's factor over Johannsen and Carter for a bunny of about as many faces.
fn printed_over_jc(faces: usize) -> &'static str {
    match faces {
        400..=600 => "1.1",
        3_500..=4_500 => "1.3",
        19_000..=21_000 => "1.5",
        48_000..=52_000 => "2.0",
        69_000..=70_000 => "2.1",
        _ => "",
    }
}

/// The same as JSON.
pub(crate) fn numbers(comparison: &Comparison) -> Value {
    let level = |level: &ComparisonLevel| {
        json!({
            "faces": level.faces,
            "methods": level.methods.iter().map(|r| (r.method.clone(), json!({
                "silhouette_edges": r.silhouette_edges,
                "tested_edges": r.tested_edges,
                "visited_nodes": r.visited_nodes,
                "seconds_median": r.seconds_median,
                "data_bytes": r.data_bytes,
                "build_seconds": r.build_seconds,
            }))).collect::<Map<_, _>>(),
        })
    };
    json!({
        "viewpoints": comparison.viewpoints,
        "levels": comparison.levels.iter().map(level).collect::<Vec<_>>(),
        "contours": comparison.contours.iter().map(|r| (r.method.clone(), json!({
            "seconds_median": r.seconds_median,
            "outline_error": r.error_px,
            "bytes": r.data_bytes,
        }))).collect::<Map<_, _>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(method: &str, seconds_median: f64) -> ExtractionResult {
        ExtractionResult {
            method: method.to_owned(),
            seconds_median,
            tested_edges: 1e6 * seconds_median,
            ..ExtractionResult::default()
        }
    }

    fn comparison() -> Comparison {
        let level = |faces, cones, brute| ComparisonLevel {
            faces,
            methods: vec![result("cones", cones), result("brute", brute)],
        };
        Comparison {
            levels: vec![
                level(500, 0.5e-3, 0.7e-3),
                level(4000, 3e-3, 2e-3),
                level(20_000, 4e-3, 8e-3),
                level(69_666, 8e-3, 40e-3),
            ],
            contours: vec![ContourResult {
                method: "tight".to_owned(),
                seconds_median: 1e-4,
                error_px: 0.25,
                data_bytes: 99,
            }],
            viewpoints: 60,
        }
    }

    #[test]
    fn a_crossover_holds_for_all_that_is_finer() {
        let comparison = comparison();
        assert_eq!(comparison.crossover("cones", "brute"), Some(20_000));
        assert_eq!(comparison.crossover("brute", "cones"), None);
        assert_eq!(comparison.crossover("dual", "brute"), None);
    }

    #[test]
    fn the_section_has_what_was_measured_and_what_was_printed() {
        let comparison = comparison();
        let html = section(&comparison).into_string();
        for part in [
            "69666",
            "from 20000 faces on",
            "0.250",
            "5.0",
            "10,256",
            "6.4 ×",
            "8.0000",
            "<svg",
        ] {
            assert!(html.contains(part), "{part} is missing");
        }
        assert_eq!(
            numbers(&comparison)["levels"][3]["methods"]["cones"]["seconds_median"],
            8e-3
        );
        assert_eq!(section(&Comparison::default()).into_string(), "");
    }
}
