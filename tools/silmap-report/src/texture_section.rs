//! The page's section on textures.

use maud::{Markup, html};
use silmap_measure::TextureFigures;

use crate::words::grouped;

/// Figures of merit, differences of colours and jumps, each as a table.
pub(crate) fn textures(figures: &TextureFigures) -> Markup {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let rows = [
        (
            "hull area seen by some texture view",
            percent(figures.seen_share),
        ),
        (
            "hull area that falls to the atlas",
            percent(figures.atlas_share),
        ),
        (
            "area × cosine, each face with its best view",
            percent(figures.merit),
        ),
        (
            "views that see a face",
            format!("{:.1}", figures.views_per_face),
        ),
        (
            "texels along the model's radius, views",
            format!("{:.0}", figures.view_texels_per_radius),
        ),
        (
            "the same, atlas",
            format!("{:.0}", figures.atlas_texels_per_radius),
        ),
        ("bytes of all pictures", grouped(figures.bytes)),
    ];
    html! {
        section {
            h2 { "Textures" }
            div.plots {
                div.scroll {
                    table {
                        caption { (figures.views) " texture views and an atlas of tiles" }
                        tbody {
                            @for (name, value) in rows {
                                tr { th scope="row" { (name) } td { (value) } }
                            }
                            @for (name, jumps) in &figures.discontinuities {
                                tr {
                                    th scope="row" { "of 1,000 texels of the atlas beside a jump, by " (name) }
                                    td { (format!("{jumps:.2}")) }
                                }
                            }
                        }
                    }
                }
                @if !figures.colours.is_empty() {
                    div.scroll {
                        table {
                            caption {
                                "Mean difference of colours from the full mesh, in steps of 255, inside both outlines, at "
                                (figures.viewpoints) " eyes on the view sphere"
                            }
                            thead { tr { th { "hull shows" } th { "red" } th { "green" } th { "blue" } th { "worst eye" } } }
                            tbody {
                                @for row in &figures.colours {
                                    tr {
                                        th scope="row" { (row.paint) }
                                        @for value in row.mean { td { (format!("{value:.2}")) } }
                                        td { (format!("{:.2}", row.worst)) }
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
