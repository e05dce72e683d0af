//! The depths of texture views on the device: an array of pictures of half-precision numbers, which every device filters.
//!
//! A number is the depth from the hull's middle along the view's forward direction, in radii of the hull; or where the view saw nothing, how
//! far around it saw nothing, so that what follows a ray need not look on the way.

use half::f16;
use silmap_geometry::Bounds;
use silmap_gpu::wgpu;
use silmap_map::{Relief, TextureSet};

use crate::LoadError;
use crate::textures::layer_count;

/// Where a view saw nothing it is this, which is farther than all that is in the hull, and the distance to what it saw in widths of the
/// picture; `RELIEF_NOTHING` of `shaders/relief.wgsl`.
const NOTHING: f32 = 2.0;

/// Distances by steps across and along are up to 8 % too large.
const DISTANCE_SHARE: f32 = 0.92;

/// A place between texels may be so many of them nearer to what was seen.
const TEXELS_NEARER: f32 = 1.5;

/// All depth pictures as one array; one that says nothing where the asset has none.
pub(crate) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    textures: &TextureSet,
    bounds: &Bounds,
) -> Result<wgpu::TextureView, LoadError> {
    let relief = textures.relief.as_ref();
    let (width, height) = relief.map_or((1, 1), |r| (r.width_px, r.height_px));
    let limit = device.limits().max_texture_dimension_2d;
    if width.max(height) > limit {
        return Err(LoadError::TextureTooLarge {
            width,
            height,
            limit,
        });
    }
    let layers = relief.map_or(0, |r| r.views.len() as u32);
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("depths"),
        size: wgpu::Extent3d {
            depth_or_array_layers: layer_count(layers),
            ..size
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    if let Some(relief) = relief {
        check(relief, textures)?;
        for (layer, view) in textures.views.iter().enumerate() {
            let middle = view.camera.depth(bounds.center);
            let texels = texels(relief, layer, (middle, bounds.radius))?;
            let mut to = texture.as_image_copy();
            to.origin.z = layer as u32;
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(2 * width),
                rows_per_image: None,
            };
            queue.write_texture(to, bytemuck::cast_slice(&texels), layout, size);
        }
    }
    Ok(texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    }))
}

fn check(relief: &Relief, textures: &TextureSet) -> Result<(), LoadError> {
    let pixels = relief.width_px as usize * relief.height_px as usize;
    let is_whole = relief.views.len() == textures.views.len()
        && relief.views.iter().all(|v| v.codes.len() == pixels);
    if is_whole && relief.bits <= u16::BITS {
        return Ok(());
    }
    Err(LoadError::BadHull {
        what: "it has not one depth for each pixel of each depth picture",
    })
}

/// A view's depths as the device takes them; those of the hull's middle, and its radius, are given.
fn texels(
    relief: &Relief,
    view: usize,
    (middle, radius): (f64, f64),
) -> Result<Vec<u16>, LoadError> {
    // Each code once.
    let number = |code: u32| match relief.depth(view, code as u16) {
        Some(depth) => half(((depth - middle) / radius) as f32),
        None => half(NOTHING),
    };
    let width = relief.width_px as f32;
    let codes = &relief.views[view].codes;
    let distances = distances(codes, relief.width_px as usize);
    let nothing = |distance: f32| {
        half(NOTHING + (distance * DISTANCE_SHARE - TEXELS_NEARER).clamp(0.0, width) / width)
    };
    let numbers: Vec<u16> = (0..1 << relief.bits).map(number).collect();
    let texels = codes
        .iter()
        .zip(distances)
        .map(|(&code, distance)| match code {
            0 => Some(nothing(distance)),
            _ => numbers.get(usize::from(code)).copied(),
        });
    texels.collect::<Option<_>>().ok_or(LoadError::BadHull {
        what: "a depth has more bits than depths have",
    })
}

/// How far each pixel is from one that is not zero, in pixels, by steps across, along and aslant; infinite where there is none.
///
/// Source: Borgefors. Distance transformations in digital images. Computer Vision, Graphics, and Image Processing, 1986.
fn distances(codes: &[u16], width: usize) -> Vec<f32> {
    const ASLANT: f32 = std::f32::consts::SQRT_2;
    let from = |&code: &u16| if code == 0 { f32::INFINITY } else { 0.0 };
    let mut distances: Vec<f32> = codes.iter().map(from).collect();
    let count = distances.len();
    let mut pass = |at: &dyn Fn(usize) -> usize| {
        for k in 0..count {
            let (x, here) = (k % width, at(k));
            let mut least = distances[here];
            if x > 0 {
                least = least.min(distances[at(k - 1)] + 1.0);
            }
            if k >= width {
                least = least.min(distances[at(k - width)] + 1.0);
                if x > 0 {
                    least = least.min(distances[at(k - width - 1)] + ASLANT);
                }
                if x + 1 < width {
                    least = least.min(distances[at(k - width + 1)] + ASLANT);
                }
            }
            distances[here] = least;
        }
    };
    pass(&|k| k);
    pass(&|k| count - 1 - k);
    distances
}

fn half(x: f32) -> u16 {
    f16::from_f32(x).to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn distances_are_those_to_the_nearest() {
        let (width, height) = (23_usize, 17_usize);
        let seen = [(3_usize, 4_usize), (20, 15), (11, 0)];
        let mut codes = vec![0; width * height];
        for (x, y) in seen {
            codes[y * width + x] = 7;
        }
        for (k, found) in distances(&codes, width).into_iter().enumerate() {
            let to = |(x, y): (usize, usize)| {
                let (dx, dy) = (
                    (k % width).abs_diff(x) as f32,
                    (k / width).abs_diff(y) as f32,
                );
                dx.hypot(dy)
            };
            let nearest = seen.into_iter().map(to).fold(f32::INFINITY, f32::min);
            assert!(found >= nearest - 1e-4 && found * DISTANCE_SHARE <= nearest + 1e-4);
        }
        assert!(distances(&[0; 12], 4).iter().all(|d| d.is_infinite()));
    }
}
