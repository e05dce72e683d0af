//! Parts: where one part of a model hides another, outlines stray less when each part is interpolated by itself.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Camera, ClosedMesh, CoverageRule, Loop, Mask, Watch};
use silmap_map::{Asset, MapReader, Method, outline};
use silmap_measure::deviation;
use silmap_models as models;
use silmap_preprocess::capture::{Backend, cpu, spiral_directions};
use silmap_preprocess::pipeline::{BuildParams, build};

const SIDE_PX: u32 = 128;

fn asset(mesh: &ClosedMesh, most: u32, coverage: CoverageRule) -> Asset {
    let mut params = BuildParams {
        views: 140,
        resolution_px: 128,
        ..BuildParams::default()
    };
    params.parts.most = most;
    params.capture.backend = Backend::Cpu;
    params.capture.coverage = coverage;
    params.map.keep = 48;
    params.hull.target_faces = 200;
    params.textures.views = 3;
    params.textures.size_px = 16;
    params.textures.relief_px = 0;
    build(mesh, "model", &params, &Watch::silent()).unwrap().0
}

fn cameras(asset: &Asset, count: u32) -> Vec<Camera> {
    let map = &asset.map;
    let camera = |d: &DVec3| {
        let eye = map.center + *d * 3.0 * map.radius;
        Camera::fit_sphere(eye, map.center, map.radius, None, (SIDE_PX, SIDE_PX)).unwrap()
    };
    spiral_directions(count).iter().map(camera).collect()
}

fn outlines(asset: &Asset, cameras: &[Camera], method: Method) -> Vec<Vec<Loop>> {
    let mut reader = MapReader::new(&asset.map).unwrap();
    let seen = |camera| outline(&asset.map, camera, method, &mut reader).unwrap();
    (cameras.iter().map(seen))
        .map(|found| found.simple_loops().clone())
        .collect()
}

fn cover(mesh: &ClosedMesh, camera: &Camera, rule: CoverageRule) -> Mask {
    let mut mask = Mask::new(SIDE_PX, SIDE_PX);
    cpu::rasterise(mesh.mesh(), camera, rule, &mut mask).unwrap();
    mask
}

#[test]
fn outlines_of_parts_stray_less() {
    let mesh = ClosedMesh::try_from(models::organic(6000)).unwrap();
    let [parts, whole] = [12, 1].map(|most| asset(&mesh, most, CoverageRule::Center));
    assert!(parts.map.part_count() > 4 && whole.map.part_count() == 1);
    let cameras = cameras(&parts, 37);
    let truths: Vec<Vec<Loop>> = (cameras.iter())
        .map(|camera| trace_contours(&cover(&mesh, camera, CoverageRule::Center)))
        .collect();
    let largest = |asset: &Asset| {
        let mut all: Vec<f64> = (outlines(asset, &cameras, Method::Tight).iter().zip(&truths))
            .map(|(found, truth)| deviation(found, truth, (SIDE_PX, SIDE_PX)).most_px)
            .collect();
        all.sort_by(f64::total_cmp);
        [all[all.len() / 2], all[all.len() * 9 / 10]]
    };
    let (of_parts, of_whole) = (largest(&parts), largest(&whole));
    assert!(of_parts[0] < 0.7 * of_whole[0], "{of_parts:?} {of_whole:?}");
    assert!(of_parts[1] < 0.9 * of_whole[1], "{of_parts:?} {of_whole:?}");
}

#[test]
fn nothing_escapes_conservative_outlines_of_parts() {
    for mesh in [models::trefoil_knot(2000), models::organic(2000)] {
        let mesh = ClosedMesh::try_from(mesh).unwrap();
        let asset = asset(&mesh, 12, CoverageRule::Any);
        assert!(asset.map.part_count() > 3);
        let map = &asset.map;
        // On the polytope, where it is promised.
        let camera = |t: &[u32; 3]| {
            let eye = t.map(|v| map.eye(v)).iter().sum::<DVec3>() / 3.0;
            Camera::fit_sphere(eye, map.center, map.radius, None, (SIDE_PX, SIDE_PX)).unwrap()
        };
        let cameras: Vec<Camera> = map.triangles.iter().map(camera).collect();
        let found = outlines(&asset, &cameras, Method::Hull);
        for (camera, loops) in cameras.iter().zip(&found) {
            let mut inside = Mask::new(SIDE_PX, SIDE_PX);
            fill_even_odd(loops, &mut inside);
            let truth = cover(&mesh, camera, CoverageRule::Center);
            let escaped = truth.count_missing_in(&inside);
            assert_eq!(escaped, 0, "from {}", camera.eye);
        }
    }
}
