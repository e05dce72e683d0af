//! Both kinds of file, read again by decoders that share nothing with the encoders of WebP.

use std::io::Cursor;

use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::metadata::LoopCount;
use image::{AnimationDecoder, Frame, ImageDecoder};

use super::*;

const SIZE: (u32, u32) = (37, 22);

/// A disc of a colour that changes, which wanders over a background; see-through where wanted.
fn frame(k: u32, background: [u8; 4]) -> ColourImage {
    let mut rgba = Vec::new();
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let (dx, dy) = (f64::from(x) - 8.0 - 3.0 * f64::from(k), f64::from(y) - 11.0);
            let is_inside = dx * dx + dy * dy < 60.0;
            rgba.extend(if is_inside {
                [40 * k as u8, 200, 90, 255]
            } else {
                background
            });
        }
    }
    ColourImage {
        width: SIZE.0,
        height: SIZE.1,
        rgba,
    }
}

fn params(format: AnimationFormat, frames: u32, per_second: f64) -> AnimationParams {
    AnimationParams {
        format,
        size_px: SIZE,
        frames,
        rate: FrameRate::new(per_second).unwrap(),
    }
}

fn written(params: &AnimationParams, frames: &[ColourImage]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut animation = Animation::new(&mut bytes, params).unwrap();
    for frame in frames {
        animation.push(frame).unwrap();
    }
    animation.finish().unwrap();
    bytes.into_inner()
}

/// The frames, whether they play for ever, and whether pixels may be see-through.
fn read(bytes: &[u8], format: AnimationFormat) -> (Vec<Frame>, bool, bool) {
    let reader = Cursor::new(bytes);
    let (frames, count, has_alpha) = match format {
        AnimationFormat::Webp(_) => {
            let decoder = WebPDecoder::new(reader).unwrap();
            assert!(decoder.has_animation());
            let has_alpha = decoder.color_type().has_alpha();
            let count = decoder.loop_count();
            (decoder.into_frames(), count, has_alpha)
        }
        AnimationFormat::Apng => {
            let decoder = PngDecoder::new(reader).unwrap();
            assert!(decoder.is_apng().unwrap());
            let decoder = decoder.apng().unwrap();
            let count = decoder.loop_count();
            (decoder.into_frames(), count, true)
        }
    };
    let is_endless = matches!(count, LoopCount::Infinite);
    (frames.collect_frames().unwrap(), is_endless, has_alpha)
}

/// Pixels of one that are not those of the other.
fn different(one: &[u8], other: &[u8]) -> usize {
    assert_eq!(one.len(), other.len());
    let pairs = one.chunks_exact(4).zip(other.chunks_exact(4));
    pairs.filter(|(a, b)| a != b).count()
}

#[test]
fn frames_times_and_loops_come_back() {
    for background in [[255; 4], [0; 4], [9, 8, 7, 0]] {
        let frames: Vec<ColourImage> = (0..5).map(|k| frame(k, background)).collect();
        for format in [AnimationFormat::Webp(None), AnimationFormat::Apng] {
            let bytes = written(&params(format, 5, 30.0), &frames);
            let (found, is_endless, has_alpha) = read(&bytes, format);
            assert!(is_endless, "{format:?}");
            let is_webp = format != AnimationFormat::Apng;
            assert_eq!(has_alpha, !is_webp || background[3] == 0, "{format:?}");
            assert_eq!(found.len(), 5);
            for (k, (found, given)) in found.iter().zip(&frames).enumerate() {
                assert_eq!(different(found.buffer(), &given.rgba), 0, "{format:?}, {k}");
                let (over, under) = found.delay().numer_denom_ms();
                let wanted = match format {
                    AnimationFormat::Webp(_) => [33, 34, 33][k % 3],
                    AnimationFormat::Apng => 33,
                };
                assert_eq!(over / under, wanted, "{format:?}, {k}");
            }
            // Another frame is told apart.
            assert!(different(found[1].buffer(), &frames[2].rgba) > 50);
        }
    }
}

#[test]
fn quality_is_heard() {
    let frames: Vec<ColourImage> = (0..3).map(|k| frame(k, [255; 4])).collect();
    let mut last = None;
    for quality in [5, 60, 100] {
        let format = AnimationFormat::Webp(Some(quality));
        let bytes = written(&params(format, 3, 10.0), &frames);
        let (found, _, _) = read(&bytes, format);
        let error: u64 = (found.iter().zip(&frames))
            .flat_map(|(a, b)| a.buffer().iter().zip(&b.rgba))
            .map(|(&a, &b)| u64::from(a.abs_diff(b)))
            .sum();
        assert!(error > 0, "something is lost");
        if let Some((bytes_before, error_before)) = last {
            assert!(bytes.len() > bytes_before && error < error_before);
        }
        last = Some((bytes.len(), error));
    }
    let see_through: Vec<ColourImage> = (0..3).map(|k| frame(k, [0; 4])).collect();
    let format = AnimationFormat::Webp(Some(60));
    let (found, _, has_alpha) = read(&written(&params(format, 3, 10.0), &see_through), format);
    assert!(has_alpha);
    let alpha = |rgba: &[u8]| rgba.iter().copied().skip(3).step_by(4).collect::<Vec<_>>();
    assert_eq!(alpha(found[2].buffer()), alpha(&see_through[2].rgba));
}

#[test]
fn a_plain_reader_sees_the_first_frame() {
    let frames = [frame(1, [255; 4]), frame(4, [255; 4])];
    let bytes = written(&params(AnimationFormat::Apng, 2, 10.0), &frames);
    let seen = image::load_from_memory(&bytes).unwrap().to_rgba8();
    assert_eq!(different(&seen, &frames[0].rgba), 0);
}

#[test]
fn what_was_not_promised_is_refused() {
    for format in [AnimationFormat::Webp(None), AnimationFormat::Apng] {
        let params = params(format, 2, 10.0);
        let begun = || Animation::new(Cursor::new(Vec::new()), &params).unwrap();
        let mut animation = begun();
        let shorter = ColourImage {
            rgba: vec![0; 16],
            ..frame(0, [0; 4])
        };
        let other = ColourImage {
            width: SIZE.0 + 1,
            ..frame(0, [0; 4])
        };
        for wrong in [shorter, other] {
            let refused = animation.push(&wrong);
            assert!(matches!(refused, Err(AnimationError::NotThatSize { .. })));
        }
        assert!(matches!(
            begun().finish(),
            Err(AnimationError::NotThatMany { found: 0, .. })
        ));
        for _ in 0..2 {
            animation.push(&frame(0, [0; 4])).unwrap();
        }
        assert!(matches!(
            animation.push(&frame(0, [0; 4])),
            Err(AnimationError::NotThatMany { found: 3, .. })
        ));
    }
    let large = AnimationParams {
        size_px: (4, MOST_WEBP_SIDE_PX + 1),
        ..params(AnimationFormat::Webp(None), 1, 10.0)
    };
    let refused = Animation::new(Cursor::new(Vec::new()), &large).unwrap_err();
    assert!(matches!(
        refused,
        AnimationError::TooLarge { height: 16_384, .. }
    ));
}
