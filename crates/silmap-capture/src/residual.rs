//! How well a carved hull agrees with each mask.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::raster;
use silmap_geometry::{Camera, ClosedMesh, CoverageRule, Mask, TriangleMesh};

use crate::pinhole::Pinhole;
use crate::view::CaptureView;

/// A hull beside a mask, both in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Pixels of both over pixels of either.
    pub overlap: f64,
    /// Pixels of the hull beside the mask, over those of the mask: where this view was outvoted, or could not be followed by voxels.
    pub outvoted: f64,
    /// Pixels of the mask beside the hull, over those of the mask: what other views carved away.
    pub missing: f64,
}

/// The residual of each view; `None` where a part of the hull lies behind its camera.
#[must_use]
pub fn residuals<'a>(
    hull: &ClosedMesh,
    views: impl IntoIterator<Item = &'a CaptureView>,
) -> Vec<Option<Residual>> {
    let views: Vec<&CaptureView> = views.into_iter().collect();
    views
        .par_iter()
        .map(|view| {
            let camera = view.camera.moved(-hull.origin());
            let mut drawn = silhouette(hull.mesh(), &camera)?;
            if let Some(known) = &view.known {
                drawn.intersect(known);
            }
            let of_mask = view.mask.count().max(1) as f64;
            let (beside, missing) = (
                drawn.count_missing_in(&view.mask) as f64,
                view.mask.count_missing_in(&drawn) as f64,
            );
            Some(Residual {
                overlap: (of_mask - missing) / (of_mask + beside),
                outvoted: beside / of_mask,
                missing: missing / of_mask,
            })
        })
        .collect()
}

/// The pixels whose centres a closed mesh covers in the image of a camera, whatever its intrinsics; `None` where some of it lies behind
/// the camera or so far aside that the arithmetic of the rasteriser ends.
#[must_use]
pub fn silhouette(mesh: &TriangleMesh, camera: &Pinhole) -> Option<Mask> {
    let half = 0.5 * DVec2::new(camera.width.into(), camera.height.into());
    // In the camera's frame, sheared so that a plain camera sees the same image.
    let sheared = |&point: &DVec3| {
        let p = camera.camera_from_object(point);
        let off = camera.principal - half;
        let x = camera.focal.x * p.x + camera.skew * p.y + off.x * p.z;
        let y = camera.focal.y * p.y + off.y * p.z;
        DVec3::new(x / half.x, y / half.y, p.z)
    };
    let plain = Camera {
        eye: DVec3::ZERO,
        right: DVec3::X,
        up: DVec3::NEG_Y,
        forward: DVec3::Z,
        half_tangent: DVec2::ONE,
        center_offset: DVec2::ZERO,
        width_px: camera.width,
        height_px: camera.height,
    };
    let mesh = TriangleMesh {
        positions: mesh.positions.iter().map(sheared).collect(),
        faces: mesh.faces.clone(),
        ..TriangleMesh::default()
    };
    let mut mask = Mask::new(camera.width, camera.height);
    raster::cover(&mesh, &plain, CoverageRule::Center, &mut mask).ok()?;
    Some(mask)
}

/// The number in the middle; the lower one of two. `None` of nothing.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// The number that a share of the others are no larger than; the lower one of two. `None` of nothing.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64) as usize).copied()
}

/// Deviations from the median that a view of the rest is within.
const DEVIATIONS: f64 = 5.0;

/// An overlap this little below the median is none the worse, however alike the others are.
const LEAST_DIFFERENCE: f64 = 0.015;

/// Which views disagree with the rest: their overlap is far below the median, by what is usual among the others.
#[must_use]
pub fn disagreeing(residuals: &[Option<Residual>]) -> Vec<usize> {
    let overlaps = || residuals.iter().flatten().map(|r| r.overlap);
    let Some(middle) = median(overlaps()) else {
        return Vec::new();
    };
    let usual = median(overlaps().map(|o| (o - middle).abs())).unwrap_or(0.0);
    let least = middle - (DEVIATIONS * usual).max(LEAST_DIFFERENCE);
    let is_below = |r: &Option<Residual>| r.is_some_and(|r| r.overlap < least);
    (0..residuals.len())
        .filter(|&v| is_below(&residuals[v]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_far_below_the_others_disagrees() {
        let of = |overlap| {
            Some(Residual {
                overlap,
                outvoted: 0.0,
                missing: 0.0,
            })
        };
        let mut all: Vec<_> = (0..20).map(|k| of(0.98 + 0.0005 * f64::from(k))).collect();
        assert!(disagreeing(&all).is_empty());
        all[7] = of(0.9);
        all[9] = None;
        assert_eq!(disagreeing(&all), [7]);
        assert!(disagreeing(&[]).is_empty());
    }
}
