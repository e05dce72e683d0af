//! The epipolar decomposition of a pair of views, as plate 5 of the paper shows it (section 5.2): both silhouettes rectified,
//! so that equal height is the same epipolar plane, with the spans of some planes; and between them the interpolated
//! silhouette from halfway.

use std::fmt::Write;

use glam::DVec2;
use silmap_geometry::{Camera, Loop};
use silmap_map::epipolar::{EpipolarFrame, project};
use silmap_map::{CapturedView, MapReader, Method, SilhouetteMap};

use crate::palette;

/// Epipolar lines that are drawn.
const LINES: usize = 26;
/// Width of a panel and the margin around its contours, in the drawing's units.
const PANEL: f64 = 300.0;
const MARGIN: f64 = 8.0;
/// Space above for the panel's name.
const HEAD: f64 = 24.0;

/// Colours of the first, second, third … span of a line.
const SPANS: [palette::Rgb; 4] = [
    [0x2b, 0x86, 0xd0],
    [0xd9, 0x6a, 0x12],
    [0x2f, 0x9e, 0x5b],
    [0xc7, 0x3a, 0x82],
];

/// Rectified contours with a name.
#[derive(Clone, Debug)]
struct Panel {
    name: String,
    loops: Vec<Loop>,
}

/// The drawings of one pair, from view to view, with the numbers of the two; `None` when the map has no pair that can be
/// rectified.
pub(crate) fn epipolar_pictures(
    map: &SilhouetteMap,
    method: Method,
) -> Option<(Vec<String>, [u32; 2])> {
    let pair = telling_pair(map)?;
    let [one, two] = pair.map(|v| &map.views[v as usize]);
    let frame = EpipolarFrame::new(one.camera.eye, two.camera.eye, map.center)?;
    let mut panels = vec![
        Panel {
            name: format!("view {}", pair[0]),
            loops: rectified(&frame, &one.camera, &loops_of(one)),
        },
        Panel {
            name: format!("halfway, by method {}", method.name()),
            loops: halfway(map, &frame, [one, two], method)?,
        },
        Panel {
            name: format!("view {}", pair[1]),
            loops: rectified(&frame, &two.camera, &loops_of(two)),
        },
    ];
    panels.retain(|p| !p.loops.is_empty());
    Some((drawings(&panels), pair))
}

/// The polytope edge whose two silhouettes have most contours, and of these the longest.
fn telling_pair(map: &SilhouetteMap) -> Option<[u32; 2]> {
    let contours = |v: u32| map.views[v as usize].contours.len();
    map.triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a < b)
        .max_by(|p, q| {
            let count = |[a, b]: [u32; 2]| contours(a).min(contours(b));
            let length = |[a, b]: [u32; 2]| map.eye(a).distance(map.eye(b));
            let by_count = count(*p).cmp(&count(*q));
            by_count.then(length(*p).total_cmp(&length(*q)))
        })
}

fn loops_of(view: &CapturedView) -> Vec<Loop> {
    view.contours.iter().map(|c| c.points.clone()).collect()
}

/// Contours in the pair's frame; one that cannot be seen in it is left out.
fn rectified(frame: &EpipolarFrame, camera: &Camera, loops: &[Loop]) -> Vec<Loop> {
    let matrix = frame.epipolar_from_image(camera);
    loops
        .iter()
        .filter_map(|points| {
            let rectify = |p: &DVec2| project(matrix * p.extend(1.0));
            points.iter().map(rectify).collect()
        })
        .collect()
}

/// The interpolated silhouette from the middle of the edge.
fn halfway(
    map: &SilhouetteMap,
    frame: &EpipolarFrame,
    [one, two]: [&CapturedView; 2],
    method: Method,
) -> Option<Vec<Loop>> {
    let eye = one.camera.eye.midpoint(two.camera.eye);
    let size = (map.resolution_px, map.resolution_px);
    let camera = Camera::fit_sphere(eye, map.center, map.radius, None, size).ok()?;
    let mut scratch = MapReader::new(map).ok()?;
    let outline = silmap_map::outline(map, &camera, method, &mut scratch).ok()?;
    Some(rectified(frame, &camera, outline.simple_loops()))
}

/// Places where a horizontal line enters and leaves the region inside some loops, in order.
fn crossings(loops: &[Loop], y: f64) -> Vec<f64> {
    let mut places = Vec::new();
    for points in loops {
        for (a, b) in silmap_geometry::polygon::edges(points) {
            if (a.y <= y) != (b.y <= y) {
                places.push(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
            }
        }
    }
    places.sort_by(f64::total_cmp);
    places
}

/// One drawing for each panel, all at one scale and height; none when there is nothing to draw.
fn drawings(panels: &[Panel]) -> Vec<String> {
    let all = || panels.iter().flat_map(|p| &p.loops).flatten();
    let low = all().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let high = all().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    let extent = (high - low).max_element();
    if extent.is_finite() && extent > 0.0 {
        let draw = |panel| drawing(panel, low, high);
        panels.iter().map(draw).collect()
    } else {
        Vec::new()
    }
}

/// A panel whose contours lie between two corners.
fn drawing(panel: &Panel, low: DVec2, high: DVec2) -> String {
    let scale = (PANEL - 2.0 * MARGIN) / (high - low).max_element();
    let height = HEAD + (high.y - low.y) * scale + 2.0 * MARGIN;
    let middle = f64::midpoint(low.x, high.x);
    let place = |p: DVec2| {
        DVec2::new(
            0.5 * PANEL + (p.x - middle) * scale,
            HEAD + MARGIN + (p.y - low.y) * scale,
        )
    };
    let (ink, grey) = (palette::hex(palette::INK), palette::hex(palette::RIGHT));
    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {PANEL} {height:.0}\" role=\"img\" aria-label=\"Epipolar lines of {0}\">\
         <text x=\"{1}\" y=\"16\" text-anchor=\"middle\" font-size=\"14\" fill=\"{ink}\">{0}</text><path d=\"",
        panel.name,
        0.5 * PANEL
    );
    for points in &panel.loops {
        for (i, p) in points.iter().enumerate() {
            let (at, verb) = (place(*p), if i == 0 { 'M' } else { 'L' });
            push(&mut svg, format_args!("{verb}{:.2} {:.2}", at.x, at.y));
        }
        svg.push('Z');
    }
    push(
        &mut svg,
        format_args!("\" fill=\"{grey}\" fill-opacity=\"0.25\" stroke=\"{ink}\"/>"),
    );
    let step = (high.y - low.y) / LINES as f64;
    for line in 0..LINES {
        let y = low.y + (line as f64 + 0.5) * step;
        let down = place(DVec2::new(middle, y)).y;
        push(
            &mut svg,
            format_args!(
                "<path d=\"M0 {down:.1}H{PANEL}\" stroke=\"{}\"/>",
                palette::hex(palette::GRID)
            ),
        );
        let crossings = crossings(&panel.loops, y);
        for (n, span) in crossings.chunks_exact(2).enumerate() {
            let [from, to] = [span[0], span[1]].map(|x| place(DVec2::new(x, y)).x);
            push(
                &mut svg,
                format_args!(
                    "<path d=\"M{from:.1} {down:.1}H{to:.1}\" stroke=\"{}\" stroke-width=\"2.5\"/>",
                    palette::hex(SPANS[n % SPANS.len()])
                ),
            );
        }
    }
    svg.push_str("</svg>");
    svg
}

fn push(svg: &mut String, part: std::fmt::Arguments<'_>) {
    // Writing into a string cannot fail.
    let _ = svg.write_fmt(part);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Loop {
        vec![
            DVec2::new(low, low),
            DVec2::new(high, low),
            DVec2::new(high, high),
            DVec2::new(low, high),
        ]
    }

    #[test]
    fn a_hole_parts_a_span() {
        let mut hole = square(1.0, 2.0);
        hole.reverse();
        let loops = [square(0.0, 4.0), hole];
        assert_eq!(crossings(&loops, 0.5), [0.0, 4.0]);
        assert_eq!(crossings(&loops, 1.5), [0.0, 1.0, 2.0, 4.0]);
        assert!(crossings(&loops, 5.0).is_empty());
        // A vertex on the line counts once.
        assert_eq!(crossings(&[square(0.0, 1.0)], 0.0).len() % 2, 0);
    }

    #[test]
    fn every_panel_has_a_drawing_of_its_own() {
        let panel = |name: &str| Panel {
            name: name.to_owned(),
            loops: vec![square(-0.2, 0.2)],
        };
        let drawn = drawings(&[panel("one"), panel("two")]);
        assert_eq!(drawn.len(), 2);
        assert!(drawn[0].contains(">one<") && drawn[1].contains(">two<"));
        assert!(drawn[1].contains("viewBox=\"0 0 300 324\""), "{}", drawn[1]);
        assert!(drawings(&[]).is_empty());
    }
}
