//! The outline of an asset's model from a viewpoint, interpolated, as an SVG picture.
//!
//! `cargo run -p silmap-map --example interpolate -- ASSET.glb X,Y,Z OUT.svg`: the eye as a direction from the model's centre; it stands
//! at three radii.

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::error::Error;
use std::fmt::Write as _;

use glam::DVec3;
use silmap_geometry::Camera;
use silmap_map::{Interpolation, MapReader, asset, outline};

const SIDE_PX: u32 = 512;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, direction, out] = arguments.as_slice() else {
        return Err("usage: interpolate ASSET.glb X,Y,Z OUT.svg".into());
    };
    let map = asset::read(&std::fs::read(file)?)?.map;
    let numbers: Vec<f64> = (direction.split(',').map(str::parse)).collect::<Result<_, _>>()?;
    let direction = DVec3::from_array(numbers.try_into().map_err(|_| "a direction is X,Y,Z")?);
    let eye = map.center + 3.0 * map.radius * direction.normalize_or(DVec3::Z);
    let camera = Camera::fit_sphere(eye, map.center, map.radius, None, (SIDE_PX, SIDE_PX))?;

    // A reader keeps buffers and what it prepared of the map: one for many viewpoints.
    let mut reader = MapReader::new(&map)?;
    let outline = outline(&map, &camera, Interpolation::default(), &mut reader)?;

    let mut path = String::new();
    for points in outline.simple_loops() {
        for (k, p) in points.iter().enumerate() {
            let letter = if k == 0 { 'M' } else { 'L' };
            write!(path, "{letter}{:.3} {:.3}", p.x, p.y)?;
        }
        path.push('Z');
    }
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {SIDE_PX} {SIDE_PX}\"><path fill-rule=\"evenodd\" d=\"{path}\"/></svg>\n"
    );
    std::fs::write(out, svg)?;
    println!("{} loops", outline.simple_loops().len());
    Ok(())
}
