//! From a closed mesh to an asset: the outline of the paper, as code.
//!
//! Source: Gu, Gortler, Hoppe, McMillan, Brown, Stone. Silhouette Mapping. Technical Report TR-1-99, Harvard University,
//! 1999, section 3; each stage's own file names its section.
//! Deviation: depths of contour vertices, which the paper does not have, are taken for the views that are kept only.

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::{
    Camera, CameraError, ClosedMesh, CoverageRule, HiddenParts, Loop, Mask, Photograph,
    TriangleMesh, without_hidden_parts,
};
use silmap_map::{
    Asset, AssetError, BuildRecord, CapturedView, CoarseHull, Placement, SilhouetteMap, TextureSet,
    ViewContour, asset,
};
use thiserror::Error;

pub use crate::build_params::BuildParams;
use crate::capture::{Backend, CaptureError, capture, deep_contours, view_sphere};
use crate::dense_map::{self, DenseMapError, DenseMapParams};
use crate::progress::{self, PrepWarning, Unused};
use crate::recipe::Recipe;
use crate::seen::{SeenSilhouette, Viewpoints, covered, viewpoints};
use crate::simplify_contour::{SimplifyContourParams, add_levels, simplify_contours};
use crate::simplify_map::{
    SimplifyMapError, SimplifyMapReport, contour_radius, is_readable, simplify,
};
use crate::texture::{self, TextureError, TextureParams};
use silmap_geometry::trace::trace_contours;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_hull::{self as hull, HullError, VerifyParams, VerifyReport};
use silmap_mesh_io::{AlphaUse, LoadOptions};

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

/// Why there is no asset.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The view sphere does not surround the model.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A view could not be drawn.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// A captured view shows nothing: the model is thinner than a pixel.
    #[error(
        "nothing of the model is seen from view {view}: it is thinner than a pixel there; a higher resolution or coverage `any` may help"
    )]
    NothingSeen {
        /// The first such view.
        view: u32,
    },
    /// The views do not make a polytope.
    #[error(transparent)]
    DenseMap(#[from] DenseMapError),
    /// The polytope of all views cuts into what it should surround.
    #[error(
        "{views} views at {radius_rel} times the model's radius are too few: flat between them, the model cannot be looked at from \
         everywhere; more views (--views), a larger --radius or a higher --resolution help"
    )]
    TooFewViews {
        /// Views captured.
        views: u32,
        /// Radius of their sphere, in radii of the model.
        radius_rel: f64,
    },
    /// The map cannot be simplified.
    #[error(transparent)]
    SimplifyMap(#[from] SimplifyMapError),
    /// There is no hull.
    #[error(transparent)]
    Hull(#[from] HullError),
    /// The hull cannot be painted.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// The parts cannot be stored.
    #[error(transparent)]
    Asset(#[from] AssetError),
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
        Captured::all_around(model, &seen.silhouettes, params, watch)
    })?;
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
            about_model(&mut hull, (model, &tree), wider);
        }
        Ok::<_, HullError>(hull)
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
    warnings.extend(stall_warnings(params, &map_report, &hull));
    if !hull_check.encloses {
        let escaped_rel = hull_check.escaped_rel;
        warnings.push(PrepWarning::HullLeaks { escaped_rel });
    }
    warnings.extend(over_budget(&params.textures, &textures));
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

/// The silhouettes of a model from many viewpoints.
#[derive(Clone, Debug, Default)]
pub struct Captured {
    /// Where they are seen from.
    pub cameras: Vec<Camera>,
    /// The pixels that each has inside.
    pub masks: Vec<Mask>,
    /// The outlines of the first views, which photographs show, and what share of them they do. Those of all others are drawn.
    pub seen: Vec<(Vec<Loop>, f64)>,
    /// Which views have outlines: all of them where it is empty.
    needed: Vec<bool>,
    /// Photographs' silhouettes that are none of the views, by their numbers.
    pub unused: Vec<(usize, Unused)>,
}

impl Captured {
    /// The pixels that the model covers from `views` evenly spread views; all else is as `params` say.
    ///
    /// # Errors
    /// When interrupted, the view sphere is too small, or a view cannot be drawn.
    pub fn evenly(
        model: &ClosedMesh,
        params: &BuildParams,
        views: u32,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        let bounds = model.bounds();
        let distance = params.view_radius_rel * bounds.radius;
        let cameras = view_sphere(bounds, distance, views, params.resolution_px)?;
        let masks = capture(model, &cameras, &params.capture, watch)?;
        Ok(Self {
            cameras,
            masks,
            ..Self::default()
        })
    }

    /// The silhouettes that photographs show, and those that the model has where there is no photograph; of a model that nobody
    /// photographed, evenly spread ones.
    ///
    /// # Errors
    /// As [`Captured::evenly`].
    pub fn all_around(
        model: &ClosedMesh,
        silhouettes: &[SeenSilhouette],
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        if silhouettes.is_empty() {
            return Self::evenly(model, params, params.views, watch);
        }
        Self::where_needed(model, silhouettes, params, &|_| true, watch)
    }

    /// As [`Captured::all_around`], with no outlines but for cameras that are needed: the others are there for the polytope.
    ///
    /// # Errors
    /// As [`Captured::evenly`].
    pub fn where_needed(
        model: &ClosedMesh,
        silhouettes: &[SeenSilhouette],
        params: &BuildParams,
        is_needed: &dyn Fn(&Camera) -> bool,
        watch: &Watch<'_>,
    ) -> Result<Self, BuildError> {
        let Viewpoints {
            seen,
            cameras,
            unused,
        } = viewpoints(
            silhouettes,
            model.bounds(),
            (params.views, params.resolution_px),
        )?;
        let needed: Vec<bool> = cameras.iter().map(is_needed).collect();
        let empty = |camera: &Camera| Mask::new(camera.width_px, camera.height_px);
        let outline = |(camera, &k): (&Camera, &usize)| {
            let silhouette: &SeenSilhouette = &silhouettes[k];
            let loops = silhouette.outline_in(camera, params.tolerance_px);
            (loops, silhouette.photographed)
        };
        let seen: Vec<_> = cameras.par_iter().zip(&seen).map(outline).collect();
        let mut masks: Vec<Mask> = (cameras.iter().zip(&seen))
            .map(|(camera, (loops, _))| covered(loops, camera))
            .collect();
        let drawn: Vec<Camera> = (cameras.iter().zip(&needed).skip(seen.len()))
            .filter(|(_, needed)| **needed)
            .map(|(camera, _)| *camera)
            .collect();
        let mut drawn = capture(model, &drawn, &params.capture, watch)?.into_iter();
        for (camera, needed) in cameras.iter().zip(&needed).skip(seen.len()) {
            let mask = needed.then(|| drawn.next()).flatten();
            masks.push(mask.unwrap_or_else(|| empty(camera)));
        }
        Ok(Self {
            cameras,
            masks,
            seen,
            needed,
            unused,
        })
    }

    /// The map of all views, on the polytope that connects them. `tree` is over the model's faces.
    ///
    /// # Errors
    /// When interrupted, nothing of the model is seen from a view, or the views do not make a polytope.
    pub fn map(
        &self,
        model: &ClosedMesh,
        tree: &Bvh,
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<SilhouetteMap, BuildError> {
        let views = self.views(model, tree, params, watch)?;
        Ok(dense_map::build(views, &map_params(model, params))?)
    }

    /// Traces and simplifies the outline of every mask, and finds how deep the contour generator lies at its vertices.
    ///
    /// # Errors
    /// When interrupted, or nothing of the model is seen from a view.
    pub fn views(
        &self,
        model: &ClosedMesh,
        tree: &Bvh,
        params: &BuildParams,
        watch: &Watch<'_>,
    ) -> Result<Vec<CapturedView>, BuildError> {
        let simplification = SimplifyContourParams {
            tolerance_px: params.tolerance_px,
            // What is captured conservatively must stay so.
            outward_only: params.capture.coverage == CoverageRule::Any,
        };
        let is_of_photographs = !self.seen.is_empty();
        watch.start(progress::CONTOURS, self.cameras.len() as u64);
        let views = (self.cameras.par_iter().zip(&self.masks).enumerate())
            .map(|(view, (&camera, mask))| {
                watch.check()?;
                if self.needed.get(view) == Some(&false) {
                    return Ok(CapturedView {
                        camera,
                        contours: Vec::new(),
                        photographed: Some(0.0),
                    });
                }
                let (loops, photographed) = match self.seen.get(view) {
                    Some((loops, share)) => (loops.clone(), *share),
                    None => {
                        let loops = simplify_contours(&trace_contours(mask), &simplification);
                        (loops, 0.0)
                    }
                };
                if loops.is_empty() {
                    return Err(BuildError::NothingSeen { view: view as u32 });
                }
                let outward_only = simplification.outward_only;
                let (loops, depths) =
                    deep_contours(tree, model.bounds(), &camera, &loops, outward_only);
                let contours = (loops.into_iter().zip(depths))
                    .map(|(points, depths)| ViewContour {
                        points,
                        depths,
                        ..ViewContour::default()
                    })
                    .collect();
                watch.advance(progress::CONTOURS, 1);
                Ok(CapturedView {
                    camera,
                    contours,
                    photographed: is_of_photographs.then_some(photographed),
                })
            })
            .collect::<Result<_, _>>()?;
        watch.finish(progress::CONTOURS);
        Ok(views)
    }
}

/// What all views of a model's map have in common.
#[must_use]
pub fn map_params(model: &ClosedMesh, params: &BuildParams) -> DenseMapParams {
    DenseMapParams {
        center: model.bounds().center,
        radius: model.bounds().radius,
        resolution_px: params.resolution_px,
        tolerance_px: params.tolerance_px,
        coverage: params.capture.coverage,
    }
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
fn check_hull(model: &ClosedMesh, hull: &CoarseHull, params: &BuildParams) -> VerifyReport {
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

/// Targets that were not reached.
fn stall_warnings(
    params: &BuildParams,
    map: &SimplifyMapReport,
    hull: &CoarseHull,
) -> Vec<PrepWarning> {
    let mut warnings = Vec::new();
    let (kept, faces) = (map.kept.len() as u32, hull.faces.len() as u32);
    if params.map.max_error.is_none() && kept > params.map.keep {
        warnings.push(PrepWarning::MapStalled {
            wanted: params.map.keep,
            reached: kept,
        });
    }
    if faces > params.hull.target_faces {
        warnings.push(PrepWarning::HullStalled {
            wanted: params.hull.target_faces,
            reached: faces,
        });
    }
    warnings
}

/// The warning about pictures that have more bytes than they should.
fn over_budget(params: &TextureParams, textures: &TextureSet) -> Option<PrepWarning> {
    let wanted = params.budget_bytes?;
    let reached = texture::picture_bytes(textures);
    (reached > wanted).then_some(PrepWarning::TexturesOverBudget { wanted, reached })
}

fn record(
    model: &TriangleMesh,
    name: &str,
    (params, views): (&BuildParams, u32),
    map: &SimplifyMapReport,
) -> BuildRecord {
    BuildRecord {
        name: name.to_owned(),
        model_faces: model.faces.len() as u64,
        model_vertices: model.positions.len() as u64,
        model_crc32: model_crc32(model),
        captured_views: views,
        error_curve: map.curve.clone(),
        uniform_curve: Vec::new(),
        order: Some(map.order.clone()),
        generator: concat!("silmap ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: options_text(params),
        params: Recipe::of(params).to_value(),
    }
}

/// The options as they would be typed.
fn options_text(params: &BuildParams) -> String {
    let goal = match params.map.max_error {
        Some(share) => format!("--max-error {}%", 100.0 * share),
        None => format!("--keep {}", params.map.keep),
    };
    let coverage = match params.capture.coverage {
        CoverageRule::Center => "center",
        CoverageRule::Any => "any",
    };
    let cavities = match params.keep_cavities {
        true => " --keep-cavities",
        false => "",
    };
    format!(
        "--views {} {goal} --method {} --resolution {} --tolerance {} --coverage {coverage} --radius {}R --faces {} \
         --texture-views {} --texture-size {} {} --backend {}{}{cavities}",
        params.views,
        params.map.method.name(),
        params.resolution_px,
        params.tolerance_px,
        params.view_radius_rel,
        params.hull.target_faces,
        params.textures.views,
        params.textures.size_px,
        picture_options(&params.textures),
        match Recipe::of(params).build.capture.backend {
            Backend::Gpu => "gpu",
            Backend::Auto | Backend::Cpu => "cpu",
        },
        mending_options(&params.load),
    )
}

fn mending_options(load: &LoadOptions) -> String {
    let options = [
        (load.close_holes, " --close-holes"),
        (load.repair, " --repair"),
    ];
    let given = options.iter().filter(|(is_given, _)| *is_given);
    let mut text: String = given.map(|&(_, option)| option).collect();
    if load.alpha == AlphaUse::Mask {
        text.push_str(" --alpha mask");
    }
    if let Some(distance) = load.weld {
        text.push_str(&format!(" --weld {distance}"));
    }
    text
}

fn picture_options(textures: &TextureParams) -> String {
    let mut text = format!(
        "--texture-format {} --texture-quality {} --atlas-size {} --tiles {} --parametrisation {}",
        textures.format.name(),
        textures.quality,
        textures.atlas_px,
        textures.tiles.name(),
        textures.parametrisation.name(),
    );
    if let Some(bytes) = textures.budget_bytes {
        text.push_str(&format!(" --texture-bytes {bytes}"));
    }
    if !textures.normals {
        text.push_str(" --no-normals");
    }
    text
}

/// CRC-32 of a mesh's vertex positions and faces, little-endian: whether an asset was made from this mesh.
#[must_use]
pub fn model_crc32(mesh: &TriangleMesh) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for position in &mesh.positions {
        for coordinate in position.to_array() {
            hasher.update(&coordinate.to_le_bytes());
        }
    }
    for face in &mesh.faces {
        for vertex in face {
            hasher.update(&vertex.to_le_bytes());
        }
    }
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
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

    #[test]
    fn the_checksum_sees_positions_and_faces() {
        let mesh = models::torus(600);
        let (mut moved, mut turned) = (mesh.clone(), mesh.clone());
        moved.positions[7].x += 1e-9;
        turned.faces[3].rotate_left(1);
        let all = [&mesh, &moved, &turned].map(model_crc32);
        assert!(all[0] != all[1] && all[0] != all[2] && all[1] != all[2]);
    }
}
