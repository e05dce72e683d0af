//! Whether the cameras of a capture are read by a convention that is not theirs: coarse hulls by other readings, and which of them agrees
//! with the masks.

use silmap_geometry::watch::{Interrupted, Stage, Watch};

use crate::carve::{CarveError, CarveParams, Carved, Trial, carve_as_read};
use crate::reading::{ALL, Misread};
use crate::view::{CameraFormat, Capture, CaptureWarning};

/// Looking for what is wrong with all cameras.
pub const READINGS: Stage = Stage("trying other readings of the cameras");

/// Masks that agree with a coarse hull at least so well are those of the cameras.
const AGREES: f64 = 0.88;

/// What a better reading leaves of the difference from one, at most.
const CLEARLY: f64 = 0.6;

/// Readings this near to the best one are as good.
const AS_GOOD: f64 = 0.006;

/// Which other reading of the cameras makes the masks agree clearly better; `None` where none does.
///
/// # Errors
/// When the caller asked to stop.
pub fn misread(capture: &Capture, watch: &Watch<'_>) -> Result<Option<Misread>, Interrupted> {
    let is_y_up = capture.format == CameraFormat::TransformsJson;
    let trial = Trial::new(&capture.views);
    watch.start(READINGS, 1 + ALL.len() as u64);
    let as_read = trial.overlap(|camera| *camera, watch)?;
    watch.advance(READINGS, 1);
    let mut found = Vec::new();
    for reading in ALL {
        let overlap = trial.overlap(|camera| reading.apply(camera, is_y_up), watch)?;
        watch.advance(READINGS, 1);
        found.push((reading, overlap));
    }
    watch.finish(READINGS);
    let best = found.iter().fold(0.0, |most: f64, f| most.max(f.1));
    if best < AGREES || 1.0 - best > CLEARLY * (1.0 - as_read) {
        return Ok(None);
    }
    let likely = found.iter().filter(|f| f.1 > best - AS_GOOD);
    Ok(Some(Misread {
        as_read,
        otherwise: best,
        likely: likely.map(|f| f.0).collect(),
    }))
}

/// Carves the hull of a capture's masks. Where little is left or it agrees badly with the masks, what may be wrong with all cameras is
/// looked for.
///
/// The result depends on the arguments alone, not on the number of threads.
///
/// # Errors
/// When interrupted, a parameter is out of range, nothing is left, or a camera is inside what is left.
pub fn carve(
    capture: &Capture,
    params: &CarveParams,
    watch: &Watch<'_>,
) -> Result<Carved, CarveError> {
    match carve_as_read(capture, params, watch) {
        Err(
            error @ (CarveError::Empty { .. }
            | CarveError::Incoherent { .. }
            | CarveError::Parallel { .. }
            | CarveError::EyeInside { .. }),
        ) => Err(match misread(capture, watch)? {
            Some(misread) => CarveError::Misread {
                error: Box::new(error),
                misread,
            },
            None => error,
        }),
        Ok(mut carved) => {
            let is_poor = |w: &CaptureWarning| matches!(w, CaptureWarning::PoorOverlap { .. });
            if carved.warnings.iter().any(is_poor) {
                carved
                    .warnings
                    .extend(misread(capture, watch)?.map(CaptureWarning::Misread));
            }
            Ok(carved)
        }
        other => other,
    }
}
