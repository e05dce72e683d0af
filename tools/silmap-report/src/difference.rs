//! Difference pictures: red where the outline covers too much, blue where it covers too little.

use silmap_geometry::{ColourImage, Mask};

use crate::palette::{self, Rgb};

/// Side of the part that is shown closer, as a divisor of the picture's.
const CLOSER: u32 = 6;

/// Pixels inside, in one colour; the rest is transparent.
pub(crate) fn silhouette(mask: &Mask, colour: Rgb) -> ColourImage {
    picture(mask, |is_inside, _| is_inside.then_some(colour), mask)
}

/// Pixels that are right, too much and too little, each in its colour; masks are of one size.
pub(crate) fn difference(truth: &Mask, predicted: &Mask) -> ColourImage {
    let colour = |truth: bool, predicted: bool| match (truth, predicted) {
        (true, true) => Some(palette::RIGHT),
        (false, true) => Some(palette::TOO_MUCH),
        (true, false) => Some(palette::TOO_LITTLE),
        (false, false) => None,
    };
    picture(truth, colour, predicted)
}

fn picture(one: &Mask, colour: impl Fn(bool, bool) -> Option<Rgb>, two: &Mask) -> ColourImage {
    let (width, height) = (one.width(), one.height());
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..i64::from(height) {
        for x in 0..i64::from(width) {
            match colour(one.get(x, y), two.get(x, y)) {
                Some([r, g, b]) => rgba.extend([r, g, b, 255]),
                None => rgba.extend([0; 4]),
            }
        }
    }
    ColourImage {
        width,
        height,
        rgba,
    }
}

/// The square part of the difference with the most wrong pixels.
pub(crate) fn closer_look(truth: &Mask, predicted: &Mask) -> ColourImage {
    let whole = difference(truth, predicted);
    let side = (truth.width().min(truth.height()) / CLOSER).max(1);
    let (left, top) = most_wrong_place(truth, predicted, side);
    let mut rgba = Vec::with_capacity(side as usize * side as usize * 4);
    for y in top..top + side {
        let start = (y as usize * whole.width as usize + left as usize) * 4;
        rgba.extend(&whole.rgba[start..start + side as usize * 4]);
    }
    ColourImage {
        width: side,
        height: side,
        rgba,
    }
}

/// The corner of the square of this side that has the most wrong pixels, to a quarter of the side.
fn most_wrong_place(truth: &Mask, predicted: &Mask, side: u32) -> (u32, u32) {
    let step = (side / 4).max(1);
    let starts = |length: u32| (0..=length - side).step_by(step as usize);
    let wrong_in = |left: u32, top: u32| {
        (top..top + side)
            .flat_map(|y| (left..left + side).map(move |x| (i64::from(x), i64::from(y))))
            .filter(|&(x, y)| truth.get(x, y) != predicted.get(x, y))
            .count()
    };
    let mut best = (0, (0, 0));
    for top in starts(truth.height()) {
        for left in starts(truth.width()) {
            let count = wrong_in(left, top);
            if count > best.0 {
                best = (count, (left, top));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(left: i64, right: i64) -> Mask {
        let mut mask = Mask::new(64, 64);
        for y in 10..30 {
            mask.set_span(y, left, right);
        }
        mask
    }

    fn count(picture: &ColourImage, [r, g, b]: Rgb) -> usize {
        picture
            .rgba
            .chunks(4)
            .filter(|p| *p == [r, g, b, 255])
            .count()
    }

    #[test]
    fn every_wrong_pixel_is_coloured_by_its_side() {
        let (truth, shifted) = (block(10, 30), block(12, 32));
        let picture = difference(&truth, &shifted);
        assert_eq!(count(&picture, palette::TOO_MUCH), 40);
        assert_eq!(count(&picture, palette::TOO_LITTLE), 40);
        assert_eq!(count(&picture, palette::RIGHT), 360);
        assert_eq!(
            count(&picture, palette::TOO_MUCH) + count(&picture, palette::TOO_LITTLE),
            truth.count_different(&shifted) as usize
        );
    }

    #[test]
    fn what_is_right_has_no_red_and_no_blue() {
        let picture = difference(&block(10, 30), &block(10, 30));
        assert_eq!(count(&picture, palette::TOO_MUCH), 0);
        assert_eq!(count(&picture, palette::TOO_LITTLE), 0);
        assert_eq!(
            count(&silhouette(&block(10, 30), palette::RIGHT), palette::RIGHT),
            400
        );
    }

    #[test]
    fn the_closer_look_is_at_what_is_wrong() {
        let mut wrong = block(10, 30);
        wrong.set(50, 52, true);
        let look = closer_look(&block(10, 30), &wrong);
        assert_eq!((look.width, look.height), (10, 10));
        assert_eq!(count(&look, palette::TOO_MUCH), 1);
    }
}
