//! Measuring the comparison of a report: every method of extraction on the model and on coarser hulls of it, and interpolation at
//! the same viewpoints.

use glam::DVec3;
use silmap_exact::{Method as Extraction, Viewpoint, walk_around};
use silmap_geometry::{Camera, ClosedMesh, TriangleMesh};
use silmap_map::{Asset, asset};
use silmap_preprocess::Monitor;
use silmap_preprocess::hull::{self, HullParams};
use silmap_report::{Comparison, ComparisonLevel, ContourResult, ExtractionResult};

use crate::bench::{Bench, Row};

/// Faces of the coarser meshes, those of the 2000 paper's figure 9.
const LEVEL_FACES: [usize; 4] = [500, 4_000, 20_000, 50_000];
/// Viewpoints, 0.5° apart.
const VIEWPOINTS: usize = 120;
/// Where they start, and how far away they are, in radii.
const START: DVec3 = DVec3::new(0.45, 0.35, 1.0);
const DISTANCE_RADII: f64 = 3.0;
/// Side of the pictures that outlines are compared in, pixels.
const SIDE_PX: u32 = 512;

/// Measures; a minute or two for a model of 70,000 faces, most of it for building forests of cones.
///
/// # Errors
/// When interrupted, or the asset's map is broken.
pub(crate) fn compare(
    asset: &Asset,
    bytes: &[u8],
    model: &ClosedMesh,
    monitor: &Monitor<'_>,
) -> anyhow::Result<Comparison> {
    let faces = model.mesh().faces.len();
    let coarser: Vec<usize> = LEVEL_FACES.into_iter().filter(|&f| f < faces).collect();
    let params = HullParams {
        target_faces: LEVEL_FACES[0] as u32,
        ..HullParams::default()
    };
    let sequence = hull::build(model, &params, monitor)?;
    let mut meshes: Vec<TriangleMesh> = (coarser.iter())
        .map(|&faces| sequence.level(faces).mesh)
        .collect();
    meshes.push(model.mesh().clone());
    let (center, radius) = (asset.map.center, asset.map.radius);
    let start = center + START.normalize_or_zero() * (DISTANCE_RADII * radius);
    let cameras = walk_around(Viewpoint::Eye(start), center, VIEWPOINTS)
        .map(|viewpoint| {
            let (Viewpoint::Eye(eye) | Viewpoint::Direction(eye)) = viewpoint;
            Camera::fit_sphere(eye, center, radius, None, (SIDE_PX, SIDE_PX))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let sizes = asset::sizes(bytes)?;
    let mut comparison = Comparison {
        viewpoints: VIEWPOINTS as u32,
        ..Comparison::default()
    };
    for mesh in &meshes {
        let bench = Bench {
            full: mesh,
            simplified: None,
            asset,
            sizes,
            cameras: cameras.clone(),
            instances: 1,
            extractions: Extraction::ALL.to_vec(),
        };
        comparison.levels.push(ComparisonLevel {
            faces: mesh.faces.len(),
            methods: bench.extraction_rows()?.iter().map(extraction).collect(),
        });
        if mesh.faces.len() == faces {
            comparison.contours = bench.contour_rows()?.iter().map(contour).collect();
        }
    }
    Ok(comparison)
}

fn extraction(row: &Row) -> ExtractionResult {
    ExtractionResult {
        method: row.name.trim_start_matches("edges-").to_owned(),
        silhouette_edges: row.silhouette_edges.unwrap_or(0.0),
        tested_edges: row.tested_edges.unwrap_or(0.0),
        visited_nodes: row.visited_nodes.unwrap_or(0.0),
        seconds_median: row.seconds_median,
        data_bytes: row.bytes,
        build_seconds: row.build_seconds.unwrap_or(0.0),
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
