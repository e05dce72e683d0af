//! `silmap evaluate CAPTURE --leave-one-out`: how well the other views of a capture predict each.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use serde::Serialize;
use silmap_capture::{Capture, CarveParams, median};
use silmap_measure::{LeaveOneOutParams, LeftOutError, Predictor, leave_one_out};
use silmap_preprocess::capture::{Backend, CaptureParams};
use silmap_preprocess::pipeline::BuildParams;

use crate::args::EvaluateArgs;
use crate::commands::captured;
use crate::files::{load_model_with, load_options};
use crate::progress::Progress;
use crate::{machine, output};

/// Above so many views only every fourth is left out.
const MANY_VIEWS: usize = 100;

#[derive(Serialize)]
struct LeaveOneOutJson<'a> {
    capture: &'a Path,
    /// Views with a mask.
    views: usize,
    /// Views that were left out in turn.
    left_out: usize,
    /// Side of the map's pictures, pixels.
    resolution: u32,
    methods: BTreeMap<&'static str, ErrorsJson>,
    per_view: Vec<ViewJson<'a>>,
    seconds: f64,
    peak_bytes: Option<u64>,
}

/// Shares of the pixels inside the left-out mask.
#[derive(Clone, Copy, Serialize)]
struct ErrorsJson {
    misclassified_mean: f64,
    misclassified_median: f64,
    misclassified_max: f64,
    escaped_mean: f64,
    escaped_max: f64,
}

#[derive(Serialize)]
struct ViewJson<'a> {
    view: &'a str,
    method: &'static str,
    misclassified: f64,
    escaped: f64,
    /// How much of the outline rests on photographs; null where it is not interpolated.
    covered: Option<f64>,
}

/// Leaves the views of a capture out in turn and prints how well the others predict them.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let started = Instant::now();
    let capture = captured::read(&args.asset, args.masks.options())?;
    let named = || capture.path.display().to_string();
    let truth = (args.model.as_ref())
        .map(|model| load_model_with(model, &load_options(args.mending)))
        .transpose()?;
    let usual = match capture.views.len() > MANY_VIEWS {
        true => 4,
        false => 1,
    };
    let every = args.every.map_or(usual, |every| every as usize);
    let resolution_px = captured::fitting_resolution_px(&capture);
    let params = LeaveOneOutParams {
        every,
        carve: CarveParams::default(),
        build: BuildParams {
            resolution_px,
            capture: CaptureParams {
                backend: Backend::Cpu,
                ..CaptureParams::default()
            },
            ..BuildParams::default()
        },
        truth: truth.map(|model| model.mesh),
    };
    let errors = Progress::new()
        .watch(|watch| leave_one_out(&capture, &params, watch))
        .with_context(named)?;
    let rows: Vec<(Predictor, ErrorsJson)> = (Predictor::ALL.into_iter())
        .filter_map(|p| Some((p, summary(&errors, p)?)))
        .collect();
    let left_out = capture.views.len().div_ceil(every);
    if args.output.json {
        return output::print_json(&LeaveOneOutJson {
            capture: &capture.path,
            views: capture.views.len(),
            left_out,
            resolution: resolution_px,
            methods: rows.iter().map(|(p, row)| (p.name(), *row)).collect(),
            per_view: errors.iter().map(|e| view_json(&capture, e)).collect(),
            seconds: started.elapsed().as_secs_f64(),
            peak_bytes: machine::peak_bytes(None),
        });
    }
    output::print_bytes(table(&capture, left_out, &rows).as_bytes())
}

fn view_json<'a>(capture: &'a Capture, error: &LeftOutError) -> ViewJson<'a> {
    ViewJson {
        view: &capture.views[error.view].name,
        method: error.predictor.name(),
        misclassified: error.misclassified,
        escaped: error.escaped,
        covered: error.covered,
    }
}

fn summary(errors: &[LeftOutError], predictor: Predictor) -> Option<ErrorsJson> {
    let of_it = || errors.iter().filter(|e| e.predictor == predictor);
    let misclassified = || of_it().map(|e| e.misclassified);
    let escaped = || of_it().map(|e| e.escaped);
    let count = of_it().count().max(1) as f64;
    Some(ErrorsJson {
        misclassified_mean: misclassified().sum::<f64>() / count,
        misclassified_median: median(misclassified())?,
        misclassified_max: misclassified().fold(0.0, f64::max),
        escaped_mean: escaped().sum::<f64>() / count,
        escaped_max: escaped().fold(0.0, f64::max),
    })
}

fn table(capture: &Capture, left_out: usize, rows: &[(Predictor, ErrorsJson)]) -> String {
    let mut text = format!(
        "{left_out} of {} views left out in turn, each predicted from the rest; shares of the pixels inside\n\
         predicted by  misclassified mean  median   worst   escaped mean   worst\n",
        capture.views.len()
    );
    for (predictor, row) in rows {
        text.push_str(&format!(
            "{:<13} {:>17.3} % {:>6.3} % {:>5.2} % {:>12.3} % {:>5.2} %\n",
            predictor.name(),
            100.0 * row.misclassified_mean,
            100.0 * row.misclassified_median,
            100.0 * row.misclassified_max,
            100.0 * row.escaped_mean,
            100.0 * row.escaped_max,
        ));
    }
    text
}
