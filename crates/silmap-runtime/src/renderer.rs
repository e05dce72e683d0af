//! The renderer: what a caller's pass draws of assets.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8: outlines into the stencil, coarse meshes where the stencil lets them.
//! Deviations: many instances share draws, outlines outlive frames, and a function of the outline can take the stencil's place.

use glam::DVec2;
use silmap_curve::curve::Texel;
use silmap_geometry::Loop;
use silmap_gpu::wgpu;
use silmap_map::Asset;

use crate::asset::LoadedAsset;
use crate::draws::{Draw, Record};
use crate::pipelines::{Layouts, Pipelines, RECORD_STRIDE};
use crate::plan::{FrameStats, Plan};
use crate::{Instance, LoadError, OptionsError, PrepareError, RendererOptions, View};

/// Texels in a row of the texture of outlines; `outline_texel` of `shaders/outline.wgsl`.
const ROW: u32 = 1024;

/// Instances that the first buffer has room for.
const FIRST_RECORDS: u64 = 256;

const _: () = assert!(
    size_of::<Record>() as u64 == RECORD_STRIDE,
    "as pipelines read it"
);

/// Draws instances of assets in passes of one kind. For each view of a frame (the eyes of a headset, lights that cast shadows) there is
/// a renderer of its own; loaded assets serve all renderers of a device.
#[derive(Debug)]
pub struct Renderer {
    layouts: Layouts,
    pipelines: Pipelines,
    options: RendererOptions,
    plan: Plan,
    size_px: DVec2,
    outlines: wgpu::Texture,
    outline_group: wgpu::BindGroup,
    records: wgpu::Buffer,
}

impl Renderer {
    /// A renderer for passes as the options say. All pipelines are compiled here.
    ///
    /// # Errors
    /// When the options contradict each other, or the device's textures are too small.
    pub fn new(device: &wgpu::Device, options: RendererOptions) -> Result<Self, OptionsError> {
        options.check()?;
        let limit = device.limits().max_texture_dimension_2d;
        if limit < ROW {
            return Err(OptionsError::TexturesTooSmall { limit, needed: ROW });
        }
        let layouts = Layouts::new(device);
        let pipelines = Pipelines::new(device, &layouts, &options);
        let wanted = options.outline_bytes / u64::from(ROW) / size_of::<Texel>() as u64;
        let rows = (wanted.min(u64::from(limit)) as u32).max(1);
        let outlines = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("outlines"),
            size: wgpu::Extent3d {
                width: ROW,
                height: rows,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let texels = outlines.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self {
            outline_group: layouts.bind_outlines(device, &texels),
            records: record_buffer(device, FIRST_RECORDS),
            plan: Plan::new(&options, ROW * rows),
            size_px: DVec2::ZERO,
            layouts,
            pipelines,
            options,
            outlines,
        })
    }

    /// What the renderer was made for.
    #[must_use]
    pub fn options(&self) -> &RendererOptions {
        &self.options
    }

    /// Brings an asset to the device.
    ///
    /// # Errors
    /// When its parts do not belong together, or its textures cannot be decoded or are too large.
    pub fn load(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        asset: &Asset,
    ) -> Result<LoadedAsset, LoadError> {
        LoadedAsset::new(device, queue, &self.layouts, asset, self.options.relight)
    }

    /// Makes ready what [`Renderer::draw`] draws: [`Renderer::plan`] and [`Renderer::upload`].
    ///
    /// # Errors
    /// When the camera is none; then nothing is drawn.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        view: &View,
        instances: &[Instance<'_>],
    ) -> Result<FrameStats, PrepareError> {
        let planned = self.plan(view, instances);
        self.upload(device, queue);
        planned
    }

    /// The processor's part of [`Renderer::prepare`]: finds what is in the picture and its outlines, interpolates those it lacks, and
    /// puts all in order. Instances that keep their place in the slice may keep the outline of the frame before for a while.
    ///
    /// # Errors
    /// When the camera is none; then nothing is drawn.
    pub fn plan(
        &mut self,
        view: &View,
        instances: &[Instance<'_>],
    ) -> Result<FrameStats, PrepareError> {
        self.size_px = DVec2::new(view.size_px.0.into(), view.size_px.1.into());
        let direction = self.options.formats.depth.map(|d| d.direction);
        let eye = view.eye(direction.unwrap_or_default());
        let planned = eye.and_then(|eye| self.plan.make(view, &eye, instances));
        if planned.is_err() {
            self.plan.clear();
        }
        planned.map(|()| self.plan.stats)
    }

    /// The rest of [`Renderer::prepare`]: brings what was planned to the device, by the queue.
    pub fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        for upload in &self.plan.uploads {
            self.write_texels(queue, upload.to, self.plan.texels(upload));
        }
        let bytes: &[u8] = bytemuck::cast_slice(&self.plan.records);
        let needed = self.plan.records.len() as u64;
        if needed * RECORD_STRIDE > self.records.size() {
            self.records = record_buffer(device, needed.next_power_of_two());
        }
        queue.write_buffer(&self.records, 0, bytes);
    }

    /// Writes texels to a place in the texture: one row, or some whole rows and the beginning of one.
    fn write_texels(&self, queue: &wgpu::Queue, to: u32, texels: &[Texel]) {
        let (x, mut y) = (to % ROW, to / ROW);
        let mut write = |x: u32, texels: &[Texel], (width, height): (u32, u32)| {
            let mut place = self.outlines.as_image_copy();
            place.origin = wgpu::Origin3d { x, y, z: 0 };
            y += height;
            queue.write_texture(
                place,
                bytemuck::cast_slice(texels),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(width * size_of::<Texel>() as u32),
                    rows_per_image: None,
                },
                wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
            );
        };
        let (rows, rest) = texels.split_at(texels.len() - texels.len() % ROW as usize);
        if !rows.is_empty() {
            write(0, rows, (ROW, rows.len() as u32 / ROW));
        }
        if !rest.is_empty() {
            write(
                if rows.is_empty() { x } else { 0 },
                rest,
                (rest.len() as u32, 1),
            );
        }
    }

    /// The outline that an instance is clipped to in what was prepared, in pixels of the view from its top-left corner: loops as in
    /// [`SpaceLoops`](crate::SpaceLoops). `None` where it is out of the picture or drawn whole.
    #[must_use]
    pub fn outline_px(&self, instance: usize) -> Option<Vec<Loop>> {
        self.plan.outline_px(instance, self.size_px)
    }

    /// Draws what was prepared. The pass has the formats of the options; with [`ClipBy::Stencil`](crate::ClipBy::Stencil) its stencil is
    /// zero where instances are, and is so again afterwards, and the reference value is set to zero.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if self.plan.draws.is_empty() {
            return;
        }
        pass.set_bind_group(0, &self.outline_group, &[]);
        pass.set_stencil_reference(0);
        let slice = |records: &std::ops::Range<u32>| {
            let bytes = |k: u32| u64::from(k) * RECORD_STRIDE;
            self.records.slice(bytes(records.start)..bytes(records.end))
        };
        for draw in &self.plan.draws {
            match draw {
                Draw::Windings { records, edges } | Draw::Clear { records, edges } => {
                    let Some((windings, clear)) = &self.pipelines.windings else {
                        continue;
                    };
                    let is_clear = matches!(draw, Draw::Clear { .. });
                    pass.set_pipeline(if is_clear { clear } else { windings });
                    pass.set_vertex_buffer(0, slice(records));
                    pass.draw(0..3 * edges, 0..records.end - records.start);
                }
                Draw::Hulls { records, hull }
                | Draw::Whole { records, hull }
                | Draw::Borders { records, hull } => {
                    let Some(of_hull) = self.pipelines.of_hull(hull.has_relief) else {
                        continue;
                    };
                    let pipeline = match draw {
                        Draw::Whole { .. } => &of_hull.whole,
                        Draw::Borders { .. } => match &of_hull.borders {
                            Some(borders) => borders,
                            None => continue,
                        },
                        _ => &of_hull.clipped,
                    };
                    pass.set_pipeline(pipeline);
                    pass.set_vertex_buffer(1, slice(records));
                    self.plan.assets[hull.asset].draw(pass, records.end - records.start);
                }
            }
        }
    }
}

fn record_buffer(device: &wgpu::Device, count: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("instances"),
        size: count * RECORD_STRIDE,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
