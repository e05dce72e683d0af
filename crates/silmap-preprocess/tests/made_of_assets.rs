//! Assets made of an asset: with fewer views, with another hull.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use silmap_geometry::{ClosedMesh, Watch};
use silmap_map::fewer_views::{FewerViewsError, ViewGoal, keep_fewer_views};
use silmap_map::{Asset, asset};
use silmap_models as models;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::other_hull::{OtherHullError, with_hull_faces};
use silmap_preprocess::pipeline::{BuildParams, Photographed, build};

fn torus() -> ClosedMesh {
    ClosedMesh::try_from(models::torus(600)).unwrap()
}

fn torus_with_faces(faces: u32) -> Asset {
    let mut params = BuildParams {
        views: 48,
        resolution_px: 64,
        ..BuildParams::default()
    };
    params.capture.backend = Backend::Cpu;
    params.map.keep = 24;
    params.hull.target_faces = faces;
    params.textures.views = 3;
    params.textures.size_px = 16;
    let (made, _) = build(&torus(), "torus", &params, &Watch::silent()).unwrap();
    // What a file holds is what there is to go on with.
    asset::read(&asset::write(&made).unwrap()).unwrap()
}

fn torus_asset() -> Asset {
    torus_with_faces(100)
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

#[test]
fn another_hull_is_the_one_that_a_build_gives() {
    let first = torus_asset();
    let (model, seen) = (torus(), Photographed::default());
    let other = |asset: &Asset| {
        let made = with_hull_faces(asset, (&model, &seen), 160, &Watch::silent());
        let (made, warnings) = made.unwrap();
        assert_eq!(warnings, Vec::new());
        asset::write(&made).unwrap()
    };
    assert!(other(&first) == asset::write(&torus_with_faces(160)).unwrap());
    assert!(other(&first) != asset::write(&first).unwrap());
    // Whether views are removed before or after is all the same.
    let fewer = |asset: &Asset| keep_fewer_views(asset, ViewGoal::Keep(16)).unwrap();
    let after = fewer(&asset::read(&other(&first)).unwrap());
    assert!(other(&fewer(&first)) == asset::write(&after).unwrap());
}

#[test]
fn a_hull_of_another_mesh_is_refused() {
    let other = ClosedMesh::try_from(models::torus(700)).unwrap();
    let about = (&other, &Photographed::default());
    let made = with_hull_faces(&torus_asset(), about, 50, &Watch::silent());
    assert!(
        matches!(made, Err(OtherHullError::OtherModel { .. })),
        "{made:?}"
    );
}
