//! Timing extraction alone.

use std::time::Instant;

use glam::DVec3;
use silmap_exact::{EdgeMesh, ExtractionMethod, Extractor, Viewpoint};
use silmap_geometry::{Interrupted, Watch};

use crate::median::median;

/// A method that takes long is timed at the first viewpoints alone, as many as it takes this long for, seconds.
const MOST_SECONDS: f64 = 2.0;

/// A method with what it prepared, and how long that took.
#[derive(Debug)]
pub(crate) struct Search<'m> {
    pub(crate) method: ExtractionMethod,
    pub(crate) extractor: Extractor<'m>,
    pub(crate) build_seconds: f64,
}

/// What a method did at some viewpoints; counts are means over them.
#[derive(Clone, Debug, Default)]
pub(crate) struct SearchTimes {
    /// Of each viewpoint, in increasing order.
    pub(crate) seconds: Vec<f64>,
    pub(crate) silhouette_edges: f64,
    pub(crate) tested_edges: f64,
    pub(crate) visited_nodes: f64,
}

impl SearchTimes {
    pub(crate) fn seconds_median(&self) -> f64 {
        median(&mut self.seconds.clone())
    }
}

impl<'m> Search<'m> {
    /// Prepares a method.
    ///
    /// # Errors
    /// When interrupted before.
    pub(crate) fn new(
        mesh: &'m EdgeMesh,
        method: ExtractionMethod,
        watch: &Watch<'_>,
    ) -> Result<Self, Interrupted> {
        watch.check()?;
        let since = Instant::now();
        let extractor = Extractor::new(mesh, method);
        Ok(Self {
            method,
            extractor,
            build_seconds: since.elapsed().as_secs_f64(),
        })
    }

    /// Extracts at one viewpoint after the other, twice: first to fill buffers that a frame finds warm, then timed. At those alone that
    /// are reached in [`MOST_SECONDS`].
    ///
    /// # Errors
    /// When interrupted.
    pub(crate) fn time(
        &mut self,
        eyes: &[DVec3],
        watch: &Watch<'_>,
    ) -> Result<SearchTimes, Interrupted> {
        let mut edges = Vec::new();
        let mut times = SearchTimes::default();
        let (mut found, mut tested, mut visited) = (0, 0, 0);
        self.extractor.forget();
        let mut reached = eyes.len();
        for is_timed in [false, true] {
            let started = Instant::now();
            for (k, &eye) in eyes.iter().enumerate().take(reached) {
                if !is_timed && k > 0 && started.elapsed().as_secs_f64() > MOST_SECONDS {
                    reached = k;
                    break;
                }
                watch.check()?;
                let viewpoint = Viewpoint::Eye(eye);
                let since = Instant::now();
                let work = self.extractor.extract(&viewpoint, &mut edges);
                if is_timed {
                    times.seconds.push(since.elapsed().as_secs_f64());
                    found += edges.len();
                    tested += work.tested_edges;
                    visited += work.visited_nodes;
                }
            }
        }
        let mean = |sum: usize| sum as f64 / reached.max(1) as f64;
        times.silhouette_edges = mean(found);
        times.tested_edges = mean(tested);
        times.visited_nodes = mean(visited);
        Ok(times)
    }
}
