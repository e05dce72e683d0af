//! An asset with fewer views, made from the asset alone.
//!
//! Source: Silhouette Mapping, section 6: the collapse order that was noted when the map was simplified is carried out.

use silmap_map::{Asset, BuildRecord, CollapseOrder, CollapseStep};
use thiserror::Error;

use crate::simplify_map::{ReplayError, replay};

/// How many views an asset shall keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewGoal {
    /// That many.
    Keep(u32),
    /// As few as hold this mean share of misclassified pixels over the captured views.
    MaxError(f64),
}

/// Why an asset cannot have fewer views.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FewerViewsError {
    /// The file has no order.
    #[error("it has no collapse order: build it again from its model")]
    NoOrder,
    /// More views were asked for than there are.
    #[error("it has {there} views, {wanted} can only be built from its model")]
    TooMany {
        /// Views asked for.
        wanted: u32,
        /// Views of the asset.
        there: u32,
    },
    /// The order ends before.
    #[error("its views can go down to {fewest}, not to {wanted}")]
    TooFew {
        /// Views asked for.
        wanted: u32,
        /// Views that no collapse can take away.
        fewest: u32,
    },
    /// The asset has a larger error than was asked for.
    #[error(
        "it misclassifies {:.4} % of the pixels with all its views, more than {:.4} %", 100.0 * share, 100.0 * limit
    )]
    TooWrong {
        /// Mean share of the asset as it is.
        share: f64,
        /// Share asked for.
        limit: f64,
    },
    /// The order does not belong to the map.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// Between the options of the build and those of later calls in [`BuildRecord::options`].
pub(crate) const THEN: &str = ", then --from with ";

/// `asset` with as few views as `goal` says, and what remains of its order. Going down in several calls gives the same as in one.
///
/// # Errors
/// When the asset has no order, or the goal cannot be reached by removing views.
pub fn keep_fewer_views(asset: &Asset, goal: ViewGoal) -> Result<Asset, FewerViewsError> {
    let order = asset
        .record
        .order
        .as_ref()
        .ok_or(FewerViewsError::NoOrder)?;
    let there = asset.map.views.len() as u32;
    let step_count = steps_to(order, there, goal)?;
    let (done, rest) = order.steps.split_at(step_count);
    let (map, kept) = replay(&asset.map, done)?;
    // Behind a step that removes a view nothing names it, so every number has a new one.
    let number = |view: u32| kept.partition_point(|&k| k < view) as u32;
    let steps = rest.iter().map(|step| CollapseStep {
        removed: number(step.removed),
        onto: number(step.onto),
        turned: (step.turned.iter().map(|edge| edge.map(number))).collect(),
        errors: step.errors,
    });
    let errors = done.last().map_or(order.errors, |step| step.errors);
    let mut error_curve = asset.record.error_curve.clone();
    let left = (0..there).rev().zip(done);
    error_curve.extend(left.map(|(views, step)| (views, step.errors.mean)));
    let first_options = asset.record.options.split(THEN).next().unwrap_or_default();
    let record = BuildRecord {
        error_curve,
        options: format!("{first_options}{THEN}--keep {}", kept.len()),
        order: Some(CollapseOrder {
            errors,
            steps: steps.collect(),
        }),
        params: crate::recipe::with_fewer_views(&asset.record.params, kept.len() as u32),
        ..asset.record.clone()
    };
    Ok(Asset {
        record,
        map,
        hull: asset.hull.clone(),
        textures: asset.textures.clone(),
        placement: asset.placement,
    })
}

/// How many steps lead to a goal.
fn steps_to(order: &CollapseOrder, there: u32, goal: ViewGoal) -> Result<usize, FewerViewsError> {
    match goal {
        ViewGoal::Keep(wanted) if wanted > there => Err(FewerViewsError::TooMany { wanted, there }),
        ViewGoal::Keep(wanted) => {
            let step_count = (there - wanted) as usize;
            if step_count > order.steps.len() {
                let fewest = there.saturating_sub(order.steps.len() as u32);
                return Err(FewerViewsError::TooFew { wanted, fewest });
            }
            Ok(step_count)
        }
        ViewGoal::MaxError(limit) => {
            let share = order.errors.mean;
            let curve = order.curve(there);
            // The curve need not rise all the way: the fewest views that hold the limit count.
            let last = curve.iter().rposition(|&(_, mean)| mean <= limit);
            last.ok_or(FewerViewsError::TooWrong { share, limit })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::Backend;
    use crate::pipeline::{BuildParams, build};
    use silmap_geometry::ClosedMesh;
    use silmap_geometry::Watch;
    use silmap_map::asset;
    use silmap_models as models;

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
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let (made, _) = build(&model, "torus", &params, &Watch::silent()).unwrap();
        // What a file holds is what there is to go on with.
        asset::read(&asset::write(&made).unwrap()).unwrap()
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
}
