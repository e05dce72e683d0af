//! All render pipelines, created on first use.
//!
//! The stencil's eight bits: the low seven count loops until they have been read and are cleared; from then on [`INSIDE`] marks the
//! pixels inside the region.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.1.
//! Deviation: the paper fills by parity, which punches a hole where a loop overlaps itself; non-zero winding does not.

use std::collections::HashMap;

use silmap_gpu::shaders::{self, Shader};
use silmap_gpu::wgpu;

use crate::EdgeStyle;
use crate::layouts::Layouts;
use crate::targets::{COVERAGE, DEPTH_STENCIL};

/// Stencil bits that count windings.
const WINDING: u32 = 0x7f;
/// Stencil bit of a pixel inside the region.
const INSIDE: u32 = 0x80;
/// Every bit.
const ALL_BITS: u32 = 0xff;
/// What a draw does with the silhouette stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum StencilRole {
    /// Leaves it alone.
    Ignore,
    /// Counts the windings of loop fans under each pixel.
    Fill,
    /// Draws where there are windings, and marks those pixels.
    Cover,
    /// Keeps what is marked inside.
    InsideOnly,
    /// Keeps what is not.
    OutsideOnly,
}

impl StencilRole {
    /// Comparison, read mask, write mask and reference; the operation where the comparison holds follows from the role.
    fn state(self) -> (wgpu::StencilState, u32) {
        use wgpu::CompareFunction::{Always, Equal, NotEqual};
        use wgpu::StencilOperation::{DecrementWrap, IncrementWrap, Keep, Replace};
        let both = |compare, pass_op, read_mask, write_mask| {
            let face = wgpu::StencilFaceState {
                compare,
                fail_op: Keep,
                depth_fail_op: Keep,
                pass_op,
            };
            wgpu::StencilState {
                front: face,
                back: face,
                read_mask,
                write_mask,
            }
        };
        match self {
            Self::Ignore => (wgpu::StencilState::default(), 0),
            Self::Fill => {
                let mut state = both(Always, IncrementWrap, WINDING, WINDING);
                state.back.pass_op = DecrementWrap;
                (state, 0)
            }
            Self::Cover => (both(NotEqual, Replace, WINDING, ALL_BITS), INSIDE),
            Self::InsideOnly => (both(Equal, Keep, INSIDE, 0), INSIDE),
            Self::OutsideOnly => (both(NotEqual, Keep, INSIDE, 0), INSIDE),
        }
    }

    /// The reference value that goes with the state.
    pub(crate) fn reference(self) -> u32 {
        self.state().1
    }
}

/// How a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Draw {
    /// The full mesh, lit.
    Model,
    /// The full mesh's mask.
    ModelMask,
    /// Loop fans into the stencil.
    Fans,
    /// Coverage one where the stencil says so.
    Cover,
    /// Coverage just inside the outline.
    EdgeInside,
    /// Coverage just outside the outline.
    EdgeOutside,
    /// The outline as lines.
    EdgeLine,
    /// The shadow on the ground.
    Ground,
    /// A colour by coverage.
    Tint,
    /// Where two masks differ.
    Difference,
    /// Edges at image precision: the nearest layer of faces.
    SoupNear,
    /// The numbers of the nearest faces.
    SoupItems,
    /// The layer behind.
    SoupEdges(EdgeStyle),
}

/// Coverage in the middle of a drawn line: half its width of 2.2 pixels, plus half the ramp.
const LINE_AT_EDGE: f64 = 1.6;

/// Depths count as equal when they differ by less than the face behind changes in depth over this many pixels: on a round
/// rim, where both layers are as steep, that is a line one pixel wide.
const EQUAL_WITHIN_PX: f32 = 4.0;

/// A pipeline's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PipelineKey {
    pub(crate) draw: Draw,
    pub(crate) stencil: StencilRole,
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) samples: u32,
}

/// The pipelines made so far.
#[derive(Debug)]
pub(crate) struct Pipelines {
    made: HashMap<PipelineKey, wgpu::RenderPipeline>,
}

/// Vertices of the full mesh: position, normal, colour, texture coordinates.
pub(crate) const MODEL_STRIDE: u64 = 36;
const MODEL_ATTRIBUTES: [wgpu::VertexAttribute; 4] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Snorm16x4, 2 => Unorm16x4, 3 => Float32x2
];
const MODEL_POSITION: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x3];
/// Faces one by one: three positions, three normals.
pub(crate) const SOUP_STRIDE: u64 = 60;
const SOUP_ATTRIBUTES: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Snorm16x4, 4 => Snorm16x4, 5 => Snorm16x4
];
const TAG_ATTRIBUTE: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![6 => Uint32];
const POINT_ATTRIBUTE: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x2];
const SEGMENT_ATTRIBUTE: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x4];

impl Draw {
    fn shader(self) -> Shader {
        match self {
            Self::Model => shaders::SHADE_MODEL,
            Self::ModelMask => shaders::CAPTURE_MASK,
            Self::Fans => shaders::STENCIL_FILL,
            Self::Cover => shaders::STENCIL_COVER,
            Self::EdgeInside | Self::EdgeOutside | Self::EdgeLine => shaders::EDGE_COVERAGE,
            Self::Ground => shaders::GROUND_SHADOW,
            Self::Tint => shaders::TINT,
            Self::Difference => shaders::DIFFERENCE,
            Self::SoupNear => shaders::SOUP_NEAR,
            Self::SoupItems => shaders::SOUP_ITEMS,
            Self::SoupEdges(EdgeStyle::Equal | EdgeStyle::Translate) => shaders::EDGES_TRANSLATE,
            Self::SoupEdges(EdgeStyle::Wireframe) => shaders::EDGES_WIREFRAME,
            Self::SoupEdges(EdgeStyle::Fatten | EdgeStyle::Charcoal) => shaders::EDGES_FATTEN,
        }
    }

    fn groups(self, layouts: &Layouts) -> [Option<&wgpu::BindGroupLayout>; 3] {
        match self {
            Self::Model => [Some(&layouts.view), None, Some(&layouts.material)],
            Self::Ground => [None, Some(&layouts.ground), None],
            Self::Tint => [None, Some(&layouts.tint), None],
            Self::Difference => [None, Some(&layouts.two_masks), None],
            Self::Cover => [None, None, None],
            Self::SoupNear | Self::SoupItems | Self::SoupEdges(_) => {
                [Some(&layouts.view), Some(&layouts.edge_lines), None]
            }
            Self::ModelMask
            | Self::Fans
            | Self::EdgeInside
            | Self::EdgeOutside
            | Self::EdgeLine => [Some(&layouts.view), None, None],
        }
    }

    fn vertex_buffers(self) -> Vec<Option<wgpu::VertexBufferLayout<'static>>> {
        use wgpu::VertexStepMode::{Instance, Vertex};
        let buffer = |array_stride, step_mode, attributes| {
            Some(wgpu::VertexBufferLayout {
                array_stride,
                step_mode,
                attributes,
            })
        };
        match self {
            Self::Model => vec![buffer(MODEL_STRIDE, Vertex, &MODEL_ATTRIBUTES[..])],
            Self::ModelMask => vec![buffer(MODEL_STRIDE, Vertex, &MODEL_POSITION[..])],
            Self::Fans => vec![buffer(8, Vertex, &POINT_ATTRIBUTE[..])],
            Self::EdgeInside | Self::EdgeOutside | Self::EdgeLine => {
                vec![buffer(16, Instance, &SEGMENT_ATTRIBUTE[..])]
            }
            Self::Cover | Self::Ground | Self::Tint | Self::Difference => Vec::new(),
            Self::SoupNear | Self::SoupItems | Self::SoupEdges(_) => vec![
                buffer(SOUP_STRIDE, Instance, &SOUP_ATTRIBUTES[..]),
                buffer(4, Instance, &TAG_ATTRIBUTE[..]),
            ],
        }
    }

    /// Whether depth is written, and how it is compared.
    fn depth(self) -> (bool, wgpu::CompareFunction) {
        match self {
            Self::Model | Self::SoupNear | Self::SoupItems => (true, wgpu::CompareFunction::Less),
            Self::SoupEdges(_) => (true, wgpu::CompareFunction::LessEqual),
            _ => (false, wgpu::CompareFunction::Always),
        }
    }

    /// How much nearer it counts as.
    fn depth_bias(self) -> wgpu::DepthBiasState {
        let slope_scale = match self {
            Self::SoupEdges(EdgeStyle::Equal) => -EQUAL_WITHIN_PX,
            _ => 0.0,
        };
        wgpu::DepthBiasState {
            slope_scale,
            ..wgpu::DepthBiasState::default()
        }
    }

    fn blend(self) -> Option<wgpu::BlendState> {
        let extreme = |operation| {
            let component = wgpu::BlendComponent {
                src_factor: wgpu::BlendFactor::One,
                dst_factor: wgpu::BlendFactor::One,
                operation,
            };
            Some(wgpu::BlendState {
                color: component,
                alpha: component,
            })
        };
        match self {
            Self::EdgeInside => extreme(wgpu::BlendOperation::Min),
            Self::EdgeOutside | Self::EdgeLine => extreme(wgpu::BlendOperation::Max),
            Self::Ground | Self::Tint => Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            _ => None,
        }
    }

    fn constants(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::EdgeInside => &[("at_edge", 0.5), ("slope", 1.0)],
            Self::EdgeOutside => &[("at_edge", 0.5), ("slope", -1.0)],
            Self::EdgeLine => &[("at_edge", LINE_AT_EDGE), ("slope", -1.0)],
            _ => &[],
        }
    }

    fn topology(self) -> wgpu::PrimitiveTopology {
        match self {
            Self::Ground => wgpu::PrimitiveTopology::TriangleStrip,
            _ => wgpu::PrimitiveTopology::TriangleList,
        }
    }

    fn writes_colour(self) -> bool {
        self != Self::Fans
    }
}

impl PipelineKey {
    /// A draw into the coverage image.
    pub(crate) fn coverage(draw: Draw, stencil: StencilRole) -> Self {
        Self {
            draw,
            stencil,
            format: COVERAGE,
            samples: 1,
        }
    }

    fn make(self, device: &wgpu::Device, layouts: &Layouts) -> wgpu::RenderPipeline {
        let shader = self.draw.shader();
        let module = shader.module(device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(shader.name),
            bind_group_layouts: &self.draw.groups(layouts),
            immediate_size: 0,
        });
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: self.draw.constants(),
            ..Default::default()
        };
        let (depth_write, depth_compare) = self.draw.depth();
        let write_mask = if self.draw.writes_colour() {
            wgpu::ColorWrites::ALL
        } else {
            wgpu::ColorWrites::empty()
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(shader.name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_main"),
                compilation_options: compilation_options.clone(),
                buffers: &self.draw.vertex_buffers(),
            },
            primitive: wgpu::PrimitiveState {
                topology: self.draw.topology(),
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_STENCIL,
                depth_write_enabled: Some(depth_write),
                depth_compare: Some(depth_compare),
                stencil: self.stencil.state().0,
                bias: self.draw.depth_bias(),
            }),
            multisample: wgpu::MultisampleState {
                count: self.samples,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs_main"),
                compilation_options,
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.format,
                    blend: self.draw.blend(),
                    write_mask,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

impl Pipelines {
    pub(crate) fn new() -> Self {
        Self {
            made: HashMap::new(),
        }
    }

    /// Starts drawing by `key`.
    pub(crate) fn set(
        &mut self,
        (device, layouts): (&wgpu::Device, &Layouts),
        pass: &mut wgpu::RenderPass<'_>,
        key: PipelineKey,
    ) {
        let pipeline = self
            .made
            .entry(key)
            .or_insert_with(|| key.make(device, layouts));
        pass.set_pipeline(pipeline);
        pass.set_stencil_reference(key.stencil.reference());
    }
}
