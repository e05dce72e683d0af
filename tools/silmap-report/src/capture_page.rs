//! A page about a capture: cameras around the hull, what was understood, and how the hull lies beside each view's mask.

use glam::{DVec2, DVec3};
use maud::{DOCTYPE, Markup, html};
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{ColourImage, Mask, TriangleMesh};

use crate::page::head;
use crate::{palette, png};

/// What the page shows.
#[derive(Clone, Debug)]
pub struct CapturePage<'a> {
    /// What it is about, a few words.
    pub title: String,
    /// What was understood of the files: what, and how.
    pub understood: Vec<(String, String)>,
    /// What was found out about the masks: what, and how.
    pub found: Vec<(String, String)>,
    /// What was odd, a sentence each.
    pub warnings: &'a [String],
    /// The carved hull, in the frame of the views.
    pub hull: &'a TriangleMesh,
    /// The views, in the order of the file.
    pub views: Vec<CapturePageView<'a>>,
}

/// A view of a capture beside the hull.
#[derive(Clone, Debug)]
pub struct CapturePageView<'a> {
    /// Its name.
    pub name: &'a str,
    /// Centre of projection.
    pub eye: DVec3,
    /// Directions of the rays through the corners of the image, around it.
    pub corners: [DVec3; 4],
    /// The mask that was read.
    pub mask: &'a Mask,
    /// The hull in the same image; `None` where a part of it lies behind the camera.
    pub hull: Option<Mask>,
    /// Intersection over union of both.
    pub overlap: Option<f64>,
    /// Pixels of the hull beside the mask, over those of the mask.
    pub outvoted: Option<f64>,
    /// Pixels of the mask beside the hull, over those of the mask.
    pub missing: Option<f64>,
    /// Why it stands out, a few words; nothing where it agrees with the rest.
    pub remark: Option<&'static str>,
}

/// The page as HTML, with all pictures in it.
#[must_use]
pub fn capture_page(page: &CapturePage<'_>) -> String {
    let mut sorted: Vec<&CapturePageView<'_>> = page.views.iter().collect();
    // What could not be compared is worst.
    let key = |view: &CapturePageView<'_>| view.overlap.unwrap_or(-1.0);
    sorted.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let colours = [palette::RIGHT, palette::TOO_MUCH, palette::TOO_LITTLE].map(palette::hex);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&page.title))
            body {
                header { h1 { (page.title) } }
                main {
                    @if !page.warnings.is_empty() {
                        section {
                            h2 { "What is odd" }
                            ul { @for warning in page.warnings { li { (warning) } } }
                        }
                    }
                    section {
                        h2 { "What was understood" }
                        (table(&page.understood))
                    }
                    section {
                        h2 { "What was found" }
                        (table(&page.found))
                    }
                    section {
                        h2 { "Cameras around the hull" }
                        p {
                            "Each camera with its name, where it looks, and the hull to scale, along the three axes of the camera file's frame. "
                            span.key style=(format!("--key:{}", palette::hex(palette::TOO_MUCH))) { "Red" }
                            " are those that disagree with the rest."
                        }
                        div.plots { @for plane in PLANES { (projection(page, plane)) } }
                    }
                    section {
                        h2 { "Each mask beside the hull" }
                        p {
                            "Worst first, cut out around the object. "
                            span.key style=(format!("--key:{}", colours[0])) { "Grey" } " is mask and hull, "
                            span.key style=(format!("--key:{}", colours[1])) { "red" }
                            " the hull alone (this view was outvoted, or the hull is too coarse), "
                            span.key style=(format!("--key:{}", colours[2])) { "blue" }
                            " the mask alone (other views carved it away)."
                        }
                        div.row { @for view in sorted { (residual(view)) } }
                    }
                }
            }
        }
    };
    markup.into_string()
}

fn table(rows: &[(String, String)]) -> Markup {
    html! {
        div.scroll {
            table {
                tbody {
                    @for (what, how) in rows {
                        tr { th scope="row" { (what) } td style="text-align:left;white-space:normal" { (how) } }
                    }
                }
            }
        }
    }
}

/// Axes to the right and up, and the one that points at the reader.
struct Plane {
    right: DVec3,
    up: DVec3,
    caption: &'static str,
}

const PLANES: [Plane; 3] = [
    Plane {
        right: DVec3::X,
        up: DVec3::Y,
        caption: "Along z: x to the right, y up.",
    },
    Plane {
        right: DVec3::X,
        up: DVec3::Z,
        caption: "Along y: x to the right, z up.",
    },
    Plane {
        right: DVec3::Y,
        up: DVec3::Z,
        caption: "Along x: y to the right, z up.",
    },
];

/// Side of a drawing, and room for names around it.
const SIDE: f64 = 440.0;
const ROOM: f64 = 46.0;

/// A camera's pyramid, as a share of the scene.
const PYRAMID: f64 = 0.045;

/// With more views only those that stand out have their name beside them, and where names would cover each other the first has; all have it under
/// the pointer.
const MOST_NAMES: usize = 60;

/// Cells of the hull's shadow, along the longer side.
const CELLS: f64 = 64.0;

fn projection(page: &CapturePage<'_>, plane: Plane) -> Markup {
    let flat = |p: DVec3| DVec2::new(p.dot(plane.right), -p.dot(plane.up));
    let points = || {
        let eyes = page.views.iter().map(|v| flat(v.eye));
        eyes.chain(page.hull.positions.iter().map(|&p| flat(p)))
    };
    let low = points().fold(DVec2::INFINITY, DVec2::min);
    let high = points().fold(DVec2::NEG_INFINITY, DVec2::max);
    let size = (high - low).max_element();
    if !(size.is_finite() && size > 0.0) {
        return html! {};
    }
    let scale = (SIDE - 2.0 * ROOM) / size;
    let extent = (high - low) * scale + DVec2::splat(2.0 * ROOM);
    let place = |p: DVec2| (p - low) * scale + DVec2::splat(ROOM);
    let middle = place(
        (page.hull.positions.iter().map(|&p| flat(p)).sum::<DVec2>())
            / page.hull.positions.len().max(1) as f64,
    );
    let names = short_names(&page.views);
    let labels = label_places(page, &names, |eye| label_place(place(flat(eye)), middle));
    html! {
        figure {
            svg.chart viewBox=(format!("0 0 {:.0} {:.0}", extent.x, extent.y)) role="img" {
                path d=(shadow(page.hull, &flat, &place)) fill=(palette::hex(palette::RIGHT)) fill-rule="evenodd" {}
                @for ((view, name), at) in page.views.iter().zip(&names).zip(&labels) {
                    @let colour = if view.remark.is_some() { palette::hex(palette::TOO_MUCH) } else { "#333333".to_owned() };
                    g stroke=(colour) fill="none" stroke-width=(if view.remark.is_some() { 1.6 } else { 0.8 }) {
                        title { (view.name) @if let Some(remark) = view.remark { ": " (remark) } }
                        path d=(pyramid(view, PYRAMID * size, |p| place(flat(p)))) {}
                    }
                    @if let Some(at) = at {
                        text x=(format!("{:.1}", at.x)) y=(format!("{:.1}", at.y + 3.0)) text-anchor="middle" font-size="9" fill=(colour) { (name) }
                    }
                }
            }
            figcaption { (plane.caption) }
        }
    }
}

/// Places of names; none where another name is already. Those of views that stand out come first.
fn label_places(
    page: &CapturePage<'_>,
    names: &[String],
    place: impl Fn(DVec3) -> DVec2,
) -> Vec<Option<DVec2>> {
    const LETTER: DVec2 = DVec2::new(5.4, 9.0);
    let mut places = vec![None; names.len()];
    let mut taken: Vec<(DVec2, DVec2)> = Vec::new();
    let has_names = page.views.len() <= MOST_NAMES;
    for is_remarkable in [true, false] {
        for (k, view) in page.views.iter().enumerate() {
            if view.remark.is_some() != is_remarkable || !(is_remarkable || has_names) {
                continue;
            }
            let at = place(view.eye);
            let half = 0.5 * DVec2::new(names[k].chars().count() as f64 * LETTER.x, LETTER.y);
            let is_free =
                |(other, size): &(DVec2, DVec2)| (at - *other).abs().cmpgt(half + *size).any();
            if is_remarkable || taken.iter().all(is_free) {
                taken.push((at, half));
                places[k] = Some(at);
            }
        }
    }
    places
}

/// Away from the hull.
fn label_place(eye: DVec2, middle: DVec2) -> DVec2 {
    const AWAY: f64 = 14.0;
    eye + AWAY * (eye - middle).normalize_or(DVec2::NEG_Y)
}

/// Names without what all of them begin with.
fn short_names(views: &[CapturePageView<'_>]) -> Vec<String> {
    const SHORT: usize = 6;
    let names: Vec<Vec<char>> = views.iter().map(|v| v.name.chars().collect()).collect();
    let shared = (0..)
        .take_while(|&k| {
            let first = names.first().and_then(|n| n.get(k));
            first.is_some() && names.iter().all(|n| n.get(k) == first && n.len() > k + 1)
        })
        .count();
    let is_short = names.iter().all(|n| n.len() <= SHORT);
    let from = if is_short || views.len() < 2 {
        0
    } else {
        shared
    };
    names.iter().map(|n| n[from..].iter().collect()).collect()
}

fn pyramid(view: &CapturePageView<'_>, reach: f64, place: impl Fn(DVec3) -> DVec2) -> String {
    let eye = place(view.eye);
    let ends = view
        .corners
        .map(|c| place(view.eye + c.normalize_or_zero() * reach));
    let mut path = String::new();
    for (k, end) in ends.iter().enumerate() {
        let next = ends[(k + 1) % 4];
        path += &format!(
            "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}",
            eye.x, eye.y, end.x, end.y, next.x, next.y
        );
    }
    path
}

/// The outline of the hull's shadow, on a coarse grid.
fn shadow(
    hull: &TriangleMesh,
    flat: &impl Fn(DVec3) -> DVec2,
    place: &impl Fn(DVec2) -> DVec2,
) -> String {
    let corners: Vec<DVec2> = hull.positions.iter().map(|&p| flat(p)).collect();
    let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = corners
        .iter()
        .copied()
        .fold(DVec2::NEG_INFINITY, DVec2::max);
    let cell = (high - low).max_element() / CELLS;
    if !(cell.is_finite() && cell > 0.0) {
        return String::new();
    }
    let cells = ((high - low) / cell).ceil().as_uvec2() + glam::UVec2::ONE;
    let mut mask = Mask::new(cells.x, cells.y);
    for face in &hull.faces {
        let [a, b, c] = face.map(|v| corners[v as usize]);
        // Points that lie closer than cells.
        let steps =
            ((a.distance(b).max(a.distance(c)).max(b.distance(c)) / cell) as u32 * 2).clamp(1, 200);
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (u, v) = (
                    f64::from(i) / f64::from(steps),
                    f64::from(j) / f64::from(steps),
                );
                let at = ((a + u * (b - a) + v * (c - a) - low) / cell).as_uvec2();
                if at.cmplt(cells).all() {
                    mask.set(at.x, at.y, true);
                }
            }
        }
    }
    let mut path = String::new();
    for points in trace_contours(&mask) {
        for (k, &p) in points.iter().enumerate() {
            let p = place(low + p * cell);
            path += &format!("{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, p.x, p.y);
        }
        path.push('Z');
    }
    path
}

/// Columns or rows of a picture, at most.
const PICTURE_PX: u32 = 220;

fn residual(view: &CapturePageView<'_>) -> Markup {
    let percent = |share: Option<f64>| {
        share.map_or_else(|| "-".to_owned(), |s| format!("{:.2} %", 100.0 * s))
    };
    let picture = overlay(view.mask, view.hull.as_ref());
    html! {
        div {
            img alt=(format!("{}: mask and hull", view.name)) width=(picture.width) height=(picture.height) src=(png::data_url(&picture));
            span {
                b { (view.name) }
                @if let Some(remark) = view.remark {
                    " " span.key style=(format!("--key:{}", palette::hex(palette::TOO_MUCH))) { (remark) }
                }
                br;
                @match view.overlap {
                    Some(overlap) => { "overlap " (format!("{overlap:.4}")) }
                    None => { "the hull reaches behind its camera" }
                }
                br;
                "outvoted " (percent(view.outvoted)) ", carved away " (percent(view.missing))
            }
        }
    }
}

/// Mask and hull over each other, cut out around both and made smaller.
fn overlay(mask: &Mask, hull: Option<&Mask>) -> ColourImage {
    let (width, height) = (mask.width(), mask.height());
    let sets = |x: u32, y: u32| {
        let at = |m: &Mask| m.get(x.into(), y.into());
        (at(mask), hull.is_some_and(at))
    };
    let (mut low, mut high) = ([width, height], [0, 0]);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if sets(x, y) != (false, false) {
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x + 1), high[1].max(y + 1)];
        }
    }
    if high[0] <= low[0] {
        (low, high) = ([0, 0], [width, height]);
    }
    let margin = (high[0] - low[0]).max(high[1] - low[1]) / 20;
    let low = low.map(|v| v.saturating_sub(margin));
    let high = [
        (high[0] + margin).min(width),
        (high[1] + margin).min(height),
    ];
    let size = [high[0] - low[0], high[1] - low[1]];
    let step = size[0].max(size[1]).div_ceil(PICTURE_PX).max(1);
    let (columns, rows) = (size[0].div_ceil(step), size[1].div_ceil(step));
    let mut rgba = Vec::with_capacity(4 * (columns * rows) as usize);
    for (column, row) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
        let mut sum = [0_u32; 4];
        let mut count = 0;
        for y in 0..step {
            for x in 0..step {
                let (x, y) = (low[0] + column * step + x, low[1] + row * step + y);
                if x >= high[0] || y >= high[1] {
                    continue;
                }
                count += 1;
                let colour = match sets(x, y) {
                    (true, true) => palette::RIGHT,
                    (false, true) => palette::TOO_MUCH,
                    (true, false) => palette::TOO_LITTLE,
                    (false, false) => continue,
                };
                for (s, c) in sum.iter_mut().zip(colour) {
                    *s += u32::from(c);
                }
                sum[3] += 1;
            }
        }
        let of = |s: u32, n: u32| (s / n.max(1)) as u8;
        rgba.extend([of(sum[0], sum[3]), of(sum[1], sum[3]), of(sum[2], sum[3])]);
        rgba.push((255 * sum[3] / count.max(1)) as u8);
    }
    ColourImage {
        width: columns,
        height: rows,
        rgba,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: u32, low: u32, high: u32) -> Mask {
        let mut mask = Mask::new(side, side);
        for y in low..high {
            mask.set_span(y, low.into(), high.into());
        }
        mask
    }

    fn view<'a>(name: &'a str, mask: &'a Mask, overlap: f64) -> CapturePageView<'a> {
        CapturePageView {
            name,
            eye: DVec3::new(3.0 * overlap, 1.0, 0.5),
            corners: [DVec3::NEG_X; 4],
            mask,
            hull: Some(square(64, 16, 50)),
            overlap: Some(overlap),
            outvoted: Some(0.0),
            missing: Some(0.1),
            remark: (overlap < 0.9).then_some("disagrees with the rest"),
        }
    }

    #[test]
    fn the_worst_view_comes_first_and_is_marked() {
        let mask = square(64, 20, 44);
        let hull = silmap_geometry::TriangleMesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..TriangleMesh::default()
        };
        let page = capture_page(&CapturePage {
            title: "A <capture>".to_owned(),
            understood: vec![("format".to_owned(), "matrices".to_owned())],
            found: Vec::new(),
            warnings: &["odd & ends".to_owned()],
            hull: &hull,
            views: vec![view("view-a1", &mask, 0.97), view("view-b2", &mask, 0.5)],
        });
        let at = |text: &str| page.find(text).unwrap();
        assert!(at("<b>view-b2</b>") < at("<b>view-a1</b>"));
        assert!(page.contains("A &lt;capture&gt;") && page.contains("odd &amp; ends"));
        assert!(!page.contains("NaN") && !page.contains("src=\"http"));
        // Names without what they share.
        assert!(page.contains(">b2</text>") && page.contains(">a1</text>"));
        assert_eq!(page.matches("<svg").count(), 3);
    }

    #[test]
    fn the_overlay_has_three_colours() {
        let picture = overlay(&square(600, 100, 300), Some(&square(600, 200, 400)));
        assert!(picture.width <= PICTURE_PX && picture.width > PICTURE_PX / 3);
        let has = |c: palette::Rgb| {
            picture
                .rgba
                .chunks_exact(4)
                .any(|p| p[..3] == c && p[3] == 255)
        };
        assert!(has(palette::RIGHT) && has(palette::TOO_MUCH) && has(palette::TOO_LITTLE));
        let none = overlay(&square(8, 2, 5), None);
        assert!(
            none.rgba
                .chunks_exact(4)
                .all(|p| p[3] == 0 || p[..3] == palette::TOO_LITTLE)
        );
    }
}
