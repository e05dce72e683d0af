//! The collapse order: further collapses of the chosen map, recorded and not carried out.
//!
//! Source: Silhouette Mapping, section 6: the collapse order is stored, so that any number of views can be had.
//! Deviation: it begins at the views that are left after they were moved, and after each collapse the edges around it are
//! turned where that lowers the error; both are noted, so that replaying needs no captured view.

use silmap_map::{CollapseOrder, CollapseStep};

use super::Simplification;
use crate::progress;
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_map::simplified_polytope::Collapse;

/// Views that are predicted to estimate what a collapse costs. The fewer views are left, the more removed ones lie around
/// each, and the order would take as long as all that went before; what a step leaves is always measured at all of them.
const ORDER_PROBES: usize = 8;

impl Simplification<'_> {
    /// Collapses down to the smallest polytope. Views are numbered in their order among those that are left now.
    pub(super) fn order(&mut self, watch: &Watch<'_>) -> Result<CollapseOrder, Interrupted> {
        let kept = self.polytope.kept();
        let number = |v: u32| kept.partition_point(|&k| k < v) as u32;
        watch.start(progress::ORDER, kept.len() as u64);
        let mut order = CollapseOrder {
            errors: self.captured_errors(),
            steps: Vec::with_capacity(kept.len()),
        };
        // Who asks for fewer views than that gets them.
        self.kept_photographs = 0;
        self.restart(watch)?;
        while let Some(step) = self.next_step(watch)? {
            order.steps.push(CollapseStep {
                removed: number(step.removed),
                onto: number(step.onto),
                turned: step.turned.iter().map(|edge| edge.map(number)).collect(),
                errors: step.errors,
            });
            watch.advance(progress::ORDER, 1);
        }
        watch.finish(progress::ORDER);
        Ok(order)
    }

    /// Evaluates all collapses anew: views were moved, and what is in the queue was true before.
    pub(super) fn restart(&mut self, watch: &Watch<'_>) -> Result<(), Interrupted> {
        self.queue.clear();
        self.probes = ORDER_PROBES;
        self.confirms = false;
        self.evaluate_all(watch)
    }

    /// One view less, and the edges around it turned; `None` when no view can go. Views have the numbers of the dense map.
    pub(super) fn next_step(
        &mut self,
        watch: &Watch<'_>,
    ) -> Result<Option<CollapseStep>, Interrupted> {
        let Collapse { removed, onto } = loop {
            watch.check()?;
            let Some((_, collapse)) = self.next_collapse(watch)? else {
                return Ok(None);
            };
            if self.apply(collapse) {
                break collapse;
            }
        };
        let turned = self.turn_edges(&self.polytope.edges_around(onto));
        let fresh = turned.iter().flat_map(|t| Collapse::along(t.now));
        self.evaluate(&fresh.collect::<Vec<_>>(), self.probes);
        Ok(Some(CollapseStep {
            removed,
            onto,
            turned: turned.iter().map(|t| t.edge).collect(),
            errors: self.captured_errors(),
        }))
    }
}
