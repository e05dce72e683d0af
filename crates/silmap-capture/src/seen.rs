//! The silhouettes that photographs show themselves, completed and corrected by the carved hull.
//!
//! An outline is a mask's own where the mask agrees with the hull that all masks leave, up to noise. Where it strays farther (a bite out
//! of a mask, a blob of background) the other masks have outvoted it, and the hull's silhouette takes its place, as it does where the
//! object leaves the image. What share is left of the mask is known for each outline.

use std::cell::LazyCell;

use glam::DVec2;
use rayon::prelude::*;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Loop, Mask, SeenSilhouette, TriangleMesh, polygon};

use crate::carve::Carved;
use crate::pinhole::Pinhole;
use crate::residual::{median, quantile, silhouette};
use crate::signed_distance::SignedDistance;
use crate::view::{Capture, CaptureView};

/// What is noise of a mask, pixels, however coarse the voxels.
const LEAST_NOISE_PX: f64 = 4.0;

/// This share of the pixels along an outline is within the usual noise...
const USUAL: f64 = 0.98;

/// ... and what strays this much farther is none.
const BEYOND_USUAL: f64 = 1.5;

/// What is no wider than this, pixels, or than a voxel, voxels cannot show: it is the mask's, whatever the hull has there.
const LEAST_WIDTH_PX: f64 = 3.0;

/// What is replaced reaches from there back to this share of it.
const BACK_TO: f64 = 0.35;

/// A view whose outline is its own by a smaller share disagrees with the rest: its camera may be wrong, or most of its mask.
const LEAST_PHOTOGRAPHED: f64 = 0.4;

/// This share of the pixels beyond the hull is what a wider hull must have room for.
const MOST_ENCLOSED: f64 = 0.95;

/// Pixels beside what the hull covers.
const MARGIN_PX: f64 = 2.0;

/// An object this much larger than its image, in images, is not completed.
const MOST_BESIDE: f64 = 2.0;

/// Nor is one that makes the picture of both so many times as large as the image.
const MOST_LARGER: f64 = 4.0;

/// A photograph's outline of the whole object.
#[derive(Clone, Debug)]
pub struct SeenOutline {
    /// The outline, in the coordinates of the hull's mesh.
    pub silhouette: SeenSilhouette,
    /// How far it strays beyond the carved hull, length units at the hull's middle.
    pub beyond: f64,
}

/// The outlines of all views, in their order; `None` where a view disagrees with most of the rest or the hull is too near to its camera.
#[must_use]
pub fn seen_outlines(capture: &Capture, carved: &Carved) -> Vec<Option<SeenOutline>> {
    let origin = carved.mesh.origin();
    let drawn: Vec<Option<Drawn>> = (capture.views.par_iter().enumerate())
        .map(|(k, view)| {
            carved.residuals[k]?;
            Drawn::of(carved.mesh.mesh(), &view.camera.moved(-origin), view)
        })
        .collect();
    let noises: Vec<f64> = drawn.par_iter().flatten().map(Drawn::noise).collect();
    let usual = median(noises).unwrap_or(0.0);
    (capture.views.par_iter().zip(drawn))
        .map(|(view, drawn)| {
            let drawn = drawn?;
            let middle = carved.mesh.bounds().center;
            let (_, depth) = drawn.camera.project(middle)?;
            let voxel_px = carved.voxel * drawn.camera.pixels_per_tangent() / depth;
            let noise = LEAST_NOISE_PX.max(voxel_px).max(BEYOND_USUAL * usual);
            let px = depth / drawn.camera.pixels_per_tangent();
            let widths = (noise, LEAST_WIDTH_PX.max(voxel_px), px);
            let outline = drawn.outline(view, widths);
            (outline.silhouette.photographed >= LEAST_PHOTOGRAPHED).then_some(outline)
        })
        .collect()
}

/// A mask beside the hull's silhouette, in an image that holds both.
struct Drawn {
    camera: Pinhole,
    /// Columns and rows left of and above the image.
    before: [u32; 2],
    hull: Mask,
    mask: Mask,
    /// What the image shows.
    shown: Mask,
    distances: SignedDistance,
}

impl Drawn {
    /// `None` where the hull reaches behind the camera or far beyond the image.
    fn of(hull: &TriangleMesh, camera: &Pinhole, view: &CaptureView) -> Option<Self> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &point in &hull.positions {
            let (image, _) = camera.project(point)?;
            (low, high) = (low.min(image), high.max(image));
        }
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let room = |beside: DVec2| {
            let px = (beside + MARGIN_PX).ceil().max(DVec2::ZERO);
            px.cmple(MOST_BESIDE * size)
                .all()
                .then(|| px.as_uvec2().to_array())
        };
        let (before, after) = (room(-low)?, room(high - size)?);
        let wide = Pinhole {
            width: camera.width + before[0] + after[0],
            height: camera.height + before[1] + after[1],
            principal: camera.principal + DVec2::new(before[0].into(), before[1].into()),
            ..*camera
        };
        let is_too_large =
            f64::from(wide.width) * f64::from(wide.height) > MOST_LARGER * size.x * size.y;
        if is_too_large || wide.width.max(wide.height) > MAX_SIDE_PX {
            return None;
        }
        let drawn = silhouette(hull, &wide)?;
        let mut shown = Mask::new(wide.width, wide.height);
        for y in 0..camera.height {
            let from = i64::from(before[0]);
            shown.set_span(y + before[1], from, from + i64::from(camera.width));
        }
        if let Some(known) = &view.known {
            shown.intersect(&moved(known, before, &wide));
        }
        Some(Self {
            camera: *camera,
            before,
            distances: SignedDistance::new(&drawn),
            hull: drawn,
            mask: moved(&view.mask, before, &wide),
            shown,
        })
    }

    /// The distance from the hull's outline that most pixels along the mask's are within.
    fn noise(&self) -> f64 {
        let mask = &self.mask;
        let away = (self.shown.pixels()).filter_map(|(column, row)| {
            let (x, y) = (i64::from(column), i64::from(row));
            let differs = |x: i64, y: i64, other: (i64, i64)| {
                self.shown.get(other.0, other.1) && mask.get(x, y) != mask.get(other.0, other.1)
            };
            let is_border = differs(x, y, (x - 1, y)) || differs(x, y, (x, y - 1));
            is_border.then(|| self.distances.at(DVec2::new(x as f64, y as f64)).abs())
        });
        quantile(away, USUAL).unwrap_or(0.0)
    }

    /// The outline, the mask's own where it is within `noise` pixels of the hull's, or what is different is not wider than `width`; `px` is
    /// how long a pixel is.
    fn outline(self, view: &CaptureView, (noise, width, px): (f64, f64, f64)) -> SeenOutline {
        let replaced = self.replaced(noise, 0.5 * width);
        let shift = DVec2::new(self.before[0].into(), self.before[1].into());
        let mut whole = self.mask.clone();
        for ((own, &hull), &replaced) in
            (whole.words_mut().iter_mut().zip(self.hull.words())).zip(replaced.words())
        {
            *own = *own & !replaced | hull & replaced;
        }
        let (outline, photographed) = match whole == self.mask {
            true => (view.outline.clone(), 1.0),
            false => {
                let traced = trace_contours(&whole);
                let photographed = share_beside(&traced, &replaced);
                let back = |points: Loop| points.into_iter().map(|p| p - shift).collect();
                (traced.into_iter().map(back).collect(), photographed)
            }
        };
        SeenOutline {
            silhouette: SeenSilhouette {
                name: view.name.clone(),
                eye: self.camera.eye,
                outline,
                ray_from_image: self.camera.ray_from_image(),
                photographed,
            },
            beyond: px * self.beyond(&whole),
        }
    }

    /// How far most pixels that the hull does not cover are from those that it does, pixels.
    fn beyond(&self, whole: &Mask) -> f64 {
        let beside = (whole.pixels()).filter(|&(x, y)| !self.hull.get(x.into(), y.into()));
        let away = beside.map(|pixel| self.distances.at(middle_of(pixel)) + 0.5);
        quantile(away, MOST_ENCLOSED).unwrap_or(0.0)
    }

    /// The pixels where the hull's silhouette takes the mask's place.
    fn replaced(&self, noise: f64, half_width: f64) -> Mask {
        let (width, height) = (self.mask.width(), self.mask.height());
        let (mut found, mut different) = (Mask::new(width, height), self.mask.clone());
        for y in 0..height {
            found.set_span(y, 0, width.into());
        }
        for (word, shown) in found.words_mut().iter_mut().zip(self.shown.words()) {
            *word &= !shown;
        }
        for ((word, &hull), &shown) in
            (different.words_mut().iter_mut().zip(self.hull.words())).zip(self.shown.words())
        {
            *word = (*word ^ hull) & shown;
        }
        let stray = |pixel| self.distances.at(middle_of(pixel)).abs();
        // Few views stray anywhere, and only they need to know how wide they do.
        let inside = LazyCell::new(|| SignedDistance::new(&different));
        let is_wide = |pixel| inside.at(middle_of(pixel)) <= -half_width;
        let mut open: Vec<(u32, u32)> = (different.pixels())
            .filter(|&pixel| stray(pixel) > noise && is_wide(pixel))
            .collect();
        for &(x, y) in &open {
            found.set(x, y, true);
        }
        while let Some((x, y)) = open.pop() {
            for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let (column, row) = (i64::from(x) + dx, i64::from(y) + dy);
                if found.get(column, row) || !different.get(column, row) {
                    continue;
                }
                let pixel = (column as u32, row as u32);
                if stray(pixel) > BACK_TO * noise {
                    found.set(pixel.0, pixel.1, true);
                    open.push(pixel);
                }
            }
        }
        found
    }
}

fn middle_of((x, y): (u32, u32)) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

/// A mask in a larger image.
fn moved(mask: &Mask, [left, above]: [u32; 2], wide: &Pinhole) -> Mask {
    if (left, above) == (0, 0) && (mask.width(), mask.height()) == (wide.width, wide.height) {
        return mask.clone();
    }
    let mut found = Mask::new(wide.width, wide.height);
    for (x, y) in mask.pixels() {
        found.set(x + left, y + above, true);
    }
    found
}

/// The share of the length of traced loops that has no pixel of `replaced` beside it.
fn share_beside(loops: &[Loop], replaced: &Mask) -> f64 {
    let (mut whole, mut own) = (0.0, 0.0);
    for (from, to) in loops.iter().flat_map(|points| polygon::edges(points)) {
        let steps = from.distance(to).round().max(1.0) as u32;
        let along = (to - from) / f64::from(steps);
        let aside = 0.5 * along.perp();
        for k in 0..steps {
            let middle = from + along * (f64::from(k) + 0.5);
            let is_replaced = [aside, -aside].iter().any(|&a| {
                let pixel = (middle + a).floor();
                replaced.get(pixel.x as i64, pixel.y as i64)
            });
            whole += 1.0;
            own += f64::from(u8::from(!is_replaced));
        }
    }
    own / f64::max(whole, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use silmap_geometry::Watch;
    use silmap_geometry::polygon::{fill_non_zero, signed_area};

    use crate::carve::carve_wider;
    use crate::tests::{self, SIZE, cameras, carved, model};

    const VIEWS: usize = 18;

    /// The capture of a torus; `spoil` changes masks.
    fn capture(spoil: impl Fn(usize, &mut Pinhole, &mut Mask)) -> Capture {
        let mut capture = tests::capture(VIEWS);
        for (k, view) in capture.views.iter_mut().enumerate() {
            spoil(k, &mut view.camera, &mut view.mask);
            view.outline = trace_contours(&view.mask);
        }
        capture
    }

    fn seen(capture: &Capture, outvoted: u32) -> Vec<Option<SeenOutline>> {
        seen_outlines(capture, &carved(capture, Some(outvoted)).unwrap())
    }

    fn area(outline: &SeenOutline) -> f64 {
        let loops = outline.silhouette.outline.iter();
        loops.map(|points| signed_area(points)).sum()
    }

    #[test]
    fn outlines_of_good_masks_are_their_own() {
        let capture = capture(|_, _, _| ());
        for (view, seen) in capture.views.iter().zip(seen(&capture, 0)) {
            let seen = seen.unwrap().silhouette;
            let name = &view.name;
            assert_eq!(seen.photographed, 1.0, "{name}");
            let area = |loops: &[Loop]| loops.iter().map(|l| signed_area(l)).sum::<f64>();
            assert!(
                seen.outline == view.outline,
                "{name}: {} loops for {}, area {} for {}",
                seen.outline.len(),
                view.outline.len(),
                area(&seen.outline),
                area(&view.outline)
            );
            // The rays are those of the camera.
            let p = DVec2::new(31.0, 77.5);
            let ray = seen.ray(p);
            assert!(ray.distance(view.camera.direction(p)) < 1e-12);
        }
    }

    /// Masks that are a pixel too large here and too small there leave less than each of them shows.
    #[test]
    fn a_wider_hull_has_room_for_what_strays() {
        let capture = capture(|k, _, mask| {
            let whole = mask.clone();
            for (y, x) in (1..SIZE.1 - 1).flat_map(|y| (1..SIZE.0 - 1).map(move |x| (y, x))) {
                let (column, row) = (i64::from(x), i64::from(y));
                let aside = [(1, 0), (-1, 0), (0, 1), (0, -1)];
                let mut beside = aside
                    .iter()
                    .map(|(dx, dy)| whole.get(column + dx, row + dy));
                match k % 2 {
                    0 => mask.set(x, y, whole.get(column, row) || beside.any(|is_set| is_set)),
                    _ => mask.set(x, y, whole.get(column, row) && beside.all(|is_set| is_set)),
                }
            }
        });
        let carved = carved(&capture, Some(0)).unwrap();
        let outlines = seen_outlines(&capture, &carved);
        let beyond = (outlines.iter().flatten())
            .map(|o| o.beyond)
            .fold(0.0, f64::max);
        let wider = carve_wider(&capture, &carved, (beyond, 64), &Watch::silent()).unwrap();
        let missing = |mesh: &TriangleMesh| {
            let share = |(view, outline): (&CaptureView, &Option<SeenOutline>)| {
                let mut own = Mask::new(SIZE.0, SIZE.1);
                fill_non_zero(&outline.as_ref().unwrap().silhouette.outline, &mut own);
                let drawn = silhouette(mesh, &view.camera).unwrap();
                own.count_missing_in(&drawn) as f64 / own.count() as f64
            };
            let shares = capture.views.iter().zip(&outlines).map(share);
            shares.fold(0.0, f64::max)
        };
        let (narrow, wide) = (missing(carved.mesh.mesh()), missing(wider.mesh()));
        assert!(wide < 0.003, "{wide} of an outline is cut off");
        assert!(narrow > 10.0 * wide.max(0.002), "the control: {narrow}");
    }

    #[test]
    fn a_bite_and_a_blob_are_outvoted_and_the_rest_stays() {
        // A bite of 30 × 30 pixels out of the middle of the rim, and a blob in a corner.
        let spoiled = capture(|k, _, mask| {
            if k == 5 {
                for y in 0..200 {
                    let is_bite = (80..110).contains(&y);
                    let last = (0..i64::from(SIZE.0)).rfind(|&x| mask.get(x, i64::from(y)));
                    if let Some(last) = last.filter(|_| is_bite) {
                        for x in last - 30..=last {
                            mask.set(x as u32, y, false);
                        }
                    }
                }
                for y in 5..25 {
                    mask.set_span(y, 5, 25);
                }
            }
        });
        let good = capture(|_, _, _| ());
        let (found, wanted) = (seen(&spoiled, 1), seen(&good, 1));
        let (found, wanted) = (found[5].as_ref().unwrap(), wanted[5].as_ref().unwrap());
        let off = (area(found) - area(wanted)).abs() / area(wanted);
        assert!(off < 0.02, "{off} of the area is off");
        let spoiled_off = (spoiled.views[5].mask.count() as f64 - area(wanted)).abs();
        assert!(spoiled_off > 0.03 * area(wanted), "the control");
        assert!((0.6..0.98).contains(&found.silhouette.photographed));
    }

    #[test]
    fn what_the_image_cuts_off_is_the_hulls() {
        // The image of one camera ends in the middle of the object.
        let cut = capture(|k, camera, mask| {
            if k == 3 {
                camera.width = 118;
                let mut narrow = Mask::new(118, SIZE.1);
                for y in 0..SIZE.1 {
                    for x in (0..118).filter(|&x| mask.get(x.into(), y.into())) {
                        narrow.set(x, y, true);
                    }
                }
                *mask = narrow;
            }
        });
        let found = seen(&cut, 0);
        let outline = found[3].as_ref().unwrap();
        let whole = silhouette(&model(), &cameras(VIEWS)[3]).unwrap();
        let mut filled = Mask::new(SIZE.0, SIZE.1);
        fill_non_zero(&outline.silhouette.outline, &mut filled);
        let off = filled.count_different(&whole) as f64 / whole.count() as f64;
        // The hull's own silhouette is that far off, with so few voxels.
        assert!(off < 0.05, "{off}");
        assert!((0.3..0.8).contains(&outline.silhouette.photographed));
        let missing = 1.0 - cut.views[3].mask.count() as f64 / whole.count() as f64;
        assert!(missing > 0.3, "the control: {missing}");
    }
}
