//! Errors of outlines as `evaluate` prints them, whatever they are compared with.

use glam::DVec3;
use serde::Serialize;
use silmap_map::{Method, SilhouetteMap};
use silmap_measure::evaluate::{MethodErrors, Shares, ViewpointError, summarise};
use silmap_measure::{Straying, StrayingSummary};

use crate::args::EvaluateArgs;

#[derive(Serialize)]
pub(crate) struct ViewpointJson {
    eye: [f64; 3],
    method: &'static str,
    misclassified: f64,
    escaped: f64,
    /// Pixels inside the true outline, which both are shares of.
    inside_px: u64,
    /// How far the outline strays, where that is measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    deviation_px: Option<StrayingJson>,
}

/// How far the outline strays from the exact one; distances are null where there is no outline.
#[derive(Serialize)]
struct StrayingJson {
    mean: f64,
    p99: f64,
    largest: f64,
    /// Where the largest is in the picture: on one of the outlines.
    at: [f64; 2],
    /// The nearest point to it on the other.
    nearest: [f64; 2],
}

impl From<Straying> for StrayingJson {
    fn from(s: Straying) -> Self {
        Self {
            mean: s.mean_px,
            p99: s.p99_px,
            largest: s.largest_px,
            at: s.place.to_array(),
            nearest: s.nearest.to_array(),
        }
    }
}

/// The errors of a method that outlines were compared with a model by.
#[derive(Serialize)]
pub(crate) struct MethodJson {
    #[serde(flatten)]
    shares: Shares,
    #[serde(skip_serializing_if = "Option::is_none")]
    deviation_px: Option<StrayingSummary>,
}

impl From<&MethodErrors> for MethodJson {
    fn from(errors: &MethodErrors) -> Self {
        Self {
            shares: errors.shares,
            deviation_px: errors.straying,
        }
    }
}

impl ViewpointJson {
    /// In coordinates about the origin of which the errors' are.
    pub(crate) fn new(e: &ViewpointError, origin: DVec3) -> Self {
        Self {
            eye: (e.eye + origin).to_array(),
            method: e.method.name(),
            misclassified: e.misclassified,
            escaped: e.escaped,
            inside_px: e.inside_px,
            deviation_px: e.straying.map(StrayingJson::from),
        }
    }
}

/// The methods to measure.
pub(crate) fn methods_of(args: &EvaluateArgs, map: &SilhouetteMap) -> Vec<Method> {
    args.method.map_or_else(
        || Method::all_for(map).collect(),
        |method| vec![method.into()],
    )
}

/// The errors of each method that was measured.
pub(crate) fn of_methods(errors: &[ViewpointError]) -> Vec<(&'static str, MethodErrors)> {
    let methods = summarise(errors).into_iter();
    methods.map(|m| (m.method.name(), m)).collect()
}

/// Their shares.
pub(crate) fn shares_of(methods: &[(&'static str, MethodErrors)]) -> Vec<(&'static str, Shares)> {
    methods.iter().map(|(name, m)| (*name, m.shares)).collect()
}

/// The column of methods.
pub(crate) const METHOD: &str = "method  ";

/// What was measured where, by what the column is of.
pub(crate) fn table(place: &str, column: &str, rows: &[(&'static str, Shares)]) -> String {
    let width = column.len();
    let mut text = format!(
        "{place}; shares of the pixels inside the true outline\n\
         {column} misclassified mean  median   worst   escaped mean   worst\n",
    );
    for (name, shares) in rows {
        text.push_str(&format!(
            "{name:<width$} {:>17.3} % {:>6.3} % {:>5.2} % {:>12.4} % {:>5.2} %\n",
            100.0 * shares.misclassified_mean,
            100.0 * shares.misclassified_median,
            100.0 * shares.misclassified_max,
            100.0 * shares.escaped_mean,
            100.0 * shares.escaped_max,
        ));
    }
    text
}

/// How far outlines stray in pictures of so many pixels a side, for the methods of which that was measured; empty where of none.
pub(crate) fn straying_table(size_px: u32, methods: &[(&'static str, MethodErrors)]) -> String {
    let width = METHOD.len();
    let mut text = String::new();
    for (name, errors) in methods {
        let Some(off) = errors.straying else {
            continue;
        };
        if text.is_empty() {
            text = format!(
                "distances between the outline and the true one, both ways, pixels of {size_px} × {size_px}\n\
                 {METHOD}  mean   99 %, median eye   largest, median eye   nine of ten eyes   worst eye\n",
            );
        }
        text.push_str(&format!(
            "{name:<width$} {:>5.2} {:>18.1} {:>21.1} {:>18.1} {:>11.1}\n",
            off.mean, off.p99_median, off.largest_median, off.largest_p90, off.largest,
        ));
    }
    text
}
