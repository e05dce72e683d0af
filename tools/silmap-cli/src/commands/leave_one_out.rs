//! `silmap evaluate CAPTURE --leave-one-out`: how well the other views of a capture predict each.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use serde::Serialize;
use silmap_capture::{Capture, CarveParams};
use silmap_measure::evaluate::Shares;
use silmap_measure::{LeaveOneOutParams, LeftOutError, Predictor, leave_one_out};
use silmap_preprocess::capture::{Backend, CaptureParams};
use silmap_preprocess::pipeline::BuildParams;

use crate::args::EvaluateArgs;
use crate::commands::captured;
use crate::commands::evaluation::table;
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
    /// Shares of the pixels inside the left-out mask.
    methods: BTreeMap<&'static str, Shares>,
    per_view: Vec<ViewJson<'a>>,
    seconds: f64,
    peak_bytes: Option<u64>,
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
    let resolution_px = silmap_capture::fitting_resolution_px(&capture);
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
    let shares = |predictor: Predictor| {
        let own = errors.iter().filter(|e| e.predictor == predictor);
        Shares::of(own.map(|e| (e.misclassified, e.escaped)))
    };
    let rows: Vec<(&str, Shares)> = (Predictor::ALL.into_iter())
        .filter_map(|p| Some((p.name(), shares(p)?)))
        .collect();
    let left_out = capture.views.len().div_ceil(every);
    if args.output.json {
        return output::print_json(&LeaveOneOutJson {
            capture: &capture.path,
            views: capture.views.len(),
            left_out,
            resolution: resolution_px,
            methods: rows.into_iter().collect(),
            per_view: errors.iter().map(|e| view_json(&capture, e)).collect(),
            seconds: started.elapsed().as_secs_f64(),
            peak_bytes: machine::peak_bytes(None),
        });
    }
    let place = format!(
        "{left_out} of {} views left out in turn, each predicted from the rest",
        capture.views.len()
    );
    output::print_bytes(table(&place, "predicted by ", &rows).as_bytes())
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
