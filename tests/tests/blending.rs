//! What the hull shows while the eye moves: nothing may pop.
//!
//! Texture views are plain colours here, each another, so that a picture shows their weights and nothing else.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use silmap_geometry::{Bounds, Camera, ColourImage};
use silmap_gpu::Gpu;
use silmap_map::Asset;
use silmap_study::{Antialias, FrameParams, Mode, Paint, PictureOptions, PictureRenderer};
use silmap_tests::{device, scene};

/// Side of the pictures.
const SIDE_PX: u32 = 384;
/// Side of the squares in which changes are looked for: a face that pops fills one.
const SQUARE_PX: usize = 24;
/// Degrees that the eye goes around the model.
const ARC: f64 = 8.0;
/// Steps of a walk, and how many times more those of a careful one.
const STEPS: u32 = 8;
const FINER: u32 = 8;

/// The hand-made asset with texture views of one colour each.
fn coloured_views(gpu: &Gpu) -> Asset {
    let mut asset = scene::asset(gpu);
    for (k, view) in asset.textures.views.iter_mut().enumerate() {
        let colour = [
            (k * 97 % 256) as u8,
            (k * 57 % 256) as u8,
            (k * 151 % 256) as u8,
            255,
        ];
        view.image = scene::png(&ColourImage {
            width: 4,
            height: 4,
            rgba: colour.repeat(16),
        });
    }
    asset
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
