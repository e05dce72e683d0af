//! What was compared, and what follows from it.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, tables 1 and 2, figures 9 and 11 and section 7;
//! Pop, Duncan, Barequet, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and Applications. SCG
//! 2001, table 2.

/// Methods compared at the same viewpoints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// The model at several resolutions, coarsest first; the last is the model itself.
    pub levels: Vec<ComparisonLevel>,
    /// Interpolation at the viewpoints of the walk.
    pub contours: Vec<ContourResult>,
    /// Viewpoints of the walk.
    pub walk_viewpoints: u32,
    /// Viewpoints on all sides.
    pub scattered_viewpoints: u32,
    /// Threads that the method on all cores has.
    pub threads: u32,
    /// Drawing, where there is something to draw with.
    pub frames: Option<FrameResults>,
}

/// Extraction from the model at one resolution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComparisonLevel {
    /// Faces of the mesh.
    pub faces: usize,
    /// A result for each method.
    pub methods: Vec<ExtractionResult>,
}

/// What one method of extraction did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtractionResult {
    /// The method.
    pub method: String,
    /// On a smooth walk.
    pub walk: Extracted,
    /// At viewpoints on all sides, each far from the one before.
    pub scattered: Extracted,
    /// Bytes kept about the mesh.
    pub data_bytes: u64,
    /// Time to build them, seconds.
    pub build_seconds: f64,
    /// For a frame of the hull clipped to what was found, on the walk, seconds: extraction, stencil and drawing. Where frames were drawn
    /// and the method does not take long.
    pub frame_seconds: Option<f64>,
}

/// Extraction at some viewpoints; counts are means over them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extracted {
    /// How many: the first ones alone where a method takes long.
    pub viewpoints: u32,
    /// Edges found.
    pub silhouette_edges: f64,
    /// Edges tested.
    pub tested_edges: f64,
    /// Nodes tested.
    pub visited_nodes: f64,
    /// Median time, seconds.
    pub seconds_median: f64,
}

/// What one method of interpolation did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContourResult {
    /// The method.
    pub method: String,
    /// Median time, seconds.
    pub seconds_median: f64,
    /// Distance to the exact outline: the area between over the length, pixels.
    pub error_px: f64,
    /// Bytes of the silhouettes.
    pub data_bytes: u64,
}

/// Frames, timed with processor and device one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameResults {
    /// What drew them.
    pub adapter: String,
    /// Side of the pictures, pixels.
    pub size_px: u32,
    /// Faces of the hull that is clipped.
    pub hull_faces: usize,
    /// Faces of a mesh, and seconds for a frame of it, fewest faces first; the last may have more than the model.
    pub full: Vec<(usize, f64)>,
    /// Seconds for a frame of the hull clipped to the interpolated outline, and the method.
    pub interpolated: Option<(String, f64)>,
    /// Seconds for a frame of the hull alone.
    pub hull_seconds: f64,
}

/// How the eye moves from one extraction to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// In small steps.
    Walk,
    /// To anywhere.
    Scattered,
}

/// The method on all cores; all others have one thread.
pub const PARALLEL: &str = "brute-parallel";
/// The method that all are compared with.
pub const BRUTE: &str = "brute";
/// Cost of testing a node over that of an edge, as the 2000 paper weighs them.
const NODE_COST: f64 = 4.0 / 3.0;

impl ExtractionResult {
    /// What it did at viewpoints that follow each other so.
    #[must_use]
    pub fn on(&self, motion: Motion) -> &Extracted {
        match motion {
            Motion::Walk => &self.walk,
            Motion::Scattered => &self.scattered,
        }
    }
}

impl ComparisonLevel {
    /// The result of a method.
    #[must_use]
    pub fn of(&self, method: &str) -> Option<&ExtractionResult> {
        self.methods.iter().find(|m| m.method == method)
    }

    /// How many times less than scalar brute force a method takes.
    #[must_use]
    pub fn times_faster(&self, result: &ExtractionResult, motion: Motion) -> Option<f64> {
        let brute = self.of(BRUTE)?.on(motion).seconds_median;
        Some(brute / result.on(motion).seconds_median.max(f64::MIN_POSITIVE))
    }

    /// Tests of Johannsen and Carter's hierarchy over those of the cones.
    #[must_use]
    pub fn cones_over_jc(&self) -> Option<f64> {
        let cost = |method: &str| {
            let found = self.of(method)?.scattered;
            Some(found.tested_edges + NODE_COST * found.visited_nodes)
        };
        Some(cost("jc")? / cost("cones")?.max(1.0))
    }

    /// The method that takes the least time for some viewpoints in all, preparation included, on one thread; and that time.
    #[must_use]
    pub fn fastest_in_all(&self, viewpoints: u32) -> Option<(&ExtractionResult, f64)> {
        (self.methods.iter())
            .filter(|r| r.method != PARALLEL)
            .map(|r| {
                let each = r.scattered.seconds_median;
                (r, r.build_seconds + f64::from(viewpoints) * each)
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The method that takes the least time.
    #[must_use]
    pub fn fastest(&self, motion: Motion, is_on_one_thread: bool) -> Option<&ExtractionResult> {
        (self.methods.iter())
            .filter(|r| !is_on_one_thread || r.method != PARALLEL)
            .min_by(|a, b| {
                let seconds = |r: &ExtractionResult| r.on(motion).seconds_median;
                seconds(a).total_cmp(&seconds(b))
            })
    }
}

impl Comparison {
    /// The fewest faces at which `method` is faster than `other`, here and at all finer levels.
    #[must_use]
    pub fn crossover(&self, method: &str, other: &str, motion: Motion) -> Option<usize> {
        let is_faster = |level: &&ComparisonLevel| {
            let seconds = |name: &str| level.of(name).map(|r| r.on(motion).seconds_median);
            matches!((seconds(method), seconds(other)), (Some(a), Some(b)) if a < b)
        };
        let faster = self.levels.iter().rev().take_while(is_faster);
        faster.last().map(|level| level.faces)
    }

    /// Faces of the levels at which `method` takes less time than all others.
    #[must_use]
    pub fn levels_won(&self, method: &str, motion: Motion) -> Vec<usize> {
        (self.levels.iter())
            .filter(|level| {
                level
                    .fastest(motion, false)
                    .is_some_and(|r| r.method == method)
            })
            .map(|level| level.faces)
            .collect()
    }

    /// The power of the number of silhouette edges with which a method's time grows, at scattered viewpoints: the slope of figure 9
    /// with both axes logarithmic.
    #[must_use]
    pub fn growth(&self, method: &str) -> Option<f64> {
        self.power(|level| Some(level.of(method)?.scattered.seconds_median))
    }

    /// The power of the number of silhouette edges with which something grows, by least squares over the levels.
    pub fn power(&self, value: impl Fn(&ComparisonLevel) -> Option<f64>) -> Option<f64> {
        const FEWEST_LEVELS: usize = 3;
        let points: Vec<(f64, f64)> = (self.levels.iter())
            .filter_map(|level| {
                let edges = level.of(BRUTE)?.scattered.silhouette_edges;
                Some((edges.ln(), value(level)?.ln()))
            })
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        let count = points.len() as f64;
        let mean_x = points.iter().map(|p| p.0).sum::<f64>() / count;
        let mean_y = points.iter().map(|p| p.1).sum::<f64>() / count;
        let spread: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let both: f64 = (points.iter())
            .map(|p| (p.0 - mean_x) * (p.1 - mean_y))
            .sum();
        (points.len() >= FEWEST_LEVELS && spread > 0.0).then(|| both / spread)
    }

    /// Methods that plots show: the one that all are compared with, the papers' own, and those that are the fastest somewhere.
    #[must_use]
    pub fn telling_methods(&self) -> Vec<&str> {
        let is_papers = |name: &str| {
            name == BRUTE || name == PARALLEL || name == "cones" || name.starts_with("dual")
        };
        let wins = |name: &str| {
            [Motion::Walk, Motion::Scattered].into_iter().any(|motion| {
                (self.levels.iter())
                    .filter_map(|level| level.fastest(motion, true))
                    .any(|r| r.method == name)
            })
        };
        let all = self.levels.last().map_or(&[][..], |level| &level.methods);
        (all.iter().map(|r| r.method.as_str()))
            .filter(|name| is_papers(name) || wins(name))
            .collect()
    }

    /// The fewest faces from which on the hull clipped by `method` has a finer silhouette than a mesh drawn in the same time.
    #[must_use]
    pub fn clipping_pays_from(&self, method: &str) -> Option<usize> {
        let pairs = self.same_time(method);
        let pays = |pair: &&(usize, Option<f64>)| pair.1.is_some_and(|drawn| drawn < pair.0 as f64);
        pairs
            .iter()
            .rev()
            .take_while(pays)
            .last()
            .map(|pair| pair.0)
    }

    /// For each level: its faces, and how many faces can be drawn unclipped in the time of the hull clipped to its silhouette by
    /// `method` (figure 11).
    #[must_use]
    pub fn same_time(&self, method: &str) -> Vec<(usize, Option<f64>)> {
        let Some(frames) = &self.frames else {
            return Vec::new();
        };
        (self.levels.iter())
            .filter_map(|level| {
                let seconds = level.of(method)?.frame_seconds?;
                Some((level.faces, frames.faces_drawn_in(seconds)))
            })
            .collect()
    }
}

impl FrameResults {
    /// How many faces of a mesh can be drawn in this time: in between the measured ones as a power of the time, `None` beyond them.
    #[must_use]
    pub fn faces_drawn_in(&self, seconds: f64) -> Option<f64> {
        // More faces do not take less time, but measured times scatter.
        let mut least = 0.0_f64;
        let times: Vec<(f64, f64)> = (self.full.iter())
            .map(|&(faces, time)| {
                least = least.max(time);
                (faces as f64, least)
            })
            .collect();
        times.windows(2).find_map(|pair| {
            let ((faces, time), (more_faces, more_time)) = (pair[0], pair[1]);
            if !(time <= seconds && seconds <= more_time) || time <= 0.0 {
                return None;
            }
            if more_time <= time {
                return Some(more_faces);
            }
            let share = (seconds / time).ln() / (more_time / time).ln();
            Some(faces * (more_faces / faces).powf(share))
        })
    }

    /// Seconds for a frame of a mesh of exactly this many faces, where it was drawn.
    #[must_use]
    pub fn full_seconds(&self, faces: usize) -> Option<f64> {
        self.full.iter().find(|f| f.0 == faces).map(|f| f.1)
    }
}
