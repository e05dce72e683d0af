//! Masks of photographs in front of a plain background.
//!
//! One set of rules, whichever way the background is told from the object:
//! 1. Each pixel has a difference from the background: how much brighter its brightest channel is (`lighter`), how much darker its
//!    darkest (`darker`), or how far its colour is from one (`unlike`), less the threshold. Values are 0 to 255. Far from a colour that is
//!    not nearly black is what has another hue: differences of brightness alone count half, so that shadows do less.
//! 2. Differences are smoothed with weights 1, 2, 1 along rows and columns, as noise of single pixels is no outline.
//! 3. Of the pixels above zero the pieces are kept that have a fifth of the largest one's area at least; what lies wholly within a
//!    twentieth of the border is the picture's frame, and no piece.
//! 4. Holes with less than a five-hundredth of the object's area are filled.
//!
//! `auto` is `unlike` with the colour that is most frequent in the twentieth along the border. Its threshold is where the fewest pixels
//! are, between the background and the threshold that separates both best (Otsu); of places with nearly as few the one nearest to the
//! background, in an empty gap its middle.
//!
//! Source: N. Otsu. A Threshold Selection Method from Gray-Level Histograms. IEEE Trans. SMC 9(1), 1979.

use std::str::FromStr;

use image::{DynamicImage, RgbImage};

use crate::levels::Levels;

/// How the object is told from a plain background. Values are 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaskRule {
    /// Its darkest channel is below.
    Darker(f32),
    /// Its brightest channel is above.
    Lighter(f32),
    /// Farther from a colour than a threshold.
    Unlike([f32; 3], f32),
    /// Unlike the colour along the border.
    Auto,
}

/// The width of the border, as a share of the shorter side.
const BORDER: f64 = 0.05;

/// Least area of a piece, as a share of the largest one's.
const LEAST_PIECE: f64 = 0.2;

/// Largest area of a hole that is filled, as a share of the object's.
const LARGEST_HOLE: f64 = 0.002;

/// How much differences of brightness count.
const OF_BRIGHTNESS: f32 = 0.5;

/// A colour this near to black has no hue.
const LEAST_COLOUR: f32 = 60.0;

/// Steps of colour that are counted together when the most frequent is looked for.
const COLOUR_STEP: u8 = 16;

/// Differences to each side over which pixels are counted for a threshold, and the least one.
const NEIGHBOURS: usize = 6;
const LEAST_THRESHOLD: usize = 8;

/// Counts within this factor of the least are as few.
const AS_FEW: f64 = 2.0;

/// Why a rule cannot be understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a rule is darker:T, lighter:T, unlike:R,G,B:T or auto, with numbers from 0 to 255")]
pub struct UnknownRule;

impl FromStr for MaskRule {
    type Err = UnknownRule;

    fn from_str(text: &str) -> Result<Self, UnknownRule> {
        let number = |word: &str| match word.trim().parse::<f32>() {
            Ok(v) if (0.0..=255.0).contains(&v) => Ok(v),
            _ => Err(UnknownRule),
        };
        let words: Vec<&str> = text.split(':').collect();
        match words[..] {
            ["auto"] => Ok(Self::Auto),
            ["darker", t] => number(t).map(Self::Darker),
            ["lighter", t] => number(t).map(Self::Lighter),
            ["unlike", colour, t] => {
                let channels: Vec<f32> = colour.split(',').map(number).collect::<Result<_, _>>()?;
                let colour = <[f32; 3]>::try_from(channels).map_err(|_| UnknownRule)?;
                Ok(Self::Unlike(colour, number(t)?))
            }
            _ => Err(UnknownRule),
        }
    }
}

impl MaskRule {
    /// What a photograph says about each pixel: inside is above zero.
    pub(crate) fn levels(self, photo: &DynamicImage) -> Levels {
        let picture = photo.to_rgb8();
        let size = picture.dimensions();
        let (width, height) = (size.0 as usize, size.1 as usize);
        let border = (BORDER * f64::from(size.0.min(size.1))).ceil() as usize;
        let is_border = |k: usize| {
            let (x, y) = (k % width, k / width);
            x.min(y).min(width - 1 - x).min(height - 1 - y) < border
        };
        let mut heights = match self {
            Self::Lighter(t) => of_channels(&picture, |c| c[0].max(c[1]).max(c[2]) - t),
            Self::Darker(t) => of_channels(&picture, |c| t - c[0].min(c[1]).min(c[2])),
            Self::Unlike(colour, t) => of_channels(&picture, |c| distance(c, colour) - t),
            Self::Auto => {
                let colour = border_colour(&picture, is_border);
                of_channels(&picture, |c| distance(c, colour))
            }
        };
        if self == Self::Auto {
            // Before smoothing, which puts pixels of outlines where there are few.
            let threshold = threshold(&heights, is_border);
            for value in &mut heights {
                *value -= threshold;
            }
        }
        heights = smoothed(&heights, (width, height));
        for value in &mut heights {
            // A tenth of the range is as good as all of it.
            *value = (*value / 25.5).clamp(-1.0, 1.0);
            if *value == 0.0 {
                *value = -f32::EPSILON;
            }
        }
        clean(&mut heights, (width, height), is_border);
        Levels::new(size, heights, false)
    }
}

fn of_channels(picture: &RgbImage, value: impl Fn([f32; 3]) -> f32) -> Vec<f32> {
    picture
        .pixels()
        .map(|p| value(p.0.map(f32::from)))
        .collect()
}

fn distance(a: [f32; 3], from: [f32; 3]) -> f32 {
    let norm = |v: [f32; 3]| v.iter().map(|c| c * c).sum::<f32>();
    let difference: [f32; 3] = std::array::from_fn(|k| a[k] - from[k]);
    let (all, length) = (norm(difference), norm(from).sqrt());
    if length < LEAST_COLOUR {
        return all.sqrt();
    }
    let along = difference.iter().zip(from).map(|(d, c)| d * c).sum::<f32>() / length;
    ((all - along * along).max(0.0) + (OF_BRIGHTNESS * along).powi(2)).sqrt()
}

/// The most frequent colour along the border.
fn border_colour(picture: &RgbImage, is_border: impl Fn(usize) -> bool) -> [f32; 3] {
    const STEPS: usize = 256 / COLOUR_STEP as usize;
    let pixels: Vec<[u8; 3]> = (picture.pixels().enumerate())
        .filter_map(|(k, p)| is_border(k).then_some(p.0))
        .collect();
    let step = |p: [u8; 3]| p.map(|c| usize::from(c / COLOUR_STEP));
    let mut counts = vec![0_u32; STEPS.pow(3)];
    for &pixel in &pixels {
        let [r, g, b] = step(pixel);
        counts[(r * STEPS + g) * STEPS + b] += 1;
    }
    let around = |v: usize| v.saturating_sub(1)..=(v + 1).min(STEPS - 1);
    let mut best = (0, [0; 3]);
    for k in 0..counts.len() {
        let [r, g, b] = [k / (STEPS * STEPS), k / STEPS % STEPS, k % STEPS];
        let mut sum = 0;
        for r in around(r) {
            for g in around(g) {
                sum += around(b)
                    .map(|b| counts[(r * STEPS + g) * STEPS + b])
                    .sum::<u32>();
            }
        }
        if sum > best.0 {
            best = (sum, [r, g, b]);
        }
    }
    let is_near = |p: &&[u8; 3]| {
        step(**p)
            .iter()
            .zip(best.1)
            .all(|(&a, b)| a.abs_diff(b) <= 1)
    };
    let near: Vec<[u8; 3]> = pixels.iter().filter(is_near).copied().collect();
    std::array::from_fn(|channel| {
        let mut values: Vec<u8> = near.iter().map(|p| p[channel]).collect();
        values.sort_unstable();
        values.get(values.len() / 2).copied().map_or(0.0, f32::from)
    })
}

fn smoothed(values: &[f32], (width, height): (usize, usize)) -> Vec<f32> {
    let along = |values: &[f32], step: usize, place: &dyn Fn(usize) -> usize, count: usize| {
        let mut out = Vec::with_capacity(values.len());
        for (k, &value) in values.iter().enumerate() {
            let at = place(k);
            let before = if at > 0 { values[k - step] } else { value };
            let after = if at + 1 < count {
                values[k + step]
            } else {
                value
            };
            out.push(0.25 * before + 0.5 * value + 0.25 * after);
        }
        out
    };
    let rows = along(values, 1, &|k| k % width, width);
    along(&rows, width, &|k| k / width, height)
}

/// Between the background and the rest.
fn threshold(distances: &[f32], is_border: impl Fn(usize) -> bool) -> f32 {
    const BINS: usize = 442;
    let mut counts = vec![0_u64; BINS];
    // The frame is neither.
    for (_, &d) in (distances.iter().enumerate()).filter(|(k, _)| !is_border(*k)) {
        counts[(d as usize).min(BINS - 1)] += 1;
    }
    let total = counts.iter().sum::<u64>() as f64;
    let all: f64 = (counts.iter().enumerate())
        .map(|(k, &c)| k as f64 * c as f64)
        .sum();
    let (mut below, mut sum, mut best) = (0.0, 0.0, (0.0, 0));
    for (k, &count) in counts.iter().enumerate() {
        below += count as f64;
        sum += k as f64 * count as f64;
        let above = total - below;
        if below == 0.0 || above == 0.0 {
            continue;
        }
        let apart = sum / below - (all - sum) / above;
        let between = below * above * apart * apart;
        // Where no pixel is in between all thresholds are as good: the last of them.
        if between >= best.0 {
            best = (between, k + 1);
        }
    }
    let around = |k: usize| {
        let from = k.saturating_sub(NEIGHBOURS);
        let to = (k + NEIGHBOURS).min(BINS - 1);
        counts[from..=to].iter().sum::<u64>() as f64
    };
    let places = LEAST_THRESHOLD..best.1.clamp(LEAST_THRESHOLD + 1, BINS);
    let fewest = places.clone().map(around).fold(f64::INFINITY, f64::min);
    let is_few = |k: &usize| around(*k) <= AS_FEW * fewest;
    let first = places.clone().find(is_few).unwrap_or(LEAST_THRESHOLD);
    // In an empty gap every place is as good.
    let gap = (first..places.end).take_while(|&k| around(k) == 0.0);
    (first + gap.count() / 2) as f32
}

/// Takes small pieces and the frame away and fills small holes.
fn clean(heights: &mut [f32], size: (usize, usize), is_border: impl Fn(usize) -> bool) {
    let inside = pieces(size, |k| heights[k] > 0.0, false);
    let is_frame = |piece: &Vec<u32>| piece.iter().all(|&k| is_border(k as usize));
    let objects = inside.iter().filter(|p| !is_frame(p));
    let largest = objects.map(Vec::len).max().unwrap_or(0);
    let mut area = 0;
    for piece in &inside {
        if is_frame(piece) || (piece.len() as f64) < LEAST_PIECE * largest as f64 {
            for &k in piece {
                heights[k as usize] *= -1.0;
            }
        } else {
            area += piece.len();
        }
    }
    let (width, height) = size;
    let reaches_border = |piece: &Vec<u32>| {
        piece.iter().any(|&k| {
            let (x, y) = (k as usize % width, k as usize / width);
            x == 0 || y == 0 || x + 1 == width || y + 1 == height
        })
    };
    for hole in pieces(size, |k| heights[k] <= 0.0, true) {
        if (hole.len() as f64) < LARGEST_HOLE * area as f64 && !reaches_border(&hole) {
            for k in hole {
                heights[k as usize] = heights[k as usize].abs().max(f32::EPSILON);
            }
        }
    }
}

/// The pixels that hang together by their sides, or also by their corners.
fn pieces(
    (width, height): (usize, usize),
    is_set: impl Fn(usize) -> bool,
    by_corners: bool,
) -> Vec<Vec<u32>> {
    let mut is_done = vec![false; width * height];
    let mut found = Vec::new();
    for start in 0..width * height {
        if is_done[start] || !is_set(start) {
            continue;
        }
        is_done[start] = true;
        let mut piece = vec![start as u32];
        let mut at = 0;
        while at < piece.len() {
            let (x, y) = (piece[at] as usize % width, piece[at] as usize / width);
            at += 1;
            for y1 in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for x1 in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                    let k = y1 * width + x1;
                    let is_side = x1 == x || y1 == y;
                    if (is_side || by_corners) && !is_done[k] && is_set(k) {
                        is_done[k] = true;
                        piece.push(k as u32);
                    }
                }
            }
        }
        found.push(piece);
    }
    found
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    /// A brown disc with a large hole and a small one on a blue background that becomes darker, with noise, specks and a black frame.
    fn photo() -> (DynamicImage, impl Fn(u32, u32) -> bool) {
        let is_object = |x: u32, y: u32| {
            let far = |cx: f64, cy: f64| (f64::from(x) - cx).hypot(f64::from(y) - cy);
            far(60.0, 50.0) < 30.0 && far(60.0, 40.0) > 6.0
        };
        let picture = RgbImage::from_fn(120, 100, |x, y| {
            let noise = ((x * 7919 + y * 104_729) % 13) as u8;
            let is_speck = (100..104).contains(&x) && (20..24).contains(&y);
            let is_hole = (70..72).contains(&x) && (60..62).contains(&y);
            if x < 2 || y < 2 {
                Rgb([0, 0, 0])
            } else if (is_object(x, y) && !is_hole) || is_speck {
                Rgb([120 + noise, 80 + noise, 30])
            } else {
                Rgb([20 + noise, 40 + noise, 150 + noise + (y / 4) as u8])
            }
        });
        (picture.into(), is_object)
    }

    #[test]
    fn plain_backgrounds_are_told_from_the_object() {
        let (photo, is_object) = photo();
        for rule in ["auto", "unlike:26,46,170:70", "lighter:1"] {
            let mask = rule.parse::<MaskRule>().unwrap().levels(&photo).mask();
            let off = (0..100_u32)
                .flat_map(|y| (0..120_u32).map(move |x| (x, y)))
                .filter(|&(x, y)| mask.get(x.into(), y.into()) != is_object(x, y));
            let off = off.count();
            // Everything is lighter than black: a rule that does not fit is not made to fit.
            assert_eq!(off < 60, rule != "lighter:1", "{rule}: {off}");
        }
    }

    #[test]
    fn rules_are_read_as_written() {
        let read = |text: &str| text.parse::<MaskRule>();
        assert_eq!(read("darker:20"), Ok(MaskRule::Darker(20.0)));
        assert_eq!(read("lighter:30.5"), Ok(MaskRule::Lighter(30.5)));
        assert_eq!(
            read("unlike:1, 2,3:40"),
            Ok(MaskRule::Unlike([1.0, 2.0, 3.0], 40.0))
        );
        for text in [
            "",
            "auto:1",
            "darker",
            "darker:256",
            "darker:nan",
            "unlike:1,2:3",
            "unlike:1,2,3",
        ] {
            assert_eq!(read(text), Err(UnknownRule), "{text}");
        }
    }

    /// Smallest and median overlap of rule and mask over every sixth photograph of a set; `None` where it is not there.
    fn overlaps(set: &str, rule: &str) -> Option<[f64; 2]> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../shared/captures")
            .join(set);
        let mut photos: Vec<_> = (std::fs::read_dir(folder.join("photos")).ok()?)
            .filter_map(|e| e.ok().map(|e| e.path()))
            .collect();
        photos.sort();
        let rule: MaskRule = rule.parse().unwrap();
        let mut found: Vec<f64> = (photos.iter().step_by(6))
            .filter_map(|photo| {
                let name = format!("{}.png", photo.file_stem()?.to_string_lossy());
                let truth = crate::mask_image::read(&folder.join("masks").join(name)).ok()?;
                let made = rule.levels(&image::open(photo).unwrap()).mask();
                let beside = made.count_missing_in(&truth.mask) as f64;
                let missing = truth.mask.count_missing_in(&made) as f64;
                let of_truth = truth.mask.count() as f64;
                Some((of_truth - missing) / (of_truth + beside))
            })
            .collect();
        found.sort_by(f64::total_cmp);
        Some([*found.first()?, found[found.len() / 2]])
    }

    #[test]
    fn real_backgrounds_are_told_from_the_object() {
        for (set, rule, least) in [
            ("squirrel", "auto", 0.98),
            ("squirrel", "lighter:24", 0.99),
            ("toy-dinosaur", "auto", 0.95),
            ("plaster-dinosaur/ring", "auto", 0.94),
            ("plaster-dinosaur/ring", "lighter:48", 0.94),
        ] {
            match overlaps(set, rule) {
                Some([smallest, median]) => {
                    println!("{set} {rule}: {smallest:.4} {median:.4}");
                    assert!(median > least, "{set} {rule}: {smallest} {median}");
                }
                None => eprintln!("skipped: {set} is not there"),
            }
        }
    }
}
