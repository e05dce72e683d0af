//! A few small pictures against those that were looked at and found good (`tests/golden/`).
//!
//! `cargo xtask bless NAME.png` replaces one by what was drawn last; look at it before it is committed. On failure the
//! drawn picture, the difference and the adapter's name lie in `target/image-tests/`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use image::RgbaImage;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Bounds, Camera, ColourImage, CoverageRule, Loop, Mask, TriangleMesh};
use silmap_gpu::{Gpu, Readback, wgpu};
use silmap_map::{Asset, Method};
use silmap_preprocess::capture::cpu;
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};
use silmap_study::{
    Antialias, Background, ClipShape, FrameParams, Mode, PictureOptions, PictureRenderer,
};
use silmap_tests::dense_maps::dense;
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

/// The picture whose outline is interpolated: between views, by the default method.
const INTERPOLATED: &str = "interpolated";

/// A displacement that no golden picture may let pass, pixels.
const SHIFT_PX: f64 = 0.25;

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

/// What draws the pictures, and what it draws.
struct Stage {
    gpu: Gpu,
    asset: Asset,
    renderer: PictureRenderer,
    camera: Camera,
    /// The model's own.
    outline: Vec<Loop>,
}

impl Stage {
    fn open(options: PictureOptions) -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mut asset = scene::asset(&gpu);
        let mesh = scene::model();
        // With depths, as the default method wants.
        (asset.map, _) = dense(&mesh, 96, 256, 0.5, CoverageRule::Center);
        let mut renderer = PictureRenderer::new(&gpu, options);
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
        Some(Self {
            gpu,
            asset,
            renderer,
            camera,
            outline,
        })
    }

    /// A case drawn with the model's own outline, moved to the right by so many pixels.
    fn draw(
        &mut self,
        &(_, mode, antialias, background): &(&str, Mode, Antialias, Background),
        shift_px: f64,
    ) -> ColourImage {
        // For `difference`: an outline that is wrong to one side, so that both colours show.
        let wrong = if mode == Mode::Difference { 1.5 } else { 0.0 };
        let offset = DVec2::new(wrong + shift_px, wrong);
        let moved = |l: &Loop| l.iter().map(|p| p + offset).collect();
        let loops: Vec<Loop> = self.outline.iter().map(moved).collect();
        let shape = ClipShape {
            loops: &loops,
            outline: &loops,
        };
        let params = FrameParams {
            background,
            ..scene::frame(self.camera, mode, antialias)
        };
        (self.renderer.render_shape(&self.gpu, &params, &shape)).unwrap()
    }

    /// The parameters of the picture with an interpolated outline.
    fn interpolated(&self) -> FrameParams {
        FrameParams {
            method: Method::Tight,
            ..scene::frame(self.camera, Mode::Clipped, Antialias::Soft)
        }
    }
}

#[test]
fn pictures_are_the_golden_ones() {
    let Some(mut stage) = Stage::open(PictureOptions::default()) else {
        return;
    };
    let adapter = stage.gpu.adapter_name();
    let mut failures = Vec::new();
    for case in CASES {
        let drawn = stage.draw(case, 0.0);
        failures.extend(compare(case.0, &drawn, &adapter).err());
    }
    let params = stage.interpolated();
    let drawn = stage.renderer.render(&stage.gpu, &params).unwrap();
    failures.extend(compare(INTERPOLATED, &drawn, &adapter).err());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Pixels of what is one unit wide at a distance of one.
fn unit_px(camera: &Camera) -> f64 {
    0.5 * f64::from(camera.height_px) / (0.5 * camera.fov_y_rad()).tan()
}

/// Pixels by which a picture is not its golden one.
fn outliers(name: &str, drawn: &ColourImage) -> u32 {
    let golden = image::open(golden_folder().join(format!("{name}.png"))).unwrap();
    let drawn = image::load_from_memory(&scene::png(drawn).bytes).unwrap();
    count_outliers(&golden.into_rgba8(), &drawn.into_rgba8())
}

#[test]
fn a_quarter_of_a_pixel_is_noticed() {
    let Some(mut stage) = Stage::open(PictureOptions::default()) else {
        return;
    };
    for case in CASES {
        if matches!(case.1, Mode::Clipped | Mode::Silhouette) {
            let found = outliers(case.0, &stage.draw(case, SHIFT_PX));
            let name = case.0;
            assert!(found > tolerance::GOLDEN.max_outliers(), "{name}: {found}");
        }
    }
    // The same of the interpolated one: all captured outlines are moved by as much as is seen in the picture.
    let params = stage.interpolated();
    let mut asset = stage.asset.clone();
    for view in &mut asset.map.views {
        let scale = unit_px(&view.camera) / unit_px(&stage.camera);
        let points = view.contours.iter_mut().flat_map(|c| &mut c.points);
        points.for_each(|p| p.x += SHIFT_PX * scale);
    }
    stage.renderer.load_asset(&stage.gpu, &asset).unwrap();
    let drawn = stage.renderer.render(&stage.gpu, &params).unwrap();
    let found = outliers(INTERPOLATED, &drawn);
    assert!(found > tolerance::GOLDEN.max_outliers(), "{found}");
}

#[test]
fn another_target_format_shows_the_same() {
    let format = wgpu::TextureFormat::Bgra8UnormSrgb;
    let Some(mut stage) = Stage::open(PictureOptions {
        target_format: format,
        ..PictureOptions::default()
    }) else {
        return;
    };
    let texture = device::target(&stage.gpu, format, SIDE_PX);
    let target = texture.create_view(&wgpu::TextureViewDescriptor::default());
    for antialias in [Antialias::Soft, Antialias::Msaa, Antialias::None] {
        let params = FrameParams {
            antialias,
            ..stage.interpolated()
        };
        // Pictures are drawn in red, green, blue whatever the target's format.
        let mut expected = stage.renderer.render(&stage.gpu, &params).unwrap();
        let mut encoder = (stage.gpu.device).create_command_encoder(&Default::default());
        (stage.renderer)
            .record(&stage.gpu, &mut encoder, &target, &params)
            .unwrap();
        let readback = Readback::new(&stage.gpu, (SIDE_PX, SIDE_PX), format).unwrap();
        let pending = readback.start(&stage.gpu, encoder, &texture);
        let (bgra, _) = pending.wait(&stage.gpu).unwrap();
        assert_ne!(expected.rgba, bgra);
        for pixel in expected.rgba.chunks_exact_mut(4) {
            pixel.swap(0, 2);
        }
        assert_eq!(expected.rgba, bgra, "{antialias:?}");
    }
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
    let names = CASES.iter().map(|c| c.0).chain([INTERPOLATED]);
    let wanted: BTreeSet<String> = names.map(str::to_owned).collect();
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
