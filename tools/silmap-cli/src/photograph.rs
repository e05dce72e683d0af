//! A picture that was drawn for a camera of a capture, with the photograph of that camera behind or beside it.

use anyhow::bail;
use image::RgbaImage;
use image::imageops::{FilterType, resize};
use silmap_capture::{MaskOptions, ViewMask};
use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};
use silmap_geometry::{ColourImage, Mask};

use crate::args::PhotographArg;
use crate::captured_camera::Captured;
use crate::interrupt;
use crate::pictures::beside;

/// More opaque than this is covered.
const COVERED: u8 = 127;

/// What the photograph is dimmed to where differences are shown, of its light.
const DIMMED: f32 = 0.4;

/// Colours of what is drawn beside the mask, and of what is missing there.
const TOO_MUCH: [u8; 3] = [230, 40, 30];
const TOO_LITTLE: [u8; 3] = [40, 90, 240];

/// A photograph in the size of a picture, and the object's mask there.
#[derive(Debug)]
pub(crate) struct Photograph {
    colours: ColourImage,
    mask: Option<ViewMask>,
}

/// A picture as it is written.
#[derive(Debug)]
pub(crate) struct Shown {
    pub(crate) picture: ColourImage,
    /// Intersection over union of what is drawn with the mask.
    pub(crate) overlap: Option<f64>,
}

impl Photograph {
    /// Reads the photograph of a view, and its mask if there is one.
    ///
    /// # Errors
    /// One sentence with the name of the file, or of the view where it has none.
    pub(crate) fn read(captured: &Captured, masks: MaskOptions) -> anyhow::Result<Self> {
        let (file, view) = (captured.file.clone(), captured.view.clone());
        let shown = file.display().to_string();
        let named = view.name.clone();
        let is_straight = !captured.drawing.is_distorted();
        let (photograph, mask) = interrupt::unless_stopped(move || {
            (
                view.photograph(&file, is_straight),
                view.mask(&file, is_straight, &masks),
            )
        })?;
        let Some(photograph) = photograph? else {
            bail!("{shown}: view {named} has no photograph");
        };
        let (width, height) = captured.drawing.size();
        let colours = match photograph.dimensions() == (width, height) {
            true => photograph,
            false => resize(&photograph, width, height, FilterType::Triangle),
        };
        Ok(Self {
            colours: colour_image(colours),
            mask: mask?.map(|found| ViewMask {
                mask: scaled(&found.mask, (width, height)),
                known: found.known.map(|known| scaled(&known, (width, height))),
            }),
        })
    }

    /// The picture with the photograph, of one that was drawn on nothing and is shown on `background` where the photograph is not behind
    /// it.
    ///
    /// # Errors
    /// When the picture has another size.
    pub(crate) fn with(
        &self,
        drawn: &ColourImage,
        place: PhotographArg,
        background: Option<[u8; 3]>,
    ) -> anyhow::Result<Shown> {
        let of = (self.colours.width, self.colours.height);
        if (drawn.width, drawn.height) != of {
            bail!("the picture has not the photograph's size");
        }
        let mut covered = covered(drawn);
        // Of what the photograph does not show its mask says nothing.
        if let Some(known) = self.mask.as_ref().and_then(|of| of.known.as_ref()) {
            covered.intersect(known);
        }
        let overlap = self.mask.as_ref().map(|of| overlap(&covered, &of.mask));
        let picture = match place {
            PhotographArg::Behind => over(drawn, |k| pixel(&self.colours, k)),
            PhotographArg::Beside => {
                let drawn = match background {
                    Some([r, g, b]) => over(drawn, |_| [r, g, b, 255]),
                    None => drawn.clone(),
                };
                beside(&[&self.colours, &drawn, &self.difference(&covered)])
            }
        };
        Ok(Shown { picture, overlap })
    }

    /// The photograph in grey, with what is wrong beside its mask; or, without one, with the border of what is drawn.
    fn difference(&self, covered: &Mask) -> ColourImage {
        let mut rgba = Vec::with_capacity(self.colours.rgba.len());
        for (k, colour) in self.colours.rgba.chunks_exact(4).enumerate() {
            let [x, y] =
                [k % covered.width() as usize, k / covered.width() as usize].map(|v| v as i64);
            let is_drawn = covered.get(x, y);
            let mark = match self.mask.as_ref().map(|of| &of.mask) {
                Some(mask) if is_drawn && !mask.get(x, y) => Some(TOO_MUCH),
                Some(mask) if !is_drawn && mask.get(x, y) => Some(TOO_LITTLE),
                Some(_) => None,
                None => (is_drawn && is_at_border(covered, x, y)).then_some(TOO_MUCH),
            };
            let [r, g, b] = mark.unwrap_or_else(|| grey(colour));
            rgba.extend([r, g, b, 255]);
        }
        ColourImage {
            rgba,
            ..self.colours.clone()
        }
    }
}

fn grey(colour: &[u8]) -> [u8; 3] {
    let light = |c: usize| linear_from_srgb(f32::from(colour[c]) / 255.0);
    // Rec. 709.
    let sum = 0.2126 * light(0) + 0.7152 * light(1) + 0.0722 * light(2);
    [(255.0 * srgb_from_linear(DIMMED * sum)).round() as u8; 3]
}

fn is_at_border(mask: &Mask, x: i64, y: i64) -> bool {
    let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
    beside.iter().any(|&(x, y)| !mask.get(x, y))
}

/// Pixels of both over pixels of either.
fn overlap(one: &Mask, other: &Mask) -> f64 {
    let beside = one.count_missing_in(other);
    let both = one.count() - beside;
    both as f64 / (beside + other.count()).max(1) as f64
}

fn covered(picture: &ColourImage) -> Mask {
    let mut mask = Mask::new(picture.width, picture.height);
    for (k, colour) in (0..).zip(picture.rgba.chunks_exact(4)) {
        mask.set(k % picture.width, k / picture.width, colour[3] > COVERED);
    }
    mask
}

/// A mask in another size: the nearest pixel of each.
fn scaled(mask: &Mask, (width, height): (u32, u32)) -> Mask {
    if (mask.width(), mask.height()) == (width, height) {
        return mask.clone();
    }
    let at = |k: u32, from: u32, to: u32| {
        let place = (f64::from(k) + 0.5) * f64::from(from) / f64::from(to);
        place as i64
    };
    let mut scaled = Mask::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let value = mask.get(at(x, mask.width(), width), at(y, mask.height(), height));
        scaled.set(x, y, value);
    }
    scaled
}

fn pixel(image: &ColourImage, k: usize) -> [u8; 4] {
    std::array::from_fn(|c| image.rgba[4 * k + c])
}

/// What was drawn, over something: blended in light.
fn over(drawn: &ColourImage, behind: impl Fn(usize) -> [u8; 4]) -> ColourImage {
    let mut rgba = Vec::with_capacity(drawn.rgba.len());
    for k in 0..drawn.rgba.len() / 4 {
        let ([front, back], alpha) = ([pixel(drawn, k), behind(k)], drawn.rgba[4 * k + 3]);
        match alpha {
            0 => rgba.extend(back),
            255 => rgba.extend(front),
            _ => {
                let share = f32::from(alpha) / 255.0;
                let light = |byte: u8| linear_from_srgb(f32::from(byte) / 255.0);
                rgba.extend((0..3).map(|c| {
                    let mixed = light(front[c]) * share + light(back[c]) * (1.0 - share);
                    (255.0 * srgb_from_linear(mixed)).round() as u8
                }));
                rgba.push(255);
            }
        }
    }
    ColourImage {
        rgba,
        ..drawn.clone()
    }
}

fn colour_image(picture: RgbaImage) -> ColourImage {
    ColourImage {
        width: picture.width(),
        height: picture.height(),
        rgba: picture.into_raw(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels in a row: drawn are the two in the middle, half and whole; the mask has the last two.
    fn row() -> (Photograph, ColourImage) {
        let mut mask = Mask::new(4, 1);
        mask.set_span(0, 2, 4);
        let image = |rgba: [[u8; 4]; 4]| ColourImage {
            width: 4,
            height: 1,
            rgba: rgba.concat(),
        };
        let photograph = Photograph {
            colours: image([[100, 100, 100, 255]; 4]),
            mask: Some(ViewMask { mask, known: None }),
        };
        let drawn = [[0; 4], [200, 0, 0, 128], [200, 0, 0, 255], [0; 4]];
        (photograph, image(drawn))
    }

    #[test]
    fn what_is_drawn_covers_the_photograph_behind() {
        let (photograph, drawn) = row();
        let shown = photograph
            .with(&drawn, PhotographArg::Behind, None)
            .unwrap();
        let at = |k: usize| pixel(&shown.picture, k);
        assert_eq!((at(0), at(2)), ([100, 100, 100, 255], [200, 0, 0, 255]));
        // Half of the light of 200: more than half of 200.
        assert!(
            (150..175).contains(&at(1)[0]) && (70..80).contains(&at(1)[1]),
            "{:?}",
            at(1)
        );
        assert_eq!(shown.overlap, Some(1.0 / 3.0));
    }

    #[test]
    fn what_is_wrong_is_red_and_blue_beside() {
        let (photograph, drawn) = row();
        let shown = photograph
            .with(&drawn, PhotographArg::Beside, Some([255; 3]))
            .unwrap();
        assert_eq!(
            (shown.picture.width, shown.picture.height),
            (3 * 4 + 2 * 8, 1)
        );
        let at = |k: usize| pixel(&shown.picture, k);
        assert_eq!(
            (at(0), at(12), at(14)),
            ([100, 100, 100, 255], [255; 4], [200, 0, 0, 255])
        );
        let difference = [24, 25, 26, 27].map(at);
        assert_eq!(difference[1][..3], TOO_MUCH);
        assert_eq!(difference[3][..3], TOO_LITTLE);
        let [r, g, b, _] = difference[0];
        assert!(r == g && g == b && r < 100);
        assert_eq!(difference[0], difference[2]);
    }

    #[test]
    fn what_the_photograph_does_not_show_counts_nowhere() {
        let (mut photograph, drawn) = row();
        let mut known = Mask::new(4, 1);
        known.set_span(0, 2, 4);
        photograph.mask.as_mut().unwrap().known = Some(known);
        let shown = photograph
            .with(&drawn, PhotographArg::Beside, None)
            .unwrap();
        assert_eq!(shown.overlap, Some(0.5));
        assert_ne!(pixel(&shown.picture, 25)[..3], TOO_MUCH);
        assert_eq!(pixel(&shown.picture, 27)[..3], TOO_LITTLE);
    }

    #[test]
    fn without_a_mask_the_border_of_what_is_drawn_is_shown() {
        let (photograph, drawn) = row();
        let bare = Photograph {
            mask: None,
            ..photograph
        };
        let shown = bare.with(&drawn, PhotographArg::Beside, None).unwrap();
        assert_eq!(shown.overlap, None);
        assert_eq!(pixel(&shown.picture, 25)[..3], TOO_MUCH);
        assert_ne!(pixel(&shown.picture, 27)[..3], TOO_LITTLE);
        let smaller = ColourImage {
            width: 2,
            height: 2,
            ..drawn
        };
        assert!(bare.with(&smaller, PhotographArg::Behind, None).is_err());
    }

    #[test]
    fn masks_keep_their_place_in_other_sizes() {
        let mut mask = Mask::new(4, 2);
        mask.set_span(1, 1, 3);
        let double = scaled(&mask, (8, 4));
        assert_eq!(double.count(), 4 * mask.count());
        assert!(double.get(2, 2) && double.get(5, 3) && !double.get(6, 3));
        assert_eq!(scaled(&double, (4, 2)), mask);
    }
}
