//! How far pictures may differ. Adapters round differently, so none is asked to agree to the bit; all tolerances are here,
//! each with its reason, and no other file can make one.

/// A tolerance for comparing two pictures of one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tolerance {
    value: u8,
    max_outliers: u32,
}

impl Tolerance {
    /// Largest difference of a channel that is no difference.
    #[must_use]
    pub fn value(&self) -> u8 {
        self.value
    }

    /// Most pixels that may differ by more.
    #[must_use]
    pub fn max_outliers(&self) -> u32 {
        self.max_outliers
    }
}

/// The stencil's region against a polygon filled on the processor. A fan's inner edges cancel exactly, so only centres that
/// lie on an edge to within the rasteriser's 1/256 pixel can differ: 2–4 of 6000 were seen between adapters.
pub const STENCIL_FILL: Tolerance = Tolerance {
    value: 0,
    max_outliers: 24,
};

/// The stencil's region against a path rasteriser, which rounds corners and slopes itself and so is up to 1/16 pixel off
/// its own edges: of 2750 pixels of edge in one tangle, 36 pixels differed, from our processor's fill as much as from the
/// device's.
pub const PATH_FILL: Tolerance = Tolerance {
    value: 0,
    max_outliers: 48,
};

/// A mesh's mask from the device against the processor's. Vertices are rounded to 1/256 pixel in different ways; centres
/// that near to an edge differ.
pub const CAPTURE_MASK: Tolerance = Tolerance {
    value: 0,
    max_outliers: 24,
};

/// Smoothed coverage against the area that a path rasteriser finds: the ramp by distance is exact for edges along rows and
/// columns and up to 9 % (23 of 255) off for diagonals; corners and features under a pixel wide are off by more.
pub const SOFT_COVERAGE: Tolerance = Tolerance {
    value: 28,
    max_outliers: 40,
};

/// Multisampled coverage against the true area. Four samples distinguish five shares: half a step (32 of 255), and as much
/// again for where the samples lie, with a margin for corners in a pixel.
pub const SAMPLED_COVERAGE: Tolerance = Tolerance {
    value: 80,
    max_outliers: 40,
};

/// A picture against its golden one. Shading differs by rounding; edge pixels by the rasteriser's grid.
pub const GOLDEN: Tolerance = Tolerance {
    value: 6,
    max_outliers: 60,
};

/// Distance in pixels from an edge of the exact outline within which a mask drawn on the processor may differ from it:
/// corners are rounded by up to 1/8192 pixel along each axis, and thin faces may turn over by that.
pub const RASTERISED_EDGE_PX: f64 = 1.0 / 2048.0;
