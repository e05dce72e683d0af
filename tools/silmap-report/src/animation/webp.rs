//! Animated WebP: each frame is encoded by itself by libwebp and put into the container here.
//!
//! The encoder of animations that the crate `webp` has takes all frames before it begins, holds each of them twice, makes the last frame
//! as long as the mean of the others, and cannot be stopped. Its files of a turning model, all of which changes, are 6 % larger.
//!
//! Source: WebP Container Specification, Google, 2023, section "Animation".

use std::io::{Seek, SeekFrom, Write};

use silmap_geometry::ColourImage;
use webp::{Encoder, PixelLayout, WebPConfig};

use super::riff::{self, MOST_FILE_BYTES, file_header, three_bytes, write_chunk};
use super::{AnimationError, MOST_WEBP_SIDE_PX};

/// Bits of the chunk that says what is in a file.
const HAS_FRAMES: u8 = 0x02;
const HAS_ALPHA: u8 = 0x10;

/// A frame takes the place of the one before, see-through pixels included, and stays until the next.
const NOT_BLENDED: u8 = 0x02;

/// A frame's chunk without what libwebp made: chunk header, place, size, duration, flags.
const FRAME_HEADER: u64 = 24;

/// How hard libwebp tries, of 6: as hard as it can where that takes milliseconds.
const LOSSY_EFFORT: i32 = 6;

/// Without loss the quality is effort, too, of 100. More than these take half as long again for no fewer bytes.
const LOSSLESS_EFFORT: (i32, f32) = (4, 20.0);

#[derive(Debug)]
pub(super) struct AnimatedWebp<W> {
    out: W,
    size_px: (u32, u32),
    config: WebPConfig,
    has_alpha: bool,
    /// Written so far.
    bytes: u64,
}

impl<W: Write + Seek> AnimatedWebp<W> {
    pub(super) fn new(
        mut out: W,
        size_px: (u32, u32),
        quality: Option<u8>,
    ) -> Result<Self, AnimationError> {
        let (width, height) = size_px;
        if width.max(height) > MOST_WEBP_SIDE_PX {
            return Err(AnimationError::TooLarge { width, height });
        }
        // The header is written again when its numbers are known.
        out.write_all(&file_header(0))?;
        let mut bytes = riff::FILE_HEADER as u64;
        bytes += write_chunk(&mut out, *b"VP8X", &[&contents(size_px, false)])?;
        // A background of nothing, which is never seen, and no end of repeating.
        bytes += write_chunk(&mut out, *b"ANIM", &[&[0; 4], &[0; 2]])?;
        Ok(Self {
            out,
            size_px,
            config: config(quality)?,
            has_alpha: false,
            bytes,
        })
    }

    pub(super) fn push(&mut self, frame: &ColourImage, millis: u32) -> Result<(), AnimationError> {
        let (width, height) = self.size_px;
        let file = Encoder::new(&frame.rgba, PixelLayout::Rgba, width, height)
            .encode_advanced(&self.config)
            .map_err(AnimationError::Webp)?;
        // A single picture may have other chunks, which are about the whole file.
        let pixels: Vec<&[u8]> = riff::chunks(&file)
            .filter(|(name, _)| matches!(name, b"ALPH" | b"VP8 " | b"VP8L"))
            .map(|(_, chunk)| chunk)
            .collect();
        let pixel_bytes: u64 = pixels.iter().map(|chunk| chunk.len() as u64).sum();
        if self.bytes + FRAME_HEADER + pixel_bytes > MOST_FILE_BYTES {
            return Err(AnimationError::TooManyBytes);
        }
        let place = [[0; 3]; 2].concat();
        let size = [three_bytes(width - 1), three_bytes(height - 1)].concat();
        let duration = three_bytes(millis);
        let head: [&[u8]; 4] = [&place, &size, &duration, &[NOT_BLENDED]];
        let parts = [&head[..], &pixels].concat();
        self.bytes += write_chunk(&mut self.out, *b"ANMF", &parts)?;
        self.has_alpha |= frame.rgba.chunks_exact(4).any(|pixel| pixel[3] < u8::MAX);
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), AnimationError> {
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&file_header(self.bytes))?;
        let contents = contents(self.size_px, self.has_alpha);
        write_chunk(&mut self.out, *b"VP8X", &[&contents])?;
        self.out.seek(SeekFrom::Start(self.bytes))?;
        Ok(self.out.flush()?)
    }
}

/// What is in the file, and how large its pictures are.
fn contents((width, height): (u32, u32), has_alpha: bool) -> Vec<u8> {
    let flags = HAS_FRAMES | if has_alpha { HAS_ALPHA } else { 0 };
    let size = [three_bytes(width - 1), three_bytes(height - 1)].concat();
    [&[flags, 0, 0, 0][..], &size].concat()
}

/// Parameters of libwebp. On one thread, as it splits the work otherwise by the machine.
fn config(quality: Option<u8>) -> Result<WebPConfig, AnimationError> {
    use webp::WebPEncodingError::VP8_ENC_ERROR_INVALID_CONFIGURATION as INVALID;
    let mut config = WebPConfig::new().map_err(|()| AnimationError::Webp(INVALID))?;
    match quality {
        Some(quality) => {
            config.method = LOSSY_EFFORT;
            config.quality = f32::from(quality.min(100));
        }
        None => {
            config.lossless = 1;
            (config.method, config.quality) = LOSSLESS_EFFORT;
            // Colours that are not seen stay as well.
            config.exact = 1;
        }
    }
    Ok(config)
}
