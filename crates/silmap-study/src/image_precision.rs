//! Silhouette edges at image precision, from single faces without connectivity.
//!
//! The nearest layer of faces fills the depth buffer; then the layer behind is drawn in one of several ways that let it
//! show next to silhouettes only. With consistently oriented faces of closed bodies the nearest layer is that of the
//! front-facing ones. For others it is read back: every face is drawn in a colour of its own, and those whose colour
//! arrives are the nearest.
//!
//! Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999.
//! Deviations: which layer a face is in is decided for the whole face, in the vertex shader, so that no pixel is in both. In
//! the item-buffer variant a face that covers no pixel's centre counts as near, where the paper would draw it as a line.
//! The paper compares depths for equality, which next to no pixel passes; here they may differ by what a face changes in
//! depth over a few pixels. The scale of `translate` is chosen so that a rim as round as [`ROUNDING_REL`] says has the width
//! that is asked for.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec3};
use silmap_geometry::{Camera, TriangleMesh};
use silmap_gpu::{Gpu, wgpu};

use crate::layouts::{Layouts, bind, filled_buffer, uniform_buffer};
use crate::pipelines::SOUP_STRIDE;
use crate::{EdgeParams, EdgeStyle, RenderError};

/// `EdgeLines` of `shaders/shared/soup.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct EdgeLinesUniform {
    /// The eye, relative to the mesh's middle.
    pub eye_in_object: [f32; 3],
    /// Width of lines, pixels.
    pub width_px: f32,
    /// Factor on the distance from the eye of what is pulled forward.
    pub depth_scale: f32,
    /// Change of depth that a slope of 1 makes in a pixel, times the distance along the viewing direction.
    pub slope_depth: f32,
    /// 1 for [`EdgeStyle::Charcoal`].
    pub charcoal: f32,
    /// 1 where tags distinguish the layers.
    pub by_tag: f32,
}

impl EdgeLinesUniform {
    pub(crate) fn new(
        camera: &Camera,
        (origin, radius): (DVec3, f64),
        (near, far): (f64, f64),
        (style, params): (EdgeStyle, &EdgeParams),
    ) -> Self {
        // Size of a pixel at unit distance.
        let pixel_rel = 2.0 * camera.half_tangent.y / f64::from(camera.height_px.max(1));
        // At this depth behind the rim of a sphere the two sides are this far apart in depth, per distance from the eye.
        let distance = camera.eye.distance(origin);
        let width = f64::from(params.width_px) * pixel_rel * distance;
        let pull = (8.0 * ROUNDING_REL * radius * width).sqrt() / distance;
        let depth_scale = match style {
            EdgeStyle::Translate => (1.0 - pull).clamp(LEAST_SCALE, 1.0),
            _ => 1.0,
        };
        let flag = |is_set: bool| if is_set { 1.0 } else { 0.0 };
        Self {
            eye_in_object: (camera.eye - origin).as_vec3().to_array(),
            width_px: params.width_px,
            depth_scale: depth_scale as f32,
            slope_depth: (far * near / (far - near) * pixel_rel) as f32,
            charcoal: flag(style == EdgeStyle::Charcoal),
            by_tag: flag(params.by_item_buffer),
        }
    }
}

/// Radius of a rim on which translated lines have their width, of the mesh's bounding sphere's: about the roundness of limbs.
const ROUNDING_REL: f64 = 1.0 / 16.0;

/// Pulled farther than half way to the eye, nothing would be left of the order of depths.
const LEAST_SCALE: f64 = 0.5;

/// Tags as the shaders read them.
const NEAR: u32 = 0;
const BEHIND: u32 = 1;

/// A pixel's centre counts as covered when it is farther than this inside of a face, pixels: four steps of the
/// rasteriser's grid.
const INSIDE_PX: f64 = 1.0 / 64.0;

/// A face as the shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SoupFace {
    corners: [[f32; 3]; 3],
    normals: [[i16; 4]; 3],
}

const _: () = assert!(
    size_of::<SoupFace>() as u64 == SOUP_STRIDE,
    "as the pipeline reads it"
);

/// As many faces as one buffer holds.
#[derive(Debug)]
struct SoupChunk {
    faces: wgpu::Buffer,
    tags: wgpu::Buffer,
    count: u32,
}

/// The faces of a mesh on the device.
#[derive(Debug)]
pub(crate) struct Soup {
    /// Middle of the mesh; positions on the device are relative to it.
    pub(crate) origin: DVec3,
    /// Radius about `origin`.
    pub(crate) radius: f64,
    pub(crate) group: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    chunks: Vec<SoupChunk>,
    corners: Vec<[[f32; 3]; 3]>,
    /// The camera for which the tags distinguish the layers.
    tagged_for: Option<Camera>,
}

/// Vertices of an instance.
fn vertices_of(style: EdgeStyle) -> u32 {
    match style {
        EdgeStyle::Equal | EdgeStyle::Translate => 3,
        EdgeStyle::Wireframe => 18,
        EdgeStyle::Fatten | EdgeStyle::Charcoal => 27,
    }
}

impl Soup {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        mesh: &TriangleMesh,
    ) -> Result<Self, RenderError> {
        let missing = |&v: &u32| v as usize >= mesh.positions.len();
        if mesh.faces.iter().flatten().any(missing) {
            let what = "a face names a vertex that does not exist";
            return Err(RenderError::BadModel { what });
        }
        let bounds = mesh.bounds();
        let normals = mesh.vertex_normals();
        let faces: Vec<SoupFace> = (mesh.faces.iter())
            .map(|face| SoupFace {
                corners: face.map(|v| single(mesh.positions[v as usize] - bounds.center)),
                normals: face.map(|v| packed(normals[v as usize].as_vec3())),
            })
            .collect();
        let room = (gpu.device.limits().max_buffer_size / SOUP_STRIDE).max(1) as usize;
        let filled = |label, bytes: &[u8]| {
            let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
            filled_buffer(&gpu.device, label, bytes, usage)
        };
        let chunks = (faces.chunks(room))
            .map(|part| SoupChunk {
                faces: filled("faces", bytemuck::cast_slice(part)),
                tags: filled("tags", bytemuck::cast_slice(&vec![NEAR; part.len()])),
                count: part.len() as u32,
            })
            .collect();
        let uniform = uniform_buffer(&gpu.device, "edge lines", &EdgeLinesUniform::zeroed());
        let group = bind(
            &gpu.device,
            "edge lines",
            &layouts.edge_lines,
            &[uniform.as_entire_binding()],
        );
        gpu.check()?;
        Ok(Self {
            origin: bounds.center,
            radius: bounds.radius,
            group,
            uniform,
            chunks,
            corners: faces.iter().map(|f| f.corners).collect(),
            tagged_for: None,
        })
    }

    pub(crate) fn write_lines(&self, gpu: &Gpu, lines: &EdgeLinesUniform) {
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(lines));
    }

    /// Draws all faces for the nearest layer.
    pub(crate) fn draw_faces(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw(pass, 3);
    }

    /// Draws what a style makes of the layer behind.
    pub(crate) fn draw_edges(&self, pass: &mut wgpu::RenderPass<'_>, style: EdgeStyle) {
        self.draw(pass, vertices_of(style));
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, vertices: u32) {
        pass.set_bind_group(1, &self.group, &[]);
        for chunk in &self.chunks {
            pass.set_vertex_buffer(0, chunk.faces.slice(..));
            pass.set_vertex_buffer(1, chunk.tags.slice(..));
            pass.draw(0..vertices, 0..chunk.count);
        }
    }

    pub(crate) fn is_tagged_for(&self, camera: &Camera) -> bool {
        self.tagged_for.as_ref() == Some(camera)
    }

    /// Gives every face its number, one and up, for the item buffer.
    pub(crate) fn number(&mut self, gpu: &Gpu) {
        self.tagged_for = None;
        let numbers: Vec<u32> = (1..=self.corners.len() as u32).collect();
        self.write_tags(gpu, &numbers);
    }

    /// Tags the faces of each layer by the item buffer that `camera` saw, four bytes a pixel.
    pub(crate) fn tag(&mut self, gpu: &Gpu, camera: &Camera, items: &[u8]) {
        let mut is_seen = vec![false; self.corners.len()];
        for pixel in items.chunks_exact(4) {
            let number = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]) as usize;
            if let Some(seen) = number.checked_sub(1).and_then(|f| is_seen.get_mut(f)) {
                *seen = true;
            }
        }
        let image =
            |p: [f32; 3]| camera.image_from_object(self.origin + Vec3::from_array(p).as_dvec3());
        let tags: Vec<u32> = (self.corners.iter().zip(is_seen))
            .map(|(corners, is_seen)| {
                if !is_seen && covers_a_centre(corners.map(image), camera.height_px) {
                    BEHIND
                } else {
                    NEAR
                }
            })
            .collect();
        self.write_tags(gpu, &tags);
        self.tagged_for = Some(*camera);
    }

    fn write_tags(&self, gpu: &Gpu, tags: &[u32]) {
        let mut left = tags;
        for chunk in &self.chunks {
            let (of_chunk, others) = left.split_at(chunk.count as usize);
            gpu.queue
                .write_buffer(&chunk.tags, 0, bytemuck::cast_slice(of_chunk));
            left = others;
        }
    }
}

fn single(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}

fn packed(normal: Vec3) -> [i16; 4] {
    let n = normal * f32::from(i16::MAX);
    [n.x as i16, n.y as i16, n.z as i16, 0]
}

/// Whether the triangle clearly holds the centre of a pixel of some row of the image.
fn covers_a_centre(corners: [DVec2; 3], rows: u32) -> bool {
    let [a, b, c] = corners;
    let (low, high) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
    if !corners.iter().all(|p| p.is_finite()) {
        return false;
    }
    let first = (low + INSIDE_PX - 0.5).ceil().max(0.0) as u32;
    let last = (high - INSIDE_PX - 0.5).floor().min(f64::from(rows) - 1.0);
    let is_in_row = |y: f64| {
        let crossing = |(s, t): (DVec2, DVec2)| {
            let is_crossed = s.y.min(t.y) <= y && y <= s.y.max(t.y) && s.y != t.y;
            is_crossed.then(|| s.x + (t.x - s.x) * (y - s.y) / (t.y - s.y))
        };
        let ends = [(a, b), (b, c), (c, a)].into_iter().filter_map(crossing);
        let (left, right) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), x| {
            (l.min(x), r.max(x))
        });
        (left + INSIDE_PX - 0.5).ceil() <= (right - INSIDE_PX - 0.5).floor()
    };
    (first..rows)
        .take_while(|&y| f64::from(y) <= last)
        .any(|y| is_in_row(f64::from(y) + 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_between_centres_cover_none() {
        let tiny = |x: f64, y: f64| {
            [[0.0, 0.0], [0.3, 0.0], [0.0, 0.3]].map(|p| DVec2::new(x, y) + DVec2::from_array(p))
        };
        assert!(!covers_a_centre(tiny(4.6, 7.1), 100));
        assert!(covers_a_centre(tiny(4.4, 7.4), 100));
        let wide = [[0.1, 0.1], [9.0, 0.2], [0.2, 0.4]].map(DVec2::from_array);
        assert!(
            !covers_a_centre(wide, 100),
            "a sliver above the first centres"
        );
        let all = [[-50.0, -50.0], [90.0, -40.0], [-40.0, 90.0]].map(DVec2::from_array);
        assert!(covers_a_centre(all, 100));
        assert!(
            !covers_a_centre(all.map(|p| p + DVec2::Y * 400.0), 100),
            "below the image"
        );
        assert!(!covers_a_centre([DVec2::NAN; 3], 100));
    }

    #[test]
    fn only_translate_pulls_and_the_wider_the_farther() {
        let camera =
            Camera::fit_sphere(DVec3::Z * 4.0, DVec3::ZERO, 1.0, None, (200, 100)).unwrap();
        let scale = |style, width_px| {
            let params = EdgeParams {
                width_px,
                ..EdgeParams::default()
            };
            let sphere = (DVec3::ZERO, 1.0);
            EdgeLinesUniform::new(&camera, sphere, (3.0, 5.0), (style, &params)).depth_scale
        };
        assert_eq!(scale(EdgeStyle::Fatten, 3.0), 1.0);
        let (narrow, wide) = (
            scale(EdgeStyle::Translate, 1.0),
            scale(EdgeStyle::Translate, 3.0),
        );
        assert!(wide < narrow && narrow < 1.0);
        // Four times the width for twice the pull.
        assert!((1.0 - scale(EdgeStyle::Translate, 4.0) - 2.0 * (1.0 - narrow)).abs() < 1e-6);
        // A pixel is 0.021 wide at the middle: √(8 · 0.021 / 16) / 4.
        assert!((1.0 - narrow - 0.0257).abs() < 3e-4, "{narrow}");
        assert_eq!(scale(EdgeStyle::Translate, 1e9), 0.5);
    }
}
