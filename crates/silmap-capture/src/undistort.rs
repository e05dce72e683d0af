//! Views without their lens: what a pinhole camera of the same place would have seen.
//!
//! Outlines are taken out of the photograph point by point, the mask is what they enclose, and the photograph is sampled where it is
//! asked for. Carving looks into the photograph's own mask, so that nothing is sampled twice. The pinhole camera has the photograph's focal lengths; its image is the box around what the photograph shows, and not
//! much larger than the photograph, so that the far corners of a fisheye lens are given up. What the photograph does not show of that
//! box is unknown.

use glam::DVec2;
use image::{Rgba, RgbaImage};
use rayon::prelude::*;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Loop, Mask, lighting};

use crate::error::CaptureFault;
use crate::lens::{Distortion, Lens, NOT_FINITE};
use crate::mask_file::read_photo;
use crate::mask_image::MaskFault;
use crate::pinhole::Pinhole;
use crate::view::CaptureView;

/// A straight run of an outline is cut into pieces of this length: a lens bends it.
const PIECE_PX: f64 = 2.0;

/// Places along the photograph's border that are looked at for the box, a pixel count apart.
const BORDER_STEP_PX: f64 = 8.0;

/// The box reaches beyond the photograph by this share of its sides, at most...
const MOST_BEYOND: f64 = 0.25;

/// ... or by this share where the object does.
const MOST_BEYOND_FOR_OBJECT: f64 = 1.0;

/// Room around the object there, pixels.
const MARGIN_PX: f64 = 24.0;

/// Halvings of an interval.
const HALVINGS: u32 = 40;

/// Gives a view, read with the camera of its photograph, a pinhole camera and what that shows.
pub(crate) fn without_lens(
    view: CaptureView,
    distortion: &Distortion,
) -> Result<CaptureView, CaptureFault> {
    if distortion.is_none() {
        return Ok(view);
    }
    let fault = |reason: &'static str| CaptureFault::Lens {
        view: view.name.clone(),
        reason,
    };
    let camera = &view.camera;
    let intrinsics = (camera.focal, camera.skew, camera.principal);
    let lens = Lens::new(*distortion, intrinsics, (camera.width, camera.height));
    let lens = lens.ok_or_else(|| fault(NOT_FINITE))?;
    let outline: Vec<Loop> = (view.outline.iter())
        .map(|points| straightened(points, &lens, camera))
        .filter(|points| points.len() > 2)
        .collect();
    let (low, size) = box_of(&lens, camera, &outline)
        .ok_or_else(|| fault("it shows nothing of its image: its distortion folds all of it"))?;
    let pinhole = Pinhole {
        principal: camera.principal - low,
        width: size.0,
        height: size.1,
        ..*camera
    };
    let outline: Vec<Loop> = (outline.into_iter())
        .map(|points| points.into_iter().map(|p| p - low).collect())
        .collect();
    let known = known(&lens, &pinhole);
    let smooth = smooth(&view.outline).map(|points| straightened(&points, &lens, camera));
    let smooth: Vec<Loop> = smooth
        .map(|l| l.into_iter().map(|p| p - low).collect())
        .collect();
    let mut mask = Mask::new(size.0, size.1);
    fill_even_odd(&smooth, &mut mask);
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

    /// The image point of the camera that a place in the photograph shows; `None` where that is beyond the lens's domain.
    #[must_use]
    pub fn image_from_photo(&self, photo: DVec2) -> Option<DVec2> {
        match &self.lens {
            Some(lens) => Some(self.camera.image(lens.tangent_from_photo(photo)?)),
            None => Some(photo),
        }
    }

    /// Columns and rows of the photograph, which differ from the camera's where a lens was taken out.
    #[must_use]
    pub fn photo_size(&self) -> (u32, u32) {
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
        let Some(lens) = &self.lens else {
            return Ok(Some(picture));
        };
        // A file that changed its size since it was looked at.
        let scale = DVec2::new(
            f64::from(picture.width()) / f64::from(lens.width),
            f64::from(picture.height()) / f64::from(lens.height),
        );
        let mut straight = RgbaImage::new(self.camera.width, self.camera.height);
        let row_bytes = 4 * self.camera.width as usize;
        let rows = straight.par_chunks_exact_mut(row_bytes).enumerate();
        rows.for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
                let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let place = self.photo_from_image(centre).filter(|&p| lens.shows(p));
                let colour = place.map_or([0; 4], |p| sample(&picture, p * scale));
                pixel.copy_from_slice(&colour);
            }
        });
        Ok(Some(straight))
    }
}

/// Colour at a place, bilinear in light.
pub(crate) fn sample(picture: &RgbaImage, place: DVec2) -> [u8; 4] {
    let last = DVec2::new(
        f64::from(picture.width() - 1),
        f64::from(picture.height() - 1),
    );
    let place = (place - DVec2::splat(0.5)).clamp(DVec2::ZERO, last);
    let (x, y) = (place.x as u32, place.y as u32);
    let (u, v) = (place.x.fract() as f32, place.y.fract() as f32);
    let right = (x + 1).min(picture.width() - 1);
    let below = (y + 1).min(picture.height() - 1);
    let corners = [
        (x, y, (1.0 - u) * (1.0 - v)),
        (right, y, u * (1.0 - v)),
        (x, below, (1.0 - u) * v),
        (right, below, u * v),
    ];
    let mut sums = [0.0_f32; 4];
    for (x, y, weight) in corners {
        let Rgba(pixel) = *picture.get_pixel(x, y);
        for (k, (sum, byte)) in sums.iter_mut().zip(pixel).enumerate() {
            let value = f32::from(byte) / 255.0;
            *sum += weight
                * if k < 3 {
                    lighting::linear_from_srgb(value)
                } else {
                    value
                };
        }
    }
    std::array::from_fn(|k| {
        let value = if k < 3 {
            lighting::srgb_from_linear(sums[k])
        } else {
            sums[k]
        };
        (255.0 * value).round().clamp(0.0, 255.0) as u8
    })
}

/// Loops without the steps of pixels: those that run along pixel borders become polygons of the borders' middles. Others are as they are.
fn smooth(outline: &[Loop]) -> impl Iterator<Item = Loop> + '_ {
    let is_of_pixels = |points: &Loop| points.iter().all(|p| *p == p.round());
    outline.iter().map(move |points| {
        if !is_of_pixels(points) {
            return points.clone();
        }
        let next = points.iter().cycle().skip(1);
        let edges = points.iter().zip(next);
        let middles = edges.flat_map(|(&from, &to)| {
            let count = from.distance(to).round() as u32;
            (0..count).map(move |k| from.lerp(to, (f64::from(k) + 0.5) / f64::from(count)))
        });
        middles.collect()
    })
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
    if let Some(tangent) = lens.tangent_from_photo(place) {
        return Some(camera.image(tangent));
    }
    let at = |share: f64| lens.tangent_from_photo(camera.principal.lerp(place, share));
    at(0.0)?;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if at(middle).is_some() {
            low = middle
        } else {
            high = middle
        }
    }
    at(low).map(|tangent| camera.image(tangent))
}

/// The box of the pinhole camera's image: its corner, in the image of [`straightened`], and its size.
fn box_of(lens: &Lens, camera: &Pinhole, outline: &[Loop]) -> Option<(DVec2, (u32, u32))> {
    let size = DVec2::new(lens.width.into(), lens.height.into());
    let border = [
        DVec2::ZERO,
        DVec2::new(size.x, 0.0),
        size,
        DVec2::new(0.0, size.y),
    ];
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (k, &from) in border.iter().enumerate() {
        let to = border[(k + 1) % 4];
        let pieces = (from.distance(to) / BORDER_STEP_PX).ceil().max(1.0);
        for piece in 0..pieces as u32 {
            let place = from.lerp(to, f64::from(piece) / pieces);
            if let Some(image) = image_of(place, lens, camera) {
                (low, high) = (low.min(image), high.max(image));
            }
        }
    }
    let whole = (low, high);
    let limits = |share: f64| (-share * size, (1.0 + share) * size);
    let (least, most) = limits(MOST_BEYOND);
    (low, high) = (low.max(least), high.min(most));
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

/// The pixels whose centres the photograph shows; `None` where it shows all.
fn known(lens: &Lens, camera: &Pinhole) -> Option<Mask> {
    let mut mask = Mask::new(camera.width, camera.height);
    let words = mask.words_per_row();
    (mask.words_mut().par_chunks_exact_mut(words).enumerate()).for_each(|(y, row)| {
        for x in 0..camera.width as usize {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let place = lens.photo_from_tangent(camera.tangent(centre));
            if place.is_some_and(|p| lens.shows(p)) {
                row[x / 64] |= 1 << (x % 64);
            }
        }
    });
    let all = u64::from(camera.width) * u64::from(camera.height);
    (mask.count() < all).then_some(mask)
}
