//! Pictures of where an outline strays farthest: what is drawn there, enlarged, with both outlines over it.

use glam::DVec2;
use silmap_geometry::polygon::{distance_squared_to_segment, edges};
use silmap_geometry::{ColourImage, Loop};
use silmap_measure::Straying;

use crate::palette::{self, Rgb};

/// How many times closer the place is shown.
const CLOSER: u32 = 6;

/// Widths of the lines in the finished picture, pixels: the true outline is drawn within the other, so that both are seen where they agree.
const PREDICTED_PX: f64 = 5.0;
const TRUE_PX: f64 = 2.0;
const FRAME_PX: f64 = 1.5;
/// How much wider the light border is that lets dark lines be seen on dark ground.
const HALO_PX: f64 = 2.0;
const HALO: Rgb = [0xff, 0xff, 0xff];

/// Colours of both outlines, as what is too much and too little elsewhere: beyond the true one the other is too much.
pub(crate) const PREDICTED: Rgb = palette::TOO_MUCH;
pub(crate) const TRUE: Rgb = palette::TOO_LITTLE;

/// The part of a picture that is shown closer, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    left: u32,
    top: u32,
    side: u32,
}

impl Part {
    /// A square around the worst place, in which its nearest point on the other outline lies too where there is room; within a picture of
    /// this size.
    pub(crate) fn around(worst: &Straying, (width, height): (u32, u32)) -> Self {
        let side = (width.min(height) / CLOSER).max(1);
        let by = worst.nearest - worst.place;
        // Halfway to the other point, but never so far that the place itself comes near the part's border.
        let share = (0.25 * f64::from(side) / by.length().max(f64::MIN_POSITIVE)).min(0.5);
        let middle = worst.place + by * share;
        let start = |at: f64, length: u32| {
            (at - 0.5 * f64::from(side))
                .round()
                .clamp(0.0, f64::from(length - side)) as u32
        };
        Self {
            left: start(middle.x, width),
            top: start(middle.y, height),
            side,
        }
    }

    fn corner(self) -> DVec2 {
        DVec2::new(f64::from(self.left), f64::from(self.top))
    }
}

/// A picture with a frame around the part.
pub(crate) fn with_frame(mut picture: ColourImage, part: Part) -> ColourImage {
    let side = f64::from(part.side);
    let corners = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)];
    let frame = [corners.map(|c| part.corner() + DVec2::from(c)).to_vec()];
    draw(&mut picture, lines(&frame), FRAME_PX + HALO_PX, HALO);
    draw(&mut picture, lines(&frame), FRAME_PX, palette::INK);
    picture
}

/// The part of `picture` with its pixels enlarged, and over it both outlines and the way from the worst place to the other outline.
pub(crate) fn closer_look(
    picture: &ColourImage,
    [predicted, truth]: [&[Loop]; 2],
    worst: &Straying,
    part: Part,
) -> ColourImage {
    let mut look = enlarged(picture, part);
    let closer = |p: DVec2| (p - part.corner()) * f64::from(CLOSER);
    let drawn = |loops| lines(loops).map(|(a, b)| (closer(a), closer(b)));
    draw(&mut look, drawn(predicted), PREDICTED_PX, PREDICTED);
    draw(&mut look, drawn(truth), TRUE_PX, TRUE);
    let way = (closer(worst.place), closer(worst.nearest));
    draw(&mut look, [way].into_iter(), TRUE_PX + HALO_PX, HALO);
    draw(&mut look, [way].into_iter(), TRUE_PX, palette::INK);
    let dot = [(way.0, way.0)].into_iter();
    draw(&mut look, dot.clone(), 3.0 * TRUE_PX + HALO_PX, HALO);
    draw(&mut look, dot, 3.0 * TRUE_PX, palette::INK);
    look
}

fn lines(loops: &[Loop]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    loops.iter().flat_map(|l| edges(l))
}

fn enlarged(picture: &ColourImage, part: Part) -> ColourImage {
    let side = part.side * CLOSER;
    let mut rgba = Vec::with_capacity(side as usize * side as usize * 4);
    for y in 0..side {
        for x in 0..side {
            let (x, y) = (part.left + x / CLOSER, part.top + y / CLOSER);
            let at = (y as usize * picture.width as usize + x as usize) * 4;
            rgba.extend(&picture.rgba[at..at + 4]);
        }
    }
    ColourImage {
        width: side,
        height: side,
        rgba,
    }
}

/// Draws lines with round ends, smooth at their borders.
fn draw(
    picture: &mut ColourImage,
    lines: impl Iterator<Item = (DVec2, DVec2)>,
    width_px: f64,
    colour: Rgb,
) {
    let (width, height) = (f64::from(picture.width), f64::from(picture.height));
    let mut cover = vec![0.0_f64; picture.rgba.len() / 4];
    let reach = 0.5 * width_px + 0.5;
    for (a, b) in lines {
        let (low, high) = (a.min(b) - reach, a.max(b) + reach);
        let within = |low: f64, high: f64, length: f64| {
            low.floor().clamp(0.0, length) as usize..high.ceil().clamp(0.0, length) as usize
        };
        for y in within(low.y, high.y, height) {
            for x in within(low.x, high.x, width) {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let off = distance_squared_to_segment(p, a, b).sqrt();
                let at = &mut cover[y * picture.width as usize + x];
                *at = at.max((reach - off).clamp(0.0, 1.0));
            }
        }
    }
    for (pixel, over) in picture.rgba.chunks_mut(4).zip(cover) {
        if over > 0.0 {
            blend(pixel, colour, over);
        }
    }
}

/// One colour over a pixel whose colour is not multiplied by its opacity.
fn blend(pixel: &mut [u8], colour: Rgb, over: f64) {
    let below = f64::from(pixel[3]) / 255.0 * (1.0 - over);
    let opacity = over + below;
    for (channel, over_channel) in pixel.iter_mut().zip(colour) {
        let mixed = f64::from(over_channel) * over + f64::from(*channel) * below;
        *channel = (mixed / opacity).round() as u8;
    }
    pixel[3] = (255.0 * opacity).round() as u8;
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 120;

    fn grey() -> ColourImage {
        ColourImage {
            width: SIDE,
            height: SIDE,
            rgba: [120, 120, 120, 255].repeat((SIDE * SIDE) as usize),
        }
    }

    fn square(x: f64, y: f64, side: f64) -> Loop {
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
            .map(|(u, v)| DVec2::new(x + u, y + v))
            .to_vec()
    }

    fn count(picture: &ColourImage, [r, g, b]: Rgb) -> usize {
        (picture.rgba.chunks(4))
            .filter(|p| *p == [r, g, b, 255])
            .count()
    }

    #[test]
    fn the_part_holds_the_place_and_lies_in_the_picture() {
        for (place, nearest) in [
            ([60.0, 50.0], [64.0, 50.0]),
            ([0.0, 0.0], [0.0, 3.0]),
            ([119.0, 60.0], [20.0, 60.0]),
        ] {
            let worst = Straying {
                place: place.into(),
                nearest: nearest.into(),
                ..Straying::default()
            };
            let part = Part::around(&worst, (SIDE, SIDE));
            let (low, high) = (part.corner(), part.corner() + f64::from(part.side));
            assert!(low.cmpge(DVec2::ZERO).all() && high.cmple(DVec2::splat(120.0)).all());
            assert!(low.cmple(worst.place).all() && high.cmpge(worst.place).all());
        }
    }

    #[test]
    fn both_outlines_are_seen_where_they_part() {
        let (truth, found) = ([square(40.0, 40.0, 40.0)], [square(40.0, 40.0, 43.0)]);
        let worst = silmap_measure::straying(&found, &truth);
        let part = Part::around(&worst, (SIDE, SIDE));
        let look = closer_look(&grey(), [&found, &truth], &worst, part);
        assert_eq!((look.width, look.height), (SIDE, SIDE));
        assert!(count(&look, TRUE) > 50 && count(&look, PREDICTED) > 50);
        assert!(count(&look, palette::INK) > 10);
        let framed = with_frame(grey(), part);
        assert!(count(&framed, [120; 3]) > 13_000 && framed != grey());
    }

    #[test]
    fn lines_beside_the_picture_draw_nothing() {
        let mut picture = grey();
        draw(
            &mut picture,
            lines(&[square(-300.0, -300.0, 100.0)]),
            3.0,
            TRUE,
        );
        assert_eq!(picture, grey());
    }
}
