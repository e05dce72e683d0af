//! The error curve as an SVG: views kept along a logarithmic axis, error up a logarithmic axis (figure 11 of the paper).

use std::fmt::Write;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
/// Room for the labels left, right, above and below the plot.
const MARGIN: [f64; 4] = [70.0, 20.0, 20.0, 50.0];

/// A logarithmic axis.
struct Axis {
    /// Logarithms of the values at its ends.
    from: f64,
    to: f64,
    /// Coordinates in the drawing of its ends.
    start: f64,
    end: f64,
}

impl Axis {
    /// An axis that just holds the values, which are positive.
    fn around(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Self {
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            from = from.min(value.ln());
            to = to.max(value.ln());
        }
        // A single value gets a factor of two of room.
        if to - from < 1e-9 {
            from -= 0.5 * f64::ln(2.0);
            to += 0.5 * f64::ln(2.0);
        }
        Self {
            from,
            to,
            start,
            end,
        }
    }

    fn place(&self, value: f64) -> f64 {
        self.start + (value.ln() - self.from) / (self.to - self.from) * (self.end - self.start)
    }

    /// Round values on the axis: 1, 2 and 5 times powers of ten.
    fn ticks(&self) -> Vec<f64> {
        let first = (self.from / std::f64::consts::LN_10).floor() as i32;
        let last = (self.to / std::f64::consts::LN_10).ceil() as i32;
        let slack = 1e-9;
        (first..=last)
            .flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10_f64.powi(power)))
            .filter(|v| v.ln() >= self.from - slack && v.ln() <= self.to + slack)
            .collect()
    }
}

/// The curve of (views kept, mean misclassified share). Points without error have no place on a logarithmic axis and are
/// left out; an empty curve gives an empty plot.
pub(crate) fn error_curve_svg(curve: &[(u32, f64)]) -> String {
    let points: Vec<(f64, f64)> = curve
        .iter()
        .filter(|(views, share)| *views > 0 && *share > 0.0 && share.is_finite())
        .map(|&(views, share)| (f64::from(views), 100.0 * share))
        .collect();
    let [left, right, top, bottom] = MARGIN;
    let x = Axis::around(points.iter().map(|p| p.0), left, WIDTH - right);
    let y = Axis::around(points.iter().map(|p| p.1), HEIGHT - bottom, top);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" role=\"img\" \
         font-family=\"system-ui, sans-serif\" font-size=\"13\" fill=\"#333\">"
    );
    if points.is_empty() {
        svg.push_str("</svg>");
        return svg;
    }
    let (x_end, y_end) = (WIDTH - right, HEIGHT - bottom);
    for tick in x.ticks() {
        let at = x.place(tick);
        push(
            &mut svg,
            format_args!("<path d=\"M{at:.1} {top}V{y_end}\" stroke=\"#e4e4e4\"/>"),
        );
        push(
            &mut svg,
            format_args!(
                "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>",
                y_end + 18.0
            ),
        );
    }
    for tick in y.ticks() {
        let at = y.place(tick);
        push(
            &mut svg,
            format_args!("<path d=\"M{left} {at:.1}H{x_end}\" stroke=\"#e4e4e4\"/>"),
        );
        push(
            &mut svg,
            format_args!(
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{} %</text>",
                left - 8.0,
                at + 4.0,
                rounded(tick)
            ),
        );
    }
    let line: Vec<String> = points
        .iter()
        .map(|&(views, percent)| format!("{:.1},{:.1}", x.place(views), y.place(percent)))
        .collect();
    push(
        &mut svg,
        format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#1f6fb4\" stroke-width=\"2\"/>",
            line.join(" ")
        ),
    );
    push(
        &mut svg,
        format_args!(
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">views kept</text></svg>",
            f64::midpoint(left, x_end),
            HEIGHT - 10.0
        ),
    );
    svg
}

fn push(svg: &mut String, part: std::fmt::Arguments<'_>) {
    // Writing into a string cannot fail.
    let _ = svg.write_fmt(part);
}

/// Powers of ten are not exact in binary: show six digits at most.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_the_data_are_ends_of_the_axis() {
        let axis = Axis::around([10.0, 1000.0, 100.0].into_iter(), 50.0, 250.0);
        assert!((axis.place(10.0) - 50.0).abs() < 1e-9);
        assert!((axis.place(100.0) - 150.0).abs() < 1e-9);
        assert!((axis.place(1000.0) - 250.0).abs() < 1e-9);
        let rounded: Vec<f64> = axis.ticks().into_iter().map(rounded).collect();
        assert_eq!(rounded, [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]);
    }

    #[test]
    fn odd_curves_do_not_break_it() {
        for curve in [
            vec![],
            vec![(128, 0.01)],
            vec![(128, 0.0), (64, f64::NAN), (0, 0.1)],
        ] {
            let svg = error_curve_svg(&curve);
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>"), "{svg}");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
