//! The passes of one frame, for each mode and each way of smoothing edges.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, sections 8.1 and 8.3.
//! Deviation: the outline's coverage is kept in an image of its own, not in the frame's alpha, so that the frame may have
//! an alpha for what is behind it; it is right on both sides of the outline, where a line over a filled inside only adds.

use silmap_gpu::{Gpu, wgpu};

use crate::clip::ClipBuffers;
use crate::image_precision::Soup;
use crate::layouts::Layouts;
use crate::model::ModelBuffers;
use crate::pipelines::{Draw, PipelineKey, Pipelines, StencilRole};
use crate::targets::{COVERAGE, SAMPLES, Targets};
use crate::{Antialias, EdgeStyle};

/// Where a frame goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Canvas<'a> {
    pub(crate) view: &'a wgpu::TextureView,
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) background: wgpu::Color,
}

/// Records the passes of one frame.
pub(crate) struct FrameRecorder<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    pub(crate) canvas: Canvas<'a>,
    pub(crate) layouts: &'a Layouts,
    pub(crate) pipelines: &'a mut Pipelines,
    pub(crate) view_group: &'a wgpu::BindGroup,
    pub(crate) clip: &'a ClipBuffers,
    pub(crate) targets: &'a mut Targets,
}

/// What a pass draws to.
#[derive(Clone, Debug)]
struct PassImages {
    colour: wgpu::TextureView,
    resolve: Option<wgpu::TextureView>,
    depth_stencil: wgpu::TextureView,
    /// The colour to start from, or what is there already.
    start: Option<wgpu::Color>,
}

/// Samples for what no outline smooths.
fn samples_of(antialias: Antialias) -> u32 {
    match antialias {
        Antialias::None => 1,
        Antialias::Soft | Antialias::Msaa => SAMPLES,
    }
}

impl FrameRecorder<'_> {
    /// The full mesh.
    pub(crate) fn original(&mut self, model: &ModelBuffers, antialias: Antialias) {
        let samples = samples_of(antialias);
        let images = self.frame_images(samples);
        let key = self.frame_key(Draw::Model, StencilRole::Ignore, samples);
        self.pass("original", images, |frame, pass| {
            frame.set(pass, key);
            model.draw(pass, true);
        });
    }

    /// Hulls, as a renderer has them ready, over the ground with their shadow where there is one.
    pub(crate) fn hulls(
        &mut self,
        hulls: &silmap_runtime::Renderer,
        ground: Option<&wgpu::BindGroup>,
    ) {
        let samples = hulls.options().formats.samples;
        let images = self.frame_images(samples);
        let key = self.frame_key(Draw::Ground, StencilRole::Ignore, samples);
        self.pass("hulls", images, |frame, pass| {
            if let Some(ground) = ground {
                frame.set(pass, key);
                pass.set_bind_group(1, ground, &[]);
                pass.draw(0..4, 0..1);
            }
            hulls.draw(pass);
        });
    }

    /// The outline: a light inside and a line.
    pub(crate) fn silhouette(&mut self, antialias: Antialias) {
        self.coverage(antialias != Antialias::None);
        let images = self.frame_images(1);
        self.tint("outline's inside", 0, images.clone());
        let line = PipelineKey::coverage(Draw::EdgeLine, StencilRole::Ignore);
        let line_images = self.mask_images(self.targets.coverage.clone());
        self.pass("outline's line", line_images, |frame, pass| {
            frame.set(pass, line);
            frame.clip.draw_segments(pass);
        });
        let over = PassImages {
            start: None,
            ..images
        };
        self.tint("outline", 1, over);
    }

    /// The full mesh, dim, under the pixels that the outline gets wrong.
    pub(crate) fn difference(&mut self, model: &ModelBuffers) {
        self.coverage(false);
        let mask = PipelineKey::coverage(Draw::ModelMask, StencilRole::Ignore);
        let mask_images = self.mask_images(self.targets.second_mask.clone());
        self.pass("mask of the original", mask_images, |frame, pass| {
            frame.set(pass, mask);
            model.draw(pass, false);
        });
        let images = self.frame_images(1);
        let backdrop = self.frame_key(Draw::Model, StencilRole::Ignore, 1);
        let wrong = self.frame_key(Draw::Difference, StencilRole::Ignore, 1);
        let masks = self.targets.two_masks_group.clone();
        self.pass("difference", images, |frame, pass| {
            frame.set(pass, backdrop);
            model.draw(pass, true);
            frame.set(pass, wrong);
            pass.set_bind_group(1, &masks, &[]);
            pass.draw(0..3, 0..1);
        });
    }

    /// The nearest layer of the full mesh's faces, and what a style makes of the layer behind.
    pub(crate) fn edges(&mut self, soup: &Soup, style: EdgeStyle, antialias: Antialias) {
        let samples = samples_of(antialias);
        let images = self.frame_images(samples);
        let near = self.frame_key(Draw::SoupNear, StencilRole::Ignore, samples);
        let behind = self.frame_key(Draw::SoupEdges(style), StencilRole::Ignore, samples);
        self.pass("edges at image precision", images, |frame, pass| {
            frame.set(pass, near);
            soup.draw_faces(pass);
            frame.set(pass, behind);
            soup.draw_edges(pass, style);
        });
    }

    /// The number of the nearest face at each pixel.
    pub(crate) fn items(&mut self, soup: &Soup) {
        let images = self.frame_images(1);
        let key = self.frame_key(Draw::SoupItems, StencilRole::Ignore, 1);
        self.pass("item buffer", images, |frame, pass| {
            frame.set(pass, key);
            soup.draw_faces(pass);
        });
    }

    /// How far the outline covers each pixel, into the coverage image: 0 or 1, with a ramp at the outline when `softly`.
    fn coverage(&mut self, softly: bool) {
        let images = self.mask_images(self.targets.coverage.clone());
        let cover = PipelineKey::coverage(Draw::Cover, StencilRole::Cover);
        let inside = PipelineKey::coverage(Draw::EdgeInside, StencilRole::InsideOnly);
        let outside = PipelineKey::coverage(Draw::EdgeOutside, StencilRole::OutsideOnly);
        self.pass("coverage", images, |frame, pass| {
            frame.fill(pass, COVERAGE, 1);
            frame.set(pass, cover);
            pass.draw(0..3, 0..1);
            if softly {
                for edge in [inside, outside] {
                    frame.set(pass, edge);
                    frame.clip.draw_segments(pass);
                }
            }
        });
    }

    /// Draws all fans into the stencil.
    fn fill(&mut self, pass: &mut wgpu::RenderPass<'_>, format: wgpu::TextureFormat, samples: u32) {
        let key = PipelineKey {
            draw: Draw::Fans,
            stencil: StencilRole::Fill,
            format,
            samples,
        };
        self.set(pass, key);
        self.clip.draw_fans(pass);
    }

    /// Draws one of the colours by the coverage image.
    fn tint(&mut self, label: &str, which: usize, images: PassImages) {
        let key = self.frame_key(Draw::Tint, StencilRole::Ignore, 1);
        let group = self.targets.tint_groups[which].clone();
        self.pass(label, images, |frame, pass| {
            frame.set(pass, key);
            pass.set_bind_group(1, &group, &[]);
            pass.draw(0..3, 0..1);
        });
    }

    /// A draw to the canvas.
    fn frame_key(&self, draw: Draw, stencil: StencilRole, samples: u32) -> PipelineKey {
        PipelineKey {
            draw,
            stencil,
            format: self.canvas.format,
            samples,
        }
    }

    /// The canvas with its background and nothing in front, drawn with `samples`.
    fn frame_images(&mut self, samples: u32) -> PassImages {
        let canvas = self.canvas.view.clone();
        let (colour, resolve, depth_stencil) = if samples == 1 {
            (canvas, None, self.targets.depth_stencil.clone())
        } else {
            let (colour, depth) = self
                .targets
                .multisampled(&self.gpu.device, self.canvas.format)
                .clone();
            (colour, Some(canvas), depth)
        };
        PassImages {
            colour,
            resolve,
            depth_stencil,
            start: Some(self.canvas.background),
        }
    }

    /// An empty mask.
    fn mask_images(&self, mask: wgpu::TextureView) -> PassImages {
        PassImages {
            colour: mask,
            resolve: None,
            depth_stencil: self.targets.depth_stencil.clone(),
            start: Some(wgpu::Color::TRANSPARENT),
        }
    }

    /// Records one pass with the view bound.
    fn pass(
        &mut self,
        label: &str,
        images: PassImages,
        draw: impl FnOnce(&mut Self, &mut wgpu::RenderPass<'_>),
    ) {
        let colour_store = if images.resolve.is_some() {
            wgpu::StoreOp::Discard
        } else {
            wgpu::StoreOp::Store
        };
        let mut pass = self
            .encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(label),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &images.colour,
                    depth_slice: None,
                    resolve_target: images.resolve.as_ref(),
                    ops: wgpu::Operations {
                        load: images.start.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
                        store: colour_store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &images.depth_stencil,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0),
                        store: wgpu::StoreOp::Discard,
                    }),
                }),
                ..Default::default()
            })
            .forget_lifetime();
        pass.set_bind_group(0, self.view_group, &[]);
        draw(self, &mut pass);
    }

    fn set(&mut self, pass: &mut wgpu::RenderPass<'_>, key: PipelineKey) {
        self.pipelines
            .set((&self.gpu.device, self.layouts), pass, key);
    }
}
