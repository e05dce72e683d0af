//! How far off the outline is from where the eye is, against the full mesh: found beside the drawing, one viewpoint after the other.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use glam::DVec3;
use silmap_geometry::{ClosedMesh, Watch};
use silmap_map::{Asset, Method};
use silmap_measure::evaluate::{EvaluateParams, ViewpointError, evaluate_at};

/// Side of the pictures that errors are counted in, pixels.
pub(crate) const SIDE_PX: u32 = 1024;

/// What is asked.
#[derive(Clone, Debug)]
struct Question {
    eye: DVec3,
    method: Method,
    asset: Arc<Asset>,
    model: Arc<ClosedMesh>,
}

impl PartialEq for Question {
    fn eq(&self, other: &Self) -> bool {
        (self.eye, self.method) == (other.eye, other.method)
            && Arc::ptr_eq(&self.asset, &other.asset)
            && Arc::ptr_eq(&self.model, &other.model)
    }
}

/// The answer to the question that was asked last, or to one before.
#[derive(Debug, Default)]
pub(crate) struct LiveError {
    running: Option<(Question, Receiver<Option<ViewpointError>>)>,
    found: Option<(Question, Option<ViewpointError>)>,
}

impl LiveError {
    /// Asks for the error where the eye is now. Returns what is known, and whether that is of this eye.
    pub(crate) fn ask(
        &mut self,
        context: &egui::Context,
        (eye, method): (DVec3, Method),
        (asset, model): (&Arc<Asset>, &Arc<ClosedMesh>),
    ) -> Option<(ViewpointError, bool)> {
        let question = Question {
            eye,
            method,
            asset: Arc::clone(asset),
            model: Arc::clone(model),
        };
        if let Some((asked, answer)) = self.running.take() {
            match answer.try_recv() {
                Ok(found) => self.found = Some((asked, found)),
                Err(TryRecvError::Empty) => self.running = Some((asked, answer)),
                // The thread ended without an answer: there is none.
                Err(TryRecvError::Disconnected) => self.found = Some((asked, None)),
            }
        }
        let is_known = self.found.as_ref().is_some_and(|(of, _)| *of == question);
        if !is_known && self.running.is_none() {
            self.running = start(context, question);
        }
        let (_, found) = self.found.as_ref()?;
        found.map(|found| (found, is_known))
    }
}

fn start(
    context: &egui::Context,
    question: Question,
) -> Option<(Question, Receiver<Option<ViewpointError>>)> {
    let (sender, answer) = channel();
    let context = context.clone();
    let asked = question.clone();
    let thread = std::thread::Builder::new().name("error".to_owned());
    let started = thread.spawn(move || {
        let params = EvaluateParams {
            methods: vec![asked.method],
            size_px: SIDE_PX,
            with_straying: true,
            ..EvaluateParams::default()
        };
        let found = evaluate_at(
            &[asked.eye],
            &asked.asset.map,
            asked.model.mesh(),
            &params,
            &Watch::silent(),
        );
        // Nobody listens any more where the window was closed.
        let _ = sender.send(found.ok().and_then(|found| found.first().copied()));
        context.request_repaint();
    });
    started.is_ok().then_some((question, answer))
}
