//! How well the silhouettes of some photographs say what another one shows: each view of a capture is left out in turn and predicted
//! from the rest.
//!
//! Predicted by each rule of interpolation; by what else could be done with the remaining masks: the nearest view's outline carried over
//! by the homography of a plane through the object, and the visual hull of all of them, without voxels; and, for orientation, by the
//! silhouette of the carved hull that votes have made. Pixels are those of the left-out mask, as shares of its inside; outside of the
//! image nothing is known, and nothing is counted.

use glam::{DVec2, DVec3};
use silmap_capture::{
    Capture, CaptureView, CarveError, CarveParams, Carved, Pinhole, carve, seen_outlines,
    silhouette, visual_hull_silhouette,
};
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{
    Bounds, Bvh, Camera, CameraError, ClosedMesh, Interrupted, Loop, Mask, SeenSilhouette, Stage,
    Watch,
};
use silmap_map::{
    Detail, InterpolateError, Interpolation, MapReader, Method, PolytopeError, SilhouetteMap,
};
use silmap_preprocess::pipeline::{BuildError, BuildParams, Gaps, capture_around};
use silmap_preprocess::seen::SAME_DIRECTION_COSINE;
use thiserror::Error;

/// Leaving views out; the units are views.
pub const LEAVE_OUT: Stage = Stage("leaving views out");

/// Views farther than this from the left-out one give no outline to it, as a cosine: 70°.
const FAR_COSINE: f64 = 0.34;

/// How far from the voted hull's silhouette the visual hull's is looked for, pixels and voxels.
const NEAR_PX: i64 = 3;

/// What predicts a left-out silhouette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Predictor {
    /// A rule of interpolation.
    Method(Method),
    /// The nearest remaining view's outline, carried over by a homography.
    NearestView,
    /// The visual hull of all remaining masks.
    VisualHull,
    /// The carved hull of the remaining masks, some of them outvoted.
    CarvedHull,
    /// Method `tight` in a map of the object's own mesh, with views where the photographs were taken, and others only far from all of them.
    Mesh,
}

impl Predictor {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Method(method) => method.name(),
            Self::NearestView => "nearest-view",
            Self::VisualHull => "visual-hull",
            Self::CarvedHull => "carved-hull",
            Self::Mesh => "mesh-tight",
        }
    }

    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Method(Method::Paper),
        Self::Method(Method::Hull),
        Self::Method(Method::Tight),
        Self::NearestView,
        Self::VisualHull,
        Self::CarvedHull,
        Self::Mesh,
    ];
}

/// What is left out, and how maps are made of the rest.
#[derive(Clone, Debug)]
pub struct LeaveOneOutParams {
    /// Every so-manieth view is left out.
    pub every: usize,
    /// How the rest is carved.
    pub carve: CarveParams,
    /// How the rest's map is made; no views are removed from it.
    pub build: BuildParams,
    /// The object itself, in the frame of the cameras, where it is known: predictions are compared with its silhouettes, and not with the
    /// masks, and its own map predicts too.
    pub truth: Option<ClosedMesh>,
}

/// A prediction beside the mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOutError {
    /// The number of the view that was left out.
    pub view: usize,
    /// What predicted it.
    pub predictor: Predictor,
    /// Misclassified pixels over pixels inside.
    pub misclassified: f64,
    /// Escaped pixels over pixels inside.
    pub escaped: f64,
    /// How much of what was looked at rests on photographs; `None` where it is not interpolated.
    pub covered: Option<f64>,
}

/// Why nothing was measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LeaveOneOutError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The capture cannot be carved.
    #[error(transparent)]
    Whole(CarveError),
    /// What is left cannot be carved.
    #[error("without view {view}: {source}")]
    Carve {
        /// The view that was left out.
        view: String,
        /// Why.
        source: CarveError,
    },
    /// What is left makes no map.
    #[error("without view {view}: {source}")]
    Map {
        /// The view that was left out.
        view: String,
        /// Why.
        source: BuildError,
    },
    /// The map cannot be read.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// An outline cannot be interpolated.
    #[error(transparent)]
    Interpolate(#[from] InterpolateError),
    /// A camera too near to the object.
    #[error("view {view}: {source}")]
    Camera {
        /// The view.
        view: String,
        /// Why.
        source: CameraError,
    },
}

/// Leaves views of a capture out in turn, and predicts each from the rest.
///
/// # Errors
/// When interrupted, or what is left cannot be built.
pub fn leave_one_out(
    capture: &Capture,
    params: &LeaveOneOutParams,
    watch: &Watch<'_>,
) -> Result<Vec<LeftOutError>, LeaveOneOutError> {
    let whole = carve(capture, &params.carve, watch).map_err(LeaveOneOutError::Whole)?;
    let views: Vec<usize> = (0..capture.views.len())
        .step_by(params.every.max(1))
        .collect();
    watch.start(LEAVE_OUT, views.len() as u64);
    let mut errors = Vec::new();
    for view in views {
        errors.extend(Remaining::without(capture, &whole, view, params, watch)?.errors(watch)?);
        watch.advance(LEAVE_OUT, 1);
    }
    watch.finish(LEAVE_OUT);
    Ok(errors)
}

/// What is left of a capture without a view, and what is made of it.
struct Remaining<'a> {
    view: usize,
    left_out: &'a CaptureView,
    views: Vec<CaptureView>,
    carved: Carved,
    map: SilhouetteMap,
    /// In the coordinates of the map.
    camera: Pinhole,
    /// A square camera at the same place.
    plain: Camera,
    /// What the object's own map has to say, if the object is known.
    by_mesh: Option<(SilhouetteMap, Mask)>,
    /// Where the coordinates of that map begin.
    mesh_origin: DVec3,
}

impl<'a> Remaining<'a> {
    fn without(
        capture: &'a Capture,
        whole: &Carved,
        view: usize,
        params: &LeaveOneOutParams,
        watch: &Watch<'_>,
    ) -> Result<Self, LeaveOneOutError> {
        let left_out = &capture.views[view];
        let name = || left_out.name.clone();
        let middle = whole.mesh.bounds().center + whole.mesh.origin();
        let direction = |v: &CaptureView| (v.camera.eye - middle).normalize_or_zero();
        // Another view from the same direction would predict nothing but itself, and what has no vote in the whole has none in the rest.
        let remains = |(k, v): &(usize, &CaptureView)| {
            let is_beside = direction(v).dot(direction(left_out)) < SAME_DIRECTION_COSINE;
            is_beside && !whole.left_out.contains(k)
        };
        let views = capture.views.iter().enumerate().filter(remains);
        let rest = Capture {
            views: views.map(|(_, view)| view.clone()).collect(),
            warnings: Vec::new(),
            name: capture.name.clone(),
            path: capture.path.clone(),
            ..*capture
        };
        // How many votes may be wrong is known of the whole.
        let carving = CarveParams {
            outvoted: Some(whole.outvoted),
            ..params.carve
        };
        let carved =
            carve(&rest, &carving, &watch.quiet()).map_err(|source| LeaveOneOutError::Carve {
                view: name(),
                source,
            })?;
        let camera = left_out.camera.moved(-carved.mesh.origin());
        let bounds = carved.mesh.bounds();
        let size = (params.build.resolution_px, params.build.resolution_px);
        let plain = Camera::fit_sphere(camera.eye, bounds.center, bounds.radius, None, size)
            .map_err(|source| LeaveOneOutError::Camera {
                view: name(),
                source,
            })?;
        let map = map_about(&rest, &carved, camera.eye, &params.build, &watch.quiet()).map_err(
            |source| LeaveOneOutError::Map {
                view: name(),
                source,
            },
        )?;
        let by_mesh = match &params.truth {
            Some(model) => mesh_map(&rest, model, &left_out.camera, &params.build, watch).map_err(
                |source| LeaveOneOutError::Map {
                    view: name(),
                    source,
                },
            )?,
            None => None,
        };
        Ok(Self {
            view,
            left_out,
            views: rest.views,
            carved,
            map,
            camera,
            plain,
            by_mesh,
            mesh_origin: (params.truth.as_ref()).map_or(DVec3::ZERO, ClosedMesh::origin),
        })
    }

    fn errors(&self, watch: &Watch<'_>) -> Result<Vec<LeftOutError>, LeaveOneOutError> {
        let mut reader = MapReader::new(&self.map)?;
        let voted = silhouette(self.carved.mesh.mesh(), &self.camera);
        let mut errors = Vec::new();
        for predictor in Predictor::ALL {
            watch.check()?;
            let mut covered = None;
            let predicted = match predictor {
                Predictor::Method(method) => {
                    let how = Interpolation {
                        method,
                        detail: Detail::Level(0),
                        ..Interpolation::default()
                    };
                    let at = reader.interpolate(&self.map, &self.plain, how)?;
                    covered = self.map.covered(at.triangle, at.barycentric);
                    Some(self.filled(&reader.simple_loops().to_loops()))
                }
                Predictor::NearestView => self.nearest_view(),
                Predictor::VisualHull => voted.as_ref().map(|voted| self.visual_hull(voted)),
                Predictor::CarvedHull => voted.clone(),
                Predictor::Mesh => self.by_mesh()?,
            };
            let Some(mut predicted) = predicted else {
                continue;
            };
            if let Some(known) = &self.left_out.known {
                predicted.intersect(known);
            }
            let truth = self.by_mesh.as_ref().map(|(_, silhouette)| silhouette);
            let mut mask = truth.unwrap_or(&self.left_out.mask).clone();
            if let Some(known) = &self.left_out.known {
                mask.intersect(known);
            }
            let inside = mask.count().max(1) as f64;
            errors.push(LeftOutError {
                view: self.view,
                predictor,
                misclassified: predicted.count_different(&mask) as f64 / inside,
                escaped: mask.count_missing_in(&predicted) as f64 / inside,
                covered,
            });
        }
        Ok(errors)
    }

    /// What loops in the plain camera's picture cover in the left-out image.
    fn filled(&self, loops: &[Loop]) -> Mask {
        seen_through(loops, &self.plain, &self.camera)
    }

    /// The outline by the object's own map, where its mesh is known.
    fn by_mesh(&self) -> Result<Option<Mask>, LeaveOneOutError> {
        let Some((map, _)) = &self.by_mesh else {
            return Ok(None);
        };
        let camera = &self.left_out.camera.moved(-self.mesh_origin);
        let size = (map.resolution_px, map.resolution_px);
        let plain = Camera::fit_sphere(camera.eye, map.center, map.radius, None, size);
        let plain = plain.map_err(|source| LeaveOneOutError::Camera {
            view: self.left_out.name.clone(),
            source,
        })?;
        let how = Interpolation {
            method: Method::Tight,
            detail: Detail::Level(0),
            ..Interpolation::default()
        };
        let mut reader = MapReader::new(map)?;
        reader.interpolate(map, &plain, how)?;
        let loops = reader.simple_loops().to_loops();
        Ok(Some(seen_through(&loops, &plain, camera)))
    }

    /// The nearest view's outline, as if the object were flat: in the plane through its middle that faces both.
    fn nearest_view(&self) -> Option<Mask> {
        let middle = self.carved.mesh.bounds().center + self.carved.mesh.origin();
        let direction = |v: &CaptureView| (v.camera.eye - middle).normalize_or_zero();
        let own = direction(self.left_out);
        let nearest = (self.views.iter())
            .max_by(|a, b| direction(a).dot(own).total_cmp(&direction(b).dot(own)))?;
        let normal = (direction(nearest) + own).normalize_or_zero();
        let to_image = |&p: &DVec2| {
            let ray = nearest.camera.direction(p);
            let along = (middle - nearest.camera.eye).dot(normal) / ray.dot(normal);
            let point = nearest.camera.eye + ray * along;
            (self.left_out.camera.project(point)).map(|(p, _)| p)
        };
        let loops: Vec<Loop> = (nearest.outline.iter())
            .map(|points| points.iter().filter_map(to_image).collect())
            .collect();
        Some(filled(&loops, &self.left_out.camera))
    }

    /// Where the rays of pixels meet the visual hull; it lies within the hull that votes have made, but for the voxels of that.
    fn visual_hull(&self, voted: &Mask) -> Mask {
        let (bounds, origin) = (self.carved.mesh.bounds(), self.carved.mesh.origin());
        let depth = self.camera.eye.distance(bounds.center);
        let voxel_px = self.carved.voxel * self.camera.pixels_per_tangent() / depth;
        let near = grown(voted, NEAR_PX + voxel_px.ceil() as i64);
        let around = Bounds {
            center: bounds.center + origin,
            radius: bounds.radius + 2.0 * self.carved.voxel,
            ..*bounds
        };
        let views: Vec<&CaptureView> = self.views.iter().collect();
        visual_hull_silhouette(&views, 0, &self.left_out.camera, (&around, &near))
    }
}

/// The map of all photographs.
fn map_about(
    capture: &Capture,
    carved: &Carved,
    eye: DVec3,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<SilhouetteMap, BuildError> {
    let model = &carved.mesh;
    let outlines = seen_outlines(capture, carved).into_iter().flatten();
    let silhouettes: Vec<SeenSilhouette> = outlines.map(|seen| seen.silhouette).collect();
    map_near(model, &silhouettes, (Gaps::Drawn, eye), params, watch)
}

/// The map of a model and of what was seen of it; only views that an eye could look through have outlines.
fn map_near(
    model: &ClosedMesh,
    silhouettes: &[SeenSilhouette],
    (gaps, eye): (Gaps, DVec3),
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<SilhouetteMap, BuildError> {
    let center = model.bounds().center;
    let is_near = |camera: &Camera| {
        let cosine = (camera.eye - center).normalize_or_zero();
        cosine.dot((eye - center).normalize_or_zero()) > FAR_COSINE
    };
    let captured = capture_around(model, silhouettes, params, (gaps, &is_near), watch)?;
    captured.map(model, &Bvh::new(model.mesh()), params, watch)
}

/// The map of a mesh with views where photographs were taken, and its silhouette in a left-out camera; `None` where some of it lies behind
/// that. Model and cameras are in the same coordinates.
fn mesh_map(
    rest: &Capture,
    model: &ClosedMesh,
    left_out: &Pinhole,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<Option<(SilhouetteMap, Mask)>, BuildError> {
    let left_out = &left_out.moved(-model.origin());
    let Some(truth) = silhouette(model.mesh(), left_out) else {
        return Ok(None);
    };
    let silhouettes: Vec<SeenSilhouette> = (rest.views.iter())
        .filter_map(|view| {
            let camera = &view.camera.moved(-model.origin());
            Some(SeenSilhouette {
                name: view.name.clone(),
                eye: camera.eye,
                outline: trace_contours(&silhouette(model.mesh(), camera)?),
                ray_from_image: camera.ray_from_image(),
                photographed: 1.0,
            })
        })
        .collect();
    // A view of the mesh in the gap would show what was left out.
    let where_from = (Gaps::Open, left_out.eye);
    let map = map_near(model, &silhouettes, where_from, params, &watch.quiet())?;
    Ok(Some((map, truth)))
}

/// What loops in a plain camera's picture cover in the image of a camera at the same place.
fn seen_through(loops: &[Loop], plain: &Camera, camera: &Pinhole) -> Mask {
    let to_image = |&p: &DVec2| {
        let ray = plain.direction_from_image(p);
        camera.project(camera.eye + ray).map(|(p, _)| p)
    };
    let loops: Vec<Loop> = loops
        .iter()
        .map(|points| points.iter().filter_map(to_image).collect())
        .collect();
    filled(&loops, camera)
}

/// The pixels of a camera's image that loops cover.
fn filled(loops: &[Loop], camera: &Pinhole) -> Mask {
    let mut mask = Mask::new(camera.width, camera.height);
    fill_non_zero(loops, &mut mask);
    mask
}

/// A mask and what is near it, by squares of that half side.
fn grown(mask: &Mask, by: i64) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    let mut wide = Mask::new(width, height);
    for y in 0..height {
        for x in 0..width {
            let (x, y) = (i64::from(x), i64::from(y));
            if mask.get(x, y) && !(mask.get(x - 1, y) && mask.get(x + 1, y)) {
                wide.set_span(y as u32, x - by, x + by + 1);
            } else if mask.get(x, y) {
                wide.set(x as u32, y as u32, true);
            }
        }
    }
    let mut grown = wide.clone();
    for y in 0..i64::from(height) {
        for other in (y - by).max(0)..(y + by + 1).min(height.into()) {
            let row = wide.row(other as u32);
            for (word, &more) in grown.row_mut(y as u32).iter_mut().zip(row) {
                *word |= more;
            }
        }
    }
    grown
}
