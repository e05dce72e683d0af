//! A line of the table, and how far its outline is from the exact one.

use serde::Serialize;
use silmap_exact::Outliner;
use silmap_geometry::polygon::{edges as segments, fill_even_odd};
use silmap_geometry::{Camera, Mask, TriangleMesh};

use super::searches::{Search, SearchTimes};
use crate::MeasureError;
use crate::median::median;

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What was timed, such as `clipped-tight-soft`.
    pub name: String,
    /// Faces that are drawn or searched.
    pub faces: Option<usize>,
    /// Of the device for a frame; of the processor where nothing is drawn.
    pub seconds_median: f64,
    /// Of the processor, for the outline and for recording the frame.
    pub cpu_seconds_median: f64,
    /// Distance to the exact outline: the area between the two over the exact one's length, pixels.
    pub outline_error: Option<f64>,
    /// Pixels on the wrong side, of those inside.
    pub misclassified: Option<f64>,
    /// What has to be kept.
    pub bytes: u64,
    /// How often it was timed.
    pub repeat: usize,
    /// Edges found by extraction at a viewpoint, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub silhouette_edges: Option<f64>,
    /// Edges tested there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tested_edges: Option<f64>,
    /// Nodes tested there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visited_nodes: Option<f64>,
    /// Seconds to prepare extraction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub build_seconds: Option<f64>,
}

impl Row {
    pub(super) fn new(name: String, faces: Option<usize>, bytes: u64) -> Self {
        Self {
            name,
            faces,
            seconds_median: 0.0,
            cpu_seconds_median: 0.0,
            outline_error: None,
            misclassified: None,
            bytes,
            repeat: 0,
            silhouette_edges: None,
            tested_edges: None,
            visited_nodes: None,
            build_seconds: None,
        }
    }

    /// The row of a method of extraction.
    pub(super) fn of_search(search: &Search<'_>, faces: usize, times: SearchTimes) -> Self {
        let bytes = search.extractor.data_bytes() as u64;
        Self {
            silhouette_edges: Some(times.silhouette_edges),
            tested_edges: Some(times.tested_edges),
            visited_nodes: Some(times.visited_nodes),
            build_seconds: Some(search.build_seconds),
            ..Self::new(format!("edges-{}", search.method), Some(faces), bytes)
        }
        .with_times(times.seconds.clone(), times.seconds)
    }

    /// Processor and device, one after the other, for rows that draw.
    #[must_use]
    pub fn frame_seconds(&self) -> f64 {
        self.seconds_median + self.cpu_seconds_median
    }

    pub(super) fn with_times(mut self, mut device: Vec<f64>, mut processor: Vec<f64>) -> Self {
        self.repeat = device.len();
        self.seconds_median = median(&mut device);
        self.cpu_seconds_median = median(&mut processor);
        self
    }

    pub(super) fn with_errors(mut self, errors: &[(f64, f64)]) -> Self {
        let count = errors.len().max(1) as f64;
        self.outline_error = Some(errors.iter().map(|e| e.0).sum::<f64>() / count);
        self.misclassified = Some(errors.iter().map(|e| e.1).sum::<f64>() / count);
        self
    }
}

/// Most viewpoints at which outlines are compared.
const COMPARED_VIEWS: usize = 8;

/// The exact outline at a viewpoint.
pub(super) struct Truth {
    pub(super) camera: Camera,
    mask: Mask,
    length_px: f64,
}

impl Truth {
    /// The exact outlines of a mesh at some of the viewpoints.
    ///
    /// # Errors
    /// When the mesh does not lie in front of a camera.
    pub(super) fn at_some(
        full: &TriangleMesh,
        cameras: &[Camera],
    ) -> Result<Vec<Self>, MeasureError> {
        let step = cameras.len().div_ceil(COMPARED_VIEWS).max(1);
        let mut outliner = Outliner::new(&full.positions);
        (cameras.iter().step_by(step))
            .map(|&camera| {
                let edges = silmap_exact::silhouette_edges(full, camera.eye);
                let loops = outliner.outline(&edges, &camera)?;
                let mut mask = Mask::new(camera.width_px, camera.height_px);
                fill_even_odd(&loops, &mut mask);
                let length_px = loops
                    .iter()
                    .flat_map(|l| segments(l))
                    .map(|(a, b)| a.distance(b));
                Ok(Truth {
                    camera,
                    length_px: length_px.sum(),
                    mask,
                })
            })
            .collect()
    }

    /// Distance in pixels and misclassified share of a mask.
    pub(super) fn errors_of(&self, found: &Mask) -> (f64, f64) {
        let different = found.count_different(&self.mask) as f64;
        (
            different / self.length_px.max(1.0),
            different / self.mask.count().max(1) as f64,
        )
    }
}
