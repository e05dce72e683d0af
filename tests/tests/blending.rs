//! What the hull shows: the views that a reference weighs, and nothing may pop while the eye moves.
//!
//! Texture views are plain colours here, each another, so that a picture shows their weights and nothing else.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec2, DVec3, Vec3};
use silmap_geometry::bvh::Bvh;
use silmap_geometry::lighting::{linear_from_srgb, srgb_from_linear};
use silmap_geometry::{Bounds, Camera, ColourImage, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::Asset;
use silmap_study::{
    Antialias, Background, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};
use silmap_tests::{device, scene, view_weights};

/// Side of the pictures.
const SIDE_PX: u32 = 384;
/// Side of the squares in which changes are looked for: a face that pops fills one.
const SQUARE_PX: usize = 24;
/// Degrees that the eye goes around the model.
const ARC: f64 = 8.0;
/// Steps of a walk, and how many times more those of a careful one.
const STEPS: u32 = 8;
const FINER: u32 = 8;

/// The colour of a view, sRGB.
fn colour_of(view: usize) -> [u8; 3] {
    [97, 57, 151].map(|step| (view * step % 256) as u8)
}

/// The hand-made asset with texture views of one colour each.
fn coloured_views(gpu: &Gpu) -> Asset {
    let mut asset = scene::asset(gpu);
    for (k, view) in asset.textures.views.iter_mut().enumerate() {
        let [r, g, b] = colour_of(k);
        view.image = scene::png(&ColourImage {
            width: 4,
            height: 4,
            rgba: [r, g, b, 255].repeat(16),
        });
    }
    asset
}

/// A choice of views for a face whose middle on the model is given, and an eye.
type Choice = fn(view_weights::Witnesses<'_>, DVec3, DVec3) -> Vec<(usize, f64)>;

/// The share of the hull's pixels that show something else than a choice of views says.
fn share_of_others(picture: &ColourImage, asset: &Asset, camera: &Camera, choice: Choice) -> f64 {
    let hull = &asset.hull;
    let point = |p: [f32; 3]| Vec3::from(p).as_dvec3();
    let mesh = TriangleMesh {
        positions: hull.positions.iter().map(|&p| point(p)).collect(),
        faces: hull.faces.clone(),
        ..TriangleMesh::default()
    };
    let bvh = Bvh::new(&mesh);
    let shown_by_face: Vec<Option<[u8; 3]>> = (hull.faces.iter().enumerate())
        .map(|(f, face)| {
            let middle = face.iter().map(|&v| point(hull.surface_points[v as usize]));
            let middle = middle.sum::<DVec3>() / 3.0;
            let views = asset.textures.views.iter().enumerate();
            let seen = views.filter(|(k, _)| asset.textures.visible_views[f] >> k & 1 == 1);
            let witnesses: Vec<_> = seen.map(|(k, view)| (k, view.camera.eye)).collect();
            let shares = choice(&witnesses, middle, camera.eye);
            let mut sum = [0.0; 3];
            for &(view, weight) in &shares {
                for (sum, encoded) in sum.iter_mut().zip(colour_of(view)) {
                    *sum += weight as f32 * linear_from_srgb(f32::from(encoded) / 255.0);
                }
            }
            let encoded = sum.map(|linear| (srgb_from_linear(linear) * 255.0).round() as u8);
            (!shares.is_empty()).then_some(encoded)
        })
        .collect();
    let (mut compared, mut others) = (0, 0);
    for (i, pixel) in (0..).zip(picture.rgba.chunks_exact(4)) {
        let centre = DVec2::new(f64::from(i % SIDE_PX), f64::from(i / SIDE_PX)) + 0.5;
        let ray = camera.direction_from_image(centre);
        let hit = bvh.first_hit(camera.eye, ray, 0.0, f64::INFINITY);
        // Faces that no view sees are lit.
        let shown = hit.and_then(|hit| shown_by_face[hit.face as usize]);
        if let Some(shown) = shown {
            compared += 1;
            let differs = |(a, b): (&u8, u8)| a.abs_diff(b) > 2;
            others += u32::from(pixel.iter().zip(shown).any(differs));
        }
    }
    assert!(compared > 10_000, "{compared} pixels were compared");
    f64::from(others) / f64::from(compared)
}

#[test]
fn faces_show_the_views_that_the_reference_weighs() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
    let asset = coloured_views(&gpu);
    renderer.load_asset(&gpu, &asset).unwrap();
    let bounds = scene::model().bounds();
    let nearest: Choice = |witnesses, _, eye| view_weights::nearest(witnesses, eye);
    for degrees in [10.0, 130.0, 250.0] {
        let camera = camera_at(&bounds, degrees);
        let mut others = |paint: Paint, choice: Choice| {
            let params = FrameParams {
                paint,
                ..scene::frame(camera, Mode::Textured, Antialias::None)
            };
            let picture = renderer.render(&gpu, &params).unwrap();
            share_of_others(&picture, &asset, &camera, choice)
        };
        // Pixels at edges of faces may fall to either face.
        let off = others(Paint::Blended, view_weights::blended);
        assert!(off < 0.002, "{off} of the blended picture");
        let off = others(Paint::Nearest, nearest);
        assert!(off < 0.002, "{off} of the picture of nearest views");
        let off = others(Paint::Blended, nearest);
        assert!(off > 0.5, "{off}: nearest views pass for blended ones");
    }
}

/// The largest mean change of a square of pixels from one frame to the next, in steps of 255.
fn largest_change(frames: &[ColourImage]) -> f64 {
    let mut largest = 0.0_f64;
    for pair in frames.windows(2) {
        let side = SIDE_PX as usize;
        for corner in (0..side / SQUARE_PX).flat_map(|y| (0..side / SQUARE_PX).map(move |x| (x, y)))
        {
            let mut sum = 0_u32;
            for y in 0..SQUARE_PX {
                let start = 4 * ((corner.1 * SQUARE_PX + y) * side + corner.0 * SQUARE_PX);
                let row = start..start + 4 * SQUARE_PX;
                let both = pair[0].rgba[row.clone()].iter().zip(&pair[1].rgba[row]);
                sum += both.map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
            }
            largest = largest.max(f64::from(sum) / (3 * SQUARE_PX * SQUARE_PX) as f64);
        }
    }
    largest
}

/// The camera at so many degrees around the model.
fn camera_at(bounds: &Bounds, degrees: f64) -> Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    scene::camera(bounds, DVec3::new(cos, 0.7, sin), 3.0, SIDE_PX)
}

/// Degrees at which another texture view becomes the nearest.
fn handover(asset: &Asset, bounds: &Bounds) -> f64 {
    let nearest = |degrees: f64| {
        let eye = camera_at(bounds, degrees).eye;
        let distance = |k: &usize| asset.textures.views[*k].camera.eye.distance(eye);
        let views = 0..asset.textures.views.len();
        views.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let all = (0..3600).map(|k| 0.1 * f64::from(k));
    let mut handovers = all.filter(|&d| nearest(d) != nearest(d + 0.1));
    handovers.next().unwrap()
}

/// The largest changes of a walk in large steps and of the same walk in small ones.
fn changes(
    renderer: &mut PictureRenderer,
    gpu: &Gpu,
    (bounds, middle): (&Bounds, f64),
    paint: Paint,
) -> (f64, f64) {
    let mut walk = |steps: u32| {
        let frames: Vec<ColourImage> = (0..=steps)
            .map(|k| {
                let part = f64::from(k) / f64::from(steps) - 0.5;
                let camera = camera_at(bounds, middle + ARC * part);
                let params = FrameParams {
                    paint,
                    ..scene::frame(camera, Mode::Textured, Antialias::Msaa)
                };
                renderer.render(gpu, &params).unwrap()
            })
            .collect();
        largest_change(&frames)
    };
    (walk(STEPS), walk(STEPS * FINER))
}

#[test]
fn the_picture_changes_in_proportion_to_the_step() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
    let asset = coloured_views(&gpu);
    renderer.load_asset(&gpu, &asset).unwrap();
    let mesh_bounds = scene::model().bounds();
    let bounds = Bounds {
        radius: mesh_bounds.radius * 1.15,
        ..mesh_bounds
    };
    let place = (&bounds, handover(&asset, &bounds));
    let (large, small) = changes(&mut renderer, &gpu, place, Paint::Blended);
    assert!(large > 1.0, "hardly anything changes: {large}");
    let share = small / large;
    // Where four views are about as far as each other weights change fast, but they do not jump; and edges go from sample to sample.
    assert!(
        share < 2.5 / f64::from(FINER),
        "{small} is {share} of {large}"
    );
    // The nearest view alone pops, as much in a small step as in a large one.
    let (large, small) = changes(&mut renderer, &gpu, place, Paint::Nearest);
    let share = small / large;
    assert!(
        share > 0.8,
        "{small} is {share} of {large}: a pop goes unnoticed"
    );
}

/// A small picture shows what a large one shows, averaged: a fine chessboard is grey from afar, and no noise.
#[test]
fn small_pictures_show_averages() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let mut asset = scene::asset(&gpu);
    let side = 256;
    let squares = (0..side * side).map(|k| (k % side + k / side) % 2);
    let board = scene::png(&ColourImage {
        width: side,
        height: side,
        rgba: squares
            .flat_map(|is_white| {
                [
                    255 * is_white as u8,
                    255 * is_white as u8,
                    255 * is_white as u8,
                    255,
                ]
            })
            .collect(),
    });
    for view in &mut asset.textures.views {
        view.image = board.clone();
    }
    // All of the hull, by one view.
    asset.textures.visible_views.fill(1);
    let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
    renderer.load_asset(&gpu, &asset).unwrap();
    let bounds = scene::model().bounds();
    // How many of the hull's pixels are as bright as half of the light.
    let mut grey = |side_px: u32| {
        let eye = asset.textures.views[0].camera.eye;
        let camera = scene::camera(
            &bounds,
            (eye - bounds.center).normalize_or_zero(),
            4.0,
            side_px,
        );
        let params = FrameParams {
            paint: Paint::Nearest,
            background: Background::Transparent,
            ..scene::frame(camera, Mode::Textured, Antialias::None)
        };
        let picture = renderer.render(&gpu, &params).unwrap();
        let pixels = picture.rgba.chunks_exact(4).filter(|p| p[3] == 255);
        let (mut count, mut grey) = (0, 0);
        for pixel in pixels {
            count += 1;
            grey += u32::from(pixel[0].abs_diff(188) < 24);
        }
        assert!(
            count > side_px * side_px / 20,
            "{count} pixels show the hull"
        );
        f64::from(grey) / f64::from(count)
    };
    let (small, large) = (grey(40), grey(1024));
    assert!(small > 0.95, "{small} of the small picture is grey");
    // Between white and black squares there is grey too.
    assert!(large < 0.75, "{large} of the large one: there is no board");
}
