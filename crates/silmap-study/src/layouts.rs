//! Uniform data and bind group layouts. Group 0 is the view, 1 the pass, 2 the object that is drawn.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3};
use silmap_geometry::{Camera, lighting};
use silmap_gpu::wgpu;
use silmap_runtime::PrepareError;

/// `View` of `shaders/shared/view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ViewUniform {
    /// Object space (moved so that the model's middle is the origin) to clip space, column-major.
    pub clip_from_object: [[f32; 4]; 4],
    /// Unit directions to the lights and their intensities.
    pub lights: [[f32; 4]; 2],
    /// Image size in pixels.
    pub size_px: [f32; 2],
    /// Factor on the albedo where no light falls.
    pub ambient: f32,
    /// Factor on everything.
    pub dim: f32,
}

impl ViewUniform {
    /// The uniform of a camera for geometry stored relative to `origin`, with depth from `near` to `far`.
    pub(crate) fn new(
        camera: &Camera,
        origin: DVec3,
        (near, far): (f64, f64),
        (light, dim): (Option<DVec3>, f32),
    ) -> Result<Self, PrepareError> {
        let clip = camera.clip_from_object(near, far) * DMat4::from_translation(origin);
        let lights = match light {
            None => lighting::LIGHTS,
            Some(light) => {
                // Lengths whose squares are no numbers are directions too.
                let unit = (light / light.abs().max_element()).try_normalize();
                let unit = unit.filter(|_| light.is_finite());
                let [x, y, z] = unit.ok_or(PrepareError::NoLight)?.as_vec3().to_array();
                [[x, y, z, lighting::MOVED], [0.0, 0.0, 1.0, 0.0]]
            }
        };
        let lights = lights.map(|[x, y, z, intensity]| {
            let length = (x * x + y * y + z * z).sqrt();
            [x / length, y / length, z / length, intensity]
        });
        Ok(Self {
            clip_from_object: clip.as_mat4().to_cols_array_2d(),
            lights,
            size_px: camera.size().as_vec2().to_array(),
            ambient: lighting::AMBIENT,
            dim,
        })
    }
}

/// `ModelMaterial` of `shaders/shade_model.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct MaterialUniform {
    /// Linear colour factor.
    pub base_colour: [f32; 4],
}

/// `Tint` of `shaders/tint.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct TintUniform {
    /// Linear colour and alpha, not premultiplied.
    pub colour: [f32; 4],
}

/// All bind group layouts.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) view: wgpu::BindGroupLayout,
    pub(crate) tint: wgpu::BindGroupLayout,
    pub(crate) two_masks: wgpu::BindGroupLayout,
    pub(crate) material: wgpu::BindGroupLayout,
    pub(crate) edge_lines: wgpu::BindGroupLayout,
    pub(crate) ground: wgpu::BindGroupLayout,
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
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let image = |filterable| wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let mask = image(false);
        let picture = image(true);
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let depths = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        Self {
            view: layout("view", &[uniform]),
            tint: layout("tint", &[mask, uniform]),
            two_masks: layout("two masks", &[mask, mask]),
            material: layout("material", &[uniform, picture, sampler]),
            edge_lines: layout("edge lines", &[uniform]),
            ground: layout("ground", &[uniform, depths, comparison]),
        }
    }
}

/// A uniform buffer with its first content.
pub(crate) fn uniform_buffer<T: Pod>(
    device: &wgpu::Device,
    label: &str,
    content: &T,
) -> wgpu::Buffer {
    filled_buffer(
        device,
        label,
        bytemuck::bytes_of(content),
        wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
    )
}

/// A buffer with its first content; never empty, because devices refuse that.
pub(crate) fn filled_buffer(
    device: &wgpu::Device,
    label: &str,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    use wgpu::util::DeviceExt;
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: if bytes.is_empty() { &[0; 4] } else { bytes },
        usage,
    })
}

/// A bind group whose bindings count up from 0.
pub(crate) fn bind(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}
