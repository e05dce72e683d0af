//! A step by which all image coordinates of a capture are off, and what it looks like.

use glam::DVec2;

/// An axis whose deviation is above cannot be told, pixels.
const MOST_DEVIATION_PX: f64 = 0.15;

/// A step of all image coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageShift {
    /// What is to be added to the image coordinates that the cameras give so that they fit the masks best, pixels.
    pub by: DVec2,
    /// Standard deviation of each, pixels.
    pub deviation: DVec2,
    /// Median distance of the silhouettes of two views from their common tangent planes, pixels.
    pub usual: f64,
}

/// What a shift looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShiftKind {
    /// No more than a pixel, and not half of one along both axes; or not to be told.
    None,
    /// Half a pixel along both axes: the first pixel's centre is elsewhere.
    HalfPixel {
        /// Whether the masks lie farther right and down than the cameras say.
        is_forward: bool,
    },
    /// The principal point is off.
    Principal,
}

impl ImageShift {
    /// Which axes can be told.
    #[must_use]
    pub fn is_known(&self) -> [bool; 2] {
        self.deviation.to_array().map(|d| d <= MOST_DEVIATION_PX)
    }

    /// What it looks like.
    #[must_use]
    pub fn kind(&self) -> ShiftKind {
        let axes: Vec<f64> = (self.by.to_array().into_iter().zip(self.is_known()))
            .filter_map(|(by, is_known)| is_known.then_some(by))
            .collect();
        let mean = 0.5 * (self.by.x + self.by.y);
        let is_half = |by: &f64| HALF.contains(&(by * mean.signum()));
        if axes.len() == 2 && axes.iter().all(is_half) && HALF_MEAN.contains(&mean.abs()) {
            return ShiftKind::HalfPixel {
                is_forward: mean > 0.0,
            };
        }
        match axes.iter().any(|by| by.abs() > MOST_USUAL_PX) {
            true => ShiftKind::Principal,
            false => ShiftKind::None,
        }
    }
}

/// What half a pixel may be measured as along each axis and in the mean of both, pixels.
const HALF: std::ops::RangeInclusive<f64> = 0.2..=0.8;
const HALF_MEAN: std::ops::RangeInclusive<f64> = 0.3..=0.75;

/// Principal points of good sets are off by less.
const MOST_USUAL_PX: f64 = 1.0;

impl std::fmt::Display for ImageShift {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axis = |k: usize, name: &str| match self.is_known()[k] {
            true => format!("{name} by {:+.2} ± {:.2} px", self.by[k], self.deviation[k]),
            false => format!("{name} cannot be told"),
        };
        write!(
            f,
            "image coordinates of the cameras fit the masks best when moved: {}, {}",
            axis(0, "x"),
            axis(1, "y")
        )
    }
}
