//! Measuring everything that a report shows about an asset: errors in all places and directions, the worst viewpoints, how long
//! outlines take, the polytope at some view counts.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::DVec3;
use silmap_geometry::Watch;
use silmap_geometry::{Bounds, Camera, ClosedMesh, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::fewer_views::{ViewGoal, keep_fewer_views};
use silmap_map::{Asset, Interpolation, MapReader, Method, SilhouetteMap, Transfer, asset};
use silmap_preprocess::capture::view_sphere;
use silmap_preprocess::dense_map::triangulate_view_sphere;
use silmap_preprocess::recipe::Recipe;

use crate::evaluate::{
    self, Comparison, EvaluateError, EvaluateParams, Place, ViewpointError, evaluate, evaluate_at,
    spread_viewpoints, summarise,
};
use crate::stray_views::stray_views;
use crate::uniform::uniform_curve;
use crate::{
    ColourRow, Conditions, ContourTime, DirectionErrors, ErrorSample, MeasureError, MethodErrors,
    PlaceErrors, PolytopeLevel, StrayView, TextureErrorParams, TextureFigures, TurntableFrame,
    WorstView, colour_errors, discontinuities_per_1000, machine, painting, turntable,
};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureParams {
    /// Test viewpoints in each place.
    pub viewpoints: u32,
    /// Seed of their directions.
    pub seed: u64,
    /// Directions of the maps of the sphere.
    pub directions: u32,
    /// Side of the test pictures, pixels.
    pub resolution_px: u32,
    /// Worst viewpoints that are shown of the best method; of the others one.
    pub worst: usize,
    /// Outlines that are timed for each method.
    pub timed_calls: u32,
}

impl Default for MeasureParams {
    fn default() -> Self {
        Self {
            viewpoints: 200,
            seed: 1,
            directions: 800,
            resolution_px: 512,
            worst: 4,
            timed_calls: 301,
        }
    }
}

/// Viewpoints at which colours are compared.
const COLOUR_VIEWPOINTS: u32 = 8;

/// The places, and where that is.
const PLACES: [(Place, &str); 3] = [
    (
        Place::Polytope,
        "where random rays from the center meet the polytope of views",
    ),
    (Place::Sphere, "on the sphere of the captured views"),
    (Place::Shell, "at distances of 1.5 to 10 radii, log-uniform"),
];

/// What was measured of an asset.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Size of its file and of the parts in it: name and bytes, the whole file last.
    pub bytes: Vec<(String, u64)>,
    /// Beside the asset's own curve: views of an even spread and their mean misclassified share, where that can be measured.
    pub uniform_curve: Option<Vec<(u32, f64)>>,
    /// The polytope of views at some counts, most views first.
    pub polytopes: Vec<PolytopeLevel>,
    /// Errors at test viewpoints in different places; the first is the one that the plots are about.
    pub places: Vec<PlaceErrors>,
    /// Errors over all directions, one set for each method.
    pub directions: Vec<DirectionErrors>,
    /// The viewpoints with the largest errors.
    pub worst: Vec<WorstView>,
    /// Those where outlines stray farthest.
    pub strays: Vec<StrayView>,
    /// A turn around it, beside its model; empty without a graphics adapter.
    pub turntable: Vec<TurntableFrame>,
    /// How well the hull is painted.
    pub textures: Option<TextureFigures>,
    /// How long an outline takes.
    pub contour_times: Vec<ContourTime>,
    /// What all that was measured on, and how.
    pub conditions: Conditions,
}

/// Measures an asset whose file has these bytes; colours and pictures only where there is a graphics adapter.
///
/// # Errors
/// When interrupted, or the map is broken.
pub fn measure(
    asset: &Asset,
    bytes: &[u8],
    model: &ClosedMesh,
    (params, gpu): (&MeasureParams, Option<&Gpu>),
    watch: &Watch<'_>,
) -> Result<Measured, MeasureError> {
    let started = Instant::now();
    let map = &asset.map;
    // First, while nothing else of this program runs.
    let contour_times = time_outlines(map, params.timed_calls, watch)?;
    let uniform_curve = curve_of_even_views(asset, model, watch)?;
    let model = model.mesh();
    let places = PLACES
        .iter()
        .map(|&(place, description)| place_errors(map, model, (place, description), params, watch))
        .collect::<Result<Vec<_>, _>>()?;
    let directions = direction_errors(map, model, params, watch)?;
    let worst = worst_views(map, model, places.first(), params, watch)?;
    let strays = stray_views(
        (asset, model),
        &worst_samples(map, places.first(), params.worst, |s| {
            s.straying.map_or(0.0, |off| off.largest_px)
        }),
        (params.resolution_px, gpu),
        watch,
    )?;
    let turntable = gpu.map_or(Ok(Vec::new()), |gpu| turntable((asset, model), gpu, watch))?;
    let textures = texture_figures(asset, model, (params, gpu), watch)?;
    Ok(Measured {
        bytes: byte_rows(&asset::sizes(bytes)?),
        uniform_curve,
        polytopes: polytopes(asset),
        places,
        directions,
        worst,
        strays,
        turntable,
        textures: Some(textures),
        contour_times,
        conditions: Conditions {
            machine: machine::describe(),
            threads: rayon::current_num_threads() as u32,
            is_optimised: !cfg!(debug_assertions),
            resolution_px: params.resolution_px,
            seed: params.seed,
            seconds: started.elapsed().as_secs_f64(),
        },
    })
}

/// The curve of evenly spread views: the one that the asset holds, else measured as the asset was built; `None` where the asset does
/// not record how, or there is none.
fn curve_of_even_views(
    asset: &Asset,
    model: &ClosedMesh,
    watch: &Watch<'_>,
) -> Result<Option<Vec<(u32, f64)>>, MeasureError> {
    let record = &asset.record;
    let curve = if record.uniform_curve.is_empty() {
        let Ok(recipe) = Recipe::from_record(record) else {
            return Ok(None);
        };
        uniform_curve(model, &recipe.build, watch)?
    } else {
        record.uniform_curve.clone()
    };
    Ok(Some(curve).filter(|curve| !curve.is_empty()))
}

fn evaluate_params(map: &SilhouetteMap, params: &MeasureParams) -> EvaluateParams {
    EvaluateParams {
        viewpoints: params.viewpoints,
        seed: params.seed,
        methods: Method::all_for(map).collect(),
        size_px: params.resolution_px,
        ..EvaluateParams::default()
    }
}

/// Errors of all methods in one place; off the polytope also of the best method by the homography, which depths replace.
fn place_errors(
    map: &SilhouetteMap,
    model: &TriangleMesh,
    (place, description): (Place, &str),
    params: &MeasureParams,
    watch: &Watch<'_>,
) -> Result<PlaceErrors, EvaluateError> {
    let params = EvaluateParams {
        place,
        ..evaluate_params(map, params)
    };
    let errors = evaluate(map, model, &params, watch)?;
    let mut methods: Vec<MethodErrors> = summarise(&errors)
        .iter()
        .map(|e| method_row(e, ""))
        .collect();
    if place != Place::Polytope && map.has_depth() {
        let by_homography = EvaluateParams {
            methods: vec![Method::best_for(map)],
            transfer: Transfer::Homography,
            ..params.clone()
        };
        let errors = evaluate(map, model, &by_homography, watch)?;
        methods.extend(
            summarise(&errors)
                .iter()
                .map(|e| method_row(e, ", by homography")),
        );
    }
    Ok(PlaceErrors {
        place: place.name().to_owned(),
        description: description.to_owned(),
        viewpoints: params.viewpoints,
        methods,
        samples: errors.iter().map(error_sample).collect(),
    })
}

fn method_row(errors: &evaluate::MethodErrors, suffix: &str) -> MethodErrors {
    let of = errors.shares;
    MethodErrors {
        method: format!("{}{suffix}", errors.method.name()),
        misclassified: [
            of.misclassified_mean,
            of.misclassified_median,
            of.misclassified_max,
        ],
        escaped: [of.escaped_mean, of.escaped_max],
        straying: errors.straying,
    }
}

fn error_sample(error: &ViewpointError) -> ErrorSample {
    ErrorSample {
        method: error.method.name().to_owned(),
        eye: error.eye,
        misclassified: error.misclassified,
        escaped: error.escaped,
        straying: error.straying,
    }
}

fn direction_errors(
    map: &SilhouetteMap,
    model: &TriangleMesh,
    params: &MeasureParams,
    watch: &Watch<'_>,
) -> Result<Vec<DirectionErrors>, EvaluateError> {
    let eyes = spread_viewpoints(map, params.directions)?;
    let params = EvaluateParams {
        with_straying: false,
        ..evaluate_params(map, params)
    };
    let errors = evaluate_at(&eyes, map, model, &params, watch)?;
    let mut best_first: Vec<Method> = Method::all_for(map).collect();
    best_first.sort_by_key(|m| *m != Method::best_for(map));
    let samples = |method: Method| {
        let direction = |e: &ViewpointError| (e.eye - map.center).normalize_or_zero();
        errors
            .iter()
            .filter(|e| e.method == method)
            .map(|e| (direction(e), e.misclassified))
            .collect()
    };
    Ok(best_first
        .into_iter()
        .map(|method| DirectionErrors {
            method: method.name().to_owned(),
            samples: samples(method),
        })
        .collect())
}

/// The viewpoints of a place with the largest errors.
fn worst_views(
    map: &SilhouetteMap,
    model: &TriangleMesh,
    place: Option<&PlaceErrors>,
    params: &MeasureParams,
    watch: &Watch<'_>,
) -> Result<Vec<WorstView>, MeasureError> {
    let mut reader = MapReader::new(map)?;
    let mut views = Vec::new();
    for (method, sample) in worst_samples(map, place, params.worst, |s| s.misclassified) {
        watch.check()?;
        let seen = Comparison::new(sample.eye, map, model, params.resolution_px)?;
        let predicted = seen.predict(map, method.into(), &mut reader)?;
        views.push(WorstView {
            sample: sample.clone(),
            camera: seen.camera,
            truth: seen.truth,
            predicted,
        });
    }
    Ok(views)
}

/// The samples of a place with the largest errors of some kind: so many of the best method, one of each other.
fn worst_samples<'a>(
    map: &SilhouetteMap,
    place: Option<&'a PlaceErrors>,
    count: usize,
    error: impl Fn(&ErrorSample) -> f64,
) -> Vec<(Method, &'a ErrorSample)> {
    let best = Method::best_for(map);
    let mut methods: Vec<Method> = Method::all_for(map).collect();
    methods.sort_by_key(|m| *m != best);
    let samples = place.map_or(&[][..], |p| &p.samples);
    let of_method = |method: Method| {
        let count = if method == best { count } else { 1 };
        let found = largest_errors(samples, method.name(), count, &error);
        found.into_iter().map(move |sample| (method, sample))
    };
    methods.into_iter().flat_map(of_method).collect()
}

/// The samples of a method with the largest errors, largest first; of equal ones the earlier first.
fn largest_errors<'a>(
    samples: &'a [ErrorSample],
    method: &str,
    count: usize,
    error: impl Fn(&ErrorSample) -> f64,
) -> Vec<&'a ErrorSample> {
    let mut of_method: Vec<&ErrorSample> = samples.iter().filter(|s| s.method == method).collect();
    of_method.sort_by(|a, b| error(b).total_cmp(&error(a)));
    of_method.truncate(count);
    of_method
}

/// How long outlines take along a smooth walk around the model, at the distance of the views.
fn time_outlines(
    map: &SilhouetteMap,
    calls: u32,
    watch: &Watch<'_>,
) -> Result<Vec<ContourTime>, MeasureError> {
    let mut reader = MapReader::new(map)?;
    let size = (map.resolution_px, map.resolution_px);
    let cameras = walk(map, calls.max(1))
        .into_iter()
        .map(|eye| Camera::fit_sphere(eye, map.center, map.radius, None, size))
        .collect::<Result<Vec<_>, _>>()?;
    Method::all_for(map)
        .map(|method| {
            let how = Interpolation::from(method);
            let mut times = Vec::with_capacity(cameras.len());
            // The first round fills the buffers that later calls, a frame each, find warm.
            for is_timed in [false, true] {
                for camera in &cameras {
                    watch.check()?;
                    let since = Instant::now();
                    reader.interpolate(map, camera, how)?;
                    if is_timed {
                        times.push(since.elapsed().as_secs_f64());
                    }
                }
            }
            times.sort_by(f64::total_cmp);
            Ok(ContourTime {
                method: method.name().to_owned(),
                median: times[times.len() / 2],
                most: times[times.len() * 19 / 20],
                calls: times.len() as u32,
            })
        })
        .collect()
}

/// Eyes on a curve that winds twice around the model while it goes up and down.
fn walk(map: &SilhouetteMap, steps: u32) -> Vec<DVec3> {
    let distance = view_distance(map);
    (0..steps)
        .map(|k| {
            let part = f64::from(k) / f64::from(steps) * std::f64::consts::TAU;
            let (x, z) = (2.0 * part).sin_cos();
            let y = 1.2 * (3.0 * part).sin();
            map.center + DVec3::new(x, y, z).normalize_or_zero() * distance
        })
        .collect()
}

fn view_distance(map: &SilhouetteMap) -> f64 {
    map.views
        .first()
        .map_or(3.0 * map.radius, |v| v.camera.eye.distance(map.center))
}

/// View counts that are half and a quarter of what is kept: the polytope changes its looks with such steps.
const COARSER: [usize; 2] = [2, 4];

/// The polytope as it was captured, as it is now, and as it would be with fewer views where the asset says which can go.
fn polytopes(asset: &Asset) -> Vec<PolytopeLevel> {
    let map = &asset.map;
    let captured = asset.record.captured_views;
    let mut levels = Vec::new();
    if captured as usize > map.views.len()
        && let Some((eyes, triangles)) = captured_polytope(map, captured)
    {
        levels.push(PolytopeLevel {
            label: format!("{captured} views captured"),
            eyes,
            triangles,
        });
    }
    levels.push(PolytopeLevel {
        label: format!("{} views kept", map.views.len()),
        eyes: map.views.iter().map(|v| v.camera.eye).collect(),
        triangles: map.triangles.clone(),
    });
    for part in COARSER {
        let goal = ViewGoal::Keep((map.views.len() / part) as u32);
        if let Ok(coarser) = keep_fewer_views(asset, goal) {
            levels.push(PolytopeLevel {
                label: format!("{} views", coarser.map.views.len()),
                eyes: coarser.map.views.iter().map(|v| v.camera.eye).collect(),
                triangles: coarser.map.triangles,
            });
        }
    }
    levels
}

/// The polytope of the captured views, which the asset does not hold but which their number determines.
fn captured_polytope(map: &SilhouetteMap, count: u32) -> Option<(Vec<DVec3>, Vec<[u32; 3]>)> {
    let arm = DVec3::splat(map.radius);
    let bounds = Bounds {
        min: map.center - arm,
        max: map.center + arm,
        center: map.center,
        radius: map.radius,
    };
    let cameras = view_sphere(&bounds, view_distance(map), count, map.resolution_px).ok()?;
    let eyes: Vec<DVec3> = cameras.iter().map(|c| c.eye).collect();
    let triangles = triangulate_view_sphere(map.center, &eyes).ok()?;
    Some((eyes, triangles))
}

/// How well the hull is painted; without a graphics adapter colours are not compared.
fn texture_figures(
    asset: &Asset,
    model: &TriangleMesh,
    (params, gpu): (&MeasureParams, Option<&Gpu>),
    watch: &Watch<'_>,
) -> Result<TextureFigures, MeasureError> {
    let found = painting(&asset.hull, &asset.textures, asset.map.radius);
    let colour_params = TextureErrorParams {
        viewpoints: COLOUR_VIEWPOINTS,
        seed: params.seed,
        size_px: params.resolution_px,
    };
    let colours = match gpu {
        Some(gpu) => colour_errors(gpu, asset, model, &colour_params, watch)?,
        None => BTreeMap::new(),
    };
    Ok(TextureFigures {
        views: found.views,
        seen_share: found.seen_share,
        atlas_share: found.atlas_share,
        merit: found.merit,
        views_per_face: found.views_per_face,
        view_texels_per_radius: found.view_texels_per_radius,
        atlas_texels_per_radius: found.atlas_texels_per_radius,
        bytes: found.bytes,
        discontinuities: discontinuities_per_1000(asset, model)
            .into_iter()
            .map(|(name, jumps)| (name.to_owned(), jumps))
            .collect(),
        viewpoints: colour_params.viewpoints,
        colours: colours
            .into_iter()
            .map(|(paint, errors)| ColourRow {
                paint: paint.to_owned(),
                mean: errors.mean,
                worst: errors.worst_viewpoint,
            })
            .collect(),
    })
}

fn byte_rows(sizes: &asset::AssetSizes) -> Vec<(String, u64)> {
    [
        ("silhouettes", sizes.map),
        ("hull", sizes.hull),
        ("textures", sizes.textures),
        ("whole file", sizes.total),
    ]
    .map(|(name, bytes)| (name.to_owned(), bytes))
    .to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_errors_of_a_method_come_first() {
        let sample = |method: &str, misclassified: f64| ErrorSample {
            method: method.to_owned(),
            eye: DVec3::ZERO,
            misclassified,
            escaped: 0.0,
            straying: None,
        };
        let samples = [
            sample("hull", 0.9),
            sample("tight", 0.1),
            sample("tight", 0.3),
            sample("tight", 0.2),
        ];
        let found = largest_errors(&samples, "tight", 2, |s| s.misclassified);
        assert_eq!(found, [&samples[2], &samples[3]]);
        assert!(largest_errors(&samples, "paper", 2, |s| s.misclassified).is_empty());
    }
}
