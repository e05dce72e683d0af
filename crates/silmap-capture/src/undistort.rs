//! Views without their lens: what a pinhole camera of the same place would have seen.
//!
//! Outlines are taken out of the photograph point by point, the mask is what they enclose, and the photograph is sampled where it is
//! asked for. Carving looks into the photograph's own mask, so that nothing is sampled twice. The pinhole camera has the photograph's focal
//! lengths; its image is the box around what the photograph shows, and at most three times as large along each side, so that the far
//! corners of a fisheye lens are given up. What the photograph does not show of that box is unknown.

use glam::DVec2;
use image::RgbaImage;
use rayon::prelude::*;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{ColourImage, Loop, Mask};

use crate::border::{box_of_border, farthest};
use crate::error::CaptureFault;
use crate::lens::{Distortion, Lens, NOT_FINITE};
use crate::mask_file::read_photo;
use crate::mask_image::MaskFault;
use crate::pinhole::Pinhole;
use crate::resample::resampled;
use crate::view::CaptureView;

/// A straight run of an outline is cut into pieces of this length: a lens bends it.
const PIECE_PX: f64 = 2.0;

/// The box reaches beyond the photograph by this share of its sides, at most...
const MOST_BEYOND: f64 = 0.25;

/// ... or by this share where the object does.
const MOST_BEYOND_FOR_OBJECT: f64 = 1.0;

/// Room around the object there, pixels.
const MARGIN_PX: f64 = 24.0;

impl Lens {
    /// The lens of a view; `None` of one without distortion.
    ///
    /// # Errors
    /// When its numbers mean nothing.
    pub(crate) fn of_view(
        name: &str,
        mut distortion: Distortion,
        camera: &Pinhole,
    ) -> Result<Option<Self>, CaptureFault> {
        if distortion.is_none() {
            return Ok(None);
        }
        // The camera of a left-handed pose looks along the other axis of x: what is even in x has the other sign there.
        if camera.focal.x < 0.0 {
            distortion.tangential[1] = -distortion.tangential[1];
            distortion.prism[0] = -distortion.prism[0];
        }
        let intrinsics = (camera.focal, camera.skew, camera.principal);
        let lens = Self::new(distortion, intrinsics, (camera.width, camera.height));
        lens.map(Some).ok_or_else(|| CaptureFault::Lens {
            view: name.to_owned(),
            reason: NOT_FINITE,
        })
    }

    /// Where the photograph shows an image point of a pinhole camera; `None` where it does not.
    fn place_of(&self, camera: &Pinhole, image: DVec2) -> Option<DVec2> {
        let place = self.photo_from_tangent(camera.tangent(image))?;
        self.shows(place).then_some(place)
    }
}

/// Gives a view, read with the camera of its photograph, a pinhole camera and what that shows.
pub(crate) fn without_lens(
    view: CaptureView,
    distortion: Distortion,
) -> Result<CaptureView, CaptureFault> {
    let camera = &view.camera;
    let Some(lens) = Lens::of_view(&view.name, distortion, camera)? else {
        return Ok(view);
    };
    let fault = |reason: &'static str| CaptureFault::Lens {
        view: view.name.clone(),
        reason,
    };
    let outline: Vec<Loop> = (view.outline.iter())
        .map(|points| straightened(points, &lens, camera))
        .collect();
    let (low, size) = box_of(&lens, camera, &outline)
        .ok_or_else(|| fault("it shows nothing of its image: its distortion folds all of it"))?;
    let pinhole = Pinhole {
        principal: camera.principal - low,
        width: size.0,
        height: size.1,
        ..*camera
    };
    let moved = |points: Loop| -> Loop { points.into_iter().map(|p| p - low).collect() };
    let mut outline: Vec<Loop> = outline.into_iter().map(moved).collect();
    let known = known(&lens, &pinhole);
    let with_smooth = (view.outline.iter()).zip(&outline).map(|(taken, found)| {
        let smooth = smooth(taken);
        smooth.map_or_else(|| found.clone(), |l| moved(straightened(&l, &lens, camera)))
    });
    let with_smooth: Vec<Loop> = with_smooth.collect();
    outline.retain(|points| points.len() > 2);
    let mut mask = Mask::new(size.0, size.1);
    fill_even_odd(&with_smooth, &mut mask);
    if let Some(known) = &known {
        mask.intersect(known);
    }
    if mask.count() == 0 {
        return Err(fault(
            "it shows nothing of the object: the mask lies where its distortion folds",
        ));
    }
    Ok(CaptureView {
        camera: pinhole,
        taken: Some(view.mask),
        mask,
        outline,
        lens: Some(lens),
        known,
        ..view
    })
}

impl CaptureView {
    /// Where the photograph shows an image point of the camera; `None` where the lens shows it nowhere. It may lie beside the photograph.
    #[must_use]
    pub fn photo_from_image(&self, image: DVec2) -> Option<DVec2> {
        match &self.lens {
            Some(lens) => lens.photo_from_tangent(self.camera.tangent(image)),
            None => Some(image),
        }
    }

    /// Columns and rows of the photograph, which differ from the camera's where a lens was taken out.
    pub(crate) fn photo_size(&self) -> (u32, u32) {
        let of_camera = (self.camera.width, self.camera.height);
        self.lens
            .map_or(of_camera, |lens| (lens.width, lens.height))
    }

    /// Whether the photograph shows an image point of the camera, whatever is there.
    #[must_use]
    pub fn is_known(&self, image: DVec2) -> bool {
        let is_known = |known: &Mask| known.get(image.x.floor() as i64, image.y.floor() as i64);
        self.camera.shows(image) && self.known.as_ref().is_none_or(is_known)
    }

    /// The photograph as the camera sees it, of the camera's size: the lens is taken out, and what the photograph does not show is
    /// transparent. `None` where there is no photograph.
    ///
    /// # Errors
    /// When the file cannot be read, or is no picture.
    pub fn photograph(&self) -> Result<Option<RgbaImage>, MaskFault> {
        let Some(path) = &self.photo else {
            return Ok(None);
        };
        let picture = read_photo(path, self.photo_size())?.into_rgba8();
        Ok(Some(match &self.lens {
            Some(lens) => straight(picture, lens, &self.camera),
            None => picture,
        }))
    }
}

/// A photograph as a pinhole camera sees it, transparent where the photograph shows nothing.
pub(crate) fn straight(photograph: RgbaImage, lens: &Lens, camera: &Pinhole) -> RgbaImage {
    let (width, height) = (camera.width, camera.height);
    let photograph = ColourImage {
        width: photograph.width(),
        height: photograph.height(),
        rgba: photograph.into_raw(),
    };
    let place = |image| lens.place_of(camera, image);
    let straight = resampled(&photograph, (width, height), [0; 4], place);
    RgbaImage::from_raw(width, height, straight.rgba).expect("four bytes for each pixel")
}

/// The pixels of a pinhole camera whose centres the photograph shows, in a place for which `is_wanted` holds.
pub(crate) fn straight_mask(
    lens: &Lens,
    camera: &Pinhole,
    is_wanted: impl Fn(DVec2) -> bool + Sync,
) -> Mask {
    let mut mask = Mask::new(camera.width, camera.height);
    let words = mask.words_per_row();
    (mask.words_mut().par_chunks_exact_mut(words).enumerate()).for_each(|(y, row)| {
        for x in 0..camera.width as usize {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            if lens.place_of(camera, centre).is_some_and(&is_wanted) {
                row[x / 64] |= 1 << (x % 64);
            }
        }
    });
    mask
}

/// The pixels whose centres the photograph shows; `None` where it shows all.
pub(crate) fn known(lens: &Lens, camera: &Pinhole) -> Option<Mask> {
    let mask = straight_mask(lens, camera, |_| true);
    let all = u64::from(camera.width) * u64::from(camera.height);
    (mask.count() < all).then_some(mask)
}

/// A loop without the steps of pixels: the polygon of the middles of the pixels' borders that it runs along. `None` where it runs along
/// none.
fn smooth(points: &Loop) -> Option<Loop> {
    if points.iter().any(|p| *p != p.round()) {
        return None;
    }
    let next = points.iter().cycle().skip(1);
    let middles = points.iter().zip(next).flat_map(|(&from, &to)| {
        let count = from.distance(to).round() as u32;
        (0..count).map(move |k| from.lerp(to, (f64::from(k) + 0.5) / f64::from(count)))
    });
    Some(middles.collect())
}

/// A loop of the photograph in the image that a pinhole camera with the photograph's focal lengths and principal point would have.
fn straightened(points: &[DVec2], lens: &Lens, camera: &Pinhole) -> Loop {
    let mut found = Loop::new();
    for (k, &from) in points.iter().enumerate() {
        let to = points[(k + 1) % points.len()];
        let pieces = (from.distance(to) / PIECE_PX).ceil().max(1.0);
        for piece in 0..pieces as u32 {
            let place = from.lerp(to, f64::from(piece) / pieces);
            found.extend(image_of(place, lens, camera));
        }
    }
    found
}

/// Where a place of the photograph lies without the lens, or the nearest place of the domain towards the axis.
fn image_of(place: DVec2, lens: &Lens, camera: &Pinhole) -> Option<DVec2> {
    let at = |share: f64| lens.tangent_from_photo(camera.principal.lerp(place, share));
    farthest(at).map(|tangent| camera.image(tangent))
}

/// The box of the pinhole camera's image: its corner, in the image of [`straightened`], and its size.
fn box_of(lens: &Lens, camera: &Pinhole, outline: &[Loop]) -> Option<(DVec2, (u32, u32))> {
    let size = DVec2::new(lens.width.into(), lens.height.into());
    let whole = box_of_border(size, |place| image_of(place, lens, camera))?;
    let limits = |share: f64| (-share * size, (1.0 + share) * size);
    let (least, most) = limits(MOST_BEYOND);
    let (mut low, mut high) = (whole.0.max(least), whole.1.min(most));
    let mut of_object = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for &p in outline.iter().flatten() {
        of_object = (of_object.0.min(p), of_object.1.max(p));
    }
    if of_object.0.cmple(of_object.1).all() {
        let (least, most) = limits(MOST_BEYOND_FOR_OBJECT);
        low = low.min((of_object.0 - MARGIN_PX).max(least)).max(whole.0);
        high = high.max((of_object.1 + MARGIN_PX).min(most)).min(whole.1);
    }
    // To whole pixels: a lens that moves nothing by half a pixel changes no size.
    let (low, high) = (low.round(), high.round());
    let sides = (high - low).min(DVec2::splat(f64::from(MAX_SIDE_PX)));
    let is_some = low.is_finite() && sides.is_finite() && sides.cmpge(DVec2::ONE).all();
    is_some.then_some((low, (sides.x as u32, sides.y as u32)))
}
