//! Complete bakes of small models with known colours.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::DVec3;
use image::RgbImage;
use silmap_geometry::lighting::linear_from_srgb;
use silmap_geometry::{Appearance, TriangleMesh};
use silmap_map::asset::TangentFrames;

use super::*;
use silmap_geometry::StageEvent;
use silmap_models as models;

/// Linear colours of the cube's sides −X, +X, −Y, +Y, −Z, +Z: no two alike.
pub(super) const SIDE_COLOURS: [[f32; 3]; 6] = [
    [0.8, 0.1, 0.1],
    [0.1, 0.8, 0.1],
    [0.1, 0.1, 0.8],
    [0.7, 0.7, 0.1],
    [0.7, 0.1, 0.7],
    [0.1, 0.7, 0.7],
];

/// Corners of the cube [−1, 1]³ by the bits of their index, and two faces a side, in the order of [`SIDE_COLOURS`].
fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let positions = (0..8)
        .map(|i| DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)))
        .collect();
    let sides = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let faces = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    (positions, faces)
}

pub(super) fn coloured_cube() -> (ClosedMesh, Bvh) {
    let (positions, faces) = cube();
    let mesh = TriangleMesh {
        positions,
        faces,
        appearance: Appearance {
            corner_colours: (0..12).map(|f| [SIDE_COLOURS[f / 2]; 3]).collect(),
            ..Appearance::default()
        },
    };
    let mesh = ClosedMesh::try_from(mesh).unwrap();
    let bvh = Bvh::new(mesh.mesh());
    (mesh, bvh)
}

/// The cube a tenth larger; P(v) are the corners of the cube itself.
pub(super) fn cube_hull() -> CoarseHull {
    let (positions, faces) = cube();
    CoarseHull {
        positions: positions
            .iter()
            .map(|p| (*p * 1.1).as_vec3().to_array())
            .collect(),
        surface_points: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        faces,
        volume_ratio: 1.331,
    }
}

pub(super) fn small_params() -> TextureParams {
    TextureParams {
        views: 6,
        size_px: 96,
        atlas_px: 96,
        candidates: 60,
        ..TextureParams::default()
    }
}

fn bake_cube(params: &TextureParams) -> TextureSet {
    let (mesh, bvh) = coloured_cube();
    bake(&mesh, &bvh, &cube_hull(), params, &Watch::silent()).unwrap()
}

pub(super) fn decode(image: &silmap_map::EncodedImage) -> RgbImage {
    image::load_from_memory(&image.bytes).unwrap().to_rgb8()
}

/// Whether a pixel is `colour` under some brightness of light.
pub(super) fn has_hue(picture: &RgbImage, at: DVec2, colour: [f32; 3]) -> bool {
    let found = picture.get_pixel(at.x as u32, at.y as u32).0;
    let found = glam::Vec3::from(found.map(|b| linear_from_srgb(f32::from(b) / 255.0)));
    let expected = glam::Vec3::from(colour);
    found.normalize_or_zero().dot(expected.normalize_or_zero()) > 0.99 && found.length() > 0.05
}

#[test]
fn every_view_shows_the_colour_of_the_faces_it_may_paint() {
    let textures = bake_cube(&small_params());
    let hull = HullFaces::new(&cube_hull());
    let mut checked = 0;
    for (v, view) in textures.views.iter().enumerate() {
        let picture = decode(&view.image);
        assert_eq!(
            (picture.width(), picture.height()),
            (view.camera.width_px, view.camera.height_px)
        );
        for face in 0..12 {
            if textures.visible_views[face] >> v & 1 == 0 {
                continue;
            }
            let middle = hull.surface_corners[face].iter().copied().sum::<DVec3>() / 3.0;
            let at = view.camera.image_from_object(middle);
            assert!(
                has_hue(&picture, at, SIDE_COLOURS[face / 2]),
                "view {v}, face {face}"
            );
            // The neighbour's colour is not there.
            assert!(!has_hue(&picture, at, SIDE_COLOURS[(face / 2 + 1) % 6]));
            checked += 1;
        }
    }
    assert!(checked >= 12, "{checked} pairs of a view and a face");
}

#[test]
fn the_atlas_shows_the_colour_of_each_face() {
    let atlas = bake_cube(&small_params()).atlas.unwrap();
    let picture = decode(&atlas.image);
    assert_eq!([picture.width(), picture.height()], atlas.size_px);
    let size = DVec2::new(atlas.size_px[0].into(), atlas.size_px[1].into());
    for face in 0..12 {
        for weights in [[0.34, 0.33, 0.33], [0.8, 0.1, 0.1], [0.1, 0.1, 0.8]] {
            let uv: DVec2 = (0..3)
                .map(|k| DVec2::from(atlas.corner_uvs[face][k].map(f64::from)) * weights[k])
                .sum();
            assert!(
                has_hue(&picture, uv * size, SIDE_COLOURS[face / 2]),
                "face {face} at {weights:?}"
            );
        }
    }
}

#[test]
fn pictures_hold_the_hull_and_little_else() {
    let hull = HullFaces::new(&cube_hull());
    for view in bake_cube(&small_params()).views {
        let size = view.camera.size();
        let offsets = hull.corners.iter().flatten().map(|&p| {
            let aside = view.camera.image_from_object(p) / size * 2.0 - 1.0;
            aside.abs().max_element()
        });
        let farthest = offsets.fold(0.0, f64::max);
        assert!((0.98..1.0).contains(&farthest), "{farthest}");
    }
}

#[test]
fn beside_the_model_the_pictures_go_on_in_its_colours() {
    for view in bake_cube(&small_params()).views {
        let picture = decode(&view.image);
        let darkest = picture.pixels().map(|p| p.0.into_iter().max()).min();
        assert!(darkest.flatten().unwrap() > 60, "{darkest:?}");
    }
}

#[test]
fn a_torus_paints_the_faces_around_its_hole() {
    let (fine, bvh, hull) = torus_in_torus();
    let params = TextureParams {
        views: 20,
        size_px: 128,
        atlas_px: 128,
        ..TextureParams::default()
    };
    let textures = bake(&fine, &bvh, &hull, &params, &Watch::silent()).unwrap();
    let unseen = textures.visible_views.iter().filter(|&&b| b == 0).count();
    assert!(10 * unseen < hull.faces.len(), "{unseen} faces");
    // A view along the axis sees one side, none sees all.
    for v in 0..textures.views.len() {
        let seen = textures.visible_views.iter().filter(|&b| b >> v & 1 == 1);
        let share = seen.count() as f64 / hull.faces.len() as f64;
        assert!(share > 0.05 && share < 0.6, "view {v} paints {share}");
    }
}

#[test]
fn any_number_of_threads_bakes_the_same() {
    let bake_on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| bake_cube(&small_params()))
    };
    assert_eq!(bake_on(1), bake_on(4));
}

#[test]
fn progress_adds_up_and_a_stop_is_heeded() {
    let (mesh, bvh) = coloured_cube();
    let (total, done) = (AtomicU64::new(0), AtomicU64::new(0));
    let on_event = |event| {
        match event {
            StageEvent::Started { total: n, .. } => total.fetch_add(n, Ordering::Relaxed),
            StageEvent::Advanced { count, .. } => done.fetch_add(count, Ordering::Relaxed),
            StageEvent::Finished { .. } => 0,
        };
    };
    let run = |stop: &AtomicBool| {
        let watch = Watch::new(&on_event, stop);
        bake(&mesh, &bvh, &cube_hull(), &small_params(), &watch)
    };
    assert!(run(&AtomicBool::new(false)).is_ok());
    assert_eq!(total.into_inner(), done.load(Ordering::Relaxed));
    assert!(matches!(
        run_stopped(&mesh, &bvh),
        Err(TextureError::Interrupted(_))
    ));
}

fn run_stopped(mesh: &ClosedMesh, bvh: &Bvh) -> Result<TextureSet, TextureError> {
    let stop = AtomicBool::new(true);
    let watch = Watch::new(&|_| {}, &stop);
    bake(mesh, bvh, &cube_hull(), &small_params(), &watch)
}

#[test]
fn what_cannot_be_is_refused() {
    let (mesh, bvh) = coloured_cube();
    let with = |hull: &CoarseHull, params: TextureParams| {
        bake(&mesh, &bvh, hull, &params, &Watch::silent())
    };
    let params = small_params();
    assert!(matches!(
        with(&CoarseHull::default(), params),
        Err(TextureError::NoHull)
    ));
    let mut broken = cube_hull();
    broken.faces[3][1] = 99;
    assert!(matches!(with(&broken, params), Err(TextureError::NoHull)));
    let many = TextureParams {
        views: 65,
        ..params
    };
    let huge = TextureParams {
        size_px: 100_000,
        ..params
    };
    for wrong in [many, huge] {
        let made = with(&cube_hull(), wrong);
        assert!(
            matches!(made, Err(TextureError::Parameter { .. })),
            "{made:?}"
        );
    }
    let inside = TextureParams {
        distance_rel: 0.5,
        ..params
    };
    assert!(matches!(
        with(&cube_hull(), inside),
        Err(TextureError::Camera(_))
    ));
}

/// A torus in a coarser one that is pushed out along its normals; P(v) are the nearest points.
fn torus_in_torus() -> (ClosedMesh, Bvh, CoarseHull) {
    let fine = ClosedMesh::try_from(models::torus(4000)).unwrap();
    let coarse = models::torus(400);
    let normals = coarse.vertex_normals();
    let bvh = Bvh::new(fine.mesh());
    let out = 0.03 * fine.bounds().radius;
    let hull = CoarseHull {
        positions: coarse
            .positions
            .iter()
            .zip(&normals)
            .map(|(p, n)| (*p + *n * out).as_vec3().to_array())
            .collect(),
        surface_points: coarse
            .positions
            .iter()
            .map(|p| bvh.closest_point(*p).0.as_vec3().to_array())
            .collect(),
        faces: coarse.faces,
        volume_ratio: 1.2,
    };
    (fine, bvh, hull)
}

#[test]
fn the_atlas_tells_the_originals_normals_in_the_frames_of_the_hull() {
    let (fine, bvh, hull) = torus_in_torus();
    let params = TextureParams {
        views: 1,
        atlas_px: 256,
        format: PictureFormat::Png,
        ..small_params()
    };
    let textures = bake(&fine, &bvh, &hull, &params, &Watch::silent()).unwrap();
    let atlas = textures.atlas.unwrap();
    let picture = decode(atlas.normals.as_ref().unwrap());
    let frames = TangentFrames::new(&hull, &atlas.corner_uvs);
    let surface = Surface::new(fine.mesh());
    let shooter = Shooter::new(
        &hull,
        (&bvh, fine.bounds().radius),
        Parametrisation::NormalShooting,
    );
    let size = f64::from(atlas.size_px[0]);
    // Mean angle between the stored and the true normals, when the picture's green is taken times this.
    let mean_angle = |green: f64| {
        let angles: Vec<f64> = (0..hull.faces.len())
            .map(|face| {
                let weights = [0.4, 0.35, 0.25];
                let uvs = atlas.corner_uvs[face].map(|uv| DVec2::from(uv.map(f64::from)));
                let at: DVec2 = (0..3).map(|k| uvs[k] * weights[k]).sum();
                let pixel = picture.get_pixel((at.x * size) as u32, (at.y * size) as u32);
                let [x, y, z] = pixel.0.map(|b| f64::from(b) / 127.5 - 1.0);
                let unit = |vectors: [DVec3; 3]| {
                    parametrisation::blend(&vectors, weights).normalize_or_zero()
                };
                let tangents = frames.tangents[face]
                    .map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
                let normals = hull.faces[face]
                    .map(|v| DVec3::from_array(frames.normals[v as usize].map(f64::from)));
                let handedness = f64::from(frames.tangents[face][0][3]);
                let up = std::array::from_fn(|k| handedness * normals[k].cross(tangents[k]));
                let told = unit(tangents) * x + unit(up) * y * green + unit(normals) * z;
                let reach = shooter.reach(face, weights);
                let source = shooter.source(face, weights, reach);
                told.angle_between(surface.normal(source.face, source.weights))
            })
            .collect();
        angles.iter().sum::<f64>() / angles.len() as f64
    };
    let right = mean_angle(1.0);
    assert!(right.to_degrees() < 2.0, "{}°", right.to_degrees());
    // With the picture upside down the normals are wrong.
    assert!(mean_angle(-1.0) > 2.0 * right);
    // No normals are stored when they were not asked for.
    let without = TextureParams {
        normals: false,
        ..params
    };
    let textures = bake(&fine, &bvh, &hull, &without, &Watch::silent()).unwrap();
    assert_eq!(textures.atlas.unwrap().normals, None);
}

#[test]
fn a_budget_is_kept_by_quality_and_then_by_size() {
    let plain = bake_cube(&small_params());
    let with = |budget| {
        bake_cube(&TextureParams {
            budget_bytes: Some(budget),
            ..small_params()
        })
    };
    let all = picture_bytes(&plain);
    assert_eq!(with(all), plain);
    for budget in [all * 9 / 10, all / 3] {
        let textures = with(budget);
        let bytes = picture_bytes(&textures);
        assert!(bytes <= budget, "{bytes} of {budget}");
        assert!(2 * bytes > budget, "{bytes} of {budget}");
        for view in &textures.views {
            let picture = decode(&view.image);
            assert_eq!(picture.width(), view.camera.width_px);
        }
    }
    let smallest = with(1);
    assert!(picture_bytes(&smallest) > 1);
    assert_eq!(smallest.views[0].camera.width_px, 16);
}

#[test]
fn every_format_holds_the_same_views() {
    for (format, of_views, of_atlas) in [
        (PictureFormat::Png, "image/png", "image/png"),
        (PictureFormat::Webp, "image/webp", "image/png"),
    ] {
        let textures = bake_cube(&TextureParams {
            format,
            ..small_params()
        });
        for view in &textures.views {
            assert_eq!(view.image.mime_type, of_views);
        }
        let atlas = textures.atlas.unwrap();
        // A cube's flat tiles are smaller as PNG.
        assert!(atlas.image.mime_type == of_atlas || atlas.image.mime_type == "image/jpeg");
        assert_ne!(atlas.image.mime_type, "image/webp");
    }
}
