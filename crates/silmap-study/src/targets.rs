//! Render targets of a frame, kept while the size stays the same.

use silmap_gpu::wgpu;

use crate::layouts::{Layouts, bind};

/// Depth and stencil together, in the one format that every platform has.
pub(crate) const DEPTH_STENCIL: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// Masks and coverage: one channel that every platform can draw to and blend.
pub(crate) const COVERAGE: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Samples a pixel where edges are smoothed by samples; four is what every platform has.
pub(crate) const SAMPLES: u32 = 4;

/// Images of one size.
#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) size_px: (u32, u32),
    pub(crate) depth_stencil: wgpu::TextureView,
    /// Where the outline covers each pixel, and how far.
    pub(crate) coverage: wgpu::TextureView,
    /// The outline's lines, or the full mesh's mask.
    pub(crate) second_mask: wgpu::TextureView,
    /// The coverage with each of the colours that are drawn by it.
    pub(crate) tint_groups: [wgpu::BindGroup; 2],
    pub(crate) two_masks_group: wgpu::BindGroup,
    /// Colour and depth with several samples, made when first asked for, by the colour's format.
    multisampled: Vec<(wgpu::TextureFormat, Samples)>,
}

/// Colour and depth with several samples.
type Samples = (wgpu::TextureView, wgpu::TextureView);

impl Targets {
    pub(crate) fn new(
        device: &wgpu::Device,
        (layouts, tints): (&Layouts, &[wgpu::Buffer; 2]),
        size_px: (u32, u32),
    ) -> Self {
        let depth_stencil = image(device, "depth and stencil", size_px, DEPTH_STENCIL, 1);
        let coverage = image(device, "coverage", size_px, COVERAGE, 1);
        let second_mask = image(device, "second mask", size_px, COVERAGE, 1);
        let of = wgpu::BindingResource::TextureView;
        let tint_groups = tints.each_ref().map(|tint| {
            let resources = [of(&coverage), tint.as_entire_binding()];
            bind(device, "tint", &layouts.tint, &resources)
        });
        let two_masks_group = bind(
            device,
            "two masks",
            &layouts.two_masks,
            &[of(&coverage), of(&second_mask)],
        );
        Self {
            size_px,
            depth_stencil,
            coverage,
            second_mask,
            tint_groups,
            two_masks_group,
            multisampled: Vec::new(),
        }
    }

    /// Colour of `format` and depth with [`SAMPLES`] samples.
    pub(crate) fn multisampled(
        &mut self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
    ) -> &Samples {
        let is_it = |(of, _): &(wgpu::TextureFormat, _)| *of == format;
        let at = self.multisampled.iter().position(is_it);
        let at = at.unwrap_or_else(|| {
            let samples = (
                image(device, "samples", self.size_px, format, SAMPLES),
                image(
                    device,
                    "depth samples",
                    self.size_px,
                    DEPTH_STENCIL,
                    SAMPLES,
                ),
            );
            self.multisampled.push((format, samples));
            self.multisampled.len() - 1
        });
        &self.multisampled[at].1
    }
}

fn image(
    device: &wgpu::Device,
    label: &str,
    size_px: (u32, u32),
    format: wgpu::TextureFormat,
    sample_count: u32,
) -> wgpu::TextureView {
    let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
    if format == COVERAGE {
        usage |= wgpu::TextureUsages::TEXTURE_BINDING;
    }
    texture_2d(device, label, size_px, format, (sample_count, usage))
        .create_view(&wgpu::TextureViewDescriptor::default())
}

/// A plain two-dimensional texture.
pub(crate) fn texture_2d(
    device: &wgpu::Device,
    label: &str,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    (sample_count, usage): (u32, wgpu::TextureUsages),
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
