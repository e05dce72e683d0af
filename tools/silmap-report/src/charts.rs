//! The plots about an asset: the simplification curve (figure 11 of the paper), how errors are distributed, how they depend on
//! the distance, and how many vertices contours have.

use std::collections::BTreeMap;

use plotters::prelude::*;
use silmap_measure::{ErrorSample, MethodErrors};

use crate::palette;
use crate::plot::{
    Axis, LABEL_AREA, Look, MARGIN_RIGHT, SIZE, Scale, Series, draw_axes, drawn, finish, rgb,
};

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
        scale: Scale::Log2,
    };
    drawn("Simplification curve", (x, ERROR_AXIS), &series)
}
const ERROR_AXIS: Axis<'static> = Axis {
    name: "misclassified",
    unit: " %",
    scale: Scale::Log,
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
        scale: Scale::Percent,
    };
    drawn("Distribution of errors", (x, ERROR_AXIS), &series)
}

/// The error of each viewpoint over its distance, which `distance` returns in radii of the bounding sphere.
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
        scale: Scale::Log2,
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
#[cfg(test)]
mod tests {
    use super::*;

    fn method(name: &str, mean: f64) -> MethodErrors {
        MethodErrors {
            method: name.to_owned(),
            misclassified: [mean, mean, mean],
            escaped: [0.0; 2],
            straying: None,
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
    fn samples_are_grouped_by_method_and_every_group_is_drawn() {
        let sample = |method: &str, misclassified: f64| ErrorSample {
            method: method.to_owned(),
            eye: [0.0; 3].into(),
            misclassified,
            escaped: 0.0,
            straying: None,
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
