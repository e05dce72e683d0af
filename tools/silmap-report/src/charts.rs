//! Plots with axes, as SVG that is put into the page: the simplification curve (figure 11 of the paper), how errors are
//! distributed, how they depend on the distance, and how many vertices contours have.
//!
//! Text and axes are drawn in two colours that the page's style sheet replaces, so that plots suit light and dark pages.

use std::collections::BTreeMap;

use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::coord::ranged1d::AsRangedCoord;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::palette::{self, Rgb};
use crate::scale::LogScale;
use crate::{Comparison, ErrorSample, MethodErrors};

/// Size of a plot in its own units; the page scales it.
const SIZE: (u32, u32) = (520, 340);
/// Height of text in those units.
const TEXT: f64 = 15.0;
/// The SVG back end writes sizes divided by this.
const TEXT_FACTOR: f64 = 1.24;
/// Room below and left of the axes.
const LABEL_AREA: (u32, u32) = (46, 78);
/// Room for half of the last label, and for the names of the series.
const MARGIN_RIGHT: u32 = 30;
const MARGIN_TOP: u32 = 32;

/// A line or cloud of points with a name.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) colour: Rgb,
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) look: Look,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    Line,
    Dashed,
    /// Small dots, as many as there are.
    Cloud,
    /// Large dots with the series' name beside them.
    Labelled,
}

/// An axis: a word under it, and how its ticks are written.
#[derive(Clone, Copy, Debug)]
struct Axis<'a> {
    name: &'a str,
    unit: &'a str,
    is_logarithmic: bool,
}

/// Views kept and mean misclassified share: the asset's own curve, that of an even spread, and the methods on the final map.
pub(crate) fn curve(
    own: &[(u32, f64)],
    uniform: Option<&[(u32, f64)]>,
    kept: u32,
    methods: &[MethodErrors],
) -> String {
    // The first removals cost next to nothing, and decades of next to nothing would take most of the plot.
    const LEAST_OF_MOST: f64 = 0.01;
    let most = (own.iter().chain(uniform.unwrap_or_default()))
        .map(|p| p.1)
        .fold(0.0, f64::max);
    let percent = |curve: &[(u32, f64)]| -> Vec<(f64, f64)> {
        curve
            .iter()
            .filter(|p| p.1 >= LEAST_OF_MOST * most)
            .map(|&(views, share)| (f64::from(views), 100.0 * share))
            .collect()
    };
    let mut series = vec![Series {
        name: "chosen by error".to_owned(),
        colour: palette::INK,
        points: percent(own),
        look: Look::Line,
    }];
    if let Some(uniform) = uniform {
        series.push(Series {
            name: "spread evenly".to_owned(),
            colour: palette::OTHER,
            points: percent(uniform),
            look: Look::Dashed,
        });
    }
    series.extend(methods.iter().map(|m| Series {
        name: m.method.clone(),
        colour: palette::of_method(&m.method),
        points: vec![(f64::from(kept), 100.0 * m.misclassified[0])],
        look: Look::Labelled,
    }));
    let x = Axis {
        name: "views kept",
        unit: "",
        is_logarithmic: true,
    };
    drawn("Simplification curve", (x, ERROR_AXIS), &series)
}

/// Methods of extraction that the crossover plot shows, and their names there: those that are the fastest somewhere, and
/// the one that all are compared with.
const CROSSING: [(&str, &str); 4] = [
    ("brute", "brute"),
    ("brute-parallel", "parallel"),
    ("cones", "cones"),
    ("dual", "dual"),
];

/// Time of extraction over the model's faces, and that of interpolation, which does not depend on them.
pub(crate) fn crossover(comparison: &Comparison) -> String {
    let time_of = |method: &str| -> Vec<(f64, f64)> {
        (comparison.levels.iter())
            .filter_map(|level| {
                let result = level.methods.iter().find(|r| r.method == method)?;
                Some((level.faces as f64, 1e6 * result.seconds_median))
            })
            .collect()
    };
    let mut series: Vec<Series> = (CROSSING.iter())
        .map(|&(method, name)| Series {
            name: name.to_owned(),
            colour: palette::of_method(method),
            points: time_of(method),
            look: Look::Line,
        })
        .collect();
    let ends = [comparison.levels.first(), comparison.levels.last()];
    series.extend(comparison.contours.last().map(|contour| {
        Series {
            name: contour.method.clone(),
            colour: palette::of_method(&contour.method),
            points: (ends.into_iter().flatten())
                .map(|level| (level.faces as f64, 1e6 * contour.seconds_median))
                .collect(),
            look: Look::Dashed,
        }
    }));
    let x = Axis {
        name: "faces",
        unit: "",
        is_logarithmic: true,
    };
    let y = Axis {
        name: "time",
        unit: " µs",
        is_logarithmic: true,
    };
    drawn("Time of extraction over resolution", (x, y), &series)
}

const ERROR_AXIS: Axis<'static> = Axis {
    name: "misclassified",
    unit: " %",
    is_logarithmic: true,
};

/// For each method: up to which error how many of the viewpoints are.
pub(crate) fn distribution(samples: &[ErrorSample]) -> String {
    let series: Vec<Series> = by_method(samples, |s| s.misclassified)
        .into_iter()
        .map(|(method, mut shares)| {
            shares.sort_by(f64::total_cmp);
            let count = shares.len() as f64;
            let point =
                |(k, share): (usize, f64)| (100.0 * (k as f64 + 0.5) / count, 100.0 * share);
            Series {
                colour: palette::of_method(&method),
                points: shares.into_iter().enumerate().map(point).collect(),
                name: method,
                look: Look::Line,
            }
        })
        .collect();
    let x = Axis {
        name: "share of the viewpoints with at most this error",
        unit: " %",
        is_logarithmic: false,
    };
    drawn("Distribution of errors", (x, ERROR_AXIS), &series)
}

/// The error of each viewpoint over its distance, which `distance` tells in radii of the bounding sphere.
pub(crate) fn by_distance(
    samples: &[ErrorSample],
    distance: impl Fn(&ErrorSample) -> f64,
) -> String {
    let series: Vec<Series> = by_method(samples, |s| (distance(s), 100.0 * s.misclassified))
        .into_iter()
        .map(|(method, points)| Series {
            colour: palette::of_method(&method),
            name: method,
            points,
            look: Look::Cloud,
        })
        .collect();
    let x = Axis {
        name: "distance from the center in radii of the bounding sphere",
        unit: "",
        is_logarithmic: true,
    };
    drawn("Error by distance", (x, ERROR_AXIS), &series)
}

/// Bars: how many views have how many contour vertices.
pub(crate) fn histogram(counts: &[usize]) -> String {
    const BINS: usize = 24;
    let most = counts.iter().copied().max().unwrap_or(0);
    let step = round_step(most.max(1) as f64 / BINS as f64);
    let bins = (most as f64 / step).floor() as usize + 1;
    let mut heights = vec![0_usize; bins];
    for &count in counts {
        heights[(count as f64 / step).floor() as usize] += 1;
    }
    let highest = heights.iter().copied().max().unwrap_or(0).max(1);
    let mut text = String::new();
    let result =
        (|| {
            let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
            let x_range = 0.0..step * bins as f64;
            let y_range = 0.0..highest as f64 * 1.05;
            let mut chart = ChartBuilder::on(&area)
                .margin_left(8)
                .margin_right(MARGIN_RIGHT)
                .margin_top(12)
                .margin_bottom(6)
                .x_label_area_size(LABEL_AREA.0)
                .y_label_area_size(LABEL_AREA.1)
                .build_cartesian_2d(x_range, y_range)?;
            draw_axes(&mut chart, ("contour vertices", ""), ("views", ""))?;
            let fill = rgb(palette::of_method("tight")).filled();
            chart.draw_series(heights.iter().enumerate().filter(|(_, n)| **n > 0).map(
                |(k, &n)| {
                    let left = k as f64 * step;
                    Rectangle::new(
                        [(left + 0.06 * step, 0.0), (left + 0.94 * step, n as f64)],
                        fill,
                    )
                },
            ))?;
            area.present()
        })();
    finish("Contour vertices of the views", text, result)
}

/// A round number not below a positive one.
fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|v| *v >= least)
        .unwrap_or(least)
        .max(1.0)
}

/// Values of the samples, by method in the order in which methods come first.
fn by_method<T>(
    samples: &[ErrorSample],
    value: impl Fn(&ErrorSample) -> T,
) -> Vec<(String, Vec<T>)> {
    let mut places = BTreeMap::new();
    let mut groups: Vec<(String, Vec<T>)> = Vec::new();
    for sample in samples {
        let place = *places.entry(sample.method.as_str()).or_insert_with(|| {
            groups.push((sample.method.clone(), Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(value(sample));
    }
    groups
}

type DrawResult = Result<(), DrawingAreaErrorKind<std::io::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The plot of some series. Points that have no place on a logarithmic axis are left out.
fn drawn(title: &str, (x_axis, y_axis): (Axis<'_>, Axis<'_>), series: &[Series]) -> String {
    let has_place = |p: &&(f64, f64)| {
        p.0.is_finite()
            && p.1.is_finite()
            && (!x_axis.is_logarithmic || p.0 > 0.0)
            && (!y_axis.is_logarithmic || p.1 > 0.0)
    };
    let series: Vec<Series> = series
        .iter()
        .map(|s| Series {
            points: s.points.iter().filter(has_place).copied().collect(),
            ..s.clone()
        })
        .collect();
    let all = || series.iter().flat_map(|s| &s.points);
    let mut text = String::new();
    let Some(y) = LogScale::around(all().map(|p| p.1)) else {
        return nothing(title);
    };
    let result = (|| {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let names = ((x_axis.name, x_axis.unit), (y_axis.name, y_axis.unit));
        let y_range = (y.from..y.to).log_scale().with_key_points(y.ticks());
        if x_axis.is_logarithmic {
            let scale = LogScale::around(all().map(|p| p.0)).unwrap_or(LogScale {
                from: 1.0,
                to: 10.0,
            });
            let (from, to) = all().fold((f64::INFINITY, 0.0_f64), |(from, to), p| {
                (from.min(p.0), to.max(p.0))
            });
            // Round ticks but no wider than the data: half of a decade would be empty else.
            const ROOM: f64 = 1.15;
            const LABEL_ROOM: f64 = 1.5;
            let has_labels = series.iter().any(|s| s.look == Look::Labelled);
            let left_room = if has_labels { LABEL_ROOM } else { ROOM };
            let ticks = powers_of_two_or(scale, (from, to));
            let x_range = (from / left_room..to * ROOM)
                .log_scale()
                .with_key_points(ticks);
            draw(&area, (x_range, y_range), names, &series)?;
        } else {
            draw(&area, (0.0..100.0, y_range), names, &series)?;
        }
        area.present()
    })();
    finish(title, text, result)
}

/// Ticks within a range: powers of two where it holds numbers of views, else round numbers.
fn powers_of_two_or(scale: LogScale, (from, to): (f64, f64)) -> Vec<f64> {
    const MANY: f64 = 30.0;
    if to >= MANY {
        (0..32)
            .map(|k| 2_f64.powi(k))
            .filter(|v| *v >= from / 1.1 && *v <= to * 1.1)
            .collect()
    } else {
        scale.ticks()
    }
}

fn draw<X, Y>(
    area: &Area<'_>,
    (x_range, y_range): (X, Y),
    ((x_name, x_unit), (y_name, y_unit)): ((&str, &str), (&str, &str)),
    series: &[Series],
) -> DrawResult
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: plotters::coord::ranged1d::ValueFormatter<f64>,
    Y::CoordDescType: plotters::coord::ranged1d::ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .margin_left(8)
        .margin_right(MARGIN_RIGHT)
        .margin_top(MARGIN_TOP)
        .margin_bottom(6)
        .x_label_area_size(LABEL_AREA.0)
        .y_label_area_size(LABEL_AREA.1)
        .build_cartesian_2d(x_range, y_range)?;
    draw_axes(&mut chart, (x_name, x_unit), (y_name, y_unit))?;
    for s in series {
        let colour = rgb(s.colour);
        match s.look {
            Look::Line => {
                chart.draw_series(LineSeries::new(s.points.clone(), colour.stroke_width(2)))?;
            }
            Look::Dashed => {
                let style = colour.stroke_width(2);
                chart.draw_series(DashedLineSeries::new(s.points.clone(), 7, 5, style))?;
            }
            Look::Cloud => {
                let dot = |&p: &(f64, f64)| Circle::new(p, 2, colour.mix(0.65).filled());
                chart.draw_series(s.points.iter().map(dot))?;
            }
            Look::Labelled => {
                let dot = |&p: &(f64, f64)| Circle::new(p, 5, colour.filled());
                chart.draw_series(s.points.iter().map(dot))?;
            }
        }
    }
    let labelled: Vec<(&Series, (i32, i32))> = series
        .iter()
        .filter(|s| s.look == Look::Labelled)
        .flat_map(|s| s.points.iter().map(move |p| (s, *p)))
        .map(|(s, p)| (s, chart.backend_coord(&p)))
        .collect();
    for (s, at) in apart(labelled) {
        let label = text_style(s.colour).pos(Pos::new(HPos::Right, VPos::Center));
        area.draw(&Text::new(s.name.clone(), at, label))?;
    }
    draw_legend(area, series)
}

/// Places for labels to the left of points, moved down where they would lie on each other.
fn apart<T>(mut labels: Vec<(T, (i32, i32))>) -> Vec<(T, (i32, i32))> {
    const LINE: i32 = 17;
    labels.sort_by_key(|l| l.1.1);
    let mut next = i32::MIN;
    for (_, (x, y)) in &mut labels {
        *x -= 10;
        *y = (*y - 1).max(next);
        next = *y + LINE;
    }
    labels
}

/// Names of the series in a line above the plot, where no data is. Those with labels name themselves.
fn draw_legend(area: &Area<'_>, series: &[Series]) -> DrawResult {
    /// Mean width of a letter; wide enough for any font that a page may have.
    const LETTER: f64 = 0.56 * TEXT;
    const MARK: i32 = 22;
    const GAP: i32 = 24;
    let y = 14;
    let mut x = LABEL_AREA.1 as i32 + 12;
    let shown =
        |s: &&Series| s.look != Look::Labelled && !s.points.is_empty() && !s.name.is_empty();
    for s in series.iter().filter(shown) {
        let colour = rgb(s.colour);
        let line = |from, to| PathElement::new(vec![(from, y), (to, y)], colour.stroke_width(2));
        match s.look {
            Look::Cloud => area.draw(&Circle::new((x + 10, y), 4, colour.filled()))?,
            Look::Dashed => {
                for from in [x, x + 8, x + 16] {
                    area.draw(&line(from, from + 5))?;
                }
            }
            _ => area.draw(&line(x, x + MARK - 2))?,
        }
        let label = text_style(palette::INK).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw(&Text::new(s.name.clone(), (x + MARK + 5, y - 1), label))?;
        x += MARK + 5 + (LETTER * s.name.chars().count() as f64) as i32 + GAP;
    }
    Ok(())
}

fn draw_axes<'a, 'b, X, Y>(
    chart: &mut ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>,
    (x_name, x_unit): (&str, &str),
    (y_name, y_unit): (&str, &str),
) -> DrawResult
where
    'b: 'a,
    X: Ranged<ValueType = f64> + plotters::coord::ranged1d::ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + plotters::coord::ranged1d::ValueFormatter<f64>,
{
    /// Of axes without ticks of their own.
    const MOST_LABELS: usize = 6;
    let written = |value: f64, unit: &str| format!("{}{unit}", rounded(value));
    chart
        .configure_mesh()
        .bold_line_style(rgb(palette::GRID).stroke_width(1))
        .light_line_style(TRANSPARENT)
        .axis_style(rgb(palette::INK).stroke_width(1))
        .label_style(text_style(palette::INK))
        .axis_desc_style(text_style(palette::INK))
        .x_desc(x_name)
        .y_desc(y_name)
        .x_labels(MOST_LABELS)
        .y_labels(MOST_LABELS)
        .x_label_formatter(&|v| written(*v, x_unit))
        .y_label_formatter(&|v| written(*v, y_unit))
        .draw()
}

fn text_style(colour: Rgb) -> TextStyle<'static> {
    let font = ("system-ui, sans-serif", TEXT * TEXT_FACTOR).into_font();
    let mut style = TextStyle::from(font);
    style.color = rgb(colour).to_backend_color();
    style
}

fn rgb([r, g, b]: Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

/// Powers of ten are not exact in binary: show six digits at most.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Puts the back end's drawing under a name and lets the page scale it. Writing into a string does not fail; a plot that
/// could not be drawn is left out.
fn finish(title: &str, text: String, result: DrawResult) -> String {
    let body = text.split_once("xmlns=\"http://www.w3.org/2000/svg\">");
    match (result, body) {
        (Ok(()), Some((_, body))) => format!(
            "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{title}\">{body}",
            SIZE.0, SIZE.1
        ),
        _ => nothing(title),
    }
}

fn nothing(title: &str) -> String {
    format!("<p>{title}: there is nothing to plot.</p>")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn method(name: &str, mean: f64) -> MethodErrors {
        MethodErrors {
            method: name.to_owned(),
            misclassified: [mean, mean, mean],
            escaped: [0.0; 2],
        }
    }

    #[test]
    fn the_curve_names_what_it_shows() {
        let own = [(1024, 0.001), (512, 0.003), (128, 0.01)];
        let methods = [method("tight", 0.004), method("hull", 0.02)];
        let alone = curve(&own, None, 128, &methods);
        let both = curve(&own, Some(&[(1024, 0.001), (128, 0.02)]), 128, &methods);
        for part in [
            "views kept",
            "misclassified",
            "tight",
            "hull",
            "chosen",
            "512",
            "1 %",
        ] {
            assert!(alone.contains(part), "{part} is missing");
        }
        assert!(both.contains("spread evenly") && !alone.contains("spread evenly"));
    }

    #[test]
    fn odd_numbers_do_not_break_it() {
        for own in [
            vec![],
            vec![(128, 0.01)],
            vec![(128, 0.0), (64, f64::NAN), (0, 0.1)],
        ] {
            let svg = curve(&own, None, 128, &[]);
            assert!(svg.ends_with("</svg>\n") || svg.ends_with("</p>"), "{svg}");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
        for counts in [vec![], vec![0], vec![7, 7, 3000]] {
            let svg = histogram(&counts);
            assert!(
                svg.contains("contour vertices") && !svg.contains("NaN"),
                "{svg}"
            );
        }
    }

    #[test]
    fn labels_do_not_lie_on_each_other() {
        let places = apart(vec![("a", (5, 40)), ("b", (5, 35)), ("c", (5, 90))]);
        let rows: Vec<(&str, i32)> = places.iter().map(|p| (p.0, p.1.1)).collect();
        assert_eq!(rows, [("b", 34), ("a", 51), ("c", 89)]);
    }

    #[test]
    fn samples_are_grouped_by_method_and_every_group_is_drawn() {
        let sample = |method: &str, misclassified: f64| ErrorSample {
            method: method.to_owned(),
            eye: [0.0; 3].into(),
            misclassified,
            escaped: 0.0,
        };
        let groups = by_method(
            &[sample("b", 1.0), sample("a", 2.0), sample("b", 3.0)],
            |s| s.misclassified,
        );
        assert_eq!(
            groups,
            [
                ("b".to_owned(), vec![1.0, 3.0]),
                ("a".to_owned(), vec![2.0])
            ]
        );
        let svg = distribution(&[
            sample("tight", 0.001),
            sample("hull", 0.1),
            sample("tight", 0.002),
            sample("hull", 0.2),
        ]);
        assert!(svg.contains("tight") && svg.contains("hull"), "{svg}");
        assert_eq!(
            svg.matches("stroke-width=\"2\"").count(),
            4,
            "two lines, two marks: {svg}"
        );
    }
}
