//! Whole bakes of small models whose colours are known.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use image::RgbImage;
use silmap_geometry::Appearance;
use silmap_geometry::lighting::linear_from_srgb;

use super::*;
use crate::models;
use crate::progress::PrepEvent;

/// Linear colours of the cube's sides −X, +X, −Y, +Y, −Z, +Z: no two alike.
const SIDE_COLOURS: [[f32; 3]; 6] = [
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

fn coloured_cube() -> (ClosedMesh, Bvh) {
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
fn cube_hull() -> CoarseHull {
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

fn small_params() -> TextureParams {
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
    bake(&mesh, &bvh, &cube_hull(), params, &Monitor::silent()).unwrap()
}

fn decode(image: &silmap_map::EncodedImage) -> RgbImage {
    image::load_from_memory(&image.bytes).unwrap().to_rgb8()
}

/// Whether a pixel is `colour` under some brightness of light.
fn has_hue(picture: &RgbImage, at: DVec2, colour: [f32; 3]) -> bool {
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
fn more_views_see_more_of_a_cube() {
    let hull = cube_hull();
    let with = |views| {
        let params = TextureParams {
            views,
            ..small_params()
        };
        report(&hull, &bake_cube(&params))
    };
    let (none, one, six) = (with(0), with(1), with(6));
    assert_eq!((none.views, none.merit, none.unseen_share), (0, 0.0, 1.0));
    assert_eq!(one.views, 1);
    // A corner view sees three of six sides, each at 1/√3.
    assert!(one.unseen_share > 0.45 && one.unseen_share < 0.9, "{one:?}");
    assert!(one.merit > 0.15 && one.merit < 0.4, "{one:?}");
    assert_eq!(six.views, 6);
    assert!(six.unseen_share == 0.0 && six.merit > 0.75, "{six:?}");
    assert!(six.views_per_face >= 1.0);
}

#[test]
fn a_torus_paints_the_faces_around_its_hole() {
    // The finer torus inside a coarse one that is pushed out along its normals.
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
    let params = TextureParams {
        views: 20,
        size_px: 128,
        atlas_px: 128,
        ..TextureParams::default()
    };
    let textures = bake(&fine, &bvh, &hull, &params, &Monitor::silent()).unwrap();
    let report = report(&hull, &textures);
    assert!(report.unseen_share < 0.1, "{report:?}");
    assert!(report.merit > 0.7, "{report:?}");
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
            PrepEvent::Started { total: n, .. } => total.fetch_add(n, Ordering::Relaxed),
            PrepEvent::Advanced { count, .. } => done.fetch_add(count, Ordering::Relaxed),
            PrepEvent::Finished { .. } => 0,
        };
    };
    let run = |stop: &AtomicBool| {
        let monitor = Monitor::new(&on_event, stop);
        bake(&mesh, &bvh, &cube_hull(), &small_params(), &monitor)
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
    let monitor = Monitor::new(&|_| {}, &stop);
    bake(mesh, bvh, &cube_hull(), &small_params(), &monitor)
}

#[test]
fn what_cannot_be_is_refused() {
    let (mesh, bvh) = coloured_cube();
    let with = |hull: &CoarseHull, params: TextureParams| {
        bake(&mesh, &bvh, hull, &params, &Monitor::silent())
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
