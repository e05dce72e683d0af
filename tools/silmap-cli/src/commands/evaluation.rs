//! Errors of outlines as `evaluate` prints them, whatever they are compared with.

use glam::DVec3;
use serde::Serialize;
use silmap_map::{Method, SilhouetteMap};
use silmap_measure::evaluate::{MethodErrors, ViewpointError};

use crate::args::EvaluateArgs;

/// Shares of the pixels inside the true outline.
#[derive(Serialize)]
pub(crate) struct MethodJson {
    misclassified_mean: f64,
    misclassified_median: f64,
    misclassified_max: f64,
    escaped_mean: f64,
    escaped_max: f64,
}

#[derive(Serialize)]
pub(crate) struct ViewpointJson {
    eye: [f64; 3],
    method: &'static str,
    misclassified: f64,
    escaped: f64,
    /// Pixels inside the true outline, which both are shares of.
    inside_px: u64,
}

impl From<&MethodErrors> for MethodJson {
    fn from(m: &MethodErrors) -> Self {
        Self {
            misclassified_mean: m.misclassified_mean,
            misclassified_median: m.misclassified_median,
            misclassified_max: m.misclassified_max,
            escaped_mean: m.escaped_mean,
            escaped_max: m.escaped_max,
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

/// What was measured at so many viewpoints of some place.
pub(crate) fn table(count: usize, place: &str, methods: &[MethodErrors]) -> String {
    let mut text = format!(
        "{count} {place}; shares of the pixels inside the true outline\n\
         method   misclassified mean  median   worst   escaped mean   worst\n",
    );
    for m in methods {
        text.push_str(&format!(
            "{:<8} {:>17.3} % {:>6.3} % {:>5.2} % {:>12.4} % {:>5.2} %\n",
            m.method.name(),
            100.0 * m.misclassified_mean,
            100.0 * m.misclassified_median,
            100.0 * m.misclassified_max,
            100.0 * m.escaped_mean,
            100.0 * m.escaped_max,
        ));
    }
    text
}
