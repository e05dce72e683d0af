//! The exact outline of a mesh file as an SVG picture.
//!
//! `cargo run -p silmap-exact --example outline_svg -- MODEL OUT.svg`: the model as OBJ, PLY, STL, OFF or glTF, seen from three radii.

#![expect(clippy::print_stdout, reason = "an example says what it did")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use silmap_exact::{EdgeMesh, ExtractionMethod, Extractor, Outliner, Viewpoint};
use silmap_geometry::Camera;
use silmap_mesh_io::{LoadOptions, load};

const SIDE_PX: u32 = 512;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, out] = arguments.as_slice() else {
        return Err("usage: outline_svg MODEL OUT.svg".into());
    };
    let model = load(Path::new(model), &LoadOptions::default())?.mesh;
    let bounds = model.bounds();
    let eye = bounds.center + 3.0 * bounds.radius * DVec3::new(0.6, 0.5, 1.0).normalize_or_zero();
    let size_px = (SIDE_PX, SIDE_PX);
    let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, size_px)?;

    let mesh = EdgeMesh::from(&model);
    let mut edges = Vec::new();
    Extractor::new(&mesh, ExtractionMethod::Table).extract(&Viewpoint::Eye(eye), &mut edges);
    let loops = Outliner::new(&model.mesh().positions).outline(&edges, &camera)?;

    let mut path = String::new();
    for points in &loops {
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
    println!("{} silhouette edges, {} loops", edges.len(), loops.len());
    Ok(())
}
