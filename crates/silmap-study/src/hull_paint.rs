//! Device buffers and textures of the coarse hull; [`blend`](crate::blend) has the weights of its pictures.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec3};
use silmap_geometry::{Camera, ColourImage, lighting};
use silmap_gpu::{Gpu, wgpu};
use silmap_map::{Asset, CoarseHull, EncodedImage, TextureSet};

use crate::blend::{FacePaint, ViewBlender};
use crate::clip::GrowingBuffer;
use crate::layouts::{Layouts, bind, columns, filled_buffer, uniform_buffer};
use crate::model::{upload_picture, write_layer};
use crate::pipelines::{FACE_PAINT_STRIDE, HULL_STRIDE};
use crate::{Paint, RenderError};

/// Texture views that a face's visibility bits can name; the length of the array in `shaders/shared/hull.wgsl`.
const MAX_VIEWS: usize = 64;

/// `HullPaint` of `shaders/shared/hull.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct HullPaintUniform {
    /// Per texture view: homogeneous texture coordinates of a point, column-major.
    pub texture_from_object: [[[f32; 4]; 4]; MAX_VIEWS],
    /// Linear colour of an unpainted hull.
    pub albedo: [f32; 4],
}

/// A corner as `shared/hull.wgsl` reads it, less what its face shows.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct HullCorner {
    position: [f32; 3],
    normal: [f32; 3],
    surface_point: [f32; 3],
    atlas_uv: [f32; 2],
}

const _: () = assert!(
    size_of::<HullCorner>() as u64 == HULL_STRIDE
        && size_of::<FacePaint>() as u64 == FACE_PAINT_STRIDE,
    "as the pipeline reads them"
);

/// The coarse hull on the device.
#[derive(Debug)]
pub(crate) struct HullBuffers {
    /// Middle of the hull; positions on the device are relative to it.
    pub(crate) origin: DVec3,
    /// Radius about `origin`.
    pub(crate) radius: f64,
    corners: wgpu::Buffer,
    face_paints: GrowingBuffer,
    paint: wgpu::BindGroup,
    blender: ViewBlender,
    corner_paints: Vec<FacePaint>,
}

impl HullBuffers {
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, asset: &Asset) -> Result<Self, RenderError> {
        let (hull, textures) = (&asset.hull, &asset.textures);
        check_hull(hull, textures)?;
        let points = hull.positions.iter().map(|&p| Vec3::from(p).as_dvec3());
        let bounds = silmap_geometry::Bounds::of_points(points);
        let corners = corners_of(hull, textures, bounds.center);
        let paint = paint_group(gpu, layouts, textures, bounds.center)?;
        gpu.check()?;
        Ok(Self {
            origin: bounds.center,
            radius: bounds.radius,
            corners: filled_buffer(
                &gpu.device,
                "hull corners",
                bytemuck::cast_slice(&corners),
                wgpu::BufferUsages::VERTEX,
            ),
            face_paints: GrowingBuffer::new(gpu, "hull face paints", wgpu::BufferUsages::VERTEX),
            paint,
            blender: blender_of(hull, textures),
            corner_paints: Vec::new(),
        })
    }

    /// Chooses what each face shows to an eye; without `paint` the hull is lit.
    pub(crate) fn choose_paint(&mut self, gpu: &Gpu, eye: DVec3, paint: Option<Paint>) {
        self.corner_paints.clear();
        let corners = &mut self.corner_paints;
        self.blender
            .choose(eye, paint, |face| corners.extend([face; 3]));
        self.face_paints.write(gpu, &self.corner_paints);
    }

    /// Draws the hull with its paint bound.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(2, &self.paint, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.set_vertex_buffer(1, self.face_paints.slice());
        pass.draw(0..self.corner_paints.len() as u32, 0..1);
    }
}

/// What the choice of pictures needs of a checked hull.
fn blender_of(hull: &CoarseHull, textures: &TextureSet) -> ViewBlender {
    let middle = |face: &[u32; 3]| -> DVec3 {
        let points = face.map(|v| Vec3::from(hull.surface_points[v as usize]).as_dvec3());
        points.into_iter().sum::<DVec3>() / 3.0
    };
    let eyes: Vec<DVec3> = textures.views.iter().map(|v| v.camera.eye).collect();
    ViewBlender::new(
        hull.faces.iter().map(middle).collect(),
        &eyes,
        &textures.visible_views,
        textures.atlas.is_some(),
    )
}

/// Whether the parts of the hull belong together.
fn check_hull(hull: &CoarseHull, textures: &TextureSet) -> Result<(), RenderError> {
    let broken = |what| Err(RenderError::BadHull { what });
    if hull
        .faces
        .iter()
        .flatten()
        .any(|&v| v as usize >= hull.positions.len())
    {
        return broken("a face names a vertex that does not exist");
    }
    if hull.surface_points.len() != hull.positions.len() {
        return broken("it has not one surface point for each vertex");
    }
    if !textures.views.is_empty() && textures.visible_views.len() != hull.faces.len() {
        return broken("it has not one set of visibility bits for each face");
    }
    if let Some(atlas) = &textures.atlas
        && atlas.corner_uvs.len() != hull.faces.len()
    {
        return broken("its atlas has not texture coordinates for each face");
    }
    if textures.views.len() > MAX_VIEWS {
        return Err(RenderError::TooManyTextures {
            count: textures.views.len(),
            limit: MAX_VIEWS,
        });
    }
    Ok(())
}

fn corners_of(hull: &CoarseHull, textures: &TextureSet, origin: DVec3) -> Vec<HullCorner> {
    let local = |p: [f32; 3]| (Vec3::from(p).as_dvec3() - origin).as_vec3();
    let mut corners = Vec::with_capacity(3 * hull.faces.len());
    for (f, face) in hull.faces.iter().enumerate() {
        let [a, b, c] = face.map(|v| local(hull.positions[v as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let uvs = textures.atlas.as_ref().map(|atlas| atlas.corner_uvs[f]);
        for (k, position) in [a, b, c].into_iter().enumerate() {
            corners.push(HullCorner {
                position: position.to_array(),
                normal: normal.to_array(),
                surface_point: local(hull.surface_points[face[k] as usize]).to_array(),
                atlas_uv: uvs.map_or([0.0; 2], |uvs| uvs[k]),
            });
        }
    }
    corners
}

/// Homogeneous texture coordinates (s·q, t·q, q) of a point of object space in a camera's picture.
fn texture_from_object(camera: &Camera) -> DMat4 {
    let row = |axis: DVec3| axis.extend(-axis.dot(camera.eye));
    let forward = row(camera.forward);
    let across = row(camera.right) / camera.half_tangent.x;
    let upward = row(camera.up) / camera.half_tangent.y;
    DMat4::from_cols(
        (forward + across) * 0.5,
        (forward - upward) * 0.5,
        forward,
        DVec4::W,
    )
    .transpose()
}

/// Decodes a picture of the asset.
fn decode(image: &EncodedImage, index: usize) -> Result<ColourImage, RenderError> {
    let decoded = image::load_from_memory(&image.bytes)
        .map_err(|reason| RenderError::BadTexture {
            index,
            reason: reason.to_string(),
        })?
        .into_rgba8();
    Ok(ColourImage {
        width: decoded.width(),
        height: decoded.height(),
        rgba: decoded.into_raw(),
    })
}

/// Layers of the array of `views` pictures. WebGL2 takes an array of one layer for a plain image, and one of a multiple of
/// six square layers for a cube, so such counts get a layer more.
fn layer_count(views: u32) -> u32 {
    let layers = views.max(2);
    if layers.is_multiple_of(6) {
        layers + 1
    } else {
        layers
    }
}

fn paint_group(
    gpu: &Gpu,
    layouts: &Layouts,
    textures: &TextureSet,
    origin: DVec3,
) -> Result<wgpu::BindGroup, RenderError> {
    let [r, g, b] = lighting::DEFAULT_ALBEDO;
    let mut paint = HullPaintUniform {
        texture_from_object: [[[0.0; 4]; 4]; MAX_VIEWS],
        albedo: [r, g, b, 1.0],
    };
    for (slot, view) in paint.texture_from_object.iter_mut().zip(&textures.views) {
        *slot = columns(texture_from_object(&view.camera) * DMat4::from_translation(origin));
    }
    let views = upload_views(gpu, textures)?;
    let atlas = match &textures.atlas {
        Some(atlas) => decode(&atlas.image, textures.views.len())?,
        None => blank(1, 1),
    };
    let atlas = upload_picture(gpu, "atlas", &atlas)?;
    let uniform = uniform_buffer(&gpu.device, "hull paint", &paint);
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("hull paint"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    let views = views.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    });
    Ok(bind(
        &gpu.device,
        "hull paint",
        &layouts.hull,
        &[
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&views),
            wgpu::BindingResource::TextureView(
                &atlas.create_view(&wgpu::TextureViewDescriptor::default()),
            ),
            wgpu::BindingResource::Sampler(&sampler),
        ],
    ))
}

fn blank(width: u32, height: u32) -> ColourImage {
    ColourImage {
        width,
        height,
        rgba: vec![255; 4 * width as usize * height as usize],
    }
}

/// All texture views as one array.
fn upload_views(gpu: &Gpu, textures: &TextureSet) -> Result<wgpu::Texture, RenderError> {
    let mut pictures = textures
        .views
        .iter()
        .enumerate()
        .map(|(index, view)| decode(&view.image, index))
        .collect::<Result<Vec<_>, _>>()?;
    if pictures.is_empty() {
        pictures.push(blank(1, 1));
    }
    let (width, height) = (pictures[0].width, pictures[0].height);
    for (index, picture) in pictures.iter().enumerate() {
        if (picture.width, picture.height) != (width, height) {
            return Err(RenderError::TextureSizesDiffer {
                index,
                width: picture.width,
                height: picture.height,
                first_width: width,
                first_height: height,
            });
        }
    }
    let limits = gpu.device.limits();
    if width.max(height) > limits.max_texture_dimension_2d {
        return Err(RenderError::TextureTooLarge {
            width,
            height,
            limit: limits.max_texture_dimension_2d,
        });
    }
    let layers = layer_count(pictures.len() as u32);
    if layers > limits.max_texture_array_layers {
        return Err(RenderError::TooManyTextures {
            count: pictures.len(),
            limit: limits.max_texture_array_layers as usize,
        });
    }
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("texture views"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: layers,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (layer, picture) in (0..).zip(&pictures) {
        write_layer(gpu, &texture, layer, picture);
    }
    Ok(texture)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_coordinates_are_image_coordinates_over_the_size() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 48)).unwrap();
        let point = DVec3::new(0.2, -0.3, 0.1);
        let h = texture_from_object(&camera) * point.extend(1.0);
        let uv = h.truncate().truncate() / h.z;
        assert!((uv * camera.size()).distance(camera.image_from_object(point)) < 1e-9);
    }

    #[test]
    fn no_layer_count_is_taken_for_a_plain_image_or_a_cube() {
        for views in 0..=64 {
            let layers = layer_count(views);
            assert!(
                layers >= views.max(2) && !layers.is_multiple_of(6),
                "{layers}"
            );
        }
    }
}
