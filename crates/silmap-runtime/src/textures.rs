//! Pictures on the device.

use silmap_geometry::ColourImage;
use silmap_gpu::wgpu;
use silmap_map::{EncodedImage, TextureSet};

use crate::LoadError;
use crate::facing::{facing, set_facing};
use crate::mips::{Halving, level_count};

/// Texture views that a face's visibility bits can name; the length of the arrays in `shaders/paint.wgsl`.
pub(crate) const MOST_VIEWS: usize = 64;

/// Of colours.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Of normals.
pub(crate) const NORMALS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Decodes a picture of the asset.
pub(crate) fn decode(image: &EncodedImage, index: usize) -> Result<ColourImage, LoadError> {
    let decoded = image::load_from_memory(&image.bytes)
        .map_err(|reason| LoadError::BadTexture {
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

/// One white pixel, where there is no picture.
pub(crate) fn blank() -> ColourImage {
    ColourImage {
        width: 1,
        height: 1,
        rgba: vec![255; 4],
    }
}

/// Layers of the array of `views` pictures. WebGL2 takes an array of one layer for a plain image, and one of a multiple of
/// six square layers for a cube, so such counts get a layer more.
pub(crate) fn layer_count(views: u32) -> u32 {
    let layers = views.max(2);
    if layers.is_multiple_of(6) {
        layers + 1
    } else {
        layers
    }
}

/// All texture views as one array.
pub(crate) fn upload_views(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    textures: &TextureSet,
) -> Result<wgpu::TextureView, LoadError> {
    let mut pictures = textures
        .views
        .iter()
        .enumerate()
        .map(|(index, view)| {
            let mut picture = decode(&view.image, index)?;
            if let Some(relief) = &textures.relief {
                set_facing(&mut picture, &facing(relief, index, &view.camera), relief);
            }
            Ok(picture)
        })
        .collect::<Result<Vec<_>, LoadError>>()?;
    if pictures.is_empty() {
        pictures.push(blank());
    }
    let (first_width, first_height) = (pictures[0].width, pictures[0].height);
    for (index, picture) in pictures.iter().enumerate() {
        let (width, height) = (picture.width, picture.height);
        if (width, height) != (first_width, first_height) {
            return Err(LoadError::TextureSizesDiffer {
                index,
                width,
                height,
                first_width,
                first_height,
            });
        }
    }
    let layers = layer_count(pictures.len() as u32);
    let limit = device.limits().max_texture_array_layers;
    if layers > limit {
        return Err(LoadError::TooManyTextures {
            count: pictures.len(),
            limit: limit as usize,
        });
    }
    let size = (first_width, first_height);
    let levels = level_count(first_width, first_height);
    let texture = make(device, ("texture views", FORMAT), size, (layers, levels))?;
    let halving = Halving::new();
    for (layer, mut picture) in (0..).zip(pictures) {
        write(queue, &texture, (layer, 0), &picture);
        for level in 1..levels {
            picture = halving.half(&picture);
            write(queue, &texture, (layer, level), &picture);
        }
    }
    Ok(texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    }))
}

/// One picture, of colours or of normals, without smaller versions: tiles of an atlas would run into each other.
pub(crate) fn upload_picture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &ColourImage,
    (label, format): (&str, wgpu::TextureFormat),
) -> Result<wgpu::TextureView, LoadError> {
    let size = (picture.width, picture.height);
    let texture = make(device, (label, format), size, (1, 1))?;
    write(queue, &texture, (0, 0), picture);
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

/// The normals of texture views, as one array; of one size.
pub(crate) fn upload_normals(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    pictures: &[ColourImage],
) -> Result<wgpu::TextureView, LoadError> {
    let size = (pictures.first()).map_or((1, 1), |p| (p.width, p.height));
    let layers = layer_count(pictures.len() as u32);
    let texture = make(device, ("normals", NORMALS), size, (layers, 1))?;
    for (layer, picture) in (0..).zip(pictures) {
        write(queue, &texture, (layer, 0), picture);
    }
    Ok(texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    }))
}

fn make(
    device: &wgpu::Device,
    (label, format): (&str, wgpu::TextureFormat),
    (width, height): (u32, u32),
    (layers, levels): (u32, u32),
) -> Result<wgpu::Texture, LoadError> {
    let limit = device.limits().max_texture_dimension_2d;
    if width.max(height) > limit {
        return Err(LoadError::TextureTooLarge {
            width,
            height,
            limit,
        });
    }
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: layers,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    }))
}

/// Fills a layer of a texture, at a level, with a picture of its size.
fn write(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    (layer, level): (u32, u32),
    picture: &ColourImage,
) {
    let mut to = texture.as_image_copy();
    to.origin.z = layer;
    to.mip_level = level;
    queue.write_texture(
        to,
        &picture.rgba,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * picture.width),
            rows_per_image: None,
        },
        wgpu::Extent3d {
            width: picture.width,
            height: picture.height,
            depth_or_array_layers: 1,
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

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
