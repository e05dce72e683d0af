//! What the command line says, and the pass that it asks for.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use glam::DVec3;
use silmap_runtime::{Antialias, DepthDirection, DepthTarget, RendererOptions, TargetFormats};

/// Draws an asset to a picture.
#[derive(Debug, Parser)]
pub(crate) struct Options {
    /// An asset that `silmap build` made
    pub(crate) asset: PathBuf,
    /// The picture, a PNG
    pub(crate) picture: PathBuf,
    /// The eye, seen from the model's middle, in radii of the sphere about it
    #[arg(long, value_name = "X,Y,Z", default_value = "1.5,1,3", allow_hyphen_values = true, value_parser = point)]
    pub(crate) from: DVec3,
    /// How many of them, one behind the other
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=10_000))]
    pub(crate) copies: u32,
    /// Pixels a side
    #[arg(long, value_name = "PIXELS", default_value_t = 512)]
    pub(crate) size: u32,
    /// What clips the hull
    #[arg(long, value_enum, default_value_t = Clip::Stencil)]
    clip: Clip,
    /// What smooths the outline
    #[arg(long, value_enum, default_value_t = Edges::Samples)]
    edges: Edges,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Clip {
    /// The stencil buffer
    Stencil,
    /// A function in the fragment shader, for passes without a stencil
    Coverage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Edges {
    /// Nothing
    Hard,
    /// Four samples a pixel
    Samples,
    /// Blending, with `--clip coverage`
    Soft,
}

impl Options {
    /// The pass: sRGB colours with a depth buffer.
    pub(crate) fn renderer(&self) -> RendererOptions {
        let formats = TargetFormats {
            colour: Some(wgpu::TextureFormat::Rgba8UnormSrgb),
            depth: Some(DepthTarget {
                format: match self.clip {
                    Clip::Stencil => wgpu::TextureFormat::Depth24PlusStencil8,
                    Clip::Coverage => wgpu::TextureFormat::Depth32Float,
                },
                direction: DepthDirection::Forward,
            }),
            samples: if self.edges == Edges::Samples { 4 } else { 1 },
        };
        RendererOptions {
            antialias: match self.edges {
                Edges::Soft => Antialias::Soft,
                Edges::Hard | Edges::Samples => Antialias::Samples,
            },
            ..RendererOptions::new(formats)
        }
    }
}

/// Three numbers.
fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.ok().as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|n| n.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("three numbers with commas between them are needed".to_owned()),
    }
}
