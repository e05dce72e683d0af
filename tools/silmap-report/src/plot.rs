//! Plots of series over axes, as SVG that is put into the page.
//!
//! Text and axes are drawn in two colours that the page's style sheet replaces, so that plots suit light and dark pages.

use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::coord::ranged1d::AsRangedCoord;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::palette::{self, Rgb};
use crate::scale::LogScale;
use crate::words::grouped;

/// Size of a plot in its own units; the page scales it.
pub(crate) const SIZE: (u32, u32) = (520, 340);
/// Height of text in those units.
const TEXT: f64 = 15.0;
/// The SVG back end writes sizes divided by this.
const TEXT_FACTOR: f64 = 1.24;
/// Space below and left of the axes.
pub(crate) const LABEL_AREA: (u32, u32) = (46, 78);
/// Space for half of the last label, and above the plot for each line of names of the series.
pub(crate) const MARGIN_RIGHT: u32 = 30;
const LEGEND_LINE: u32 = 22;
const MARGIN_TOP: u32 = 10;

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
    /// A line with a dot at each point.
    Dotted,
    Dashed,
    /// Small dots, as many as there are.
    Cloud,
    /// Large dots.
    Dots,
    /// Large dots with the series' name beside them.
    Labelled,
    /// A star with the series' name beside it.
    Star,
}

impl Look {
    fn has_label(self) -> bool {
        matches!(self, Self::Labelled | Self::Star)
    }
}

/// What an axis is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Evenly, from 0 to 100.
    Percent,
    /// Logarithmically, with ticks at round numbers.
    Log,
    /// Logarithmically, with ticks at powers of two where there is more than a handful.
    Log2,
}

/// An axis: a word under it, and how its ticks are written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis<'a> {
    pub(crate) name: &'a str,
    pub(crate) unit: &'a str,
    pub(crate) scale: Scale,
}

impl Axis<'_> {
    fn is_logarithmic(&self) -> bool {
        self.scale != Scale::Percent
    }
}

pub(crate) type DrawResult = Result<(), DrawingAreaErrorKind<std::io::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The plot of some series. Points that have no place on a logarithmic axis are left out.
pub(crate) fn drawn(
    title: &str,
    (x_axis, y_axis): (Axis<'_>, Axis<'_>),
    series: &[Series],
) -> String {
    let has_place = |p: &&(f64, f64)| {
        p.0.is_finite()
            && p.1.is_finite()
            && (!x_axis.is_logarithmic() || p.0 > 0.0)
            && (!y_axis.is_logarithmic() || p.1 > 0.0)
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
        if x_axis.is_logarithmic() {
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
            let has_labels = series.iter().any(|s| s.look.has_label());
            let left_room = if has_labels { LABEL_ROOM } else { ROOM };
            let ticks = match x_axis.scale {
                Scale::Log2 => powers_of_two_or(scale, (from, to)),
                _ => scale.ticks(),
            };
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

/// Ticks within a range: powers of two where it holds many, else round numbers.
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
    let legend = legend_lines(series);
    let mut chart = ChartBuilder::on(area)
        .margin_left(8)
        .margin_right(MARGIN_RIGHT)
        .margin_top(MARGIN_TOP + LEGEND_LINE * legend.len() as u32)
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
            Look::Dotted => {
                let style = colour.stroke_width(2);
                chart.draw_series(LineSeries::new(s.points.clone(), style))?;
                let dot = |&p: &(f64, f64)| Circle::new(p, 3, colour.filled());
                chart.draw_series(s.points.iter().map(dot))?;
            }
            Look::Dashed => {
                let style = colour.stroke_width(2);
                chart.draw_series(DashedLineSeries::new(s.points.clone(), 7, 5, style))?;
            }
            Look::Cloud => {
                let dot = |&p: &(f64, f64)| Circle::new(p, 2, colour.mix(0.65).filled());
                chart.draw_series(s.points.iter().map(dot))?;
            }
            Look::Dots | Look::Labelled => {
                let dot = |&p: &(f64, f64)| Circle::new(p, 5, colour.filled());
                chart.draw_series(s.points.iter().map(dot))?;
            }
            Look::Star => {
                for point in &s.points {
                    let at = chart.backend_coord(point);
                    area.draw(&Polygon::new(star(at), colour.filled()))?;
                }
            }
        }
    }
    let labelled: Vec<(&Series, (i32, i32))> = series
        .iter()
        .filter(|s| s.look.has_label())
        .flat_map(|s| s.points.iter().map(move |p| (s, *p)))
        .map(|(s, p)| (s, chart.backend_coord(&p)))
        .collect();
    for (s, at) in apart(labelled) {
        let label = text_style(s.colour).pos(Pos::new(HPos::Right, VPos::Center));
        area.draw(&Text::new(s.name.clone(), at, label))?;
    }
    draw_legend(area, &legend)
}

/// A star of five points about a place of the drawing.
fn star((x, y): (i32, i32)) -> Vec<(i32, i32)> {
    const RADIUS: f64 = 9.0;
    const INNER: f64 = 0.45;
    (0..10)
        .map(|k| {
            let (sin, cos) = (std::f64::consts::PI * f64::from(k) / 5.0).sin_cos();
            let radius = if k % 2 == 0 { RADIUS } else { INNER * RADIUS };
            let whole = |v: f64| v.round() as i32;
            (x + whole(radius * sin), y - whole(radius * cos))
        })
        .collect()
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

/// Space that a name takes in the legend, with its mark and the gap behind.
fn legend_width(name: &str) -> i32 {
    /// Mean width of a letter; wide enough for any font that a page may have.
    const LETTER: f64 = 0.56 * TEXT;
    LEGEND_MARK + (LETTER * name.chars().count() as f64) as i32 + LEGEND_GAP
}

const LEGEND_MARK: i32 = 27;
const LEGEND_GAP: i32 = 20;

/// The series that are named above the plot, where no data is, in as many lines as they need. Those with labels name themselves.
fn legend_lines(series: &[Series]) -> Vec<Vec<&Series>> {
    let room = (SIZE.0 - LABEL_AREA.1) as i32;
    let mut lines: Vec<Vec<&Series>> = Vec::new();
    let mut left = 0;
    let shown = |s: &&Series| !s.look.has_label() && !s.points.is_empty() && !s.name.is_empty();
    for s in series.iter().filter(shown) {
        let width = legend_width(&s.name);
        match lines.last_mut() {
            Some(line) if width - LEGEND_GAP <= left => line.push(s),
            _ => {
                left = room;
                lines.push(vec![s]);
            }
        }
        left -= width;
    }
    lines
}

fn draw_legend(area: &Area<'_>, lines: &[Vec<&Series>]) -> DrawResult {
    for (row, line) in (0..).zip(lines) {
        let y = 14 + row * LEGEND_LINE as i32;
        let mut x = LABEL_AREA.1 as i32 + 4;
        for s in line {
            draw_legend_entry(area, s, (x, y))?;
            x += legend_width(&s.name);
        }
    }
    Ok(())
}

fn draw_legend_entry(area: &Area<'_>, s: &Series, (x, y): (i32, i32)) -> DrawResult {
    let colour = rgb(s.colour);
    let line = |from, to| PathElement::new(vec![(from, y), (to, y)], colour.stroke_width(2));
    match s.look {
        Look::Cloud | Look::Dots => area.draw(&Circle::new((x + 10, y), 4, colour.filled()))?,
        Look::Dashed => {
            for from in [x, x + 8, x + 16] {
                area.draw(&line(from, from + 5))?;
            }
        }
        _ => area.draw(&line(x, x + 20))?,
    }
    let label = text_style(palette::INK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(s.name.clone(), (x + LEGEND_MARK, y - 1), label))
}

pub(crate) fn draw_axes<'a, 'b, X, Y>(
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
    let written = |value: f64, unit: &str| {
        // Thousands with a letter: labels are close to each other.
        if unit.is_empty() && value >= 1000.0 && value % 1000.0 == 0.0 {
            return format!("{}k", grouped((value / 1000.0) as u64));
        }
        format!("{}{unit}", rounded(value))
    };
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

pub(crate) fn rgb([r, g, b]: Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

/// Powers of ten are not exact in binary: show six digits at most.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Puts the back end's drawing under a name and lets the page scale it. Writing into a string does not fail; a plot that
/// could not be drawn is left out.
pub(crate) fn finish(title: &str, text: String, result: DrawResult) -> String {
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

    #[test]
    fn names_that_do_not_fit_go_to_a_further_line() {
        let series = |name: &str, look| Series {
            name: name.to_owned(),
            colour: palette::INK,
            points: vec![(1.0, 1.0)],
            look,
        };
        let mut all = vec![series("a", Look::Line), series("named beside", Look::Star)];
        assert_eq!(legend_lines(&all).len(), 1);
        all.extend((0..5).map(|_| series("a long name of it", Look::Dashed)));
        let lines = legend_lines(&all);
        assert_eq!(lines.iter().map(Vec::len).sum::<usize>(), 6);
        for line in &lines {
            let width: i32 = line.iter().map(|s| legend_width(&s.name)).sum();
            let room = (SIZE.0 - LABEL_AREA.1) as i32;
            assert!(width - LEGEND_GAP <= room, "{width}");
        }
    }

    #[test]
    fn labels_do_not_lie_on_each_other() {
        let places = apart(vec![("a", (5, 40)), ("b", (5, 35)), ("c", (5, 90))]);
        let rows: Vec<(&str, i32)> = places.iter().map(|p| (p.0, p.1.1)).collect();
        assert_eq!(rows, [("b", 34), ("a", 51), ("c", 89)]);
    }
}
