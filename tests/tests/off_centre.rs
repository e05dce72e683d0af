//! Cameras that do not look at the middle of their image: what is drawn, filled, interpolated and extracted through one is the same part
//! of what a larger image about the middle has.

use glam::{DVec2, DVec3};
use silmap_exact::{OutlineError, Outliner, silhouette_edges};
use silmap_geometry::{Camera, ColourImage, CoverageRule, Loop, Mask, raster};
use silmap_map::{Interpolation, MapReader, Method, outline};
use silmap_study::{Antialias, Mode, PictureOptions, PictureRenderer, ShadowParams};
use silmap_tests::{device, scene, tolerance};

/// Side of the large image.
const LARGE_PX: u32 = 256;

/// Part of it: its top-left corner, columns and rows. The middle of the large image is near its corner.
const PART: ([u32; 2], (u32, u32)) = ([70, 33], (150, 101));

fn corner() -> DVec2 {
    DVec2::from(PART.0.map(f64::from))
}

/// A camera that sees the whole torus, and the same for the part of its image.
fn cameras(distance_rel: f64) -> (Camera, Camera) {
    let bounds = scene::model().bounds();
    let towards = DVec3::new(0.4, 0.9, 0.7);
    let large = scene::camera(&bounds, towards, distance_rel, LARGE_PX);
    let part = large.cropped(corner(), PART.1);
    assert!(part.center_offset.abs().max_element() > 0.2, "{part:?}");
    (large, part)
}

/// Pixels of the part that are another in a picture of the large image.
fn count_different(large: &Mask, part: &Mask) -> u64 {
    let different = |x: u32, y: u32| {
        let (from_x, from_y) = (x + PART.0[0], y + PART.0[1]);
        part.get(x.into(), y.into()) != large.get(from_x.into(), from_y.into())
    };
    (0..PART.1.1)
        .flat_map(|y| (0..PART.1.0).map(move |x| (x, y)))
        .filter(|&(x, y)| different(x, y))
        .count() as u64
}

/// The largest distance between loops of the large image, moved by `shift`, and those of the part, point by point.
fn largest_gap(large: &[Loop], part: &[Loop], shift: DVec2) -> f64 {
    assert_eq!(large.len(), part.len(), "loops");
    let pairs = large.iter().zip(part).flat_map(|(a, b)| {
        assert_eq!(a.len(), b.len(), "points");
        a.iter().zip(b)
    });
    pairs
        .map(|(a, b)| (*a - shift).distance(*b))
        .fold(0.0, f64::max)
}

#[test]
fn the_rasteriser_covers_the_same_pixels() {
    let mesh = scene::model();
    let (large, part) = cameras(3.0);
    for rule in [CoverageRule::Center, CoverageRule::Any] {
        let draw = |camera: &Camera| {
            let mut mask = Mask::new(camera.width_px, camera.height_px);
            raster::cover(&mesh, camera, rule, &mut mask).expect("it is in view");
            mask
        };
        let (whole, of_part) = (draw(&large), draw(&part));
        assert!(of_part.count() > 1000, "{rule:?}: much of it is seen");
        assert_eq!(count_different(&whole, &of_part), 0, "{rule:?}");
        // What a camera draws that ignores where its axis is.
        let centred = Camera {
            center_offset: DVec2::ZERO,
            ..part
        };
        assert!(count_different(&whole, &draw(&centred)) > 1000, "{rule:?}");
    }
}

#[test]
fn interpolated_outlines_are_the_same() {
    let map = scene::outlines();
    for (distance, method) in [
        (3.0, Method::Hull),
        (6.0, Method::Hull),
        (2.2, Method::Paper),
    ] {
        let (large, part) = cameras(distance);
        let how = Interpolation::from(method);
        let mut reader = MapReader::new(&map).expect("a sound map");
        let mut loops = |camera: &Camera| {
            let outline = outline(&map, camera, how, &mut reader).expect("an eye outside");
            outline.simple_loops().to_vec()
        };
        let (whole, of_part) = (loops(&large), loops(&part));
        assert!(!whole.is_empty(), "there is an outline");
        let gap = largest_gap(&whole, &of_part, corner());
        assert!(gap < 1e-6, "{gap} px at {distance} by {method:?}");
        assert!(largest_gap(&whole, &of_part, DVec2::ZERO) > 10.0);
    }
}

#[test]
fn exact_outlines_are_the_same() -> Result<(), OutlineError> {
    let mesh = scene::model();
    let (large, part) = cameras(3.0);
    let edges = silhouette_edges(&mesh, large.eye);
    let mut outliner = Outliner::new(&mesh.positions);
    let whole = outliner.outline(&edges, &large)?;
    let of_part = outliner.outline(&edges, &part)?;
    let gap = largest_gap(&whole, &of_part, corner());
    assert!(gap < 1e-6 && !whole.is_empty(), "{gap} px");
    Ok(())
}

#[test]
fn the_device_draws_the_same_pixels() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
    let asset = scene::asset(&gpu);
    renderer.load_asset(&gpu, &asset).expect("it fits");
    renderer
        .load_model(&gpu, &scene::model())
        .expect("it fits too");
    let (large, part) = cameras(3.0);
    for (mode, antialias) in [
        (Mode::Clipped, Antialias::Soft),
        (Mode::Clipped, Antialias::None),
        (Mode::Textured, Antialias::Msaa),
        (Mode::Original, Antialias::None),
        (Mode::Difference, Antialias::None),
    ] {
        let mut draw = |camera: Camera| {
            let mut params = scene::frame(camera, mode, antialias);
            params.shadow = (mode == Mode::Textured).then_some(ShadowParams {
                to_light: DVec3::new(0.3, 1.0, 0.2),
                up: DVec3::Y,
            });
            renderer.render(&gpu, &params).expect("it is drawn")
        };
        let (whole, of_part) = (draw(large), draw(part));
        let allowed = tolerance::GOLDEN;
        let outliers = count_outliers(&whole, &of_part, allowed.value());
        let name = format!("{mode:?}, {antialias:?}");
        assert!(outliers <= allowed.max_outliers(), "{name}: {outliers}");
        let centred = draw(Camera {
            center_offset: DVec2::ZERO,
            ..part
        });
        assert!(
            count_outliers(&whole, &centred, allowed.value()) > 1000,
            "{name}: a camera that ignores its axis"
        );
    }
}

/// Pixels of the part of which a channel differs by more than `value` from the large picture's.
fn count_outliers(large: &ColourImage, part: &ColourImage, value: u8) -> u32 {
    assert_eq!((part.width, part.height), PART.1);
    let row = |image: &ColourImage, y: u32, x: u32| {
        let start = 4 * (y * image.width + x) as usize;
        image.rgba[start..start + 4 * part.width as usize].to_vec()
    };
    let mut outliers = 0;
    for y in 0..part.height {
        let expected = row(large, y + PART.0[1], PART.0[0]);
        let found = row(part, y, 0);
        let pairs = expected.chunks(4).zip(found.chunks(4));
        let differs = |(a, b): &(&[u8], &[u8])| (0..4).any(|c| a[c].abs_diff(b[c]) > value);
        outliers += pairs.filter(differs).count() as u32;
    }
    outliers
}
