//! Depths of an asset beside those of the mesh that it was built from, as the renderer leaves them: by relief, and of the hull alone.
//!
//! `cargo run --release --example depth_errors -- ASSET.glb MODEL`
#![allow(clippy::print_stdout, reason = "it is a program")]

use std::error::Error;
use std::path::Path;

use silmap_geometry::Watch;
use silmap_gpu::Gpu;
use silmap_map::asset;
use silmap_measure::{OFF_REL, depth_errors};
use silmap_mesh_io::{LoadOptions, load};
use silmap_runtime::Paint;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(model)) = (arguments.next(), arguments.next()) else {
        return Err("usage: depth_errors ASSET.glb MODEL".into());
    };
    let asset = asset::read(&std::fs::read(file)?)?;
    let options = LoadOptions {
        close_holes: true,
        ..LoadOptions::default()
    };
    let model = load(Path::new(&model), &options)?;
    let gpu = Gpu::new()?;
    for (name, paint) in [("relief", Paint::Relief), ("hull", Paint::Blended)] {
        let watch = Watch::silent();
        let errors = depth_errors(&gpu, &asset, model.mesh.mesh(), (paint, 8, 4, 512), &watch)?;
        let percent = |share: f64| 100.0 * share;
        println!(
            "{name}: mean {:.3} % of R, {:.2} % of pixels off by more than {} % of R",
            percent(errors.mean),
            percent(errors.off),
            percent(OFF_REL)
        );
    }
    Ok(())
}
