//! What goes through a stage and back must be what it was.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::TAU;
use std::path::Path;
use std::process::Command;

use glam::{DVec2, DVec3};
use image::{ImageBuffer, ImageFormat, Rgb};
use silmap_geometry::{Camera, CoverageRule};
use silmap_map::asset;
use silmap_map::{
    Asset, Atlas, BuildRecord, CapturedView, CoarseHull, DepthPicture, EncodedImage, Placement,
    Relief, SilhouetteMap, TextureSet, TextureView, ViewContour,
};
use silmap_tests::outside;

/// Vertices per contour in the size check: what the bunny has on average.
const CONTOUR_VERTICES: u32 = 150;

/// An octahedron with every face divided into `n`² triangles: 4n² + 2 unit vectors and their triangles.
fn divided_octahedron(n: i32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut points: Vec<[i32; 3]> = Vec::new();
    let mut triangles = Vec::new();
    let mut index = |p: [i32; 3]| match points.iter().position(|q| *q == p) {
        Some(i) => i as u32,
        None => {
            points.push(p);
            points.len() as u32 - 1
        }
    };
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|k| if octant >> k & 1 == 0 { 1 } else { -1 });
        let is_mirrored = sign.iter().product::<i32>() < 0;
        let mut corner = |i: i32, j: i32| index([i * sign[0], j * sign[1], (n - i - j) * sign[2]]);
        for i in 0..n {
            for j in 0..n - i {
                let mut push = |mut t: [u32; 3]| {
                    if is_mirrored {
                        t.swap(1, 2);
                    }
                    triangles.push(t);
                };
                push([corner(i, j), corner(i + 1, j), corner(i, j + 1)]);
                if i + j + 2 <= n {
                    push([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                }
            }
        }
    }
    let directions = points
        .iter()
        .map(|p| DVec3::from_array(p.map(f64::from)).normalize_or_zero())
        .collect();
    (directions, triangles)
}

/// A wobbly outline about the image's middle, in sixteenths of a pixel, with depths on the file's grid.
fn wobbly_contour(view: usize, distance: f64) -> ViewContour {
    let steps = |value: f64, per_unit: f64| (value * per_unit).round() / per_unit;
    let angles = (0..CONTOUR_VERTICES).map(|k| TAU * f64::from(k) / f64::from(CONTOUR_VERTICES));
    ViewContour {
        part: 0,
        points: angles
            .clone()
            .map(|a| {
                let radius_px = 180.0 + 40.0 * (5.0 * a + view as f64).sin();
                let p = DVec2::splat(256.0) + DVec2::from_angle(a) * radius_px;
                DVec2::new(steps(p.x, 16.0), steps(p.y, 16.0))
            })
            .collect(),
        depths: angles
            .map(|a| distance + steps(0.7 * (7.0 * a).cos(), 4096.0))
            .collect(),
        levels: (0..CONTOUR_VERTICES)
            .map(|k| (k.trailing_zeros() as u8).min(ViewContour::COARSEST_LEVEL))
            .collect(),
    }
}

fn picture(side_px: u32, format: ImageFormat) -> EncodedImage {
    let image = ImageBuffer::from_fn(side_px, side_px, |x, y| Rgb([x as u8, y as u8, 90]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    EncodedImage {
        mime_type: format.to_mime_type().into(),
        bytes: bytes.into_inner(),
    }
}

/// An asset of 146 views of 150 contour vertices, an octahedron for a hull, two texture views and an atlas.
fn sample_asset() -> Asset {
    let (center, radius) = (DVec3::new(0.25, -0.5, 1.0), 1.0);
    let (directions, triangles) = divided_octahedron(6);
    let camera = |direction: DVec3, side: u32| {
        let eye = center + direction * 3.0;
        Camera::fit_sphere(eye, center, radius, None, (side, side)).unwrap()
    };
    let views = directions
        .iter()
        .enumerate()
        .map(|(v, &direction)| {
            let camera = camera(direction, 512);
            let distance = camera.eye.distance(center);
            CapturedView {
                camera,
                contours: vec![wobbly_contour(v, distance)],
                photographed: None,
            }
        })
        .collect();
    let (corners, faces) = divided_octahedron(1);
    let texture_view = |direction| TextureView {
        camera: camera(direction, 64),
        image: picture(64, ImageFormat::Jpeg),
    };
    Asset {
        record: BuildRecord {
            name: "sample \"quoted\"".into(),
            model_faces: 8,
            model_vertices: 6,
            model_crc32: 0xdead_beef,
            captured_views: 1024,
            error_curve: vec![(1024, 0.0), (512, 0.25), (146, 0.5)],
            uniform_curve: vec![(512, 0.5)],
            order: None,
            generator: "silmap".into(),
            options: "--keep 146".into(),
            ..BuildRecord::default()
        },
        map: SilhouetteMap {
            center,
            radius,
            resolution_px: 512,
            tolerance_px: 0.5,
            coverage: CoverageRule::Any,
            views,
            triangles,
        },
        hull: CoarseHull {
            positions: corners
                .iter()
                .map(|p| (center + *p * 2.0).as_vec3().to_array())
                .collect(),
            surface_points: corners
                .iter()
                .map(|p| (center + *p).as_vec3().to_array())
                .collect(),
            volume_ratio: 1.1 + 1e-16,
            faces,
        },
        textures: TextureSet {
            relief: Some(Relief {
                bits: 10,
                width_px: 2,
                height_px: 1,
                views: [0.1, 0.2]
                    .map(|near| DepthPicture {
                        near,
                        far: 0.7,
                        codes: vec![0, 1023],
                    })
                    .to_vec(),
            }),
            views: vec![texture_view(DVec3::Z), texture_view(DVec3::NEG_Z)],
            visible_views: vec![1, 2, 3, 0, 1, 2, 3, 0],
            atlas: Some(Atlas {
                image: picture(128, ImageFormat::Png),
                normals: Some(picture(128, ImageFormat::Jpeg)),
                size_px: [128, 128],
                corner_uvs: (0..8)
                    .map(|f| [[0.1, 0.1], [0.1 * f as f32, 0.2], [0.9, 0.8]])
                    .collect(),
            }),
        },
        placement: Placement::at(DVec3::new(5e5, 5.4e6, 0.1)),
    }
}

#[test]
fn asset_write_read_write_is_byte_equal() {
    let asset = sample_asset();
    let file = asset::write(&asset).unwrap();
    let back = asset::read(&file).unwrap();
    // The contours are on the file's grid already; depths are, up to the last bit of adding the distance.
    assert_eq!(back, asset::quantise(&asset).unwrap());
    assert_eq!(back.hull, asset.hull);
    assert_eq!(back.textures, asset.textures);
    assert_eq!(back.record, asset.record);
    for (a, b) in asset.map.views.iter().zip(&back.map.views) {
        assert_eq!(a.camera, b.camera);
        assert_eq!(a.contours[0].points, b.contours[0].points);
    }
    assert_eq!(asset::write(&back).unwrap(), file);
}

#[test]
fn a_moved_contour_vertex_changes_the_file() {
    let asset = sample_asset();
    let mut moved = asset.clone();
    moved.map.views[3].contours[0].points[70].x += 1.0 / 16.0;
    assert_ne!(asset::write(&moved).unwrap(), asset::write(&asset).unwrap());
    assert_ne!(
        asset::quantise(&moved).unwrap(),
        asset::quantise(&asset).unwrap()
    );
}

#[test]
fn silhouettes_stay_small() {
    let asset = sample_asset();
    let sizes = asset::sizes(&asset::write(&asset).unwrap()).unwrap();
    let vertices: usize = asset.map.contour_vertex_counts().sum();
    let bytes_each = sizes.map as f64 / vertices as f64;
    // 200 KiB for 128 views of 150 vertices would be ten bytes each.
    assert!(bytes_each < 6.2, "{bytes_each} bytes a vertex");
}

#[test]
fn the_khronos_validator_finds_nothing() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("gltf-validator");
    if !folder.join("node_modules").is_dir() {
        outside::skip("the Khronos validator: run `npm ci` in tests/gltf-validator first");
        return;
    }
    let scratch = tempfile::tempdir().unwrap();
    let validate = |name: &str, bytes: &[u8]| {
        let path = scratch.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let run = Command::new("node")
            .arg(folder.join("validate.js"))
            .arg(&path)
            .output()
            .unwrap();
        (
            run.status.success(),
            String::from_utf8_lossy(&run.stdout).into_owned(),
        )
    };
    let mut asset = sample_asset();
    let file = asset::write(&asset).unwrap();
    let (is_clean, report) = validate("textured.glb", &file);
    assert!(is_clean, "{report}");
    asset.textures = TextureSet::default();
    let (is_clean, report) = validate("plain.glb", &asset::write(&asset).unwrap());
    assert!(is_clean, "{report}");
    // The validator does look: a cut file and a mesh with another count of vertices are refused.
    assert!(!validate("cut.glb", &file[..file.len() - 4]).0);
    let key = b"\"VEC3\"";
    let at = file.windows(key.len()).position(|w| w == key).unwrap();
    let mut wrong = file;
    wrong[at + 4] = b'2';
    assert!(!validate("wrong.glb", &wrong).0);
}
