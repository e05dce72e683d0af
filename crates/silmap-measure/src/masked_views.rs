//! How far interpolated outlines are from the masks of photographs, at the photographs' own cameras.
//!
//! The same shares as [`crate::evaluate`] measures against a model: pixels whose inside or outside is wrong, over the mask's; and those of
//! the mask that are predicted outside. What a mask says nothing of counts nowhere. How far outlines stray is not measured: the outline of a
//! mask is not known to a pixel, and ends where the mask says nothing.

use rayon::prelude::*;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, Loop, Mask, Watch};
use silmap_map::{Interpolation, MapReader, SilhouetteMap};

use crate::evaluate::{EVALUATE, EvaluateError, EvaluateParams, ViewpointError, compare};

/// From loops of the image that is interpolated for to those of the mask.
pub type PlaceLoops<'a> = dyn Fn(&[Loop]) -> Vec<Loop> + Sync + 'a;

/// A photograph's camera and mask.
#[derive(Clone, Copy)]
pub struct MaskedView<'a> {
    /// What outlines are interpolated for, in the map's coordinates.
    pub camera: Camera,
    /// Where they lie in the mask.
    pub place: &'a PlaceLoops<'a>,
    /// The object's pixels.
    pub mask: &'a Mask,
    /// The pixels of which the mask says something; all of them without.
    pub known: Option<&'a Mask>,
}

impl std::fmt::Debug for MaskedView<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MaskedView")
            .field("camera", &self.camera)
            .finish_non_exhaustive()
    }
}

/// The error of one method at one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskError {
    /// Index of the view.
    pub view: usize,
    /// The shares.
    pub error: ViewpointError,
    /// Pixels of both over pixels of either.
    pub overlap: f64,
}

/// Measures interpolated outlines against masks: per view, in their order and that of the methods. Of `params` the methods, the transfer
/// and the detail count.
///
/// # Errors
/// When interrupted, when nothing is asked for, or when the map is broken.
pub fn evaluate_masks(
    map: &SilhouetteMap,
    views: &[MaskedView<'_>],
    params: &EvaluateParams,
    watch: &Watch<'_>,
) -> Result<Vec<MaskError>, EvaluateError> {
    if views.is_empty() || params.methods.is_empty() {
        return Err(EvaluateError::Nothing);
    }
    let prepared = MapReader::new(map)?;
    watch.start(EVALUATE, views.len() as u64);
    let per_view: Vec<Vec<MaskError>> = (views.par_iter().enumerate())
        .map_init(
            || prepared.clone(),
            |reader, (number, view)| {
                watch.check()?;
                let errors = errors_at(view, map, params, reader)?;
                watch.advance(EVALUATE, 1);
                Ok(errors
                    .into_iter()
                    .map(|e| MaskError { view: number, ..e })
                    .collect())
            },
        )
        .collect::<Result<_, EvaluateError>>()?;
    watch.finish(EVALUATE);
    Ok(per_view.into_iter().flatten().collect())
}

fn errors_at(
    view: &MaskedView<'_>,
    map: &SilhouetteMap,
    params: &EvaluateParams,
    reader: &mut MapReader,
) -> Result<Vec<MaskError>, EvaluateError> {
    let mut truth = view.mask.clone();
    if let Some(known) = view.known {
        truth.intersect(known);
    }
    let mut errors = Vec::with_capacity(params.methods.len());
    for &method in &params.methods {
        let how = Interpolation {
            method,
            transfer: params.transfer,
            detail: params.detail,
        };
        let outline = silmap_map::outline(map, &view.camera, how, reader)?;
        let mut predicted = Mask::new(truth.width(), truth.height());
        fill_even_odd((view.place)(outline.simple_loops()), &mut predicted);
        if let Some(known) = view.known {
            predicted.intersect(known);
        }
        let (misclassified, escaped) = compare(&predicted, &truth);
        let missed = truth.count_missing_in(&predicted);
        let either = predicted.count() + missed;
        errors.push(MaskError {
            view: 0,
            error: ViewpointError {
                eye: view.camera.eye,
                method,
                misclassified,
                escaped,
                inside_px: truth.count(),
                straying: None,
            },
            overlap: (truth.count() - missed) as f64 / either.max(1) as f64,
        });
    }
    Ok(errors)
}
