//! From a closed mesh to an asset: the outline of the paper, as code.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, section 3; each stage's own file names its section.
//! Deviation: contour vertices have depths, which the paper does not have.

use std::time::Instant;

use glam::Vec3;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::{
    ClosedMesh, HiddenParts, Photograph, SeenSilhouette, TriangleMesh, without_hidden_parts,
};
use silmap_map::simplified_polytope::{contour_radius, is_readable};
use silmap_map::{Asset, CoarseHull, Placement, SilhouetteMap, TextureSet, asset};

pub use crate::build_error::BuildError;
pub use crate::build_params::BuildParams;
pub use crate::captured::Captured;
pub use crate::gaps::{Gaps, capture_around};
use crate::progress::PrepWarning;
pub use crate::record::model_crc32;
use crate::record::record;
use crate::simplify_contour::add_levels;
use crate::simplify_map::{SimplifyMapReport, simplify};
use crate::texture::{self, TextureParams};
use silmap_geometry::watch::Watch;
use silmap_hull::{self as hull, HullError, VerifyParams, VerifyReport};

/// Seconds that each stage took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Drawing the views.
    pub capture: f64,
    /// Tracing and simplifying outlines, and finding their depths.
    pub contours: f64,
    /// Choosing the views to keep.
    pub map: f64,
    /// Collapsing to the hull.
    pub hull: f64,
    /// Taking and placing the textures.
    pub textures: f64,
}

/// What building found out.
#[derive(Clone, Debug)]
pub struct BuildReport {
    /// Views captured.
    pub views: u32,
    /// Views kept, the error curve, and the errors over all captured views.
    pub map: SimplifyMapReport,
    /// Whether the hull, as it is stored, encloses the model.
    pub hull_check: VerifyReport,
    /// Seconds of each stage.
    pub seconds: StageSeconds,
    /// What was odd.
    pub warnings: Vec<PrepWarning>,
}

/// What is known of a model besides its mesh.
#[derive(Clone, Debug, Default)]
pub struct Photographed {
    /// Its silhouettes as photographs show them; they become views of the map.
    pub silhouettes: Vec<SeenSilhouette>,
    /// The photographs themselves, their cameras in the model's coordinates; its textures are made of them.
    pub photographs: Vec<Photograph>,
    /// A mesh around it that has room for the silhouettes where they stray beyond it; the hull is made around this.
    pub wider: Option<ClosedMesh>,
}

/// Makes the asset of a model, rounded as its file will be.
///
/// # Errors
/// When interrupted, the view sphere is too small, the model is too thin to be seen, or a stage fails.
pub fn build(
    model: &ClosedMesh,
    name: &str,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<(Asset, BuildReport), BuildError> {
    build_photographed(model, &Photographed::default(), name, params, watch)
}

/// As [`build`], of a model that was photographed: its mesh closes what photographs leave open.
///
/// # Errors
/// As [`build`].
pub fn build_photographed(
    model: &ClosedMesh,
    seen: &Photographed,
    name: &str,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<(Asset, BuildReport), BuildError> {
    let mut seconds = StageSeconds::default();
    // What no eye can see costs nothing; the record is of the whole.
    let whole = model;
    let cleared = without_unseen(whole, params);
    let model = cleared.as_ref().map_or(whole, |(seen, _)| seen);
    let tree = Bvh::new(model.mesh());

    // The silhouettes from many viewpoints, on the polytope that connects them.
    let captured = timed(&mut seconds.capture, || {
        capture_around(
            model,
            &seen.silhouettes,
            params,
            (Gaps::Drawn, &|_| true),
            watch,
        )
    })?;
    let captured = match params.map.candidates() {
        Some(count) if captured.seen.is_empty() => {
            captured.with_candidates(count, model.bounds(), watch)?
        }
        _ => captured,
    };
    let dense = timed(&mut seconds.contours, || {
        captured.map(model, &tree, params, watch)
    })?;
    check_readable(&dense, params)?;
    let Captured { masks, unused, .. } = captured;
    let views = masks.len() as u32;

    // Views that their neighbours predict well go.
    let (mut map, map_report) = timed(&mut seconds.map, || {
        simplify(&dense, &masks, &params.map, watch)
    })?;
    drop(masks);
    // Coarser contours for pictures in which the model is small.
    timed(&mut seconds.contours, || add_levels(&mut map));

    // A coarse mesh around the model, and pictures to put on it.
    let hull = timed(&mut seconds.hull, || {
        hull_around((model, &tree), seen, params, watch)
    })?;
    let textures = timed(&mut seconds.textures, || {
        texture::bake_photographed(
            (model, &tree),
            &hull,
            &seen.photographs,
            &params.textures,
            watch,
        )
    })?;

    let hull_check = timed(&mut seconds.hull, || check_hull(model, &hull, params));

    let hidden = cleared
        .as_ref()
        .map(|&(_, hidden)| PrepWarning::HiddenParts(hidden));
    let mut warnings: Vec<PrepWarning> = hidden.into_iter().collect();
    let not_used = unused.into_iter().map(|(silhouette, reason)| {
        let name = |k: usize| seen.silhouettes[k].name.clone();
        PrepWarning::SilhouetteNotUsed {
            name: name(silhouette),
            reason,
            other: reason.other().map(name),
        }
    });
    warnings.extend(not_used);
    warnings.extend(map_stalled(params, &map_report));
    warnings.extend(hull_warnings(params, (&hull, &hull_check), &textures));
    let asset = asset::quantise(&Asset {
        record: record(whole.mesh(), name, (params, views), &map_report),
        map,
        hull,
        textures,
        placement: Placement::at(model.origin()),
    })?;
    let report = BuildReport {
        views,
        map: map_report,
        hull_check,
        seconds,
        warnings,
    };
    Ok((asset, report))
}

fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let since = Instant::now();
    let result = work();
    *seconds += since.elapsed().as_secs_f64();
    result
}

/// The model without what no eye outside can see, and what that was; `None` where all of it is built.
#[must_use]
pub fn without_unseen(
    model: &ClosedMesh,
    params: &BuildParams,
) -> Option<(ClosedMesh, HiddenParts)> {
    (!params.keep_cavities)
        .then(|| without_hidden_parts(model))
        .flatten()
}

/// The coarse hull of a model, or of what is around it where that has room for more.
pub(crate) fn hull_around(
    (model, tree): (&ClosedMesh, &Bvh),
    seen: &Photographed,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<CoarseHull, HullError> {
    let wider = seen.wider.as_ref();
    let sequence = hull::build(wider.unwrap_or(model), &params.hull, watch)?;
    let faces = params.hull.target_faces as usize;
    let level = sequence.tightened_level(faces, params.tightening, watch)?;
    let rounded = level.round();
    let mut hull = CoarseHull {
        positions: rounded.positions,
        faces: rounded.faces,
        surface_points: rounded.surface_points,
        volume_ratio: rounded.volume_ratio,
    };
    if let Some(wider) = wider {
        about_model(&mut hull, (model, tree), wider);
    }
    Ok(hull)
}

/// Makes sure that the model can be looked at from all places of the polytope.
fn check_readable(dense: &SilhouetteMap, params: &BuildParams) -> Result<(), BuildError> {
    let eye = |v: u32| dense.views[v as usize].camera.eye - dense.center;
    let radius = contour_radius(dense);
    if (dense.triangles.iter()).all(|t| is_readable(t.map(eye), radius)) {
        return Ok(());
    }
    Err(BuildError::TooFewViews {
        views: params.views,
        radius_rel: params.view_radius_rel,
    })
}

/// Makes the hull of a wider mesh that of the model.
fn about_model(hull: &mut CoarseHull, (model, tree): (&ClosedMesh, &Bvh), wider: &ClosedMesh) {
    for point in &mut hull.surface_points {
        let (closest, _, _) = tree.closest_point(Vec3::from(*point).as_dvec3());
        *point = closest.as_vec3().to_array();
    }
    hull.volume_ratio *= wider.mesh().volume() / model.mesh().volume();
}

/// Looks whether the hull in single precision encloses the model, or the model an inner one.
pub(crate) fn check_hull(
    model: &ClosedMesh,
    hull: &CoarseHull,
    params: &BuildParams,
) -> VerifyReport {
    let double = |&p: &[f32; 3]| Vec3::from(p).as_dvec3();
    let hull = TriangleMesh {
        positions: hull.positions.iter().map(double).collect(),
        faces: hull.faces.clone(),
        ..TriangleMesh::default()
    };
    let (inside, outside) = if params.hull.inner {
        (&hull, model.mesh())
    } else {
        (model.mesh(), &hull)
    };
    hull::verify(inside, outside, &VerifyParams::default())
}

/// The warning about more views than were asked for.
fn map_stalled(params: &BuildParams, map: &SimplifyMapReport) -> Option<PrepWarning> {
    let (wanted, reached) = (params.map.keep, map.kept.len() as u32);
    (params.map.max_error.is_none() && reached > wanted)
        .then_some(PrepWarning::MapStalled { wanted, reached })
}

/// What was not reached with the hull and its pictures.
pub(crate) fn hull_warnings(
    params: &BuildParams,
    (hull, check): (&CoarseHull, &VerifyReport),
    textures: &TextureSet,
) -> Vec<PrepWarning> {
    let (wanted, reached) = (params.hull.target_faces, hull.faces.len() as u32);
    let stalled = (reached > wanted).then_some(PrepWarning::HullStalled { wanted, reached });
    let escaped_rel = check.escaped_rel;
    let leaks = (!check.encloses).then_some(PrepWarning::HullLeaks { escaped_rel });
    let over_budget = over_budget(&params.textures, textures);
    [stalled, leaks, over_budget]
        .into_iter()
        .flatten()
        .collect()
}

/// The warning about pictures that have more bytes than they should.
fn over_budget(params: &TextureParams, textures: &TextureSet) -> Option<PrepWarning> {
    let wanted = params.budget_bytes?;
    let reached = texture::picture_bytes(textures);
    (reached > wanted).then_some(PrepWarning::TexturesOverBudget { wanted, reached })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::capture::Backend;
    use silmap_models as models;

    fn small_params() -> BuildParams {
        let mut params = BuildParams {
            views: 48,
            resolution_px: 64,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        params.map.keep = 20;
        params.hull.target_faces = 100;
        params.textures.views = 3;
        params.textures.size_px = 16;
        params
    }

    fn torus() -> ClosedMesh {
        ClosedMesh::try_from(models::torus(600)).unwrap()
    }

    #[test]
    fn an_asset_has_what_was_asked_for() {
        let (asset, report) = build(&torus(), "torus", &small_params(), &Watch::silent()).unwrap();
        assert_eq!(asset.map.views.len(), 20);
        assert_eq!(asset.map.triangles.len(), 2 * 20 - 4);
        assert!(asset.map.has_depth());
        assert!(asset.hull.faces.len() <= 100);
        assert_eq!(asset.textures.views.len(), 3);
        assert_eq!(asset.record.captured_views, 48);
        assert_eq!(asset.record.name, "torus");
        assert!(report.map.order.errors.mean > 0.0);
        assert_eq!(report.warnings, Vec::new());
        assert!(report.hull_check.encloses, "{:?}", report.hull_check);
        // What is in memory is what comes back from the file.
        let bytes = asset::write(&asset).unwrap();
        assert_eq!(asset::read(&bytes).unwrap(), asset);
    }

    #[test]
    fn a_hull_that_single_precision_breaks_is_said() {
        let mut far = models::torus(600);
        for position in &mut far.positions {
            *position += DVec3::splat(1e5);
        }
        let mut params = small_params();
        params.hull.target_faces = 500;
        let far = ClosedMesh::try_from(far).unwrap();
        let (_, report) = build(&far, "torus", &params, &Watch::silent()).unwrap();
        assert!(!report.hull_check.encloses, "{:?}", report.hull_check);
        let is_leak = |w: &PrepWarning| matches!(w, PrepWarning::HullLeaks { .. });
        assert!(report.warnings.iter().any(is_leak), "{:?}", report.warnings);
    }

    #[test]
    fn a_sphere_of_views_in_the_model_is_refused() {
        let params = BuildParams {
            view_radius_rel: 0.9,
            ..small_params()
        };
        let made = build(&torus(), "torus", &params, &Watch::silent());
        assert!(matches!(made, Err(BuildError::Camera(_))), "{made:?}");
    }

    #[test]
    fn a_model_thinner_than_a_pixel_is_refused() {
        let mut flat = models::torus(600);
        for position in &mut flat.positions {
            position.x *= 1e-5;
            position.y *= 1e-5;
        }
        let made = build(
            &ClosedMesh::try_from(flat).unwrap(),
            "needle",
            &small_params(),
            &Watch::silent(),
        );
        assert!(
            matches!(made, Err(BuildError::NothingSeen { .. })),
            "{made:?}"
        );
    }

    #[test]
    fn a_request_to_stop_is_heard() {
        let stop = std::sync::atomic::AtomicBool::new(true);
        let made = build(
            &torus(),
            "torus",
            &small_params(),
            &Watch::new(&|_| {}, &stop),
        );
        assert!(made.is_err());
    }
}
