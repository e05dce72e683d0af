//! What a scene came to, and what to draw it with.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{SceneParams, SceneRow};
use crate::machine;

/// All ways to draw one scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResults {
    /// The graphics adapter.
    pub adapter: String,
    /// How the device is timed: `timestamps` or `submit-to-idle`.
    pub timing: &'static str,
    /// The machine.
    pub machine: String,
    /// Instances.
    pub instances: usize,
    /// Diameter of the sphere about the model on the screen, pixels.
    pub pixels: f64,
    /// Side of the picture, pixels.
    pub side_px: u32,
    /// Whether the camera walks around the scene.
    pub is_walking: bool,
    /// One way each.
    pub rows: Vec<SceneRow>,
    /// How many times longer the device takes than for the hull clipped by the stencil.
    pub ratios: BTreeMap<String, f64>,
}

/// Times closer together than this say nothing.
const LEVEL: f64 = 1.1;

impl SceneResults {
    pub(super) fn new(
        params: &SceneParams,
        rows: Vec<SceneRow>,
        (adapter, has_timestamps): (String, bool),
    ) -> Self {
        let mut results = Self {
            adapter,
            timing: machine::timing(has_timestamps),
            machine: machine::describe(),
            instances: params.instances,
            pixels: params.pixels,
            side_px: params.side_px,
            is_walking: !params.is_still,
            rows,
            ratios: BTreeMap::new(),
        };
        if let Some(clipped) = results.row("clipped-stencil") {
            let seconds = clipped.seconds_median;
            let ratio = |row: &SceneRow| {
                (
                    format!("{}/clipped-stencil", row.name),
                    row.seconds_median / seconds,
                )
            };
            results.ratios = results.rows.iter().map(ratio).collect();
        }
        results
    }

    /// The row of a name.
    #[must_use]
    pub fn row(&self, name: &str) -> Option<&SceneRow> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// Whether a simplified mesh with as good an outline or the clipped hull draws this scene in less time, as a sentence.
    #[must_use]
    pub fn advice(&self) -> Option<String> {
        let mesh = self.row("lod-equal-error")?;
        let clipped = ["clipped-stencil", "clipped-coverage"]
            .into_iter()
            .filter_map(|name| self.row(name));
        let clipped = clipped.min_by(|a, b| a.seconds_median.total_cmp(&b.seconds_median))?;
        let faces = mesh.faces;
        let ratio = clipped.seconds_median / mesh.seconds_median;
        let start = if ratio > LEVEL {
            format!(
                "a mesh simplified to {faces} faces is the better choice: it takes {ratio:.1} times less time than {}",
                clipped.name
            )
        } else if ratio * LEVEL < 1.0 {
            format!(
                "{} is the better choice: it takes {:.1} times less time than a mesh simplified to {faces} faces",
                clipped.name,
                1.0 / ratio
            )
        } else {
            format!(
                "{} and a mesh simplified to {faces} faces take about the same time",
                clipped.name
            )
        };
        Some(format!(
            "In this scene {start}, with outlines {:.3} and {:.3} pixels off on average, {:.1} and {:.1} at the thickest place.",
            mesh.outline_error_px.mean,
            clipped.outline_error_px.mean,
            mesh.outline_error_px.thickest,
            clipped.outline_error_px.thickest,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CpuParts, OutlineErrorPx};

    fn row(name: &str, seconds: f64, mean: f64) -> SceneRow {
        SceneRow {
            name: name.to_owned(),
            faces: 700,
            seconds_median: seconds,
            cpu_seconds_mean: 0.0,
            cpu_seconds_max: 0.0,
            cpu_parts: CpuParts::default(),
            outline_error_px: OutlineErrorPx {
                mean,
                largest: mean,
                thickest: mean,
            },
            bytes: 1,
            repeat: 3,
            interpolated_mean: 0.0,
            timed_instances: None,
        }
    }

    fn results(mesh: f64, stencil: f64, coverage: f64) -> SceneResults {
        let params = SceneParams {
            instances: 9,
            pixels: 20.0,
            side_px: 64,
            is_still: false,
            frames: 3,
        };
        let rows = vec![
            row("lod-equal-error", mesh, 0.2),
            row("clipped-stencil", stencil, 0.1),
            row("clipped-coverage", coverage, 0.1),
        ];
        SceneResults::new(&params, rows, (String::new(), true))
    }

    #[test]
    fn the_faster_one_is_advised() {
        let advice = |results: SceneResults| results.advice().unwrap();
        let mesh = advice(results(1.0, 3.0, 2.0));
        assert!(
            mesh.contains("700 faces is the better choice") && mesh.contains("2.0 times"),
            "{mesh}"
        );
        let clipped = advice(results(3.0, 1.0, 2.0));
        assert!(
            clipped.contains("clipped-stencil is the better choice")
                && clipped.contains("3.0 times"),
            "{clipped}"
        );
        assert!(advice(results(1.0, 1.05, 2.0)).contains("about the same"));
        assert_eq!(
            results(6.0, 3.0, 2.0).ratios["lod-equal-error/clipped-stencil"],
            2.0
        );
    }
}
