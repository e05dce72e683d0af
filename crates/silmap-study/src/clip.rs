//! Outline loops as geometry for the stencil and for the coverage of edge pixels, where the outline itself is shown.
//!
//! Loops come from interpolation, from exact extraction or from a file; nothing here knows which. Each becomes one
//! triangle fan, so that no triangulation is needed, whatever its shape.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, sections 8.1 and 8.3.

use glam::DVec2;
use silmap_geometry::polygon;
use silmap_gpu::{Gpu, wgpu};

use crate::frame::all_finite;
use crate::{ClipShape, RenderError};

/// A buffer that grows to what is written and then stays.
#[derive(Debug)]
pub(crate) struct GrowingBuffer {
    buffer: wgpu::Buffer,
    label: &'static str,
}

/// Size of a fresh buffer in bytes: a contour of a few hundred vertices.
const FIRST_BYTES: u64 = 16 * 1024;

impl GrowingBuffer {
    pub(crate) fn new(gpu: &Gpu, label: &'static str, usage: wgpu::BufferUsages) -> Self {
        let buffer = Self::make(
            gpu,
            label,
            FIRST_BYTES,
            usage | wgpu::BufferUsages::COPY_DST,
        );
        Self { buffer, label }
    }

    fn make(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    pub(crate) fn write<T: bytemuck::NoUninit>(&mut self, gpu: &Gpu, items: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        let needed = bytes.len() as u64;
        if needed > self.buffer.size() {
            let size = needed.next_power_of_two();
            self.buffer = Self::make(gpu, self.label, size, self.buffer.usage());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
    }

    pub(crate) fn slice(&self) -> wgpu::BufferSlice<'_> {
        self.buffer.slice(..)
    }
}

/// The loops of one frame as the device sees them.
#[derive(Debug)]
pub(crate) struct ClipBuffers {
    points: GrowingBuffer,
    indices: GrowingBuffer,
    segments: GrowingBuffer,
    geometry: FanGeometry,
}

/// Fans and segments, in memory.
#[derive(Debug, Default)]
struct FanGeometry {
    points: Vec<[f32; 2]>,
    indices: Vec<u32>,
    segments: Vec<[f32; 4]>,
    heights: Vec<f64>,
}

impl ClipBuffers {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            points: GrowingBuffer::new(gpu, "loop points", wgpu::BufferUsages::VERTEX),
            indices: GrowingBuffer::new(gpu, "loop fans", wgpu::BufferUsages::INDEX),
            segments: GrowingBuffer::new(gpu, "outline segments", wgpu::BufferUsages::VERTEX),
            geometry: FanGeometry::default(),
        }
    }

    /// Brings a shape to the device.
    pub(crate) fn load(&mut self, gpu: &Gpu, shape: &ClipShape<'_>) -> Result<(), RenderError> {
        self.geometry.build(shape)?;
        self.points.write(gpu, &self.geometry.points);
        self.indices.write(gpu, &self.geometry.indices);
        self.segments.write(gpu, &self.geometry.segments);
        Ok(())
    }

    /// Draws the fans of all loops.
    pub(crate) fn draw_fans(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.points.slice());
        pass.set_index_buffer(self.indices.slice(), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.geometry.indices.len() as u32, 0, 0..1);
    }

    /// Draws a quadrilateral about each segment of the outline.
    pub(crate) fn draw_segments(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.segments.slice());
        pass.draw(0..6, 0..self.geometry.segments.len() as u32);
    }
}

impl FanGeometry {
    fn build(&mut self, shape: &ClipShape<'_>) -> Result<(), RenderError> {
        if !all_finite(shape.loops.iter().chain(shape.outline)) {
            return Err(RenderError::LoopNotFinite);
        }
        self.points.clear();
        self.indices.clear();
        self.segments.clear();
        for points in shape.loops.iter().filter(|l| l.len() >= 3) {
            self.add_fan(points);
        }
        for (a, b) in shape.outline.iter().flat_map(|l| polygon::edges(l)) {
            let (a, b) = (a.as_vec2(), b.as_vec2());
            self.segments.push([a.x, a.y, b.x, b.y]);
        }
        Ok(())
    }

    /// One fan, from the vertex of median height: from there the triangles are wide, where from an end of a tall loop
    /// they would be slivers.
    fn add_fan(&mut self, points: &[DVec2]) {
        let base = self.points.len() as u32;
        let count = points.len() as u32;
        self.heights.clear();
        self.heights.extend(points.iter().map(|p| p.y));
        let (_, &mut median, _) = self
            .heights
            .select_nth_unstable_by(points.len() / 2, f64::total_cmp);
        let apex = points.iter().position(|p| p.y == median).unwrap_or(0) as u32;
        self.points
            .extend(points.iter().map(|p| p.as_vec2().to_array()));
        for step in 1..count - 1 {
            let at = |k: u32| base + (apex + k) % count;
            self.indices.extend([base + apex, at(step), at(step + 1)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use silmap_geometry::Loop;

    fn shape(loops: &[Loop]) -> ClipShape<'_> {
        ClipShape {
            loops,
            ..ClipShape::EMPTY
        }
    }

    fn fan_area(geometry: &FanGeometry) -> f64 {
        let corner = |i: u32| {
            let [x, y] = geometry.points[i as usize];
            DVec2::new(x.into(), y.into())
        };
        geometry
            .indices
            .chunks(3)
            .map(|t| polygon::signed_area(&[corner(t[0]), corner(t[1]), corner(t[2])]))
            .sum()
    }

    proptest! {
        #[test]
        fn fans_have_the_area_of_their_loops(
            loops in prop::collection::vec(prop::collection::vec((-64_i32..640, -64_i32..640), 0..9), 0..4)
        ) {
            let loops: Vec<Loop> = loops
                .iter()
                .map(|l| l.iter().map(|&(x, y)| DVec2::new(x.into(), y.into()) / 8.0).collect())
                .collect();
            let wanted: f64 = loops.iter().map(|l| polygon::signed_area(l)).sum();
            let mut geometry = FanGeometry::default();
            geometry.build(&shape(&loops)).unwrap();
            prop_assert!((fan_area(&geometry) - wanted).abs() < 1e-6, "{} is not {wanted}", fan_area(&geometry));
        }
    }

    #[test]
    fn a_loop_that_is_not_finite_is_refused() {
        let mut geometry = FanGeometry::default();
        let broken = [vec![DVec2::ZERO, DVec2::X, DVec2::NAN]];
        let built = geometry.build(&shape(&broken));
        assert!(
            matches!(built, Err(RenderError::LoopNotFinite)),
            "{built:?}"
        );
    }
}
