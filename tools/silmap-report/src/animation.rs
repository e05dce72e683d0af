//! Animated pictures, WebP and PNG, that are written frame by frame and repeat for ever.
//!
//! A frame is encoded when it comes and goes to the file at once, so that memory does not grow with the frames. Each frame holds the
//! whole picture: as a model turns, all of it changes, and what does not change is plain background, which costs next to nothing.

mod apng;
mod frame_rate;
mod riff;
#[cfg(test)]
mod tests;
mod webp;

use std::fmt;
use std::io::{self, Seek, Write};

use silmap_geometry::ColourImage;
use thiserror::Error;

use self::apng::Apng;
pub use self::frame_rate::FrameRate;
use self::riff::MOST_FILE_BYTES;
use self::webp::AnimatedWebp;

/// Columns or rows of a WebP picture at most.
pub const MOST_WEBP_SIDE_PX: u32 = 16_383;

/// What a file of moving pictures is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnimationFormat {
    /// WebP, the quality of 0 to 100; without one nothing is lost.
    Webp(Option<u8>),
    /// PNG with more than one frame, which loses nothing. Programs that know plain PNG alone show the first frame.
    Apng,
}

/// What is known before the first frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnimationParams {
    /// The kind of file.
    pub format: AnimationFormat,
    /// Columns and rows.
    pub size_px: (u32, u32),
    /// Frames that will come, at least one.
    pub frames: u32,
    /// How fast they follow each other.
    pub rate: FrameRate,
}

/// Why moving pictures were not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AnimationError {
    /// A side is longer than the format can say.
    #[error("a WebP picture has at most {MOST_WEBP_SIDE_PX} pixels a side, not {width} × {height}")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A frame has another size than the animation, or too few bytes for its own.
    #[error("a frame of {bytes} bytes is no picture of {width} × {height} pixels")]
    NotThatSize {
        /// Columns of the animation.
        width: u32,
        /// Rows of the animation.
        height: u32,
        /// Bytes of the frame.
        bytes: usize,
    },
    /// There are more or fewer frames than was said.
    #[error("{found} frames came, not {expected}")]
    NotThatMany {
        /// Frames that were to come.
        expected: u32,
        /// Frames that came.
        found: u32,
    },
    /// The file is over what its format can hold.
    #[error(
        "a WebP file holds at most {MOST_FILE_BYTES} bytes: fewer or smaller frames, or a lower quality, are needed"
    )]
    TooManyBytes,
    /// A frame cannot be encoded as WebP.
    #[error("the WebP encoder failed: {0:?}")]
    Webp(::webp::WebPEncodingError),
    /// A frame cannot be encoded as PNG.
    #[error(transparent)]
    Png(::png::EncodingError),
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

impl From<::png::EncodingError> for AnimationError {
    fn from(error: ::png::EncodingError) -> Self {
        match error {
            // As itself, for its kind.
            ::png::EncodingError::IoError(error) => Self::Io(error),
            other => Self::Png(other),
        }
    }
}

/// A file of moving pictures that is being written.
pub struct Animation<W: Write + Seek> {
    params: AnimationParams,
    found: u32,
    encoder: Encoder<W>,
}

enum Encoder<W: Write + Seek> {
    Webp(AnimatedWebp<W>),
    Apng(Apng<W>),
}

impl<W: Write + Seek> fmt::Debug for Animation<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Animation")
            .field("params", &self.params)
            .field("found", &self.found)
            .finish_non_exhaustive()
    }
}

impl<W: Write + Seek> Animation<W> {
    /// Begins a file where `out` stands; a WebP file must begin at its first byte.
    ///
    /// # Errors
    /// When the format has no such size, or nothing can be written.
    pub fn new(out: W, params: &AnimationParams) -> Result<Self, AnimationError> {
        let encoder = match params.format {
            AnimationFormat::Webp(quality) => {
                Encoder::Webp(AnimatedWebp::new(out, params.size_px, quality)?)
            }
            AnimationFormat::Apng => Encoder::Apng(Apng::new(out, params)?),
        };
        Ok(Self {
            params: *params,
            found: 0,
            encoder,
        })
    }

    /// Writes the next frame.
    ///
    /// # Errors
    /// When it has another size, is one too many, cannot be encoded or cannot be written.
    pub fn push(&mut self, frame: &ColourImage) -> Result<(), AnimationError> {
        let (width, height) = self.params.size_px;
        let bytes = frame.rgba.len();
        if (frame.width, frame.height) != (width, height)
            || bytes as u64 != 4 * u64::from(width) * u64::from(height)
        {
            return Err(AnimationError::NotThatSize {
                width,
                height,
                bytes,
            });
        }
        if self.found >= self.params.frames {
            return Err(self.not_that_many(self.found + 1));
        }
        match &mut self.encoder {
            Encoder::Webp(webp) => webp.push(frame, self.params.rate.millis(self.found))?,
            Encoder::Apng(apng) => apng.push(frame)?,
        }
        self.found += 1;
        Ok(())
    }

    /// Writes what is left after the last frame.
    ///
    /// # Errors
    /// When frames are missing, or nothing can be written.
    pub fn finish(self) -> Result<(), AnimationError> {
        if self.found != self.params.frames || self.found == 0 {
            return Err(self.not_that_many(self.found));
        }
        match self.encoder {
            Encoder::Webp(webp) => webp.finish(),
            Encoder::Apng(apng) => apng.finish(),
        }
    }

    fn not_that_many(&self, found: u32) -> AnimationError {
        AnimationError::NotThatMany {
            expected: self.params.frames,
            found,
        }
    }
}
