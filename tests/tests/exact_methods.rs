//! Every method of exact extraction on real models: the same directed edges, and loops of them.
//!
//! The models lie outside the repository, in `../shared/models`; where that folder is missing, nothing is tested and a line
//! says so.

use glam::DVec3;
use silmap_exact::{
    EdgeMesh, ExtractionMethod, Extractor, Viewpoint, chain_loops, silhouette_edges,
};
use silmap_geometry::ClosedMesh;
use silmap_mesh_io::{LoadOptions, load};
use silmap_tests::outside;

/// Models, and whether they are mended first. The quadratic method keeps this to models of moderate size.
const MODELS: &[(&str, bool)] = &[
    ("fuze/fuze.obj", false),
    ("decimated-knight.off", false),
    ("spot/spot_triangulated.obj", false),
    ("cow.obj", true),
    ("three-hole-torus.off", false),
    ("torus.stl", false),
    ("knot-quads.obj", false),
    ("duck.glb", false),
    ("fertility.off", false),
    ("beethoven.ply", true),
];

/// Eyes near and far, one in a face's plane, and directions, one of them along a face.
fn viewpoints(model: &ClosedMesh) -> Vec<Viewpoint> {
    let (center, radius) = (model.bounds().center, model.bounds().radius);
    let [a, b, c] = model.mesh().corners(model.mesh().faces.len() / 3);
    let mut viewpoints: Vec<Viewpoint> = [
        DVec3::new(2.0, 0.3, 0.4),
        DVec3::new(-0.5, 2.5, 1.0),
        DVec3::new(0.1, -0.2, -4.0),
        DVec3::new(0.2, 0.1, 0.3),
    ]
    .map(|p| Viewpoint::Eye(center + p * radius))
    .to_vec();
    viewpoints.push(Viewpoint::Eye(a + (b - a) * 7.0 - (c - a) * 3.0));
    viewpoints.push(Viewpoint::Direction(DVec3::new(1.0, -2.0, 0.5)));
    viewpoints.push(Viewpoint::Direction(b - a));
    viewpoints
}

#[test]
fn methods_agree_on_real_models() {
    let Some(folder) = outside::shared("models") else {
        return;
    };
    for &(name, is_mended) in MODELS {
        let options = LoadOptions {
            close_holes: is_mended,
            repair: is_mended,
            ..LoadOptions::default()
        };
        let model = load(&folder.join(name), &options).expect(name).mesh;
        let mesh = EdgeMesh::from(&model);
        let mut extractors: Vec<Extractor<'_>> = ExtractionMethod::ALL
            .iter()
            .map(|&method| Extractor::new(&mesh, method))
            .collect();
        let mut found = Vec::new();
        for viewpoint in viewpoints(&model) {
            let mut wanted = None;
            for (extractor, method) in extractors.iter_mut().zip(ExtractionMethod::ALL) {
                extractor.extract(&viewpoint, &mut found);
                found.sort_unstable();
                let wanted = wanted.get_or_insert_with(|| found.clone());
                assert_eq!(found, *wanted, "{name}, {method}, {viewpoint:?}");
            }
            if let Viewpoint::Eye(eye) = viewpoint {
                let mut reference = silhouette_edges(model.mesh(), eye);
                reference.sort_unstable();
                assert_eq!(found, reference, "{name}, {viewpoint:?}");
            }
            assert!(!found.is_empty() && chain_loops(&found).is_ok(), "{name}");
        }
    }
}
