//! Reading a texture back to memory.
//!
//! Rows in a copy buffer are padded to the device's alignment. [`Readback::start`] records the copy and may be called for
//! several textures before the first is awaited, so that the device never idles; natively [`PendingRead::wait`] blocks,
//! on the web [`PendingRead::finish`] is awaited.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

use crate::{Gpu, GpuError, wait_for};

/// Where the rows of an image lie in a copy buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowLayout {
    /// Bytes of a row that hold pixels.
    pub row_bytes: u32,
    /// Bytes from one row to the next, a multiple of the copy alignment.
    pub stride_bytes: u32,
    /// Rows.
    pub rows: u32,
}

impl RowLayout {
    /// The layout of an image, or nothing when it has no pixels or its rows overflow.
    #[must_use]
    pub fn new(width: u32, height: u32, bytes_per_pixel: u32) -> Option<Self> {
        let row_bytes = width.checked_mul(bytes_per_pixel)?;
        let stride_bytes =
            row_bytes.checked_next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)?;
        (row_bytes > 0 && height > 0).then_some(Self {
            row_bytes,
            stride_bytes,
            rows: height,
        })
    }

    /// Size of the copy buffer in bytes.
    #[must_use]
    pub fn buffer_bytes(&self) -> u64 {
        u64::from(self.stride_bytes) * u64::from(self.rows)
    }

    /// The pixels without the padding.
    ///
    /// # Panics
    /// When `padded` is shorter than [`RowLayout::buffer_bytes`].
    #[must_use]
    pub fn without_padding(&self, padded: &[u8]) -> Vec<u8> {
        assert!(
            padded.len() as u64 >= self.buffer_bytes(),
            "the copy buffer holds all rows"
        );
        padded
            .chunks_exact(self.stride_bytes as usize)
            .take(self.rows as usize)
            .flat_map(|row| &row[..self.row_bytes as usize])
            .copied()
            .collect()
    }
}

/// A reusable copy buffer for images of one size and format.
#[derive(Debug)]
pub struct Readback {
    buffer: wgpu::Buffer,
    layout: RowLayout,
    size: wgpu::Extent3d,
}

impl Readback {
    /// A buffer for images of `width` × `height` pixels of `format`.
    ///
    /// # Errors
    /// When the format has no plain bytes per pixel, the size is zero, or the buffer would be over the device's limit.
    pub fn new(
        gpu: &Gpu,
        (width, height): (u32, u32),
        format: wgpu::TextureFormat,
    ) -> Result<Self, GpuError> {
        let not_readable = GpuError::NotReadable {
            width,
            height,
            format,
        };
        let layout = format
            .block_copy_size(None)
            .filter(|_| format.block_dimensions() == (1, 1))
            .and_then(|bytes| RowLayout::new(width, height, bytes))
            .filter(|l| l.buffer_bytes() <= gpu.device.limits().max_buffer_size)
            .ok_or(not_readable)?;
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: layout.buffer_bytes(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        Ok(Self {
            buffer,
            layout,
            size,
        })
    }

    /// Ends `encoder` with a copy of `texture`, submits it, and asks for the bytes.
    #[must_use]
    pub fn start(
        self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        texture: &wgpu::Texture,
    ) -> PendingRead {
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.layout.stride_bytes),
                    rows_per_image: None,
                },
            },
            self.size,
        );
        let submission = gpu.queue.submit([encoder.finish()]);
        let answer = Answer::default();
        let reply = answer.clone();
        self.buffer
            .map_async(wgpu::MapMode::Read, .., move |mapped| {
                reply.give(mapped.is_ok());
            });
        PendingRead {
            readback: self,
            answer,
            submission,
        }
    }
}

/// A read-back on its way.
#[derive(Debug)]
pub struct PendingRead {
    readback: Readback,
    answer: Answer,
    submission: wgpu::SubmissionIndex,
}

impl PendingRead {
    /// Blocks until the pixels are here, and returns them row by row without padding, with the buffer for the next read.
    ///
    /// # Errors
    /// When the device was lost, refused the work or did not finish in time; always on the web, where nothing may block.
    pub fn wait(self, gpu: &Gpu) -> Result<(Vec<u8>, Readback), GpuError> {
        wait_for(gpu, Some(self.submission.clone()))?;
        let mapped = self.answer.taken().unwrap_or(false);
        self.take(gpu, mapped)
    }

    /// As [`PendingRead::wait`], without blocking. On WebGL2 the page's next submission moves it on.
    ///
    /// # Errors
    /// When the device was lost or refused the work.
    pub async fn finish(self, gpu: &Gpu) -> Result<(Vec<u8>, Readback), GpuError> {
        // Gives a device that is already done the chance to say so.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        let mapped = self.answer.clone().await;
        self.take(gpu, mapped)
    }

    fn take(self, gpu: &Gpu, mapped: bool) -> Result<(Vec<u8>, Readback), GpuError> {
        gpu.check()?;
        let lost = |reason: &str| GpuError::DeviceLost {
            reason: reason.to_owned(),
        };
        if !mapped {
            return Err(lost("an image could not be read back"));
        }
        let readback = self.readback;
        let view = readback
            .buffer
            .get_mapped_range(..)
            .map_err(|refusal| lost(&refusal.to_string()))?;
        let pixels = readback.layout.without_padding(&view);
        drop(view);
        readback.buffer.unmap();
        Ok((pixels, readback))
    }
}

/// A yes or no that a callback gives and a future awaits.
#[derive(Clone, Debug, Default)]
struct Answer(Arc<Mutex<(Option<bool>, Option<Waker>)>>);

impl Answer {
    fn give(&self, value: bool) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.0 = Some(value);
        if let Some(waker) = state.1.take() {
            waker.wake();
        }
    }

    fn taken(&self) -> Option<bool> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).0
    }
}

impl Future for Answer {
    type Output = bool;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<bool> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match state.0 {
            Some(value) => Poll::Ready(value),
            None => {
                state.1 = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_padded_to_the_alignment() {
        let layout = RowLayout::new(65, 3, 4).unwrap();
        assert_eq!((layout.row_bytes, layout.stride_bytes), (260, 512));
        assert_eq!(layout.buffer_bytes(), 1536);
        let exact = RowLayout::new(64, 1, 4).unwrap();
        assert_eq!(exact.row_bytes, exact.stride_bytes);
    }

    #[test]
    fn padding_is_removed_and_nothing_else() {
        let layout = RowLayout::new(5, 2, 1).unwrap();
        let padded: Vec<u8> = (0..512_u32).map(|i| (i % 251) as u8).collect();
        let expected: Vec<u8> = padded[..5]
            .iter()
            .chain(&padded[256..261])
            .copied()
            .collect();
        assert_eq!(layout.without_padding(&padded), expected);
    }

    #[test]
    fn images_without_pixels_or_beyond_all_bounds_have_no_layout() {
        assert_eq!(RowLayout::new(0, 4, 4), None);
        assert_eq!(RowLayout::new(4, 0, 4), None);
        assert_eq!(RowLayout::new(u32::MAX, 1, 4), None);
        assert_eq!(RowLayout::new(u32::MAX, 1, 1), None);
    }
}
