//! Assets as they are built, with fewer views.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use silmap_geometry::{ClosedMesh, Watch};
use silmap_map::fewer_views::{FewerViewsError, ViewGoal, keep_fewer_views};
use silmap_map::{Asset, asset};
use silmap_models as models;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::pipeline::{BuildParams, build};

fn torus_asset() -> Asset {
    let mut params = BuildParams {
        views: 48,
        resolution_px: 64,
        ..BuildParams::default()
    };
    params.capture.backend = Backend::Cpu;
    params.map.keep = 24;
    params.hull.target_faces = 100;
    params.textures.views = 3;
    params.textures.size_px = 16;
    let model = ClosedMesh::try_from(models::torus(600)).expect("a torus is closed");
    let (made, _) = build(&model, "torus", &params, &Watch::silent()).expect("a torus is built");
    // What a file holds is what there is to go on with.
    let bytes = asset::write(&made).expect("it can be written");
    asset::read(&bytes).expect("it can be read")
}

#[test]
fn going_down_in_two_calls_is_going_down_in_one() {
    let asset = torus_asset();
    let at_once = keep_fewer_views(&asset, ViewGoal::Keep(12)).unwrap();
    let half_way = keep_fewer_views(&asset, ViewGoal::Keep(17)).unwrap();
    assert_eq!(
        (half_way.map.views.len(), at_once.map.views.len()),
        (17, 12)
    );
    assert_ne!(half_way, at_once);
    let stored = asset::read(&asset::write(&half_way).unwrap()).unwrap();
    assert_eq!(stored, half_way);
    assert_eq!(keep_fewer_views(&stored, ViewGoal::Keep(12)), Ok(at_once));
    // To stay where one is changes the options only.
    let same = keep_fewer_views(&asset, ViewGoal::Keep(24)).unwrap();
    assert_eq!(
        (&same.map, &same.record.order),
        (&asset.map, &asset.record.order)
    );
}

#[test]
fn an_error_gives_the_fewest_views_that_hold_it() {
    let asset = torus_asset();
    let curve = asset.record.order.as_ref().unwrap().curve(24);
    let limit = curve[5].1;
    let made = keep_fewer_views(&asset, ViewGoal::MaxError(limit)).unwrap();
    let views = made.map.views.len() as u32;
    assert!(views <= curve[5].0);
    assert_eq!(made.record.error_curve.last().unwrap().0, views);
    assert!(made.record.order.unwrap().errors.mean <= limit);
    let all_below = curve.iter().filter(|(v, _)| *v < views);
    assert!(all_below.clone().count() > 0 && all_below.clone().all(|(_, e)| *e > limit));
}

#[test]
fn goals_out_of_reach_are_refused() {
    let asset = torus_asset();
    let refused = |goal| keep_fewer_views(&asset, goal).unwrap_err().to_string();
    assert_eq!(
        refused(ViewGoal::Keep(25)),
        "it has 24 views, 25 can only be built from its model"
    );
    assert!(refused(ViewGoal::Keep(3)).contains("not to 3"));
    assert!(refused(ViewGoal::MaxError(1e-9)).contains("more than 0.0000 %"));
    let mut without = asset.clone();
    without.record.order = None;
    let refused = keep_fewer_views(&without, ViewGoal::Keep(12));
    assert_eq!(refused, Err(FewerViewsError::NoOrder));
    let mut foreign = asset.clone();
    let order = foreign.record.order.as_mut().unwrap();
    // A view on the other side is no neighbour.
    let eye = |view: u32| asset.map.eye(view);
    let from = eye(order.steps[0].removed);
    let opposite = (0..24).min_by(|&a, &b| from.dot(eye(a)).total_cmp(&from.dot(eye(b))));
    order.steps[0].onto = opposite.unwrap();
    let refused = keep_fewer_views(&foreign, ViewGoal::Keep(12));
    assert!(
        matches!(refused, Err(FewerViewsError::Replay(_))),
        "{refused:?}"
    );
}
