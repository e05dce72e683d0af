//! A few small pictures against those that were looked at and found good (`tests/golden/`).
//!
//! `cargo xtask bless NAME.png` replaces one by what was drawn last; look at it before it is committed. On failure the
//! drawn picture, the difference and the adapter's name lie in `target/image-tests/`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;
use image::RgbaImage;
use silmap_geometry::{Bounds, Camera, ColourImage, CoverageRule, Loop, Mask, TriangleMesh};
use silmap_preprocess::capture::cpu;
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};
use silmap_preprocess::trace::trace_contours;
use silmap_runtime::{
    Antialias, Background, ClipShape, FrameParams, Mode, Renderer, RendererOptions,
};
use silmap_tests::{device, scene, tolerance};

/// Side of the pictures.
const SIDE_PX: u32 = 96;
/// Largest golden file.
const MAX_BYTES: usize = 16 * 1024;

/// The pictures: name, mode, smoothing, background.
const CASES: &[(&str, Mode, Antialias, Background)] = &[
    (
        "original",
        Mode::Original,
        Antialias::Msaa,
        Background::Colour([255; 3]),
    ),
    (
        "coarse",
        Mode::Coarse,
        Antialias::Msaa,
        Background::Colour([40, 60, 90]),
    ),
    (
        "textured",
        Mode::Textured,
        Antialias::None,
        Background::Colour([255; 3]),
    ),
    (
        "clipped-soft",
        Mode::Clipped,
        Antialias::Soft,
        Background::Colour([255; 3]),
    ),
    (
        "clipped-soft-transparent",
        Mode::Clipped,
        Antialias::Soft,
        Background::Transparent,
    ),
    (
        "clipped-msaa",
        Mode::Clipped,
        Antialias::Msaa,
        Background::Colour([20, 20, 20]),
    ),
    (
        "silhouette",
        Mode::Silhouette,
        Antialias::Soft,
        Background::Colour([255; 3]),
    ),
    (
        "difference",
        Mode::Difference,
        Antialias::None,
        Background::Colour([255; 3]),
    ),
];

fn golden_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

/// The model's own outline, traced at eight times the size: it does not change when interpolation gets better.
fn true_outline(mesh: &TriangleMesh, camera: &Camera) -> Vec<Loop> {
    const FINER: u32 = 8;
    let fine = camera.resized((camera.width_px * FINER, camera.height_px * FINER));
    let mut mask = Mask::new(fine.width_px, fine.height_px);
    cpu::rasterise(mesh, &fine, CoverageRule::Center, &mut mask).unwrap();
    let params = SimplifyContourParams {
        tolerance_px: 0.8,
        outward_only: false,
    };
    simplify_contours(&trace_contours(&mask), &params)
        .iter()
        .map(|l| l.iter().map(|p| p / f64::from(FINER)).collect())
        .collect()
}

/// Pixels that differ by more than the tolerance in some channel, colours weighted by their alpha.
fn count_outliers(a: &RgbaImage, b: &RgbaImage) -> u32 {
    if a.dimensions() != b.dimensions() {
        return u32::MAX;
    }
    let allowed = i32::from(tolerance::GOLDEN.value());
    let shown = |p: &image::Rgba<u8>, c: usize| match c {
        3 => i32::from(p[3]),
        _ => i32::from(p[c]) * i32::from(p[3]) / 255,
    };
    a.pixels()
        .zip(b.pixels())
        .filter(|(p, q)| (0..4).any(|c| (shown(p, c) - shown(q, c)).abs() > allowed))
        .count() as u32
}

/// Compares with the golden picture; leaves what was drawn for `cargo xtask bless` when it is another.
fn compare(name: &str, drawn: &ColourImage, adapter: &str) -> Result<(), String> {
    let bytes = scene::png(drawn).bytes;
    if bytes.len() > MAX_BYTES {
        return Err(format!("{name}: {} bytes are too many", bytes.len()));
    }
    let drawn = image::load_from_memory(&bytes).unwrap().into_rgba8();
    let golden = image::open(golden_folder().join(format!("{name}.png")));
    let outliers = match &golden {
        Ok(golden) => count_outliers(&golden.to_rgba8(), &drawn),
        Err(_) => u32::MAX,
    };
    if outliers <= tolerance::GOLDEN.max_outliers() {
        return Ok(());
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/image-tests");
    std::fs::create_dir_all(folder.join("actual")).unwrap();
    std::fs::write(folder.join(format!("actual/{name}.png")), bytes).unwrap();
    std::fs::write(folder.join(format!("{name}-adapter.txt")), adapter).unwrap();
    let what = match golden {
        Ok(golden) => {
            difference(&golden.to_rgba8(), &drawn)
                .save(folder.join(format!("{name}-diff.png")))
                .unwrap();
            format!("{outliers} pixels differ on {adapter}, see target/image-tests")
        }
        Err(_) => "there is no golden picture".to_owned(),
    };
    Err(format!(
        "{name}: {what}; to accept what was drawn: cargo xtask bless {name}.png"
    ))
}

fn difference(a: &RgbaImage, b: &RgbaImage) -> RgbaImage {
    RgbaImage::from_fn(
        a.width().min(b.width()),
        a.height().min(b.height()),
        |x, y| {
            let (p, q) = (a.get_pixel(x, y), b.get_pixel(x, y));
            let off = [0, 1, 2].map(|c| {
                p[c].abs_diff(q[c])
                    .max(p[3].abs_diff(q[3]))
                    .saturating_mul(4)
            });
            image::Rgba([off[0], off[1], off[2], 255])
        },
    )
}

#[test]
fn pictures_are_the_golden_ones() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let asset = scene::asset(&gpu);
    let mesh = scene::model();
    let mut renderer = Renderer::new(&gpu, RendererOptions::default());
    renderer.load_asset(&gpu, &asset).unwrap();
    renderer.load_model(&gpu, &mesh).unwrap();
    // The hull is larger than the model and shall be seen whole.
    let bounds = mesh.bounds();
    let roomy = Bounds {
        radius: bounds.radius * 1.15,
        ..bounds
    };
    let camera = scene::camera(&roomy, DVec3::new(0.6, 0.9, 1.0), 3.0, SIDE_PX);
    let outline = true_outline(&mesh, &camera);
    // For `difference`: an outline that is wrong to one side, so that both colours show.
    let moved: Vec<Loop> = outline
        .iter()
        .map(|l| l.iter().map(|p| p + 1.5).collect())
        .collect();
    let mut failures = Vec::new();
    for &(name, mode, antialias, background) in CASES {
        let loops = if mode == Mode::Difference {
            &moved
        } else {
            &outline
        };
        let shape = ClipShape {
            loops,
            outline: loops,
            ..ClipShape::EMPTY
        };
        let params = FrameParams {
            background,
            ..scene::frame(camera, mode, antialias)
        };
        let drawn = renderer.render_shape(&gpu, &params, &shape).unwrap();
        failures.extend(compare(name, &drawn, &gpu.adapter_name()).err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn golden_pictures_are_small_all_used_and_tell_modes_apart() {
    let mut found = BTreeSet::new();
    let mut pictures = Vec::new();
    for entry in
        std::fs::read_dir(golden_folder()).expect("run the tests, then: cargo xtask bless --all")
    {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "png") {
            continue;
        }
        let bytes = std::fs::read(&path).unwrap();
        assert!(bytes.len() <= MAX_BYTES, "{} is too large", path.display());
        found.insert(path.file_stem().unwrap().to_string_lossy().into_owned());
        pictures.push(image::load_from_memory(&bytes).unwrap().into_rgba8());
    }
    let wanted: BTreeSet<String> = CASES.iter().map(|c| c.0.to_owned()).collect();
    assert_eq!(found, wanted);
    for (i, a) in pictures.iter().enumerate() {
        assert_eq!(count_outliers(a, a), 0);
        for b in &pictures[i + 1..] {
            assert!(
                count_outliers(a, b) > tolerance::GOLDEN.max_outliers(),
                "two golden pictures pass for each other"
            );
        }
    }
}
