//! The page's section on the comparison: recommended method, tables, plots and the papers' figures.

use maud::{Markup, PreEscaped, html};

use super::printed::{CLIPPING, RATES, over_jc};
use super::{
    BRUTE, Comparison, ComparisonLevel, ExtractionResult, FrameResults, Motion, PARALLEL, plots,
};
use crate::words::{grouped, significant};

pub(crate) fn section(comparison: &Comparison) -> Markup {
    let Some(model) = comparison.levels.last() else {
        return html! {};
    };
    html! {
        section {
            h2 { "Exact extraction beside interpolation" }
            p {
                "Every method of extraction finds the same edges; they differ in time and in what they keep about the model. Measured on a walk, "
                (comparison.walk_viewpoints) " viewpoints 0.5° apart at three radii, and at " (comparison.scattered_viewpoints)
                " scattered ones on all sides at two to four radii, where " code { "dual" }
                " has little to go on from. One thread, but for " code { (PARALLEL) } ", which has " (comparison.threads) "."
            }
            h3 { "Which one to take" }
            (advice(comparison, model))
            h3 { "The model" }
            (model_table(comparison, model))
            h3 { "Over resolution" }
            (resolution(comparison))
            @if let Some(frames) = &comparison.frames { (frames_part(comparison, model, frames)) }
            h3 { "Beside the papers" }
            (printed_tables(comparison, model))
        }
    }
}

/// Sentences that follow from what was measured.
fn advice(comparison: &Comparison, model: &ComparisonLevel) -> Markup {
    let case = |what: &str, motion: Motion| {
        let (all, one) = (model.fastest(motion, false), model.fastest(motion, true));
        html! {
            li {
                (what) ": "
                @if let Some(one) = one { (fastest(model, one, motion)) " on one thread" }
                @match (all, one) {
                    (Some(all), Some(one)) if all.method != one.method => {
                        "; " (fastest(model, all, motion)) " on " (comparison.threads)
                    }
                    _ => {}
                }
                "."
            }
        }
    };
    const FEW: u32 = 10;
    html! {
        ul {
            (case("An eye that moves smoothly", Motion::Walk))
            (case("An eye that may be anywhere next", Motion::Scattered))
            @if let Some((r, seconds)) = model.fastest_in_all(FEW) {
                li {
                    (FEW) " viewpoints and no more, preparation included: " code { (r.method) } ", " (millis(seconds)) " ms in all on one thread."
                }
            }
            li { (parallel_wins(comparison)) }
            @if let Some(contour) = comparison.contours.last() {
                li {
                    "Interpolation by " code { (contour.method) } " takes " (micros(contour.seconds_median))
                    " µs for the whole outline whatever the model's faces, not its edges alone, and is "
                    (format!("{:.2}", contour.error_px)) " pixels off on average."
                }
            }
        }
    }
}

fn fastest(model: &ComparisonLevel, result: &ExtractionResult, motion: Motion) -> Markup {
    html! {
        code { (result.method) } ", " (micros(result.on(motion).seconds_median)) " µs"
        @if let Some(times) = model.times_faster(result, motion).filter(|_| result.method != BRUTE) {
            ", " (format!("{times:.1}")) " times " code { (BRUTE) }
        }
    }
}

/// Where brute force on all cores and several faces at a time is the fastest of all.
fn parallel_wins(comparison: &Comparison) -> Markup {
    let faces_of = |motion| {
        let won = comparison.levels_won(PARALLEL, motion);
        let words: Vec<String> = won.iter().map(|&n| grouped(n as u64)).collect();
        match words.split_last() {
            None => "at no resolution".to_owned(),
            Some((last, [])) => format!("at {last} faces"),
            Some((last, rest)) => format!("at {} and {last} faces", rest.join(", ")),
        }
    };
    html! {
        "Vectorised brute force on " (comparison.threads) " threads, " code { (PARALLEL) } ", is the fastest of all "
        (faces_of(Motion::Walk)) " on the walk, and " (faces_of(Motion::Scattered)) " at scattered viewpoints."
    }
}

fn model_table(comparison: &Comparison, model: &ComparisonLevel) -> Markup {
    html! {
        div.scroll {
            table {
                caption {
                    (grouped(model.faces as u64)) " faces, "
                    @if let Some(brute) = model.of(BRUTE) { (whole(brute.scattered.silhouette_edges)) " of their edges on a silhouette; " }
                    "tests are means over the scattered viewpoints"
                }
                thead {
                    tr {
                        th rowspan="2" { "method" }
                        th.group colspan="2" { "walk" }
                        th.group colspan="2" { "scattered" }
                        th.group colspan="2" { "tested" }
                        th rowspan="2" { "bytes" } th rowspan="2" { "build, s" } th rowspan="2" { "error, px" }
                    }
                    tr {
                        th { "µs" } th { "times " code { (BRUTE) } }
                        th { "µs" } th { "times " code { (BRUTE) } }
                        th { "edges" } th { "nodes" }
                    }
                }
                tbody {
                    @for r in &model.methods {
                        tr {
                            th scope="row" { (r.method) }
                            @for motion in [Motion::Walk, Motion::Scattered] {
                                td { (micros(r.on(motion).seconds_median)) }
                                td { (ratio(model.times_faster(r, motion))) }
                            }
                            td { (whole(r.scattered.tested_edges)) }
                            td { (whole(r.scattered.visited_nodes)) }
                            td { (grouped(r.data_bytes)) }
                            td { (format!("{:.3}", r.build_seconds)) }
                            td { "0" }
                        }
                    }
                    @for r in &comparison.contours {
                        tr {
                            th scope="row" { "interpolated, " (r.method) }
                            td { (micros(r.seconds_median)) }
                            td {} td {} td {} td {} td {}
                            td { (grouped(r.data_bytes)) }
                            td {}
                            td { (format!("{:.3}", r.error_px)) }
                        }
                    }
                }
            }
        }
    }
}

fn resolution(comparison: &Comparison) -> Markup {
    let plot = |motion: Motion, where_: &str| {
        html! {
            figure {
                (PreEscaped(plots::crossover(comparison, motion)))
                figcaption {
                    "Median time over the faces of the model, " (where_) ": hulls of it with fewer faces, and the model. “parallel” is "
                    code { (PARALLEL) } ". Dashed: interpolation, which does not depend on the faces. "
                    @for (method, other) in [("cones", BRUTE), ("cones", PARALLEL), ("dual", PARALLEL)] {
                        @match comparison.crossover(method, other, motion) {
                            Some(faces) => { code { (method) } " is ahead of " code { (other) } " from " (grouped(faces as u64)) " faces on. " }
                            None => { code { (method) } " is not ahead of " code { (other) } " at the finest. " }
                        }
                    }
                }
            }
        }
    };
    html! {
        div.plots {
            (plot(Motion::Walk, "on the walk"))
            (plot(Motion::Scattered, "at scattered viewpoints"))
        }
        div.plots {
            figure {
                (PreEscaped(plots::complexity(comparison)))
                figcaption {
                    "Figure 9 of the 2000 paper: mean time over the mean number of silhouette edges, here medians at scattered viewpoints. The dots are \
                     what it prints of the bunny of 69,674 faces, on its machine. The paper finds the tree's time to grow as the \
                     number of silhouette edges, and brute force's as its square. Here "
                    @if let Some(power) = comparison.power(|level| Some(level.faces as f64)) {
                        "the faces grow as its power " (format!("{power:.1}")) ", and time as its power: "
                    }
                    @for (k, method) in comparison.telling_methods().into_iter().enumerate() {
                        @if let Some(power) = comparison.growth(method) {
                            @if k > 0 { ", " }
                            code { (method) } " " (format!("{power:.1}"))
                        }
                    }
                    "."
                }
            }
            div.scroll {
                table {
                    caption { "The fastest method, by faces" }
                    thead {
                        tr {
                            th rowspan="2" { "faces" }
                            th.group colspan="2" { "walk" }
                            th.group colspan="2" { "scattered" }
                        }
                        tr { th { "one thread" } th { "any" } th { "one thread" } th { "any" } }
                    }
                    tbody {
                        @for level in &comparison.levels {
                            tr {
                                th scope="row" { (grouped(level.faces as u64)) }
                                @for motion in [Motion::Walk, Motion::Scattered] {
                                    @for is_on_one_thread in [true, false] {
                                        td { (level.fastest(motion, is_on_one_thread).map_or("", |r| &r.method)) }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn frames_part(comparison: &Comparison, model: &ComparisonLevel, frames: &FrameResults) -> Markup {
    let full = frames.full_seconds(model.faces);
    let drawn = |seconds: f64| drawn_in(frames, seconds);
    let faster = |seconds: f64| ratio(full.map(|full| full / seconds));
    html! {
        h3 { "As frames" }
        p {
            "Pictures of " (frames.size_px) "² by " (frames.adapter) ", processor and device one after the other, the least median of three rounds: the mesh as it is, and the hull of "
            (grouped(frames.hull_faces as u64)) " faces clipped to the exact silhouette, without antialiasing."
        }
        div.plots {
            figure {
                (PreEscaped(plots::same_time(comparison)))
                figcaption {
                    "Figure 11 of the 2000 paper: pairs that take the same time. Across, the faces that the silhouette is extracted from, on the \
                     walk; up, how many faces can be drawn unclipped in the time of the hull clipped to that silhouette. Below the dashed \
                     diagonal clipping draws the finer silhouette. The star is the whole model by " code { "cones" }
                    ", the level line the hull clipped to the interpolated outline. Grey dots: the models of the paper's table 1, \
                     taking the time of drawing to be proportional to the faces. "
                    @for method in ["cones", "dual"] {
                        @match comparison.clipping_pays_from(method) {
                            Some(faces) => { "By " code { (method) } " clipping pays from " (grouped(faces as u64)) " faces on. " }
                            None => { "By " code { (method) } " it does not pay here. " }
                        }
                    }
                }
            }
            div.scroll {
                table {
                    caption { "Frames of the model, " (grouped(model.faces as u64)) " faces" }
                    thead { tr { th { "" } th { "ms" } th { "times the mesh" } th { "faces drawn in" br; "the same time" } } }
                    tbody {
                        @if let Some(full) = full {
                            tr { th scope="row" { "the mesh" } td { (millis(full)) } td { "1.0" } td { (grouped(model.faces as u64)) } }
                        }
                        tr {
                            th scope="row" { "the hull alone" }
                            td { (millis(frames.hull_seconds)) } td { (faster(frames.hull_seconds)) } td { (drawn(frames.hull_seconds)) }
                        }
                        @for r in &model.methods {
                            @if let Some(seconds) = r.frame_seconds {
                                tr {
                                    th scope="row" { "clipped, " code { (r.method) } }
                                    td { (millis(seconds)) } td { (faster(seconds)) } td { (drawn(seconds)) }
                                }
                            }
                        }
                        @if let Some((method, seconds)) = &frames.interpolated {
                            tr {
                                th scope="row" { "clipped, interpolated by " code { (method) } }
                                td { (millis(*seconds)) } td { (faster(*seconds)) } td { (drawn(*seconds)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The faces that can be drawn in this time, as far as was measured.
fn drawn_in(frames: &FrameResults, seconds: f64) -> String {
    let grouped = |faces: usize| grouped(faces as u64);
    match (frames.faces_drawn_in(seconds), &frames.full[..]) {
        (Some(faces), _) => whole(faces),
        (None, [fewest, ..]) if seconds < fewest.1 => format!("under {}", grouped(fewest.0)),
        (None, [.., most]) => format!("over {}", grouped(most.0)),
        (None, []) => String::new(),
    }
}

fn printed_tables(comparison: &Comparison, model: &ComparisonLevel) -> Markup {
    let ms = |value: f64| format!("{value:.1}");
    let (cones, brute, dual) = (model.of("cones"), model.of(BRUTE), model.of("dual"));
    let frames = comparison.frames.as_ref();
    let here = format!("here, {}", grouped(model.faces as u64));
    html! {
        div.scroll {
            table {
                caption { "2000, table 2: anchored cones and brute force at random viewpoints; here the scattered ones" }
                thead {
                    tr {
                        th rowspan="2" { "model, faces" } th rowspan="2" { "silhouette" br; "edges" }
                        th.group colspan="2" { "tested" } th.group colspan="2" { "for each edge found" }
                        th.group colspan="3" { "time, ms" }
                    }
                    tr {
                        th { "edges" } th { "nodes" } th { "edges" } th { "nodes" }
                        th { "cones" } th { "brute" } th { "ratio" }
                    }
                }
                tbody {
                    @if let (Some(cones), Some(brute)) = (cones, brute) {
                        @let found = cones.scattered;
                        tr.here {
                            th scope="row" { (here) }
                            td { (whole(found.silhouette_edges)) }
                            td { (whole(found.tested_edges)) } td { (whole(found.visited_nodes)) }
                            td { (format!("{:.2}", found.tested_edges / found.silhouette_edges.max(1.0))) }
                            td { (format!("{:.2}", found.visited_nodes / found.silhouette_edges.max(1.0))) }
                            td { (millis(found.seconds_median)) } td { (millis(brute.scattered.seconds_median)) }
                            td { (ratio(model.times_faster(cones, Motion::Scattered))) }
                        }
                    }
                    @for c in &CLIPPING {
                        @let found = f64::from(c.silhouette_edges);
                        tr {
                            th scope="row" { (c.model) ", " (grouped(c.faces.into())) }
                            td { (grouped(c.silhouette_edges.into())) }
                            td { (grouped(c.tested_edges.into())) } td { (grouped(c.tested_nodes.into())) }
                            td { (format!("{:.2}", f64::from(c.tested_edges) / found)) }
                            td { (format!("{:.2}", f64::from(c.tested_nodes) / found)) }
                            td { (ms(c.tree_ms)) } td { (ms(c.brute_ms)) } td { (format!("{:.1}", c.brute_ms / c.tree_ms)) }
                        }
                    }
                }
            }
        }
        div.scroll {
            table {
                caption { "2000, table 1: frames, ms; there processor and device work side by side, here one after the other" }
                thead { tr {
                    th { "model, faces" } th { "hull," br; "faces" } th { "the mesh" } th { "extraction" } th { "stencil" } th { "hull" }
                    th { "total" } th { "ratio" } th { "faces in the" br; "same time" }
                } }
                tbody {
                    @if let (Some(frames), Some(cones)) = (frames, cones) {
                        @if let (Some(full), Some(total)) = (frames.full_seconds(model.faces), cones.frame_seconds) {
                            tr.here {
                                th scope="row" { (here) ", " code { "cones" } }
                                td { (grouped(frames.hull_faces as u64)) }
                                td { (millis(full)) } td { (millis(cones.walk.seconds_median)) } td {}
                                td { (millis(frames.hull_seconds)) } td { (millis(total)) }
                                td { (format!("{:.1}", full / total)) }
                                td { (drawn_in(frames, total)) }
                            }
                        }
                    }
                    @for c in &CLIPPING {
                        tr {
                            th scope="row" { (c.model) ", " (grouped(c.faces.into())) }
                            td { (grouped(c.hull_faces.into())) }
                            td { (ms(c.original_ms)) } td { (ms(c.frame_extraction_ms)) } td { (ms(c.stencil_ms)) } td { (ms(c.hull_ms)) }
                            td { (ms(c.total_ms)) } td { (format!("{:.1}", c.original_ms / c.total_ms)) }
                            td { (whole(c.faces_in_the_same_time())) }
                        }
                    }
                }
            }
        }
        div.scroll {
            table {
                caption { "2001, table 2: extractions in a second, the eye led by hand; here on the walk" }
                thead { tr { th { "model, faces" } th { "dual space" } th { "brute force" } th { "ratio" } } }
                tbody {
                    @if let (Some(dual), Some(brute)) = (dual, brute) {
                        tr.here {
                            th scope="row" { (here) }
                            td { (whole(1.0 / dual.walk.seconds_median)) } td { (whole(1.0 / brute.walk.seconds_median)) }
                            td { (ratio(model.times_faster(dual, Motion::Walk))) }
                        }
                    }
                    @for r in &RATES {
                        tr {
                            th scope="row" { (r.model) ", " (grouped(r.faces.into())) }
                            td { (significant(r.dual)) } td { (significant(r.brute)) } td { (format!("{:.1}", r.dual / r.brute)) }
                        }
                    }
                }
            }
        }
        div.scroll {
            table {
                caption {
                    "2000, section 7: tests of " code { "jc" } " over those of " code { "cones" }
                    ", a node counted as 4/3 edges; here at scattered viewpoints"
                }
                thead { tr { th { "faces" } th { "here" } th { "the paper's bunny" } } }
                tbody {
                    @for level in &comparison.levels {
                        tr {
                            th scope="row" { (grouped(level.faces as u64)) }
                            td { (ratio(level.cones_over_jc())) }
                            td { (ratio(over_jc(level.faces))) }
                        }
                    }
                }
            }
        }
        p {
            "Machines of the papers: a Pentium III of 550 MHz with a GeForce 256 in 2000, an SGI Octane of 195 MHz in 2001. Counts do not depend on \
             the machine. What the 2000 paper draws in figure 11 it does not print; the last column of its table 1 here is faces × total / mesh."
        }
    }
}

fn ratio(value: Option<f64>) -> String {
    const LEAST_IN_TENTHS: f64 = 0.095;
    value.map_or(String::new(), |v| {
        if v < LEAST_IN_TENTHS {
            format!("{v:.4}")
        } else {
            format!("{v:.1}")
        }
    })
}

/// Microseconds with one digit behind the point.
fn micros(seconds: f64) -> String {
    const LEAST_IN_WHOLE: f64 = 1e-3;
    if seconds < LEAST_IN_WHOLE {
        format!("{:.1}", 1e6 * seconds)
    } else {
        whole(1e6 * seconds)
    }
}

/// Milliseconds with the digits that matter.
fn millis(seconds: f64) -> String {
    significant(1e3 * seconds)
}

/// A count or a mean of counts, rounded.
fn whole(value: f64) -> String {
    if value.is_finite() {
        grouped(value.round() as u64)
    } else {
        String::new()
    }
}
