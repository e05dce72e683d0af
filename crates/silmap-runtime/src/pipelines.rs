//! All pipelines of a renderer, made with it: none is compiled in the middle of a frame.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.1.
//! Deviation: the paper fills by parity, which punches a hole where a loop overlaps itself; here windings are counted.

use silmap_gpu::shaders::Shader;
use silmap_gpu::wgpu;

use crate::shaders;
use crate::{Antialias, ClipBy, DepthDirection, RendererOptions};

/// Bytes of a hull's corner: see `Corner` of `shaders/paint.wgsl`.
pub(crate) const CORNER_STRIDE: u64 = 64;
const CORNER: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x2, 4 => Uint32x2, 5 => Float32x3
];

/// Bytes of an instance: see `shaders/instance.wgsl`.
pub(crate) const RECORD_STRIDE: u64 = 128;
const RECORD: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
    6 => Float32x4, 7 => Float32x4, 8 => Float32x4, 9 => Float32x4, 10 => Float32x4, 11 => Uint32x4,
    12 => Float32x4, 13 => Float32x4
];

/// Bind group layouts: 0 the outlines, 1 an asset.
#[derive(Debug)]
pub(crate) struct Layouts {
    outlines: wgpu::BindGroupLayout,
    asset: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    depth_sampler: wgpu::Sampler,
}

/// What an asset has on the device: its uniform, its texture views, its atlas, its depths, and the normals of both.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AssetBindings<'a> {
    pub(crate) uniform: &'a wgpu::Buffer,
    pub(crate) views: &'a wgpu::TextureView,
    pub(crate) atlas: &'a wgpu::TextureView,
    pub(crate) depths: &'a wgpu::TextureView,
    pub(crate) normals: &'a wgpu::TextureView,
    pub(crate) atlas_normals: &'a wgpu::TextureView,
}

impl Layouts {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let layout = |label, kinds: &[wgpu::BindingType]| {
            let entries: Vec<_> = (0..)
                .zip(kinds)
                .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty,
                    count: None,
                })
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &entries,
            })
        };
        let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
            sample_type,
            view_dimension,
            multisampled: false,
        };
        let colour = wgpu::TextureSampleType::Float { filterable: true };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        Self {
            outlines: layout(
                "outlines",
                &[texture(
                    wgpu::TextureSampleType::Uint,
                    wgpu::TextureViewDimension::D2,
                )],
            ),
            asset: layout(
                "asset",
                &[
                    uniform,
                    texture(colour, wgpu::TextureViewDimension::D2Array),
                    texture(colour, wgpu::TextureViewDimension::D2),
                    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                    texture(colour, wgpu::TextureViewDimension::D2Array),
                    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                    texture(colour, wgpu::TextureViewDimension::D2Array),
                    texture(colour, wgpu::TextureViewDimension::D2),
                ],
            ),
            depth_sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("depths"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("paint"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            }),
        }
    }

    pub(crate) fn bind_outlines(
        &self,
        device: &wgpu::Device,
        texels: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("outlines"),
            layout: &self.outlines,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(texels),
            }],
        })
    }

    pub(crate) fn bind_asset(
        &self,
        device: &wgpu::Device,
        asset: &AssetBindings<'_>,
    ) -> wgpu::BindGroup {
        let resources = [
            asset.uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(asset.views),
            wgpu::BindingResource::TextureView(asset.atlas),
            wgpu::BindingResource::Sampler(&self.sampler),
            wgpu::BindingResource::TextureView(asset.depths),
            wgpu::BindingResource::Sampler(&self.depth_sampler),
            wgpu::BindingResource::TextureView(asset.normals),
            wgpu::BindingResource::TextureView(asset.atlas_normals),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("asset"),
            layout: &self.asset,
            entries: &entries,
        })
    }
}

/// What a draw does with the stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stencil {
    Ignore,
    /// Counts windings.
    Count,
    /// Keeps what has windings.
    Inside,
    /// Sets it to zero.
    Clear,
}

impl Stencil {
    fn state(self) -> wgpu::StencilState {
        use wgpu::CompareFunction::{Always, NotEqual};
        use wgpu::StencilOperation::{DecrementWrap, IncrementWrap, Keep, Zero};
        const ALL_BITS: u32 = 0xff;
        let face = |compare, pass_op, depth_fail_op| wgpu::StencilFaceState {
            compare,
            fail_op: Keep,
            depth_fail_op,
            pass_op,
        };
        let (front, back, write_mask) = match self {
            Self::Ignore => return wgpu::StencilState::default(),
            Self::Count => (
                face(Always, IncrementWrap, IncrementWrap),
                face(Always, DecrementWrap, DecrementWrap),
                ALL_BITS,
            ),
            Self::Inside => (face(NotEqual, Keep, Keep), face(NotEqual, Keep, Keep), 0),
            Self::Clear => (face(Always, Zero, Zero), face(Always, Zero, Zero), ALL_BITS),
        };
        wgpu::StencilState {
            front,
            back,
            read_mask: ALL_BITS,
            write_mask,
        }
    }
}

/// How one kind of draw is made.
#[derive(Clone, Copy, Debug)]
struct Kind {
    shader: Shader,
    has_corners: bool,
    stencil: Stencil,
    /// Whether depth is written, and compared.
    writes_depth: bool,
    depth: Option<DepthTest>,
    blend: Option<wgpu::BlendState>,
    writes_colour: bool,
    to_samples: bool,
    /// Of the fragment shader.
    constants: &'static [(&'static str, f64)],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DepthTest {
    Nearer,
    Equal,
}

/// All pipelines.
#[derive(Debug)]
pub(crate) struct Pipelines {
    /// For outlines in the stencil.
    pub(crate) windings: Option<(wgpu::RenderPipeline, wgpu::RenderPipeline)>,
    on_hull: HullPipelines,
    by_relief: Option<HullPipelines>,
}

/// Those that draw hulls.
#[derive(Debug)]
pub(crate) struct HullPipelines {
    pub(crate) clipped: wgpu::RenderPipeline,
    /// Pixels covered in part, where those are drawn apart.
    pub(crate) borders: Option<wgpu::RenderPipeline>,
    pub(crate) whole: wgpu::RenderPipeline,
}

/// The shaders of one way to show hulls.
struct HullShaders {
    whole: Shader,
    inside: Shader,
    samples: Shader,
    four_samples: Shader,
    soft: Shader,
    border: Shader,
    is_relief: bool,
}

const ON_HULL: HullShaders = HullShaders {
    whole: shaders::HULL,
    inside: shaders::HULL_INSIDE,
    samples: shaders::HULL_SAMPLES,
    four_samples: shaders::HULL_FOUR_SAMPLES,
    soft: shaders::HULL_SOFT,
    border: shaders::HULL_SOFT_BORDER,
    is_relief: false,
};

const BY_RELIEF: HullShaders = HullShaders {
    whole: shaders::RELIEF_HULL,
    inside: shaders::RELIEF_INSIDE,
    samples: shaders::RELIEF_SAMPLES,
    four_samples: shaders::RELIEF_FOUR_SAMPLES,
    soft: shaders::RELIEF_SOFT,
    border: shaders::RELIEF_SOFT_BORDER,
    is_relief: true,
};

impl Pipelines {
    pub(crate) fn new(device: &wgpu::Device, layouts: &Layouts, options: &RendererOptions) -> Self {
        let windings = Kind {
            shader: shaders::WINDINGS,
            has_corners: false,
            stencil: Stencil::Count,
            writes_depth: false,
            depth: None,
            blend: None,
            writes_colour: false,
            to_samples: false,
            constants: &[],
        };
        let clear = Kind {
            stencil: Stencil::Clear,
            ..windings
        };
        let make = |kind: &Kind| make(device, layouts, options, kind);
        let hulls = |shaders| HullPipelines::new(device, layouts, options, shaders);
        Self {
            windings: (options.clip == ClipBy::Stencil).then(|| (make(&windings), make(&clear))),
            on_hull: hulls(&ON_HULL),
            by_relief: options.has_relief().then(|| hulls(&BY_RELIEF)),
        }
    }

    /// Those that show the hull's own surface, or the model's within it; `None` where they were not asked for.
    pub(crate) fn of_hull(&self, has_relief: bool) -> Option<&HullPipelines> {
        match has_relief {
            true => self.by_relief.as_ref(),
            false => Some(&self.on_hull),
        }
    }
}

impl HullPipelines {
    fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        options: &RendererOptions,
        shaders: &HullShaders,
    ) -> Self {
        let make = |kind: &Kind| make(device, layouts, options, kind);
        let has_colour = options.formats.colour.is_some();
        let has_depth = options.formats.depth.is_some();
        let hull = Kind {
            shader: if has_colour {
                shaders.whole
            } else {
                shaders::HULL_DEPTH
            },
            has_corners: true,
            stencil: Stencil::Ignore,
            writes_depth: true,
            depth: Some(DepthTest::Nearer),
            blend: None,
            writes_colour: has_colour,
            to_samples: false,
            constants: if shaders.is_relief {
                options.relief.constants()
            } else {
                &[]
            },
        };
        // OpenGL's shaders cannot choose samples: the device spreads them by alpha.
        let is_opengl = device.adapter_info().backend == wgpu::Backend::Gl;
        let is_soft = options.antialias == Antialias::Soft;
        let blended = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let by_coverage = match (has_colour, is_soft) {
            (false, _) => Kind {
                shader: shaders::HULL_INSIDE_DEPTH,
                ..hull
            },
            (true, true) => Kind {
                shader: if has_depth {
                    shaders.soft
                } else {
                    shaders::HULL_BLENDED
                },
                blend: blended,
                ..hull
            },
            (true, false) if options.formats.samples == 4 && !is_opengl => Kind {
                shader: shaders.four_samples,
                ..hull
            },
            (true, false) if options.formats.samples > 1 => Kind {
                shader: shaders.samples,
                to_samples: true,
                blend: Some(OPAQUE_SAMPLES),
                ..hull
            },
            (true, false) => Kind {
                shader: shaders.inside,
                ..hull
            },
        };
        let is_stencil = options.clip == ClipBy::Stencil;
        let clipped = if is_stencil {
            Kind {
                stencil: Stencil::Inside,
                ..hull
            }
        } else {
            by_coverage
        };
        let border = Kind {
            shader: shaders.border,
            blend: blended,
            writes_depth: false,
            depth: Some(DepthTest::Equal),
            ..hull
        };
        Self {
            clipped: make(&clipped),
            borders: (is_soft && has_depth).then(|| make(&border)),
            whole: make(&hull),
        }
    }
}

/// The colour of a covered sample replaces what is there; alpha says how much of a pixel is covered, and adds up to one.
const OPAQUE_SAMPLES: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent::REPLACE,
    alpha: wgpu::BlendComponent::OVER,
};

fn make(
    device: &wgpu::Device,
    layouts: &Layouts,
    options: &RendererOptions,
    kind: &Kind,
) -> wgpu::RenderPipeline {
    let module = kind.shader.module(device);
    let label = Some(kind.shader.name);
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[
            Some(&layouts.outlines),
            kind.has_corners.then_some(&layouts.asset),
        ],
        immediate_size: 0,
    });
    let corners = wgpu::VertexBufferLayout {
        array_stride: CORNER_STRIDE,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &CORNER,
    };
    let records = wgpu::VertexBufferLayout {
        array_stride: RECORD_STRIDE,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &RECORD,
    };
    let buffers: &[Option<wgpu::VertexBufferLayout<'_>>] = if kind.has_corners {
        &[Some(corners), Some(records)]
    } else {
        &[Some(records)]
    };
    let write_mask = if kind.writes_colour {
        wgpu::ColorWrites::ALL
    } else {
        wgpu::ColorWrites::empty()
    };
    let targets = options.formats.colour.map(|format| {
        Some(wgpu::ColorTargetState {
            format,
            blend: kind.blend,
            write_mask,
        })
    });
    let fragment = Some(wgpu::FragmentState {
        module: &module,
        entry_point: Some("fs_main"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: kind.constants,
            ..Default::default()
        },
        targets: targets.as_slice(),
    });
    let depth_stencil = options.formats.depth.map(|depth| {
        use wgpu::CompareFunction::{Always, Equal, Greater, Less};
        let compare = match (kind.depth, depth.direction) {
            (None, _) => Always,
            (Some(DepthTest::Equal), _) => Equal,
            (Some(DepthTest::Nearer), DepthDirection::Forward) => Less,
            (Some(DepthTest::Nearer), DepthDirection::Reversed) => Greater,
        };
        wgpu::DepthStencilState {
            format: depth.format,
            depth_write_enabled: Some(kind.writes_depth),
            depth_compare: Some(compare),
            stencil: kind.stencil.state(),
            bias: wgpu::DepthBiasState::default(),
        }
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: kind.has_corners.then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil,
        multisample: wgpu::MultisampleState {
            count: options.formats.samples,
            alpha_to_coverage_enabled: kind.to_samples,
            ..Default::default()
        },
        fragment,
        multiview_mask: None,
        cache: None,
    })
}
