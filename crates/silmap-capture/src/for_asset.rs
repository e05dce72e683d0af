//! What an asset is built with of a capture besides its carved hull: colours and silhouettes of its photographs, room for these, and how fine
//! they are.

use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{ClosedMesh, SeenSilhouette, camera};

use crate::carve::{CarveError, Carved, carve_wider};
use crate::gains::{GainRange, even_out};
use crate::paint::{Painted, paint};
use crate::photographs::{ViewPhotograph, photographs};
use crate::residual::{median, quantile};
use crate::seen::seen_outlines;
use crate::view::{Capture, CaptureView, CaptureWarning};

/// The hull has room for silhouettes that stray beyond the carved one by this share of its longest side, at most.
const MOST_WIDER: f64 = 0.01;

/// Photographs keep so many pixels a side for each of a texture view's.
const PHOTOGRAPH_OVER_TEXTURE: u32 = 2;

/// A carved hull that photographs coloured.
#[derive(Clone, Debug)]
pub struct Coloured {
    /// The hull, with colours.
    pub mesh: ClosedMesh,
    /// How much of it some photograph shows.
    pub painted: Painted,
    /// The photographs, evened out.
    pub photographs: Vec<ViewPhotograph>,
    /// The factors that even them out; `None` without photographs.
    pub gains: Option<GainRange>,
}

/// Colours a carved hull by the photographs, for textures of so many pixels a side.
///
/// # Errors
/// When the caller asked to stop.
pub fn coloured(
    capture: &Capture,
    mesh: ClosedMesh,
    texture_px: u32,
    warnings: &mut Vec<CaptureWarning>,
    watch: &Watch<'_>,
) -> Result<Coloured, Interrupted> {
    let how = (mesh.origin(), PHOTOGRAPH_OVER_TEXTURE * texture_px);
    let mut photographs = photographs(capture, how, warnings, watch)?;
    let gains = if photographs.is_empty() {
        None
    } else {
        let about = (&mesh, capture);
        Some(even_out(&mut photographs, about, warnings, watch)?)
    };
    let (mesh, painted) = paint(mesh, &photographs, watch)?;
    Ok(Coloured {
        mesh,
        painted,
        photographs,
        gains,
    })
}

/// The photographs' own silhouettes, and a mesh around the carved hull that has room for those that stray beyond it.
///
/// # Errors
/// When interrupted.
pub fn silhouettes_with_room(
    capture: &Capture,
    carved: &Carved,
    watch: &Watch<'_>,
) -> Result<(Vec<SeenSilhouette>, ClosedMesh), CarveError> {
    let outlines = seen_outlines(capture, carved);
    let bounds = carved.mesh.bounds();
    let longest = (bounds.max - bounds.min).max_element();
    // Most views are enough: a few bad masks would make the hull wide.
    let beyond = quantile(outlines.iter().flatten().map(|o| o.beyond), 0.75).unwrap_or(0.0);
    let voxels = (longest / carved.voxel).ceil() as u32;
    let outward = beyond.min(MOST_WIDER * longest);
    let wider = carve_wider(capture, carved, (outward, voxels), watch)?;
    let seen = outlines.into_iter().flatten();
    Ok((seen.map(|seen| seen.silhouette).collect(), wider))
}

/// The side of pictures in which a pixel is about one of most photographs', as large as the masks are in these, pixels.
#[must_use]
pub fn fitting_resolution_px(capture: &Capture) -> u32 {
    let half_px = |view: &CaptureView| view.extent_px().map(|extent| 0.5 * extent.length());
    let usual = median(capture.views.iter().filter_map(half_px)).unwrap_or(0.0);
    let side = 2.0 * camera::FIT_MARGIN * usual;
    (side as u32).next_multiple_of(64).clamp(256, 1024)
}
