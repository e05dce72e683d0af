//! Reading a map allocates nothing once its buffers are warm: a frame must not wait for the allocator.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use silmap_geometry::{Camera, CoverageRule};
use silmap_map::{MapReader, Method};
use silmap_models as models;
use silmap_preprocess::simplify_contour::add_levels;
use silmap_tests::dense_maps::dense;

#[test]
fn a_warm_walk_allocates_nothing() {
    let (mut map, _) = dense(
        &models::trefoil_knot(2048),
        40,
        128,
        0.5,
        CoverageRule::Center,
    );
    add_levels(&mut map);
    // The size on the screen changes, and the contours' level of detail with it.
    let sizes = [40, 64, 512];
    let cameras: Vec<Camera> = (0..60)
        .map(|k| {
            let turn = f64::from(k) * 0.1;
            let direction = DVec3::new(turn.cos(), 0.5 * (0.7 * turn).sin(), turn.sin());
            // On the polytope, and far enough off it on both sides.
            let distance = map.radius * (3.0 + 1.8 * (3.0 * turn).sin());
            let eye = map.center + direction.normalize_or_zero() * distance;
            let size = sizes[k as usize / 7 % sizes.len()];
            Camera::fit_sphere(eye, map.center, map.radius, None, (size, size)).unwrap()
        })
        .collect();
    for method in Method::ALL {
        let mut scratch = MapReader::new(&map).unwrap();
        let mut walk = || {
            for camera in &cameras {
                scratch.interpolate(&map, camera, method.into()).unwrap();
            }
        };
        let cold = allocation_counter::measure(&mut walk).count_total;
        assert!(cold > 0, "{method:?}: the counter does not count");
        // The cache of polytope edges is smaller than the walk: its places grow to the largest contours they meet.
        (0..8).for_each(|_| walk());
        let warm = allocation_counter::measure(&mut walk).count_total;
        assert_eq!(warm, 0, "{method:?}: {warm} allocations, {cold} when cold");
    }
}
