//! An asset on the device: its hull and its pictures, and the map that its outlines are read from.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Mat4, Vec3};
use silmap_geometry::{Bounds, Camera, ColourImage, lighting};
use silmap_gpu::wgpu;
use silmap_gpu::wgpu::util::DeviceExt;
use silmap_map::{
    Asset, BoundingSphere, CoarseHull, MapReader, Method, Placement, SilhouetteMap, TextureSet,
    TextureView,
};

use crate::LoadError;
use crate::depths;
use crate::normals;
use crate::pipelines::{AssetBindings, CORNER_STRIDE, Layouts};
use crate::textures::{
    FORMAT, MOST_VIEWS, NORMALS, blank, decode, upload_normals, upload_picture, upload_views,
};

/// An asset that can be drawn by every renderer of its device. Copies are cheap, and are the same asset.
#[derive(Clone, Debug)]
pub struct LoadedAsset(pub(crate) Arc<AssetData>);

/// What is known of a loaded asset.
#[derive(Debug)]
pub(crate) struct AssetData {
    /// No other asset of this process has it.
    pub(crate) id: u64,
    /// Middle of the hull; positions on the device are relative to it.
    pub(crate) origin: DVec3,
    /// Radius of the hull about `origin`.
    pub(crate) radius: f64,
    pub(crate) map: SilhouetteMap,
    pub(crate) method: Method,
    readers: Mutex<Vec<MapReader>>,
    placement: Placement,
    corners: wgpu::Buffer,
    corner_count: u32,
    group: wgpu::BindGroup,
    /// Whether it says where the model's surface is within the hull.
    pub(crate) has_relief: bool,
    /// Whether it has normals: of texture views, and of the atlas.
    has_normals: (bool, bool),
}

/// `Corner` of `shaders/paint.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Corner {
    position: [f32; 3],
    normal: [f32; 3],
    surface_point: [f32; 3],
    atlas_uv: [f32; 2],
    visible: [u32; 2],
    middle: [f32; 3],
}

const _: () = assert!(
    size_of::<Corner>() as u64 == CORNER_STRIDE,
    "as the pipelines read it"
);

/// `Asset` of `shaders/paint.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct AssetUniform {
    texture_from_object: [[[f32; 4]; 4]; MOST_VIEWS],
    eyes: [[f32; 4]; MOST_VIEWS],
    lights: [[f32; 4]; 2],
    albedo: [f32; 4],
    counts: [u32; 4],
    depth: [f32; 4],
}

static NEXT_ID: AtomicU64 = AtomicU64::new(0);

impl LoadedAsset {
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layouts: &Layouts,
        asset: &Asset,
        is_relit: bool,
    ) -> Result<Self, LoadError> {
        let (hull, textures) = (&asset.hull, &asset.textures);
        check_hull(hull, textures)?;
        let reader = MapReader::new(&asset.map)?;
        let points = hull.positions.iter().map(|&p| Vec3::from(p).as_dvec3());
        let bounds = Bounds::of_points(points);
        let corners = corners_of(hull, textures, bounds.center);
        let content = bytemuck::cast_slice(&corners);
        let corner_buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("hull corners"),
            contents: content,
            usage: wgpu::BufferUsages::VERTEX,
        });
        let views = upload_views(device, queue, textures)?;
        let atlas = match &textures.atlas {
            Some(atlas) => decode(&atlas.image, textures.views.len())?,
            None => blank(),
        };
        let atlas = upload_picture(device, queue, &atlas, ("atlas", FORMAT))?;
        let depths = depths::upload(device, queue, textures, &bounds)?;
        let normals = if is_relit {
            Normals::of(asset)?
        } else {
            Normals::default()
        };
        let has_normals = (!normals.views.is_empty(), normals.atlas.is_some());
        let view_normals = upload_normals(device, queue, &normals.views)?;
        let of_atlas = normals.atlas.unwrap_or_else(normals::none);
        let atlas_normals = upload_picture(device, queue, &of_atlas, ("atlas normals", NORMALS))?;
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("asset"),
            contents: bytemuck::bytes_of(&uniform_of(asset, &bounds, has_normals)),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let bindings = AssetBindings {
            uniform: &uniform,
            views: &views,
            atlas: &atlas,
            depths: &depths,
            normals: &view_normals,
            atlas_normals: &atlas_normals,
        };
        let group = layouts.bind_asset(device, &bindings);
        #[cfg_attr(
            target_arch = "wasm32",
            allow(
                clippy::arc_with_non_send_sync,
                reason = "browsers keep what is on the device on one thread; elsewhere it is shared"
            )
        )]
        Ok(Self(Arc::new(AssetData {
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            origin: bounds.center,
            radius: bounds.radius,
            method: Method::best_for(&asset.map),
            map: asset.map.clone(),
            readers: Mutex::new(vec![reader]),
            placement: asset.placement,
            corners: corner_buffer,
            corner_count: corners.len() as u32,
            group,
            has_relief: textures.relief.is_some() && !textures.views.is_empty(),
            has_normals,
        })))
    }

    /// Where the origin of the asset's coordinates lies in the model and in the scene of its file: instances are placed about it.
    #[must_use]
    pub fn placement(&self) -> Placement {
        self.0.placement
    }

    /// Whether a [moved light](crate::Instance::light) falls on it: it was loaded with [`RendererOptions::relight`](crate::RendererOptions::relight),
    /// and has depths, or an atlas with normals.
    #[must_use]
    pub fn can_relight(&self) -> bool {
        let (of_views, of_atlas) = self.0.has_normals;
        of_views || of_atlas
    }

    /// A sphere about the hull, in the coordinates of the asset.
    #[must_use]
    pub fn bounds(&self) -> BoundingSphere {
        BoundingSphere {
            center: self.0.origin,
            radius: self.0.radius,
        }
    }

    /// A sphere about the model, whose outlines are known from outside of it.
    #[must_use]
    pub fn model_bounds(&self) -> BoundingSphere {
        self.0.map.bounding_sphere()
    }
}

impl AssetData {
    /// A reader of the map that no other thread uses.
    pub(crate) fn take_reader(&self) -> Option<MapReader> {
        let kept = self
            .readers
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        // The map was read once when it was loaded.
        kept.or_else(|| MapReader::new(&self.map).ok())
    }

    /// Takes it back.
    pub(crate) fn give_reader_back(&self, reader: MapReader) {
        let mut readers = self.readers.lock().unwrap_or_else(PoisonError::into_inner);
        readers.push(reader);
    }

    /// Draws the hull of as many instances as the second vertex buffer's slice holds.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, instances: u32) {
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.draw(0..self.corner_count, 0..instances);
    }
}

/// Pictures of normals.
#[derive(Default)]
struct Normals {
    /// Of each texture view, or none.
    views: Vec<ColourImage>,
    atlas: Option<ColourImage>,
}

impl Normals {
    /// What an asset tells of its model's normals; its depths were checked before.
    fn of(asset: &Asset) -> Result<Self, LoadError> {
        let textures = &asset.textures;
        // Photographs have a light of their own; a hull that was carved after photographs, but drawn, has the studio's, and depths.
        let is_seen = (asset.map.views.iter()).any(|view| view.photographed.is_some());
        if is_seen && textures.relief.is_none() {
            return Ok(Self::default());
        }
        let views = textures.relief.as_ref().map(|relief| {
            let views = textures.views.iter().enumerate();
            let of_view =
                |(k, view): (usize, &TextureView)| normals::of_view(relief, k, &view.camera);
            views.map(of_view).collect()
        });
        let atlas = textures.atlas.as_ref();
        Ok(Self {
            views: views.unwrap_or_default(),
            atlas: match atlas {
                Some(atlas) => normals::of_atlas(&asset.hull, atlas)?,
                None => None,
            },
        })
    }
}

/// Whether the parts of the hull belong together.
fn check_hull(hull: &CoarseHull, textures: &TextureSet) -> Result<(), LoadError> {
    let broken = |what| Err(LoadError::BadHull { what });
    let count = hull.positions.len();
    if hull.faces.is_empty() {
        return broken("it has no face");
    }
    if hull.faces.iter().flatten().any(|&v| v as usize >= count) {
        return broken("a face names a vertex that does not exist");
    }
    if hull.surface_points.len() != count {
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
    if textures.views.len() > MOST_VIEWS {
        return Err(LoadError::TooManyTextures {
            count: textures.views.len(),
            limit: MOST_VIEWS,
        });
    }
    Ok(())
}

fn corners_of(hull: &CoarseHull, textures: &TextureSet, origin: DVec3) -> Vec<Corner> {
    let local = |p: [f32; 3]| (Vec3::from(p).as_dvec3() - origin).as_vec3();
    let mut corners = Vec::with_capacity(3 * hull.faces.len());
    for (f, face) in hull.faces.iter().enumerate() {
        let [a, b, c] = face.map(|v| local(hull.positions[v as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let uvs = textures.atlas.as_ref().map(|atlas| atlas.corner_uvs[f]);
        let bits = textures.visible_views.get(f).copied().unwrap_or(0);
        let surface = face.map(|v| local(hull.surface_points[v as usize]));
        let middle = (surface[0] + surface[1] + surface[2]) / 3.0;
        for (k, position) in [a, b, c].into_iter().enumerate() {
            corners.push(Corner {
                position: position.to_array(),
                normal: normal.to_array(),
                surface_point: surface[k].to_array(),
                atlas_uv: uvs.map_or([0.0; 2], |uvs| uvs[k]),
                visible: [bits as u32, (bits >> 32) as u32],
                middle: middle.to_array(),
            });
        }
    }
    corners
}

fn uniform_of(asset: &Asset, bounds: &Bounds, (of_views, of_atlas): (bool, bool)) -> AssetUniform {
    let origin = bounds.center;
    let textures = &asset.textures;
    let [r, g, b] = lighting::DEFAULT_ALBEDO;
    let mut uniform = AssetUniform {
        texture_from_object: [[[0.0; 4]; 4]; MOST_VIEWS],
        eyes: [[0.0; 4]; MOST_VIEWS],
        lights: lighting::LIGHTS.map(|[x, y, z, intensity]| {
            let length = (x * x + y * y + z * z).sqrt();
            [x / length, y / length, z / length, intensity]
        }),
        albedo: [r, g, b, lighting::AMBIENT],
        counts: [
            textures.views.len() as u32,
            u32::from(textures.atlas.is_some()),
            u32::from(of_views),
            u32::from(of_atlas),
        ],
        depth: [bounds.radius as f32, 0.0, 0.0, 0.0],
    };
    for (k, view) in textures.views.iter().enumerate() {
        let matrix = texture_from_object(&view.camera) * DMat4::from_translation(origin);
        let mut rows = matrix.transpose();
        rows.w_axis = (view.camera.forward / bounds.radius).extend(0.0);
        uniform.texture_from_object[k] = Mat4::to_cols_array_2d(&rows.transpose().as_mat4());
        let pixel = 2.0 * view.camera.half_tangent.max_element() / view.camera.size().max_element();
        uniform.eyes[k] = (view.camera.eye - origin)
            .extend(pixel)
            .as_vec4()
            .to_array();
    }
    uniform
}

/// Homogeneous texture coordinates (s·q, t·q, q) of a point of object space in a camera's picture.
fn texture_from_object(camera: &Camera) -> DMat4 {
    let row = |axis: DVec3| axis.extend(-axis.dot(camera.eye));
    let forward = row(camera.forward);
    let (tangent, off) = (camera.half_tangent, camera.center_offset);
    let across = row(camera.right) / tangent.x + forward * off.x;
    let upward = row(camera.up) / tangent.y + forward * off.y;
    DMat4::from_cols(
        (forward + across) * 0.5,
        (forward - upward) * 0.5,
        forward,
        DVec4::W,
    )
    .transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_coordinates_are_image_coordinates_over_the_size() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 48)).unwrap();
        let camera = camera.cropped(glam::DVec2::new(9.0, -5.0), (80, 40));
        let point = DVec3::new(0.2, -0.3, 0.1);
        let h = texture_from_object(&camera) * point.extend(1.0);
        let uv = h.truncate().truncate() / h.z;
        assert!((uv * camera.size()).distance(camera.image_from_object(point)) < 1e-9);
    }
}
