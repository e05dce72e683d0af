//! Errors of outlines as `evaluate` prints them, whatever they are compared with.

use glam::DVec3;
use serde::Serialize;
use silmap_map::{Method, SilhouetteMap};
use silmap_measure::evaluate::{Shares, ViewpointError, summarise};

use crate::args::EvaluateArgs;

#[derive(Serialize)]
pub(crate) struct ViewpointJson {
    eye: [f64; 3],
    method: &'static str,
    misclassified: f64,
    escaped: f64,
    /// Pixels inside the true outline, which both are shares of.
    inside_px: u64,
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
pub(crate) fn of_methods(errors: &[ViewpointError]) -> Vec<(&'static str, Shares)> {
    let methods = summarise(errors).into_iter();
    methods.map(|m| (m.method.name(), m.shares)).collect()
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
