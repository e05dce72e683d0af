//! The page: headings, pictures, tables, and the curve.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::plot::error_curve_svg;
use crate::{MethodErrors, PictureRow, Report};

const STYLE: &str = "
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 72rem; margin: 2rem auto; padding: 0 1rem }
h1, h2 { font-weight: 600; line-height: 1.2 }
figure { margin: 1.5rem 0 }
.row { display: grid; grid-auto-flow: column; grid-auto-columns: 1fr; gap: .75rem }
.row div { text-align: center }
.row img { width: 100%; height: auto; border: 1px solid #ddd }
figcaption { color: #555 }
table { border-collapse: collapse; margin: 1rem 0 }
th, td { padding: .25rem .75rem; border-bottom: 1px solid #ddd; text-align: right }
th:first-child, td:first-child { text-align: left }
svg { max-width: 100%; height: auto }
@media (prefers-color-scheme: dark) { body { background: #1c1c1e; color: #ddd } figcaption { color: #aaa } svg { background: #fff } }
";

pub(crate) fn page(report: &Report<'_>) -> Markup {
    let asset = report.asset;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (report.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (report.title) }
                p {
                    "A hull of " (asset.hull.faces.len()) " textured triangles stands for a mesh of "
                    (asset.record.model_faces) ". Its outline is interpolated from "
                    (asset.map.views.len()) " captured silhouettes."
                }
                h2 { "Pictures" }
                @for row in &report.rows { (picture_row(row)) }
                h2 { "Errors of the outline" }
                (error_table(&report.errors))
                @if asset.record.error_curve.len() > 1 {
                    figure {
                        (PreEscaped(error_curve_svg(&asset.record.error_curve)))
                        figcaption {
                            "Mean share of misclassified pixels over all captured views, as views are removed from the map."
                        }
                    }
                }
                h2 { "Sizes" }
                (pair_table("part", "bytes", report.bytes.iter().map(|(name, n)| (name, n.to_string()))))
                h2 { "Times" }
                (pair_table("stage", "seconds", report.seconds.iter().map(|(name, s)| (name, format!("{s:.2}")))))
                @for note in &report.notes { p { (note) } }
            }
        }
    }
}

fn picture_row(row: &PictureRow) -> Markup {
    html! {
        figure {
            div.row {
                @for picture in &row.pictures {
                    div {
                        img alt=(format!("{}: {}", row.caption, picture.label))
                            src=(format!("data:image/png;base64,{}", STANDARD.encode(&picture.png)));
                        (picture.label)
                    }
                }
            }
            figcaption { (row.caption) }
        }
    }
}

fn error_table(errors: &[MethodErrors]) -> Markup {
    html! {
        table {
            tr {
                th { "method" } th { "viewpoints" }
                th { "misclassified, mean" } th { "median" } th { "worst" }
                th { "escaped, mean" } th { "worst" }
            }
            @for row in errors {
                tr {
                    td { (row.method) } td { (row.viewpoints) }
                    @for share in row.misclassified { td { (percent(share)) } }
                    @for share in row.escaped { td { (percent(share)) } }
                }
            }
        }
    }
}

fn pair_table<'a>(
    left: &str,
    right: &str,
    rows: impl Iterator<Item = (&'a String, String)>,
) -> Markup {
    html! {
        table {
            tr { th { (left) } th { (right) } }
            @for (name, value) in rows { tr { td { (name) } td { (value) } } }
        }
    }
}

/// A share with three digits behind the point: escaped pixels are counted in hundredths of a percent.
fn percent(share: f64) -> String {
    format!("{:.3} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use silmap_map::{Asset, BuildRecord, CoarseHull, SilhouetteMap, TextureSet};

    use super::*;
    use crate::Picture;

    fn asset() -> Asset {
        Asset {
            record: BuildRecord {
                model_faces: 69_674,
                error_curve: vec![(1024, 0.001), (128, 0.01)],
                ..BuildRecord::default()
            },
            map: SilhouetteMap {
                center: [0.0; 3].into(),
                radius: 1.0,
                resolution_px: 64,
                tolerance_px: 0.5,
                coverage: silmap_geometry::CoverageRule::Center,
                views: Vec::new(),
                triangles: Vec::new(),
            },
            hull: CoarseHull::default(),
            textures: TextureSet::default(),
        }
    }

    #[test]
    fn the_page_holds_what_it_was_given_and_loads_nothing() {
        let asset = asset();
        let report = Report {
            title: "A <model> & more".to_owned(),
            asset: &asset,
            bytes: vec![("map".to_owned(), 12_345)],
            seconds: vec![("capture".to_owned(), 1.5)],
            rows: vec![PictureRow {
                caption: "from the left".to_owned(),
                pictures: vec![Picture {
                    label: "clipped".to_owned(),
                    png: b"picture".to_vec(),
                }],
            }],
            errors: vec![MethodErrors {
                method: "hull".to_owned(),
                viewpoints: 7,
                misclassified: [0.0123, 0.01, 0.05],
                escaped: [0.0001, 0.002],
            }],
            notes: vec!["On a machine.".to_owned()],
        };
        let html = crate::html(&report);
        for part in [
            "A &lt;model&gt; &amp; more",
            "69674",
            "12345",
            "1.50",
            "from the left",
            "data:image/png;base64,cGljdHVyZQ==",
            "1.230 %",
            "0.010 %",
            "On a machine.",
            "<svg",
        ] {
            assert!(html.contains(part), "{part} is missing");
        }
        assert!(
            !html.contains("src=\"http") && !html.contains("href="),
            "the page loads something"
        );
    }
}
