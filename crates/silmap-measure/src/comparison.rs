//! Comparing: every method of extraction on the model and on coarser hulls of it, frames clipped to what
//! they find, and interpolation at the same viewpoints.

use glam::DVec3;
use silmap_exact::{EdgeMesh, ExtractionMethod, Viewpoint, walk_around};
use silmap_geometry::Watch;
use silmap_geometry::{Camera, ClosedMesh, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_hull::{self as hull, HullParams};
use silmap_map::{Asset, Method, asset};

use crate::bench::{Bench, FrameTimes, Row, Search, SearchTimes};
use crate::{MeasureError, subdivide};

mod results;

pub use results::{
    BRUTE, Comparison, ComparisonLevel, ContourResult, Extracted, ExtractionResult, FrameResults,
    Motion, PARALLEL,
};

/// Faces of the coarser meshes: those of the 2000 paper's figure 9, and two more for larger models.
const LEVEL_FACES: [usize; 6] = [500, 4_000, 20_000, 50_000, 100_000, 200_000];
/// A coarser mesh with more than this share of the model's faces shows nothing new.
const LARGEST_SHARE: f64 = 0.8;
/// Viewpoints of the walk, 0.5° apart.
const WALK_VIEWPOINTS: usize = 120;
/// Where it starts, and how far away it is, in radii.
const START: DVec3 = DVec3::new(0.45, 0.35, 1.0);
const DISTANCE_RADII: f64 = 3.0;
/// Viewpoints on all sides, and their distances in radii.
const SCATTERED_VIEWPOINTS: usize = 100;
const SCATTERED_RADII: [f64; 2] = [2.0, 4.0];
/// Frames are drawn from the first viewpoints of the walk, in rounds.
const FRAMES: usize = 15;
const FRAME_ROUNDS: usize = 3;
/// Methods that take longer than this on the walk, seconds, are not drawn with.
const LONGEST_IN_FRAMES: f64 = 0.1;
/// Side of the pictures, pixels.
const SIDE_PX: u32 = 512;

/// Measures; minutes, most of them for building forests of cones.
///
/// # Errors
/// When interrupted, or the asset's map is broken.
pub fn compare(
    asset: &Asset,
    bytes: &[u8],
    model: &ClosedMesh,
    gpu: Option<&Gpu>,
    watch: &Watch<'_>,
) -> Result<Comparison, MeasureError> {
    let meshes = resolutions(model, watch)?;
    let (center, radius) = (asset.map.center, asset.map.radius);
    let cameras = walk_cameras(center, radius)?;
    let walk: Vec<DVec3> = cameras.iter().map(|c| c.eye).collect();
    let scattered = scattered_eyes(center, radius);
    let sizes = asset::sizes(bytes)?;
    let bench = |full, cameras: &[Camera]| Bench {
        full,
        simplified: None,
        asset,
        sizes,
        cameras: cameras.to_vec(),
        instances: 1,
        extractions: Vec::new(),
        watch,
    };
    let mut comparison = Comparison {
        walk_viewpoints: walk.len() as u32,
        scattered_viewpoints: scattered.len() as u32,
        threads: rayon::current_num_threads() as u32,
        ..Comparison::default()
    };
    let edge_meshes = (meshes.iter())
        .map(EdgeMesh::new)
        .collect::<Result<Vec<_>, _>>()?;
    let mut drawn = Vec::new();
    for (mesh, edge_mesh) in meshes.iter().zip(&edge_meshes) {
        let mut level = ComparisonLevel {
            faces: mesh.faces.len(),
            methods: Vec::new(),
        };
        let mut quick = Vec::new();
        for &method in ExtractionMethod::ALL {
            let mut search = Search::new(edge_mesh, method, watch)?;
            let (on_walk, on_all_sides) =
                (search.time(&walk, watch)?, search.time(&scattered, watch)?);
            let result = extraction(&search, &on_walk, &on_all_sides);
            if result.walk.seconds_median < LONGEST_IN_FRAMES {
                quick.push(search);
            }
            level.methods.push(result);
        }
        comparison.levels.push(level);
        drawn.push((bench(mesh, &cameras[..FRAMES]), quick));
    }
    comparison.contours = (bench(model.mesh(), &cameras).contour_rows()?.iter())
        .map(contour)
        .collect();
    if let Some(gpu) = gpu {
        // Clipping to a fine silhouette may take longer than drawing the model: then a larger mesh has the same time.
        let larger = subdivide(model.mesh(), 4 * model.mesh().faces.len());
        drawn.push((bench(&larger, &cameras[..FRAMES]), Vec::new()));
        comparison.frames = Some(frames(gpu, asset, &mut drawn, &mut comparison.levels)?);
    }
    Ok(comparison)
}

/// Draws frames of all meshes, and of the hull clipped to what their searches find, which `levels` have results of; there may be
/// further meshes.
fn frames(
    gpu: &Gpu,
    asset: &Asset,
    drawn: &mut [(Bench<'_>, Vec<Search<'_>>)],
    levels: &mut [ComparisonLevel],
) -> Result<FrameResults, MeasureError> {
    let times = frame_times(gpu, drawn)?;
    for (level, ((_, searches), times)) in levels.iter_mut().zip(drawn.iter().zip(&times)) {
        for (search, &seconds) in searches.iter().zip(&times.exact) {
            let name = search.method.name();
            if let Some(result) = level.methods.iter_mut().find(|r| r.method == name) {
                result.frame_seconds = Some(seconds);
            }
        }
    }
    let faces = drawn.iter().map(|(bench, _)| bench.full.faces.len());
    // What is drawn of the asset alone does not depend on the mesh.
    let least =
        |seconds: fn(&FrameTimes) -> f64| times.iter().map(seconds).fold(f64::INFINITY, f64::min);
    let best = Method::best_for(&asset.map).name().to_owned();
    Ok(FrameResults {
        adapter: gpu.adapter_name(),
        size_px: SIDE_PX,
        hull_faces: asset.hull.faces.len(),
        full: faces.zip(times.iter().map(|t| t.full)).collect(),
        interpolated: Some((best, least(|t| t.interpolated))),
        hull_seconds: least(|t| t.hull),
    })
}

/// Times of all frames: the least median of several rounds over all meshes, so that what else the machine does at some time falls
/// on all of them alike.
fn frame_times(
    gpu: &Gpu,
    drawn: &mut [(Bench<'_>, Vec<Search<'_>>)],
) -> Result<Vec<FrameTimes>, MeasureError> {
    let mut drawers = (drawn.iter())
        .map(|(bench, _)| bench.drawer(gpu))
        .collect::<Result<Vec<_>, MeasureError>>()?;
    let mut least: Vec<FrameTimes> = Vec::new();
    for round in 0..FRAME_ROUNDS {
        for (k, ((bench, searches), drawer)) in drawn.iter_mut().zip(&mut drawers).enumerate() {
            let times = bench.frame_times(drawer, searches)?;
            if round == 0 {
                least.push(times);
            } else {
                least[k] = times.least(&least[k]);
            }
        }
    }
    Ok(least)
}

/// Coarser hulls of the model, and the model.
fn resolutions(model: &ClosedMesh, watch: &Watch<'_>) -> Result<Vec<TriangleMesh>, MeasureError> {
    let most = (LARGEST_SHARE * model.mesh().faces.len() as f64) as usize;
    let params = HullParams {
        target_faces: LEVEL_FACES[0] as u32,
        ..HullParams::default()
    };
    let sequence = hull::build(model, &params, watch)?;
    let mut meshes: Vec<TriangleMesh> = (LEVEL_FACES.into_iter())
        .filter(|&faces| faces <= most)
        .map(|faces| sequence.level(faces).mesh)
        .collect();
    meshes.push(model.mesh().clone());
    // A sequence that ends early has one level for several counts.
    meshes.dedup_by_key(|mesh| mesh.faces.len());
    Ok(meshes)
}

fn walk_cameras(center: DVec3, radius: f64) -> Result<Vec<Camera>, MeasureError> {
    let start = center + START.normalize_or_zero() * (DISTANCE_RADII * radius);
    walk_around(Viewpoint::Eye(start), center, WALK_VIEWPOINTS)
        .map(|viewpoint| {
            let (Viewpoint::Eye(eye) | Viewpoint::Direction(eye)) = viewpoint;
            Ok(Camera::fit_sphere(
                eye,
                center,
                radius,
                None,
                (SIDE_PX, SIDE_PX),
            )?)
        })
        .collect()
}

/// Eyes on all sides, none near the one before, and the same ones on every machine.
fn scattered_eyes(center: DVec3, radius: f64) -> Vec<DVec3> {
    // Powers of the inverse of the plastic number's kin for three dimensions: their multiples fill a cube evenly.
    const STEPS: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_3,
        0.549_700_477_901_970_2,
    ];
    let [near, far] = SCATTERED_RADII;
    (1..=SCATTERED_VIEWPOINTS)
        .map(|k| {
            let [u, v, w] = STEPS.map(|step| (step * k as f64).fract());
            let z = 2.0 * u - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
            let direction = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
            center + direction * (radius * (near + (far - near) * w))
        })
        .collect()
}

fn extracted(times: &SearchTimes) -> Extracted {
    Extracted {
        viewpoints: times.seconds.len() as u32,
        silhouette_edges: times.silhouette_edges,
        tested_edges: times.tested_edges,
        visited_nodes: times.visited_nodes,
        seconds_median: times.seconds_median(),
    }
}

fn extraction(
    search: &Search<'_>,
    walk: &SearchTimes,
    scattered: &SearchTimes,
) -> ExtractionResult {
    ExtractionResult {
        method: search.method.name().to_owned(),
        walk: extracted(walk),
        scattered: extracted(scattered),
        data_bytes: search.extractor.data_bytes() as u64,
        build_seconds: search.build_seconds,
        frame_seconds: None,
    }
}

fn contour(row: &Row) -> ContourResult {
    ContourResult {
        method: row.name.trim_start_matches("contour-").to_owned(),
        seconds_median: row.seconds_median,
        error_px: row.outline_error.unwrap_or(0.0),
        data_bytes: row.bytes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_eyes_are_on_all_sides_and_far_from_the_last() {
        let center = DVec3::new(1.0, -2.0, 3.0);
        let eyes = scattered_eyes(center, 2.0);
        let directions: Vec<DVec3> = (eyes.iter())
            .map(|&eye| {
                let distance = eye.distance(center) / 2.0;
                assert!((2.0..=4.0).contains(&distance), "{distance}");
                (eye - center).normalize_or_zero()
            })
            .collect();
        for octant in 0..8_u32 {
            let is_in = |d: &&DVec3| (0..3).all(|k| (d[k] > 0.0) == (octant >> k & 1 == 1));
            let count = directions.iter().filter(is_in).count();
            assert!((8..18).contains(&count), "{count} in octant {octant}");
        }
        let near = (directions.windows(2)).filter(|d| d[0].angle_between(d[1]) < 0.5);
        assert!(near.count() < 5);
    }
}
