//! The photographs of a capture, cut out around the object and made ready to be asked for colours.
//!
//! Masks are often drawn a little outside of the object, their small holes are filled, and a lens blurs background into its border. What
//! looks like the background around the mask is therefore taken out of it, where little of the object does so itself. How far the
//! background then reaches into what is left is measured on the photographs themselves: to where colours have come most of the way from
//! those outside to those well inside.

use std::path::Path;

use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;
use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};
use silmap_geometry::photograph::INSIDE_STEPS;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{ColourImage, Mask, Photograph};

use crate::residual::median;
use crate::signed_distance::{SignedDistance, bounds_of};
use crate::view::{Capture, CaptureView, CaptureWarning};

/// Reading photographs.
pub const PHOTOGRAPHS: Stage = Stage("reading photographs");

/// Pixels that are kept around the mask.
const MARGIN_PX: u32 = 2;

/// Background reaches so far into a mask at least and at most, pixels of the photograph.
const BORDER_PX: [f64; 2] = [1.5, 6.0];

/// Distances from the border at which there is background for certain, and the object for certain, pixels.
const OUTSIDE_PX: [f64; 2] = [-8.0, -3.0];
const INSIDE_PX: [f64; 2] = [8.0, 14.0];

/// Share of the way from the background's colours to the object's that says that a pixel shows the object.
const ARRIVED: f64 = 0.8;

/// Background and object that differ by less tell nothing, of 255.
const LEAST_DIFFERENCE: f64 = 16.0;

/// A pixel looks like the background when it differs by less than so many times what the background's own pixels do; the difference is
/// at least and at most these shares of what is usual well inside, so that the object's shadows are not taken for a black background.
const SPREADS: f64 = 3.0;
const LIKE_BACKGROUND: [f64; 2] = [0.03, 0.08];

/// Where more of a mask than this looks like the background, the object itself does.
const MOST_TAKEN: f64 = 0.1;

/// A view's photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewPhotograph {
    /// Index of the view in [`Capture::views`].
    pub view: usize,
    /// The photograph, its gain one.
    pub photograph: Photograph,
}

/// Reads the photographs of all views that have one, for points that are counted from `origin`. What is kept of one is the part with the
/// object, halved until neither side has more than `side_px` pixels. One that cannot be read is left out, with a warning.
///
/// # Errors
/// When the caller asked to stop.
pub fn photographs(
    capture: &Capture,
    (origin, side_px): (DVec3, u32),
    warnings: &mut Vec<CaptureWarning>,
    watch: &Watch<'_>,
) -> Result<Vec<ViewPhotograph>, Interrupted> {
    let with_photo: Vec<usize> = (0..capture.views.len())
        .filter(|&v| capture.views[v].photo.is_some())
        .collect();
    watch.start(PHOTOGRAPHS, with_photo.len() as u64);
    let read = (with_photo.par_iter())
        .map(|&v| {
            watch.check()?;
            let view = &capture.views[v];
            let found = colours(view).map(|colours| cut_out(view, &colours, origin));
            watch.advance(PHOTOGRAPHS, 1);
            Ok((v, found))
        })
        .collect::<Result<Vec<_>, Interrupted>>()?;
    watch.finish(PHOTOGRAPHS);
    let (mut found, mut borders) = (Vec::new(), Vec::new());
    for (view, result) in read {
        match result {
            Ok(Some((photograph, border))) => {
                borders.extend(border);
                found.push(ViewPhotograph { view, photograph });
            }
            Ok(None) => {}
            Err(reason) => {
                let view = capture.views[view].name.clone();
                warnings.push(CaptureWarning::Photo { view, reason });
            }
        }
    }
    // One rule made all masks.
    let border = median(borders).unwrap_or(BORDER_PX[0]);
    found.par_iter_mut().for_each(|p| {
        p.photograph.border_px = border;
        while p.photograph.picture.width.max(p.photograph.picture.height) > side_px.max(1) {
            halve(&mut p.photograph);
        }
    });
    Ok(found)
}

/// The photograph as the view's camera sees it, its lens taken out.
fn colours(view: &CaptureView) -> Result<ColourImage, String> {
    let picture = match view.photograph() {
        Ok(Some(picture)) => picture,
        Ok(None) => return Err("there is none".to_owned()),
        Err(fault) => {
            let path = view.photo.as_deref().unwrap_or(Path::new(""));
            return Err(format!("{} {fault}", path.display()));
        }
    };
    let (width, height) = (picture.width(), picture.height());
    // A file that changed since it was looked at.
    if (width, height) != (view.camera.width, view.camera.height) {
        return Err(format!("it has {width} × {height} pixels"));
    }
    Ok(ColourImage {
        width,
        height,
        rgba: picture.into_raw(),
    })
}

/// The part around the mask, and how far background reaches into it, where that can be told; `None` of a mask without pixels.
fn cut_out(
    view: &CaptureView,
    colours: &ColourImage,
    origin: DVec3,
) -> Option<(Photograph, Option<f64>)> {
    let found = Background::around(colours, &SignedDistance::new(&view.mask), &view.mask);
    let taken_out = (found.as_ref()).and_then(|b| b.taken_out(colours, &view.mask));
    let mask = taken_out.as_ref().unwrap_or(&view.mask);
    let (low, high) = bounds_of(mask)?;
    let distances = SignedDistance::new(mask);
    let border = found.and_then(|b| b.reach(colours, &distances, mask));
    let first = low.map(|v| v.saturating_sub(MARGIN_PX));
    let ends = [
        (high[0] + MARGIN_PX).min(colours.width),
        (high[1] + MARGIN_PX).min(colours.height),
    ];
    let [width, height] = [
        ends[0].checked_sub(first[0])?,
        ends[1].checked_sub(first[1])?,
    ];
    let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
    for y in first[1]..ends[1] {
        for x in first[0]..ends[0] {
            let at = 4 * (y as usize * colours.width as usize + x as usize);
            rgba.extend(&colours.rgba[at..at + 3]);
            // Transparent is what a straightened photograph does not show.
            let is_shown = colours.rgba[at + 3] >= 128;
            let inside = if is_shown {
                -distances.at(centre_of(x, y))
            } else {
                0.0
            };
            rgba.push((inside * INSIDE_STEPS).clamp(0.0, 255.0).round() as u8);
        }
    }
    let camera = view.camera.moved(-origin);
    let [a, b, w] = camera.to_matrix().map(DVec4::from_array);
    let corner = DVec2::new(first[0].into(), first[1].into());
    let photograph = Photograph {
        eye: camera.eye,
        image_from_object: [a - w * corner.x, b - w * corner.y, w],
        picture: ColourImage {
            width,
            height,
            rgba,
        },
        border_px: BORDER_PX[0],
        gain: [1.0; 3],
    };
    Some((photograph, border))
}

fn centre_of(x: u32, y: u32) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

/// What is seen around a mask.
struct Background {
    colour: [f64; 3],
    /// Mean difference of its pixels from that.
    spread: f64,
    /// The usual difference of pixels well inside.
    inside: f64,
}

impl Background {
    /// `None` where there is nothing around, or it and the object look alike.
    fn around(colours: &ColourImage, distances: &SignedDistance, mask: &Mask) -> Option<Self> {
        let outside = pixels_at(OUTSIDE_PX, distances, mask);
        let count = outside.len() as f64;
        if outside.is_empty() {
            return None;
        }
        let mut background = Self {
            colour: [0, 1, 2].map(|c| {
                let values = outside.iter().map(|&p| colour_of(colours, p)[c]);
                values.sum::<f64>() / count
            }),
            spread: 0.0,
            inside: 0.0,
        };
        let off = outside.iter().map(|&p| background.off(colours, p));
        background.spread = off.sum::<f64>() / count;
        let inside = pixels_at(INSIDE_PX, distances, mask);
        background.inside = median(inside.iter().map(|&p| background.off(colours, p)))?;
        (background.inside >= LEAST_DIFFERENCE).then_some(background)
    }

    /// Mean difference of a pixel's channels from the background's.
    fn off(&self, colours: &ColourImage, pixel: (u32, u32)) -> f64 {
        let value = colour_of(colours, pixel);
        (0..3)
            .map(|c| (value[c] - self.colour[c]).abs())
            .sum::<f64>()
            / 3.0
    }

    /// The mask without what looks like the background; `None` where much of the object looks so, too.
    fn taken_out(&self, colours: &ColourImage, mask: &Mask) -> Option<Mask> {
        let [low, high] = LIKE_BACKGROUND.map(|share| share * self.inside);
        let most = (SPREADS * self.spread).clamp(low, high);
        let mut alike = Mask::new(mask.width(), mask.height());
        for (x, y) in mask.pixels() {
            alike.set(x, y, self.off(colours, (x, y)) <= most);
        }
        // Only where all around it is alike: pores and grain are the object's.
        let around = || (-1..=1_i64).flat_map(|j| (-1..=1_i64).map(move |i| (i, j)));
        let is_like_background = |x: u32, y: u32| {
            let (x, y) = (i64::from(x), i64::from(y));
            around().all(|(i, j)| alike.get(x + i, y + j) || !mask.get(x + i, y + j))
        };
        let mut rest = mask.clone();
        let mut taken = 0;
        for (x, y) in mask.pixels() {
            if alike.get(x.into(), y.into()) && is_like_background(x, y) {
                rest.set(x, y, false);
                taken += 1;
            }
        }
        (taken as f64 <= MOST_TAKEN * mask.count() as f64).then_some(rest)
    }

    /// How far the background reaches into a mask.
    fn reach(&self, colours: &ColourImage, distances: &SignedDistance, mask: &Mask) -> Option<f64> {
        let usual = |range: [f64; 2]| {
            let there = pixels_at(range, distances, mask);
            median(there.iter().map(|&p| self.off(colours, p)))
        };
        let inside = usual(INSIDE_PX)?;
        let mut depth = 0.5;
        // The first half pixel at which the usual colour has arrived.
        while depth < BORDER_PX[1] && usual([depth, depth + 1.0])? < ARRIVED * inside {
            depth += 0.5;
        }
        // A window's usual colour has arrived when half of it has.
        Some((depth + 1.0).clamp(BORDER_PX[0], BORDER_PX[1]))
    }
}

fn colour_of(colours: &ColourImage, (x, y): (u32, u32)) -> [f64; 3] {
    let at = 4 * (y as usize * colours.width as usize + x as usize);
    [0, 1, 2].map(|c| f64::from(colours.rgba[at + c]))
}

/// Pixels that lie so far inside a mask's border.
fn pixels_at([near, far]: [f64; 2], distances: &SignedDistance, mask: &Mask) -> Vec<(u32, u32)> {
    let (low, high) = bounds_of(mask).unwrap_or(([0; 2], [0; 2]));
    let margin = -OUTSIDE_PX[0] as u32;
    let columns = low[0].saturating_sub(margin)..(high[0] + margin).min(mask.width());
    let rows = low[1].saturating_sub(margin)..(high[1] + margin).min(mask.height());
    rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
        .filter(|&(x, y)| {
            let inside = -distances.at(centre_of(x, y));
            inside >= near && inside < far
        })
        .collect()
}

/// Half as many pixels along each side, each the mean of up to four.
fn halve(photograph: &mut Photograph) {
    let picture = &photograph.picture;
    let (width, height) = (picture.width.div_ceil(2), picture.height.div_ceil(2));
    let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut count, mut inside) = ([0.0_f32; 3], 0.0_f32, u8::MAX);
            for row in 2 * y..(2 * y + 2).min(picture.height) {
                for column in 2 * x..(2 * x + 2).min(picture.width) {
                    let at = 4 * (row as usize * picture.width as usize + column as usize);
                    for (s, &byte) in sum.iter_mut().zip(&picture.rgba[at..at + 3]) {
                        *s += linear_from_srgb(f32::from(byte) / 255.0);
                    }
                    count += 1.0;
                    inside = inside.min(picture.rgba[at + 3]);
                }
            }
            rgba.extend(sum.map(|s| (255.0 * srgb_from_linear(s / count)).round() as u8));
            rgba.push(inside / 2);
        }
    }
    photograph.picture = ColourImage {
        width,
        height,
        rgba,
    };
    photograph.border_px *= 0.5;
    let [a, b, w] = photograph.image_from_object;
    photograph.image_from_object = [0.5 * a, 0.5 * b, w];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pinhole::Pinhole;

    /// A bright disc on dark ground, its mask `wider` pixels larger.
    fn disc(wider: f64) -> (CaptureView, ColourImage) {
        let (width, height) = (160, 120);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let lens = (DVec2::splat(200.0), DVec2::new(80.0, 60.0));
        let eye = DVec3::new(1.0, 0.0, -4.0);
        let from_middle = |x: u32, y: u32| centre_of(x, y).distance(DVec2::new(70.0, 55.0));
        let mut mask = Mask::new(width, height);
        let mut rgba = Vec::new();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            mask.set(x, y, from_middle(x, y) < 40.0 + wider);
            let value = if from_middle(x, y) < 40.0 { 180 } else { 20 };
            rgba.extend([value, value, value - 10, 255]);
        }
        let view = CaptureView {
            name: "disc".to_owned(),
            camera: Pinhole::from_pose(eye, axes, lens, (width, height)).unwrap(),
            mask,
            outline: Vec::new(),
            photo: None,
            lens: None,
            taken: None,
            known: None,
        };
        let colours = ColourImage {
            width,
            height,
            rgba,
        };
        (view, colours)
    }

    #[test]
    fn background_in_a_mask_is_found_and_left_out() {
        for wider in [0.0, 3.0, 4.5] {
            let (view, colours) = disc(wider);
            let (mut photograph, border) = cut_out(&view, &colours, DVec3::ZERO).unwrap();
            let border = border.unwrap();
            let expected = wider.max(BORDER_PX[0]);
            assert!((border - expected).abs() <= 1.0, "{wider}: {border}");
            photograph.border_px = border;
            // All around the disc, wherever there is a colour it is the disc's.
            for k in 0..3600 {
                let turn = f64::from(k) * 0.1;
                let away = 34.0 + f64::from(k % 12);
                let aside = away * DVec2::new(turn.cos(), turn.sin());
                let ray = view.camera.direction(DVec2::new(70.0, 55.0) + aside);
                let at = photograph.image_from_direction(ray).unwrap();
                if let Some(seen) = photograph.look(at) {
                    let value = 255.0 * srgb_from_linear(seen.colour[0]);
                    assert!(value > 165.0 && away < 42.0, "{value} at {away}");
                }
            }
        }
    }

    #[test]
    fn holes_that_a_mask_lacks_show_no_background() {
        let (view, mut colours) = disc(0.0);
        let middle = DVec2::new(60.0, 50.0);
        for (x, y) in view.mask.pixels() {
            if centre_of(x, y).distance(middle) < 7.0 {
                let at = 4 * (y * colours.width + x) as usize;
                colours.rgba[at..at + 3].copy_from_slice(&[22, 19, 12]);
            }
        }
        let (photograph, _) = cut_out(&view, &colours, DVec3::ZERO).unwrap();
        let look = |at: DVec2| {
            let ray = view.camera.direction(at);
            photograph.look(photograph.image_from_direction(ray).unwrap())
        };
        assert_eq!((look(middle), look(middle + DVec2::X * 6.0)), (None, None));
        assert!(look(middle + DVec2::new(0.0, 12.0)).is_some());
        // An object that looks like the background in many places is left as it is.
        for (x, y) in view.mask.pixels().filter(|(x, _)| x % 6 < 3) {
            let at = 4 * (y * colours.width + x) as usize;
            colours.rgba[at..at + 3].copy_from_slice(&[22, 19, 12]);
        }
        let (photograph, _) = cut_out(&view, &colours, DVec3::ZERO).unwrap();
        let ray = view.camera.direction(middle);
        assert!(
            photograph
                .look(photograph.image_from_direction(ray).unwrap())
                .is_some()
        );
    }

    #[test]
    fn cutting_and_halving_keep_what_is_seen_where() {
        let (view, colours) = disc(0.0);
        let origin = DVec3::new(0.3, -0.2, 0.1);
        let (photograph, _) = cut_out(&view, &colours, origin).unwrap();
        let point = view.camera.eye + 2.0 * view.camera.direction(DVec2::new(60.0, 50.0)) - origin;
        let at = photograph.project(point).unwrap();
        // The box of the mask begins at column 30 and row 15.
        assert!(
            at.distance(DVec2::new(60.0 - 28.0, 50.0 - 13.0)) < 1e-9,
            "{at}"
        );
        let mut half = photograph.clone();
        halve(&mut half);
        assert!(half.project(point).unwrap().distance(0.5 * at) < 1e-9);
        assert_eq!(half.picture.width, photograph.picture.width.div_ceil(2));
        let (whole, half) = (photograph.look(at).unwrap(), half.look(0.5 * at).unwrap());
        assert!((whole.colour[0] - half.colour[0]).abs() < 1e-6);
        assert!((whole.inside_px - 2.0 * half.inside_px).abs() < 1.5);
    }

    #[test]
    fn what_looks_like_its_background_has_no_border_of_its_own() {
        let (view, mut colours) = disc(2.0);
        colours.rgba.fill(90);
        assert_eq!(cut_out(&view, &colours, DVec3::ZERO).unwrap().1, None);
    }
}
