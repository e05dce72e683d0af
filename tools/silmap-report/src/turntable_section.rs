//! The page's moving picture: the full mesh and the clipped hull turn side by side; a still one for readers who asked for less motion.

use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use silmap_geometry::ColourImage;
use silmap_measure::TurntableFrame;

use crate::Report;
use crate::animation::{Animation, AnimationError, AnimationFormat, AnimationParams, FrameRate};
use crate::words::grouped;

/// Frames per second.
const RATE: f64 = 12.0;

/// What is lost can hardly be seen at this size, and the page stays small.
const QUALITY: u8 = 65;

/// White columns between the two.
const GAP_PX: usize = 8;

pub(crate) fn section(report: &Report<'_>) -> Markup {
    let frames: Vec<ColourImage> = report.measured.turntable.iter().map(beside).collect();
    // Without a still one nobody could stop it.
    let (Some(first), Ok(moving), Ok(still)) = (
        frames.first(),
        webp(&frames),
        webp(frames.get(..1).unwrap_or(&[])),
    ) else {
        return html! {};
    };
    html! {
        section {
            h2 { "All around" }
            figure.turn {
                picture {
                    source media="(prefers-reduced-motion: reduce)" srcset=(data_url(&still));
                    img alt="The model and the clipped hull, turning side by side"
                        width=(first.width) height=(first.height) src=(data_url(&moving));
                }
                figcaption {
                    "On the left the model, " (grouped(report.asset.record.model_faces)) " faces; on the right the hull of "
                    (grouped(report.asset.hull.faces.len() as u64)) " faces, clipped to the interpolated outline."
                }
            }
        }
    }
}

/// Both pictures of a frame in one.
fn beside(frame: &TurntableFrame) -> ColourImage {
    let (left, right) = (&frame.model, &frame.clipped);
    let row = |picture: &ColourImage, y: usize| {
        let length = picture.width as usize * 4;
        let start = y * length;
        (picture.rgba.get(start..start + length)).map_or_else(|| vec![255; length], <[u8]>::to_vec)
    };
    let height = left.height.max(right.height);
    let gap = [u8::MAX; GAP_PX * 4];
    let rows = (0..height as usize).flat_map(|y| [row(left, y), gap.to_vec(), row(right, y)]);
    ColourImage {
        width: left.width + GAP_PX as u32 + right.width,
        height,
        rgba: rows.flatten().collect(),
    }
}

fn webp(frames: &[ColourImage]) -> Result<Vec<u8>, AnimationError> {
    let size_px = frames.first().map_or((1, 1), |f| (f.width, f.height));
    let params = AnimationParams {
        format: AnimationFormat::Webp(Some(QUALITY)),
        size_px,
        frames: frames.len() as u32,
        rate: FrameRate::new(RATE).expect("a rate in the middle of those there are"),
    };
    let mut bytes = Cursor::new(Vec::new());
    let mut animation = Animation::new(&mut bytes, &params)?;
    frames.iter().try_for_each(|frame| animation.push(frame))?;
    animation.finish()?;
    Ok(bytes.into_inner())
}

fn data_url(webp: &[u8]) -> String {
    format!("data:image/webp;base64,{}", STANDARD.encode(webp))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(width: u32, height: u32, value: u8) -> ColourImage {
        ColourImage {
            width,
            height,
            rgba: vec![value; (width * height * 4) as usize],
        }
    }

    #[test]
    fn pictures_stand_side_by_side() {
        let both = beside(&TurntableFrame {
            model: plain(3, 2, 10),
            clipped: plain(4, 3, 200),
        });
        assert_eq!((both.width, both.height), (3 + 8 + 4, 3));
        let at = |x: u32, y: u32| both.rgba[((y * both.width + x) * 4) as usize];
        assert_eq!(
            [at(2, 1), at(3, 1), at(10, 1), at(11, 1)],
            [10, 255, 255, 200]
        );
        assert_eq!([at(0, 2), at(14, 2)], [255, 200], "the shorter one ends");
        assert_eq!(both.rgba.len(), 15 * 3 * 4);
    }

    #[test]
    fn nothing_turns_where_nothing_was_drawn() {
        assert!(webp(&[]).is_err());
    }
}
