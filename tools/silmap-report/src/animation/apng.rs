//! Animated PNG, by the crate `png`.

use std::io::Write;

use ::png::{BitDepth, BlendOp, ColorType, Compression, DisposeOp, Encoder, Filter, Writer};
use silmap_geometry::ColourImage;

use super::{AnimationError, AnimationParams};

/// So often does it play: for ever.
const NO_END: u32 = 0;

pub(super) struct Apng<W: Write> {
    writer: Writer<W>,
}

impl<W: Write> Apng<W> {
    pub(super) fn new(out: W, params: &AnimationParams) -> Result<Self, AnimationError> {
        let (width, height) = params.size_px;
        let mut encoder = Encoder::new(out, width, height);
        encoder.set_color(ColorType::Rgba);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced);
        encoder.set_filter(Filter::Adaptive);
        encoder.set_animated(params.frames, NO_END)?;
        let (seconds, parts) = params.rate.delay();
        encoder.set_frame_delay(seconds, parts)?;
        encoder.set_blend_op(BlendOp::Source)?;
        encoder.set_dispose_op(DisposeOp::None)?;
        Ok(Self {
            writer: encoder.write_header()?,
        })
    }

    pub(super) fn push(&mut self, frame: &ColourImage) -> Result<(), AnimationError> {
        Ok(self.writer.write_image_data(&frame.rgba)?)
    }

    pub(super) fn finish(self) -> Result<(), AnimationError> {
        Ok(self.writer.finish()?)
    }
}
