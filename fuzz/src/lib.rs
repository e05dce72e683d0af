//! What the fuzz targets share: what is done with a file once it has been read.

pub mod cameras;

use std::path::Path;
use std::sync::LazyLock;

use anyhow::Context as _;
use glam::DVec3;
use silmap_exact::{ConeForest, EdgeMesh, Extractor, Viewpoint};
use silmap_geometry::Watch;
use silmap_geometry::{Camera, ClosedMesh};
use silmap_hull::ProgressiveHull;
use silmap_map::asset::{self, Asset};
use silmap_map::{MapReader, Method, outline};
use silmap_mesh_io::{LoadOptions, load_bytes};
use silmap_models as models;
use silmap_map::fewer_views::{ViewGoal, keep_fewer_views};
use silmap_preprocess::pipeline::{BuildParams, build};

/// Reads a mesh as a file of that format and, when that works, mends it in every way there is.
///
/// There is no folder: whatever else a file names is missing.
pub fn read_mesh(bytes: &[u8], extension: &str) {
    read_mesh_at(
        bytes,
        Path::new("/nonexistent/model")
            .with_extension(extension)
            .as_path(),
    );
}

/// The same of what was read from `path`, whose extension names the format, and beside which further files lie.
pub fn read_mesh_at(bytes: &[u8], path: &Path) {
    let mended = LoadOptions {
        close_holes: true,
        repair: true,
        ..LoadOptions::default()
    };
    for options in [LoadOptions::default(), mended] {
        match load_bytes(path, bytes, &options) {
            Ok(loaded) => {
                let mesh = loaded.mesh.mesh();
                assert!(mesh.positions.iter().all(|p| p.is_finite()));
                let vertices = mesh.positions.len() as u32;
                assert!(mesh.faces.iter().flatten().all(|&v| v < vertices));
            }
            Err(fault) => assert!(is_one_sentence(&fault.to_string()), "{fault}"),
        }
    }
}

/// A message that a person can read: something, and on one line.
#[must_use]
pub fn is_one_sentence(message: &str) -> bool {
    !message.trim().is_empty() && !message.contains('\n')
}

/// The mesh that saved cone forests belong to.
pub static FOREST_MESH: LazyLock<EdgeMesh> =
    LazyLock::new(|| EdgeMesh::new(&models::torus(400)).expect("a torus is closed"));

/// A small asset whose views are noted in the order in which they can go.
///
/// # Errors
/// When building fails.
pub fn small_asset() -> anyhow::Result<Asset> {
    let model = ClosedMesh::try_from(models::torus(60))
        .ok()
        .context("a torus is closed")?;
    let mut params = BuildParams {
        views: 32,
        resolution_px: 32,
        ..BuildParams::default()
    };
    params.map.keep = 12;
    params.hull.target_faces = 40;
    params.textures.views = 2;
    params.textures.size_px = 16;
    params.textures.atlas_px = 16;
    // Far away, so that it has a place of its own.
    let model = model.with_origin(DVec3::new(1e6, 0.0, -3.0));
    Ok(build(&model, "torus", &params, &Watch::silent())?.0)
}

/// The bytes of [`small_asset`].
pub static ASSET_FILE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let asset = small_asset().expect("a torus can be built");
    asset::write(&asset).expect("what was built can be written")
});

/// Reads an asset, asks all that can be asked of it, and writes it again whole and with fewer views.
pub fn read_asset(bytes: &[u8]) {
    let asset = match asset::read(bytes) {
        Ok(asset) => asset,
        Err(fault) => return assert!(is_one_sentence(&fault.to_string()), "{fault}"),
    };
    let _ = asset::sizes(bytes).expect("what can be read has sizes");
    look_at(&asset);
    let views = asset.map.views.len() as u32;
    let fewer = keep_fewer_views(&asset, ViewGoal::Keep(views / 2));
    for asset in [Some(&asset), fewer.as_ref().ok()].into_iter().flatten() {
        match asset::write(asset) {
            Ok(file) => drop(asset::read(&file).expect("what was written can be read")),
            Err(fault) => assert!(is_one_sentence(&fault.to_string()), "{fault}"),
        }
    }
}

/// Takes a file for [`ASSET_FILE`] after another program lost the extension, and puts it back.
pub fn attach_to(bytes: &[u8]) {
    match asset::attach(bytes, &ASSET_FILE, None) {
        Ok(attached) => drop(asset::read(&attached.file).expect("what was put back can be read")),
        Err(fault) => assert!(is_one_sentence(&fault.to_string()), "{fault}"),
    }
}

/// Outlines of an asset's map from eyes on all sides, near and far, by every method.
pub fn look_at(asset: &Asset) {
    let map = &asset.map;
    let Ok(mut scratch) = MapReader::new(map) else {
        return;
    };
    for (direction, distance) in [
        (DVec3::new(1.0, 0.2, -0.3), 1.3),
        (DVec3::new(-0.5, 1.0, 0.1), 2.9),
        (DVec3::new(0.1, -0.4, -1.0), 40.0),
    ] {
        let eye = map.center + direction.normalize_or_zero() * distance * map.radius;
        let Ok(camera) = Camera::fit_sphere(eye, map.center, map.radius, None, (64, 48)) else {
            continue;
        };
        for method in Method::all_for(map) {
            if let Ok(outline) = outline(map, &camera, method, &mut scratch) {
                let mut points = outline.simple_loops().iter().flat_map(|l| l.iter());
                assert!(points.all(|p| p.is_finite()));
            }
        }
    }
}

/// Reads a saved hull sequence and makes its finest, a middle and its coarsest hull.
pub fn read_sequence(bytes: &[u8]) {
    let hull = match ProgressiveHull::from_bytes(bytes) {
        Ok(hull) => hull,
        Err(fault) => return assert!(is_one_sentence(&fault.to_string()), "{fault}"),
    };
    let finest = hull.model().faces.len();
    for faces in [finest, finest / 2, 4] {
        let level = hull.level(faces);
        assert!(level.mesh.positions.iter().all(|p| p.is_finite()));
        let _ = level.round();
    }
    let _ = hull.to_bytes();
}

/// Reads a saved cone forest of [`FOREST_MESH`] and searches it.
pub fn read_forest(bytes: &[u8]) {
    let mesh: &EdgeMesh = &FOREST_MESH;
    let forest = match ConeForest::from_bytes(mesh, bytes) {
        Ok(forest) => forest,
        Err(fault) => return assert!(is_one_sentence(&fault.to_string()), "{fault}"),
    };
    let mut by_forest = Extractor::with_forest(mesh, &forest);
    let mut brute = Extractor::new(mesh, silmap_exact::ExtractionMethod::Brute);
    for eye in [DVec3::new(3.0, 0.5, 1.0), DVec3::new(-0.2, 9.0, -4.0)] {
        let viewpoint = Viewpoint::Eye(eye);
        let found = |extractor: &mut Extractor<'_>| {
            let mut edges = Vec::new();
            extractor.extract(&viewpoint, &mut edges);
            edges.sort_unstable();
            edges
        };
        // Reading a forest computes its cones again: a forged one may be slow but not wrong.
        assert_eq!(found(&mut by_forest), found(&mut brute));
    }
}
