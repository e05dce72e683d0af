//! The collapse order: how a map goes on losing views, so that an asset can be made smaller without its model.
//!
//! Source: Silhouette Mapping, section 6 and figure 11: any number of views on the curve can be had.
//! Deviation: the paper's order ends at the views that are kept. This one begins there, at the map that is stored, because
//! its views were moved after the greedy sequence; and after a collapse edges may be turned where that lowers the error.

use super::packing::{Decoder, Encoder};
use super::paint::check_share;
use super::{AssetError, BuildRecord};

const PART: &str = "steps of the collapse order";

/// Fewest bytes of a step (two views, two shares, a count) and of a turned edge.
const STEP_BYTES: usize = 11;
const EDGE_BYTES: usize = 2;

/// Misclassified pixels as a share of the view's inside, over all captured views; stored in single precision.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CapturedErrors {
    /// Mean share.
    pub mean: f64,
    /// Largest share of a view.
    pub max: f64,
}

/// One view less. Views are numbered as in the map that the order belongs to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CollapseStep {
    /// The view that goes.
    pub removed: u32,
    /// The neighbour that its triangles are pulled to.
    pub onto: u32,
    /// Edges that are turned afterwards, in this order: the two views at the ends of each.
    pub turned: Vec<[u32; 2]>,
    /// The errors that are left then.
    pub errors: CapturedErrors,
}

/// How a map goes on losing views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CollapseOrder {
    /// The errors of the map as it is.
    pub errors: CapturedErrors,
    /// One view less each, down to the fewest that make a polytope.
    pub steps: Vec<CollapseStep>,
}

impl CollapseOrder {
    /// Numbers of views and their mean misclassified shares, from `view_count` views down.
    #[must_use]
    pub fn curve(&self, view_count: u32) -> Vec<(u32, f64)> {
        let shares = self.steps.iter().map(|step| step.errors.mean);
        let shares = std::iter::once(self.errors.mean).chain(shares);
        (0..=view_count).rev().zip(shares).collect()
    }

    /// As it comes back from a file.
    pub(super) fn round(&mut self) {
        let all = self.steps.iter_mut().map(|step| &mut step.errors);
        for errors in all.chain([&mut self.errors]) {
            errors.mean = f64::from(errors.mean as f32);
            errors.max = f64::from(errors.max as f32);
        }
    }

    /// Refuses views that do not exist or have gone before.
    fn check(&self, view_count: usize) -> Result<(), AssetError> {
        let mut is_there = vec![true; view_count];
        for (s, step) in self.steps.iter().enumerate() {
            let ends = step.turned.iter().flatten();
            for &view in [step.removed, step.onto].iter().chain(ends) {
                match is_there.get(view as usize) {
                    Some(true) => {}
                    Some(false) => return Err(bad_step(s, "names a view that went before")),
                    None => {
                        return Err(AssetError::NoSuch {
                            what: "view",
                            index: view.into(),
                            count: view_count,
                        });
                    }
                }
            }
            is_there[step.removed as usize] = false;
            if step.removed == step.onto || step.turned.iter().flatten().any(|&v| v == step.removed)
            {
                return Err(bad_step(s, "uses the view that it removes"));
            }
        }
        Ok(())
    }
}

fn bad_step(step: usize, reason: &'static str) -> AssetError {
    AssetError::CollapseOrder { step, reason }
}

/// The bytes of a record's order, if it has one, for a map of `view_count` views.
pub(super) fn encode(
    record: &BuildRecord,
    view_count: usize,
) -> Result<Option<Vec<u8>>, AssetError> {
    let Some(order) = &record.order else {
        return Ok(None);
    };
    order.check(view_count)?;
    let mut out = Encoder::default();
    encode_errors(&mut out, order.errors)?;
    out.count(order.steps.len());
    for step in &order.steps {
        out.unsigned(step.removed.into());
        out.unsigned(step.onto.into());
        encode_errors(&mut out, step.errors)?;
        out.count(step.turned.len());
        for &view in step.turned.iter().flatten() {
            out.unsigned(view.into());
        }
    }
    Ok(Some(out.finish()))
}

pub(super) fn decode(bytes: &[u8], view_count: usize) -> Result<CollapseOrder, AssetError> {
    let mut read = Decoder::new(bytes, PART);
    let errors = decode_errors(&mut read)?;
    let step_count = read.count(STEP_BYTES)?;
    let mut steps = Vec::with_capacity(step_count);
    for _ in 0..step_count {
        let removed = read.index("view", view_count)?;
        let onto = read.index("view", view_count)?;
        let errors = decode_errors(&mut read)?;
        let turned_count = read.count(EDGE_BYTES)?;
        let mut turned = Vec::with_capacity(turned_count);
        for _ in 0..turned_count {
            let mut view = || read.index("view", view_count);
            turned.push([view()?, view()?]);
        }
        steps.push(CollapseStep {
            removed,
            onto,
            turned,
            errors,
        });
    }
    read.finish()?;
    let order = CollapseOrder { errors, steps };
    order.check(view_count)?;
    Ok(order)
}

fn encode_errors(out: &mut Encoder, errors: CapturedErrors) -> Result<(), AssetError> {
    for share in [errors.mean as f32, errors.max as f32] {
        check_share(share)?;
        out.single(share);
    }
    Ok(())
}

fn decode_errors(read: &mut Decoder<'_>) -> Result<CapturedErrors, AssetError> {
    let mut share = || {
        let share = read.single()?;
        check_share(share).map(|()| f64::from(share))
    };
    Ok(CapturedErrors {
        mean: share()?,
        max: share()?,
    })
}
