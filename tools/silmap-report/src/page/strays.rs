//! How far outlines stray: a table for each place, and the farthest in pictures.

use maud::{Markup, html};
use silmap_measure::{PlaceErrors, StrayView, Straying};

use super::{picture_row, swatch};
use crate::canvas::Canvas;
use crate::stray_picture::{self, Part, closer_look, with_frame};
use crate::words::{percent, significant};
use crate::{Picture, PictureRow, Report, palette};

/// The tables of all places; nothing where that was not measured.
pub(super) fn tables(report: &Report<'_>) -> Markup {
    let is_measured = |place: &&PlaceErrors| place.methods.iter().any(|m| m.straying.is_some());
    let places: Vec<&PlaceErrors> = (report.measured.places.iter())
        .filter(is_measured)
        .collect();
    if places.is_empty() {
        return html! {};
    }
    html! {
        h3 { "How far the outline strays" }
        p {
            "Distances from the boundary of each outline, interpolated and true, to that of the other, in pixels of the same pictures. A hair \
             or a slit counts by its length here, and hardly by its area above. Of each eye: the mean, what 99 of 100 points \
             of the boundary are within, and the largest."
        }
        div.plots { @for place in places { (table(place)) } }
    }
}

fn table(place: &PlaceErrors) -> Markup {
    html! {
        div.scroll {
            table {
                caption {
                    (place.viewpoints) " eyes " (place.description) " (" code { (place.place) } ")"
                }
                thead {
                    tr {
                        th rowspan="2" { "method" }
                        th rowspan="2" { "mean, px" }
                        th rowspan="2" { "99 %, median eye" }
                        th.group colspan="3" { "largest, px" }
                    }
                    tr { th { "median eye" } th { "9 of 10 eyes" } th { "worst" } }
                }
                tbody {
                    @for row in &place.methods {
                        @if let Some(off) = row.straying {
                            tr {
                                th scope="row" { (swatch(&row.method)) (row.method) }
                                td { (format!("{:.2}", off.mean)) }
                                @for distance in [off.p99_median, off.largest_median, off.largest_p90, off.largest] {
                                    td { (pixels(distance)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A tenth of a pixel is as much as is known.
pub(super) fn pixels(distance: f64) -> String {
    if distance.is_finite() {
        format!("{distance:.1}")
    } else {
        "no outline".to_owned()
    }
}

/// The viewpoints where outlines stray farthest.
pub(super) fn views(report: &Report<'_>) -> Markup {
    if report.measured.strays.is_empty() {
        return html! {};
    }
    let of = (report.measured.places.first()).map_or("", |p| p.description.as_str());
    html! {
        section {
            h2 { "Where outlines stray farthest" }
            p {
                "Of the eyes " (of) ", those with the largest distance between the outlines, and the place where that is, six times closer. The "
                span.key style=(format!("--key:{}", palette::hex(stray_picture::PREDICTED))) { "interpolated outline is red" } ", the "
                span.key style=(format!("--key:{}", palette::hex(stray_picture::TRUE))) { "true one blue" }
                ", within the red where both agree; the black line is the distance."
            }
            @for view in &report.measured.strays {
                @if let Some(worst) = &view.sample.straying { (row(report, view, worst)) }
            }
        }
    }
}

fn row(report: &Report<'_>, view: &StrayView, worst: &Straying) -> Markup {
    let mut canvas = Canvas::new(&view.camera);
    canvas.draw_model(report.model);
    let model = canvas.finish();
    let part = Part::around(worst, (model.width, model.height));
    let (label, base) = match &view.drawn {
        Some(drawn) => ("clipped hull", drawn),
        None => ("model, for want of a graphics adapter", &model),
    };
    let look = closer_look(base, [&view.predicted, &view.truth], worst, part);
    let [x, y, z] = (view.sample.eye + report.asset.placement.in_scene)
        .to_array()
        .map(significant);
    let (base, label) = (with_frame(base.clone(), part), label.to_owned());
    let picture = |label: String, image| Picture { label, image };
    picture_row(&PictureRow {
        caption: format!(
            "Method {}: {} px at the worst place, 99 % of the boundary within {} px, {:.2} px on average; {} % misclassified; eye {x},{y},{z}",
            view.sample.method,
            pixels(worst.largest_px),
            pixels(worst.p99_px),
            worst.mean_px,
            percent(view.sample.misclassified),
        ),
        pictures: vec![
            picture("model".to_owned(), model),
            picture(label, base),
            picture(
                format!(
                    "its worst place, six times closer: {} px",
                    pixels(worst.largest_px)
                ),
                look,
            ),
        ],
    })
}
