//! The page: headings, pictures, tables and plots, for wide and narrow windows, light and dark.

use glam::DVec3;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use silmap_map::Method;
use silmap_measure::{ErrorSample, MethodErrors, PlaceErrors, WorstView};

use crate::contour_generator::{contour_generator_pictures, telling_view};
use crate::difference::{closer_look, difference, silhouette};
use crate::direction_map::{direction_map, shared_scale};
use crate::epipolar_picture::epipolar_pictures;
use crate::polytope_picture::polytope_picture;
use crate::texture_section::textures;
use crate::words::{grouped, millis, percent, significant};
use crate::{
    Picture, PictureRow, Report, charts, comparison, palette, png, scene_section, turntable_section,
};

mod sizes;
mod strays;

use sizes::{sizes, times};

const STYLE: &str = include_str!("page.css");

/// The head of any page.
pub(crate) fn head(title: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            title { (title) }
            style { (PreEscaped(STYLE)) }
        }
    }
}

pub(crate) fn page(report: &Report<'_>) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            (head(&report.title))
            body {
                header {
                    h1 { (report.title) }
                    (opening(report))
                }
                main {
                    (turntable_section::section(report))
                    @if !report.rows.is_empty() {
                        section {
                            h2 { "Pictures" }
                            @for row in &report.rows { (picture_row(row)) }
                        }
                    }
                    (errors(report))
                    (curve(report))
                    (directions(report))
                    (worst(report))
                    (strays::views(report))
                    (polytopes(report))
                    (inside(report))
                    @if let Some(figures) = &report.measured.textures { (textures(figures)) }
                    (sizes(report))
                    (times(report))
                    @if let Some(comparison) = &report.comparison { (comparison::section(comparison)) }
                    (scene_section::section(&report.scenes))
                    @if !report.notes.is_empty() {
                        section {
                            h2 { "Notes" }
                            @for note in &report.notes { p { (note) } }
                        }
                    }
                }
            }
        }
    }
}

/// What it is about, and the figures that matter most.
fn opening(report: &Report<'_>) -> Markup {
    let asset = report.asset;
    let best = Method::best_for(&asset.map).name();
    let errors = report
        .measured
        .places
        .first()
        .and_then(|p| p.methods.iter().find(|m| m.method == best));
    let time = report
        .measured
        .contour_times
        .iter()
        .find(|t| t.method == best);
    html! {
        p {
            "A hull of " (grouped(asset.hull.faces.len() as u64)) " textured triangles stands for a mesh of "
            (grouped(asset.record.model_faces)) " faces. Its outline is interpolated from "
            (asset.map.views.len()) " silhouettes that were captured around it."
        }
        ul.figures {
            @if let Some(errors) = errors {
                li { b { (percent(errors.misclassified[0])) " %" } "of the pixels misclassified on average (" (best) ")" }
                @if let Some(off) = errors.straying {
                    li { b { (strays::pixels(off.largest_median)) " px" } "at most between the outlines, at the median eye (" (best) ")" }
                }
            }
            @if let Some(time) = time {
                li { b { (millis(time.median)) " ms" } "for an outline (" (best) ", median)" }
            }
            @for (name, bytes) in [report.measured.bytes.first(), report.measured.bytes.last()].into_iter().flatten() {
                li { b { (format!("{:.0}", *bytes as f64 / 1024.0)) " KiB" } (name) }
            }
        }
    }
}

fn errors(report: &Report<'_>) -> Markup {
    let (center, radius) = (report.asset.map.center, report.asset.map.radius);
    let distance = |s: &ErrorSample| s.eye.distance(center) / radius;
    // Where the eye's distance varies by more than this, errors are plotted over it.
    const SPREAD: f64 = 2.0;
    let is_deep = |place: &&PlaceErrors| {
        let all = || place.samples.iter().map(distance);
        all().fold(0.0, f64::max) > SPREAD * all().fold(f64::INFINITY, f64::min)
    };
    html! {
        section {
            h2 { "Errors of the outline" }
            p {
                "Pixels whose inside or outside is wrong, in percent of the pixels inside the true outline; "
                "“escaped” are those of them that are inside and predicted outside. "
                "Pictures of " (report.measured.conditions.resolution_px) "²; random directions, seed "
                (report.measured.conditions.seed) "."
            }
            div.plots { @for place in &report.measured.places { (error_table(place)) } }
            (strays::tables(report))
            @if let Some(first) = report.measured.places.first() {
                div.plots {
                    figure {
                        (PreEscaped(charts::distribution(&first.samples)))
                        figcaption { "Eyes " (first.description) ": how many of them have at most which error." }
                    }
                    @for place in report.measured.places.iter().filter(is_deep) {
                        figure {
                            (PreEscaped(charts::by_distance(&place.samples, distance)))
                            figcaption { "Eyes " (place.description) ": one point for each eye and method." }
                        }
                    }
                }
            }
        }
    }
}

fn error_table(place: &PlaceErrors) -> Markup {
    html! {
        div.scroll {
            table {
                caption {
                    (place.viewpoints) " eyes " (place.description) " (" code { (place.place) } ")"
                }
                thead {
                    tr {
                        th rowspan="2" { "method" }
                        th.group colspan="3" { "misclassified, %" }
                        th.group colspan="2" { "escaped, %" }
                    }
                    tr { th { "mean" } th { "median" } th { "worst" } th { "mean" } th { "worst" } }
                }
                tbody {
                    @for row in &place.methods {
                        tr {
                            th scope="row" { (swatch(&row.method)) (row.method) }
                            @for share in row.misclassified { td { (percent(share)) } }
                            @for share in row.escaped { td { (percent(share)) } }
                        }
                    }
                }
            }
        }
    }
}

pub(crate) fn swatch(method: &str) -> Markup {
    let colour = palette::hex(palette::of_method(method));
    html! { span.swatch style=(format!("background:{colour}")) {} }
}

fn curve(report: &Report<'_>) -> Markup {
    let curve = &report.asset.record.error_curve;
    let uniform = report.measured.uniform_curve.as_deref();
    let methods: &[MethodErrors] = report.measured.places.first().map_or(&[], |p| &p.methods);
    let kept = report.asset.map.views.len() as u32;
    if curve.len() < 2 && uniform.is_none() {
        return html! {};
    }
    html! {
        section {
            h2 { "Views and error" }
            figure.single {
                (PreEscaped(charts::curve(curve, uniform, kept, methods)))
                figcaption {
                    "The mean share of misclassified pixels over all "
                    (report.asset.record.captured_views)
                    " captured views, as views are removed one by one, by the method that the views were chosen with"
                    @if uniform.is_some() { ", and that of as many views spread evenly" }
                    ". The dots are the methods on the finished asset, at the test viewpoints of the first table: other eyes than \
                     those of the curve, and views that may have been moved since."
                }
            }
        }
    }
}

fn directions(report: &Report<'_>) -> Markup {
    let Some(scale) = shared_scale(&report.measured.directions) else {
        return html! {};
    };
    let center = report.asset.map.center;
    let views: Vec<DVec3> = (report.asset.map.views.iter())
        .map(|v| (v.camera.eye - center).normalize_or_zero())
        .collect();
    let count = report
        .measured
        .directions
        .first()
        .map_or(0, |d| d.samples.len());
    html! {
        section {
            h2 { "Error by direction" }
            p {
                "All directions to look from, in a map that keeps areas (Mollweide): from +Z in the middle, +X halfway to the right, "
                "+Y at the top. Measured at " (count) " directions spread evenly, on the polytope of views; dots are the views. "
                "The colours are the same in all maps."
            }
            div.plots {
                @for errors in &report.measured.directions {
                    figure {
                        (PreEscaped(direction_map(errors, &views, &scale)))
                        figcaption { "Method " b { (errors.method) } "." }
                    }
                }
            }
        }
    }
}

fn worst(report: &Report<'_>) -> Markup {
    if report.measured.worst.is_empty() {
        return html! {};
    }
    let of = report
        .measured
        .places
        .first()
        .map_or("", |p| p.description.as_str());
    html! {
        section {
            h2 { "Worst viewpoints" }
            p {
                "Of the eyes " (of) ", those with the largest errors. "
                span.key style=(format!("--key:{}", palette::hex(palette::TOO_MUCH))) { "Red is too much" } ", "
                span.key style=(format!("--key:{}", palette::hex(palette::TOO_LITTLE))) { "blue too little" } "."
            }
            @for view in &report.measured.worst { (worst_row(report, view)) }
        }
    }
}

fn worst_row(report: &Report<'_>, view: &WorstView) -> Markup {
    let mut canvas = crate::canvas::Canvas::new(&view.camera);
    canvas.draw_model(report.model);
    let picture = |label: &str, image| Picture {
        label: label.to_owned(),
        image,
    };
    let grey = palette::RIGHT;
    let [x, y, z] = (view.sample.eye + report.asset.placement.in_scene)
        .to_array()
        .map(significant);
    picture_row(&PictureRow {
        caption: format!(
            "Method {}: {} % misclassified, {} % escaped; eye {x},{y},{z}",
            view.sample.method,
            percent(view.sample.misclassified),
            percent(view.sample.escaped),
        ),
        pictures: vec![
            picture("model", canvas.finish()),
            picture("true outline", silhouette(&view.truth, grey)),
            picture("predicted outline", silhouette(&view.predicted, grey)),
            picture("difference", difference(&view.truth, &view.predicted)),
            picture(
                "its worst part, six times closer",
                closer_look(&view.truth, &view.predicted),
            ),
        ],
    })
}

fn polytopes(report: &Report<'_>) -> Markup {
    let pictures: Vec<Picture> = report
        .measured
        .polytopes
        .iter()
        .filter_map(|level| {
            let image = polytope_picture(level, report.model, report.asset.map.center).ok()?;
            let label = level.label.clone();
            Some(Picture { label, image })
        })
        .collect();
    if pictures.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "The polytope of views" }
            (picture_row(&PictureRow {
                caption: "The corners are viewpoints, the model is in the middle. Between the corners of a triangle the outline is \
                          interpolated: where it changes slowly, triangles can be large.".to_owned(),
                pictures,
            }))
        }
    }
}

/// How an outline is stored and read: the contour generator, and spans along epipolar lines.
fn inside(report: &Report<'_>) -> Markup {
    let map = &report.asset.map;
    let generator = telling_view(map)
        .and_then(|view| contour_generator_pictures(view, map, report.model).ok())
        .unwrap_or_default();
    let epipolar = epipolar_pictures(map, Method::best_for(map));
    html! {
        section {
            h2 { "How it works" }
            @if !generator.is_empty() {
                h3 { "A contour in space" }
                (picture_row(&PictureRow {
                    caption: "One captured contour, each vertex at its stored depth: the curve on the model where its surface turns \
                              away from the view. Red bounds the model, blue its holes, fainter behind the model; thin lines \
                              join parts that lie behind each other.".to_owned(),
                    pictures: generator,
                }))
            }
            @if let Some((drawings, [one, two])) = epipolar {
                h3 { "A pair of views, plane by plane" }
                figure {
                    div.panels { @for svg in drawings { (PreEscaped(svg)) } }
                    figcaption {
                        "The contours of views " (one) " and " (two) " rectified: equal height is the same epipolar plane, in \
                         which the spans of both views bound those of every view between them. First, second and further \
                         spans of a line have colours of their own."
                    }
                }
            }
        }
    }
}

/// Pictures with fewer columns than this are enlarged without smoothing: their pixels are what they show.
const SHARP_BELOW_PX: u32 = 128;

fn picture_row(row: &PictureRow) -> Markup {
    html! {
        figure {
            div.row {
                @for picture in &row.pictures {
                    div {
                        img.closer[picture.image.width < SHARP_BELOW_PX]
                            alt=(format!("{}: {}", row.caption, picture.label))
                            width=(picture.image.width) height=(picture.image.height)
                            src=(png::data_url(&picture.image));
                        span { (picture.label) }
                    }
                }
            }
            figcaption { (row.caption) }
        }
    }
}

#[cfg(test)]
mod tests;
