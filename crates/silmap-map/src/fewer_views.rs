//! An asset with fewer views, made from the asset alone.
//!
//! Source: Silhouette Mapping, section 6: the collapse order that was noted when the map was simplified is carried out.

use serde_json::Value;
use thiserror::Error;

use crate::asset::{Asset, BuildRecord, CollapseOrder, CollapseStep};
use crate::replay::{ReplayError, replay};

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
pub const THEN: &str = ", then --from with ";

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
        params: with_fewer_views(&asset.record.params, kept.len() as u32),
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

/// The recipe of an asset whose views were removed down to `views`, as it is stored.
#[must_use]
pub fn with_fewer_views(params: &Value, views: u32) -> Value {
    let mut params = params.clone();
    if let Value::Object(entries) = &mut params {
        entries.insert("fewer_views".to_owned(), views.into());
    }
    params
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
