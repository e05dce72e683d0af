//! Mesh and eyes moved together: outlines follow, from capture to interpolation.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DMat3, DVec3};
use silmap_geometry::Watch;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Bounds, Bvh, Camera, ClosedMesh, CoverageRule, Mask, TriangleMesh};
use silmap_map::{
    Asset, CapturedView, MapReader, Method, Placement, SilhouetteMap, ViewContour, asset, outline,
};
use silmap_mesh_io::{self as mesh_io, LoadOptions};
use silmap_models as models;
use silmap_preprocess::capture::{Backend, CaptureParams, capture, deep_contours, view_sphere};
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_preprocess::pipeline::{self, BuildParams};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};

const FACES: usize = 2_000;
const VIEWS: u32 = 80;
const SIDE_PX: u32 = 160;
const TOLERANCE_PX: f64 = 0.5;

/// Share of the inside that may differ where pixels on the rim fall otherwise, and contours are thinned out otherwise.
const RIM_SHARE: f64 = 0.01;
/// Share that differs at least when outlines from different eyes are compared.
const MIXED_UP_SHARE: f64 = 0.05;

/// A similarity: what is moved by it looks the same, or mirrored.
#[derive(Clone, Copy)]
struct Motion {
    linear: DMat3,
    offset: DVec3,
}

impl Motion {
    fn scale(&self) -> f64 {
        self.linear.determinant().abs().cbrt()
    }

    fn is_mirroring(&self) -> bool {
        self.linear.determinant() < 0.0
    }

    fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.offset
    }

    fn mesh(&self, mesh: &TriangleMesh) -> TriangleMesh {
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            *p = self.point(*p);
        }
        if self.is_mirroring() {
            moved.faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        moved
    }

    /// The camera that sees the moved object as `camera` sees the object; after mirroring, left and right are exchanged.
    fn camera(&self, camera: &Camera) -> Camera {
        let turn = |v: DVec3| self.linear * v / self.scale();
        let sign = if self.is_mirroring() { -1.0 } else { 1.0 };
        Camera {
            eye: self.point(camera.eye),
            right: turn(camera.right) * sign,
            up: turn(camera.up),
            forward: turn(camera.forward),
            ..*camera
        }
    }
}

/// The map of a moved mesh, seen by the moved cameras.
fn map_of(mesh: &TriangleMesh, cameras: &[Camera], motion: &Motion) -> SilhouetteMap {
    let bounds = mesh.bounds();
    let mesh = motion.mesh(mesh);
    let cameras: Vec<Camera> = cameras.iter().map(|c| motion.camera(c)).collect();
    let closed = ClosedMesh::try_from(mesh.clone()).unwrap();
    let masks = capture(
        &closed,
        &cameras,
        &CaptureParams::default(),
        &Watch::silent(),
    )
    .unwrap();
    let (tree, moved_bounds) = (Bvh::new(&mesh), mesh.bounds());
    let params = SimplifyContourParams {
        tolerance_px: TOLERANCE_PX,
        outward_only: false,
    };
    let views = cameras.iter().zip(&masks).map(|(&camera, mask)| {
        let loops = simplify_contours(&trace_contours(mask), &params);
        let (loops, depths) = deep_contours(&tree, &moved_bounds, &camera, &loops, false);
        let contours = loops.into_iter().zip(depths);
        CapturedView {
            camera,
            contours: contours
                .map(|(points, depths)| ViewContour {
                    points,
                    depths,
                    ..ViewContour::default()
                })
                .collect(),
            photographed: None,
        }
    });
    let params = DenseMapParams {
        center: motion.point(bounds.center),
        radius: bounds.radius * motion.scale(),
        resolution_px: SIDE_PX,
        tolerance_px: TOLERANCE_PX,
        coverage: CoverageRule::Center,
    };
    dense_map::build(views.collect(), &params).unwrap()
}

/// Outlines as masks.
fn outlines(map: &SilhouetteMap, cameras: &[Camera], method: Method) -> Vec<Mask> {
    let mut scratch = MapReader::new(map).unwrap();
    let drawn = cameras.iter().map(|camera| {
        let found = outline(map, camera, method, &mut scratch).unwrap();
        let mut mask = Mask::new(SIDE_PX, SIDE_PX);
        fill_even_odd(found.simple_loops(), &mut mask);
        mask
    });
    drawn.collect()
}

fn flipped(mask: &Mask) -> Mask {
    let mut turned = Mask::new(SIDE_PX, SIDE_PX);
    for y in 0..SIDE_PX {
        for x in 0..SIDE_PX {
            turned.set(SIDE_PX - 1 - x, y, mask.get(x.into(), y.into()));
        }
    }
    turned
}

/// Share of the inside in which two rows of masks differ, on average.
fn share_different(a: &[Mask], b: &[Mask]) -> f64 {
    assert!(!a.is_empty() && a.len() == b.len(), "nothing is compared");
    let shares = a.iter().zip(b);
    let sum: f64 = shares
        .map(|(a, b)| a.count_different(b) as f64 / a.count() as f64)
        .sum();
    sum / a.len() as f64
}

/// For each method, how much outlines differ when mesh and eyes are moved together, and when the eyes are mixed up.
fn differences(motion: &Motion) -> Vec<(Method, f64, f64)> {
    const STAY: Motion = Motion {
        linear: DMat3::IDENTITY,
        offset: DVec3::ZERO,
    };
    let mesh = models::trefoil_knot(FACES);
    let bounds = mesh.bounds();
    let cameras = view_sphere(&bounds, 3.0 * bounds.radius, VIEWS, SIDE_PX).unwrap();
    // Neither views nor on an edge between two; some inside the view sphere, some outside.
    let eyes = view_sphere(&bounds, 2.5 * bounds.radius, 7, SIDE_PX).unwrap();
    let far = view_sphere(&bounds, 4.0 * bounds.radius, 5, SIDE_PX).unwrap();
    let eyes = [eyes, far].concat();
    let moved_eyes: Vec<Camera> = eyes.iter().map(|c| motion.camera(c)).collect();
    let still = map_of(&mesh, &cameras, &STAY);
    let moved = map_of(&mesh, &cameras, motion);
    let as_before = |masks: Vec<Mask>| -> Vec<Mask> {
        if motion.is_mirroring() {
            masks.iter().map(flipped).collect()
        } else {
            masks
        }
    };
    let measure = |method| {
        let wanted = outlines(&still, &eyes, method);
        let followed = as_before(outlines(&moved, &moved_eyes, method));
        // The next eye's in place of each: the metric must not pass over that.
        let mut mixed_up = followed.clone();
        mixed_up.rotate_left(1);
        (
            method,
            share_different(&wanted, &followed),
            share_different(&wanted, &mixed_up),
        )
    };
    Method::ALL.into_iter().map(measure).collect()
}

#[test]
fn outlines_keep_their_pixels_when_the_scene_is_scaled() {
    // A power of two, so that nothing is rounded otherwise.
    let motion = Motion {
        linear: DMat3::from_diagonal(DVec3::splat(8.0)),
        offset: DVec3::ZERO,
    };
    for (method, followed, mixed_up) in differences(&motion) {
        assert_eq!(followed, 0.0, "{method:?}");
        assert!(mixed_up > MIXED_UP_SHARE, "{method:?}: {mixed_up}");
    }
}

#[test]
fn outlines_follow_when_the_scene_is_turned_and_shifted() {
    let axis = DVec3::new(1.0, -2.0, 0.5).normalize_or_zero();
    let motion = Motion {
        linear: DMat3::from_axis_angle(axis, 1.1),
        offset: DVec3::new(0.7, -3.0, 11.0),
    };
    for (method, followed, mixed_up) in differences(&motion) {
        println!("{method:?}: {followed:.5}, mixed up {mixed_up:.3}");
        assert!(followed < RIM_SHARE, "{method:?}: {followed}");
        assert!(mixed_up > MIXED_UP_SHARE, "{method:?}: {mixed_up}");
    }
}

#[test]
fn outlines_are_mirrored_when_the_scene_is() {
    let motion = Motion {
        linear: DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        offset: DVec3::ZERO,
    };
    for (method, followed, mixed_up) in differences(&motion) {
        println!("{method:?}: {followed:.5}, mixed up {mixed_up:.3}");
        assert!(followed < RIM_SHARE, "{method:?}: {followed}");
        assert!(mixed_up > MIXED_UP_SHARE, "{method:?}: {mixed_up}");
    }
}

/// The asset of a knot at some place, through a file and back.
fn asset_at(shift: DVec3) -> Asset {
    // Multiples of 2⁻²⁰ are held far away as well as at the origin.
    let grid = f64::from(1 << 20);
    let mut mesh = models::trefoil_knot(FACES);
    for p in &mut mesh.positions {
        *p = (*p * 8.0 * grid).round() / grid + shift;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knot.ply");
    mesh_io::write(&path, &mesh).unwrap();
    let loaded = mesh_io::load(&path, &LoadOptions::default()).unwrap();
    assert!(loaded.mesh.origin().distance(shift) < loaded.mesh.bounds().radius);
    let mut params = BuildParams {
        views: VIEWS,
        resolution_px: SIDE_PX,
        ..BuildParams::default()
    };
    params.capture.backend = Backend::Cpu;
    params.map.keep = VIEWS / 2;
    params.hull.target_faces = 200;
    params.textures.views = 2;
    params.textures.size_px = 16;
    let (asset, _) = pipeline::build(&loaded.mesh, "knot", &params, &Watch::silent()).unwrap();
    asset
}

#[test]
fn far_from_the_origin_everything_is_as_at_the_origin() {
    let shift = DVec3::new(5e5, 5.4e6, 200.0);
    let (near, far) = (asset_at(DVec3::ZERO), asset_at(shift));
    assert_eq!(near.placement, Placement::default());
    assert_eq!(far.placement, Placement::at(shift));
    // Ratio, outlines, pictures and all: nothing but the place differs, in memory and in the file.
    let moved_back = Asset {
        placement: Placement::default(),
        ..far.clone()
    };
    assert_eq!(near, moved_back);
    let chunk = |asset: &Asset| {
        let file = asset::write(asset).unwrap();
        let json = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        let text = String::from_utf8(file[20..20 + json].to_vec()).unwrap();
        (text, file[20 + json..].to_vec())
    };
    let ((near_text, near_data), (far_text, far_data)) = (chunk(&near), chunk(&far));
    assert_eq!(near_data, far_data);
    let translation = "\"translation\":[500000.0,5400000.0,200.0]";
    assert!(far_text.contains(translation) && !near_text.contains("translation"));
    assert_eq!(asset::read(&asset::write(&far).unwrap()).unwrap(), far);

    // A place whose last digits are not the model's: the same but for rounding.
    let odd = asset_at(DVec3::new(-432_109.876_543_21, 5e6 + 0.1, 1.0 / 3.0));
    let (wanted, found) = (near.hull.volume_ratio, odd.hull.volume_ratio);
    assert!((found / wanted - 1.0).abs() < 0.01, "{found} {wanted}");
    let bounds = Bounds {
        min: near.map.center - near.map.radius,
        max: near.map.center + near.map.radius,
        center: near.map.center,
        radius: near.map.radius,
    };
    let eyes = view_sphere(&bounds, 2.5 * bounds.radius, 7, SIDE_PX).unwrap();
    let drawn = |asset: &Asset, eyes: &[Camera]| outlines(&asset.map, eyes, Method::Tight);
    let moved_eyes: Vec<Camera> = eyes
        .iter()
        .map(|c| c.moved(odd.map.center - near.map.center))
        .collect();
    let wanted = drawn(&near, &eyes);
    let mut followed = drawn(&odd, &moved_eyes);
    let share = share_different(&wanted, &followed);
    assert!(share < RIM_SHARE, "{share}");
    followed.rotate_left(1);
    assert!(share_different(&wanted, &followed) > MIXED_UP_SHARE);
}
