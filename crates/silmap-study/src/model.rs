//! Device buffers of the full mesh, for modes that draw it or compare with it.

use glam::{DVec3, Vec3};
use silmap_geometry::{Appearance, ColourImage, Material, TextureWrap, TriangleMesh, lighting};
use silmap_gpu::{Gpu, split_faces, wgpu};

use crate::RenderError;
use crate::layouts::{Layouts, MaterialUniform, bind, filled_buffer, uniform_buffer};
use crate::pipelines::MODEL_STRIDE;
use crate::targets::texture_2d;

/// A vertex as `shade_model` reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct ModelVertex {
    position: [f32; 3],
    normal: [i16; 4],
    colour: [u16; 4],
    uv: [f32; 2],
}

const _: () = assert!(
    size_of::<ModelVertex>() as u64 == MODEL_STRIDE,
    "as the pipeline reads it"
);

/// A piece of the mesh with one material.
#[derive(Debug)]
struct ModelChunk {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    material: usize,
}

/// The full mesh on the device.
#[derive(Debug)]
pub(crate) struct ModelBuffers {
    /// Middle of the model; positions on the device are relative to it.
    pub(crate) origin: DVec3,
    /// Radius about `origin`.
    pub(crate) radius: f64,
    chunks: Vec<ModelChunk>,
    materials: Vec<wgpu::BindGroup>,
}

/// Bytes of three 32-bit indices.
const FACE_BYTES: u64 = 12;

impl ModelBuffers {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        mesh: &TriangleMesh,
    ) -> Result<Self, RenderError> {
        check_appearance(mesh)?;
        let bounds = mesh.bounds();
        let normals = mesh.vertex_normals();
        let room = gpu.device.limits().max_buffer_size;
        let max_vertices = (room / MODEL_STRIDE) as usize;
        let max_faces = (room / FACE_BYTES) as usize;
        let materials = materials_of(&mesh.appearance);
        let mut chunks = Vec::new();
        for material in 0..materials.len() {
            let (faces, vertex_count) = numbered_faces(mesh, material);
            for chunk in split_faces(&faces, vertex_count, max_vertices, max_faces) {
                let vertices: Vec<ModelVertex> = chunk
                    .vertices
                    .iter()
                    .map(|&v| vertex_of(mesh, &normals, bounds.center, v))
                    .collect();
                chunks.push(ModelChunk {
                    vertices: filled_buffer(
                        &gpu.device,
                        "model vertices",
                        bytemuck::cast_slice(&vertices),
                        wgpu::BufferUsages::VERTEX,
                    ),
                    indices: filled_buffer(
                        &gpu.device,
                        "model faces",
                        bytemuck::cast_slice(&chunk.faces),
                        wgpu::BufferUsages::INDEX,
                    ),
                    index_count: 3 * chunk.faces.len() as u32,
                    material,
                });
            }
        }
        let materials = materials
            .iter()
            .map(|m| material_group(gpu, layouts, m))
            .collect::<Result<_, _>>()?;
        gpu.check()?;
        Ok(Self {
            origin: bounds.center,
            radius: bounds.radius,
            chunks,
            materials,
        })
    }

    /// Draws all pieces; binds their materials when `with_materials`.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, with_materials: bool) {
        for chunk in &self.chunks {
            if with_materials {
                pass.set_bind_group(2, &self.materials[chunk.material], &[]);
            }
            pass.set_vertex_buffer(0, chunk.vertices.slice(..));
            pass.set_index_buffer(chunk.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..chunk.index_count, 0, 0..1);
        }
    }
}

/// Whether what the appearance refers to is there.
fn check_appearance(mesh: &TriangleMesh) -> Result<(), RenderError> {
    let look = &mesh.appearance;
    let fits = |count: usize| count == 0 || count == mesh.faces.len();
    let broken = |what| Err(RenderError::BadModel { what });
    if mesh
        .faces
        .iter()
        .flatten()
        .any(|&v| v as usize >= mesh.positions.len())
    {
        return broken("a face names a vertex that does not exist");
    }
    if !(fits(look.corner_uvs.len())
        && fits(look.corner_colours.len())
        && fits(look.face_materials.len()))
    {
        return broken("some faces have colours or texture coordinates, others none");
    }
    if look
        .face_materials
        .iter()
        .any(|&m| usize::from(m) >= look.materials.len())
    {
        return broken("a face names a material that does not exist");
    }
    Ok(())
}

/// The materials that pieces are drawn with: the model's, after one for faces that name none.
fn materials_of(look: &Appearance) -> Vec<Material> {
    let base_colour = if look.is_plain() {
        lighting::DEFAULT_ALBEDO
    } else {
        [1.0; 3]
    };
    let unnamed = Material {
        base_colour,
        ..Material::default()
    };
    let named = if look.face_materials.is_empty() {
        &[]
    } else {
        &look.materials[..]
    };
    std::iter::once(unnamed)
        .chain(named.iter().cloned())
        .collect()
}

/// The faces drawn with a material (0: none named) over vertices, or over corners where corners have attributes; and how
/// many of these there are.
fn numbered_faces(mesh: &TriangleMesh, material: usize) -> (Vec<[u32; 3]>, usize) {
    let look = &mesh.appearance;
    let of_face = |f: usize| {
        look.face_materials
            .get(f)
            .map_or(0, |&m| usize::from(m) + 1)
    };
    let by_corner = has_corners(look);
    let faces = (0..mesh.faces.len())
        .filter(|&f| of_face(f) == material)
        .map(|f| {
            if by_corner {
                [0, 1, 2].map(|k| 3 * f as u32 + k)
            } else {
                mesh.faces[f]
            }
        })
        .collect();
    let count = if by_corner {
        3 * mesh.faces.len()
    } else {
        mesh.positions.len()
    };
    (faces, count)
}

fn has_corners(look: &Appearance) -> bool {
    !(look.corner_uvs.is_empty() && look.corner_colours.is_empty())
}

/// Vertex `id`, counted as [`numbered_faces`] does.
fn vertex_of(mesh: &TriangleMesh, normals: &[DVec3], origin: DVec3, id: u32) -> ModelVertex {
    let look = &mesh.appearance;
    let (vertex, face, corner) = if has_corners(look) {
        let (face, corner) = (id as usize / 3, id as usize % 3);
        (mesh.faces[face][corner] as usize, face, corner)
    } else {
        (id as usize, usize::MAX, 0)
    };
    let normal = normals[vertex].as_vec3() * f32::from(i16::MAX);
    let colour = look
        .corner_colours
        .get(face)
        .map_or([1.0; 3], |c| c[corner]);
    let colour = Vec3::from(colour).clamp(Vec3::ZERO, Vec3::ONE) * f32::from(u16::MAX);
    ModelVertex {
        position: (mesh.positions[vertex] - origin).as_vec3().to_array(),
        normal: [normal.x as i16, normal.y as i16, normal.z as i16, 0],
        colour: [colour.x as u16, colour.y as u16, colour.z as u16, u16::MAX],
        uv: look.corner_uvs.get(face).map_or([0.0; 2], |c| c[corner]),
    }
}

fn material_group(
    gpu: &Gpu,
    layouts: &Layouts,
    material: &Material,
) -> Result<wgpu::BindGroup, RenderError> {
    let white = ColourImage {
        width: 1,
        height: 1,
        rgba: vec![255; 4],
    };
    let picture = material.texture.as_ref().unwrap_or(&white);
    let texture = upload_picture(gpu, "model texture", picture)?;
    let [r, g, b] = material.base_colour;
    let uniform = MaterialUniform {
        base_colour: [r, g, b, 1.0],
    };
    let uniform = uniform_buffer(&gpu.device, "material", &uniform);
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("model texture"),
        address_mode_u: address_mode(material.wrap[0]),
        address_mode_v: address_mode(material.wrap[1]),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    Ok(bind(
        &gpu.device,
        "material",
        &layouts.material,
        &[
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(
                &texture.create_view(&wgpu::TextureViewDescriptor::default()),
            ),
            wgpu::BindingResource::Sampler(&sampler),
        ],
    ))
}

fn address_mode(wrap: TextureWrap) -> wgpu::AddressMode {
    match wrap {
        TextureWrap::Repeat => wgpu::AddressMode::Repeat,
        TextureWrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        TextureWrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    }
}

/// A picture as a texture of sRGB colours.
fn upload_picture(
    gpu: &Gpu,
    label: &str,
    picture: &ColourImage,
) -> Result<wgpu::Texture, RenderError> {
    let (width, height) = (picture.width, picture.height);
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if width == 0
        || height == 0
        || picture.rgba.len() as u64 != 4 * u64::from(width) * u64::from(height)
    {
        return Err(RenderError::BadModel {
            what: "a texture has no pixels or not as many as it says",
        });
    }
    if width > limit || height > limit {
        return Err(RenderError::TextureTooLarge {
            width,
            height,
            limit,
        });
    }
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let texture = texture_2d(&gpu.device, label, (width, height), format, (1, usage));
    gpu.queue.write_texture(
        texture.as_image_copy(),
        &picture.rgba,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * width),
            rows_per_image: None,
        },
        texture.size(),
    );
    Ok(texture)
}
