//! What the graphics device draws against what the processor finds: stencil fills, coverage at edges, captured masks, and a
//! whole frame. Adapters round vertices to a grid of 1/256 pixel, so a few pixels may differ, but only where a centre lies
//! on an edge to within that; every comparison has a twin that must fail.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec2, DVec3};
use silmap_geometry::polygon::{self, fill_even_odd, fill_non_zero};
use silmap_geometry::{Bounds, Camera, ColourImage, CoverageRule, Loop, Mask, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::{
    Asset, BuildRecord, CapturedView, CoarseHull, Placement, SilhouetteMap, TextureSet,
};
use silmap_models as models;
use silmap_preprocess::capture::gpu::GpuCapture;
use silmap_preprocess::capture::{cpu, view_sphere};
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_study::{
    Antialias, Background, ClipShape, FrameParams, Mode, PictureOptions, PictureRenderer,
    RenderError,
};
use silmap_tests::tolerance::{self, Tolerance};
use silmap_tests::{device, scene};

/// Side of the test images: no multiple of the copy alignment, so that padding is in play.
const SIDE_PX: u32 = 120;

/// A pixel centre farther than this from every edge must not differ: four steps of the rasteriser's grid.
const GRID_PX: f64 = 1.0 / 64.0;

/// The same for the path rasteriser, which is less exact; 1/25 pixel was the farthest seen.
const PATH_GRID_PX: f64 = 1.0 / 16.0;

/// A renderer whose hull is a box that fills the image, and a camera before it: what is drawn is the clip region itself.
struct Screen {
    gpu: Gpu,
    renderer: PictureRenderer,
    camera: Camera,
}

impl Screen {
    fn open() -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
        renderer.load_asset(&gpu, &box_asset()).unwrap();
        let eye = DVec3::new(0.0, 0.0, 10.0);
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (SIDE_PX, SIDE_PX)).unwrap();
        Some(Self {
            gpu,
            renderer,
            camera,
        })
    }

    fn alpha(&mut self, antialias: Antialias, shape: &ClipShape<'_>) -> Vec<u8> {
        let params = FrameParams {
            background: Background::Transparent,
            ..scene::frame(self.camera, Mode::Clipped, antialias)
        };
        let picture = self
            .renderer
            .render_shape(&self.gpu, &params, shape)
            .unwrap();
        alpha_of(&picture)
    }

    fn mask(&mut self, loops: &[Loop]) -> Mask {
        let shape = ClipShape {
            loops,
            ..ClipShape::EMPTY
        };
        mask_of(&self.alpha(Antialias::None, &shape), SIDE_PX)
    }
}

fn alpha_of(picture: &ColourImage) -> Vec<u8> {
    picture.rgba.chunks(4).map(|pixel| pixel[3]).collect()
}

fn mask_of(alpha: &[u8], side_px: u32) -> Mask {
    let mut mask = Mask::new(side_px, side_px);
    for (i, &value) in (0..).zip(alpha) {
        mask.set(i % side_px, i / side_px, value > 127);
    }
    mask
}

/// A cube of half-side 3 and a map without a contour; the camera sees no farther than 1.02 from the middle.
fn box_asset() -> Asset {
    let positions: Vec<[f32; 3]> = (0..8)
        .map(|k| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|bit| 6.0 * bit as f32 - 3.0))
        .collect();
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let bounds = Bounds {
        min: DVec3::splat(-0.5),
        max: DVec3::splat(0.5),
        center: DVec3::ZERO,
        radius: 1.0,
    };
    let views = view_sphere(&bounds, 3.0, 24, 16)
        .unwrap()
        .into_iter()
        .map(|camera| CapturedView {
            camera,
            contours: Vec::new(),
            photographed: None,
        })
        .collect();
    let params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px: 16,
        tolerance_px: 0.5,
        coverage: CoverageRule::Center,
    };
    Asset {
        record: BuildRecord::default(),
        map: dense_map::build(views, &params).unwrap(),
        hull: CoarseHull {
            surface_points: positions.clone(),
            positions,
            faces: sides
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .collect(),
            volume_ratio: 1.0,
        },
        textures: TextureSet::default(),
        placement: Placement::default(),
    }
}

/// `count` corners that jump about, from a fixed generator: self-crossings, slivers, points outside of the image.
fn tangle(seed: u32, count: u32) -> Loop {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1_u32 << 24)
    };
    (0..count)
        .map(|_| DVec2::new(next(), next()) * 150.0 - 15.0)
        .collect()
}

/// A regular polygon, counter-clockwise in the image when `radius` is positive and its mirror when it is not.
fn ring(center: DVec2, radius: f64, corners: u32) -> Loop {
    (0..corners)
        .map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(corners) + 0.1;
            center + DVec2::new(radius.abs() * angle.cos(), radius * angle.sin())
        })
        .collect()
}

/// Loops that are hard to fill.
fn hard_shapes() -> Vec<Vec<Loop>> {
    let middle = DVec2::new(61.3, 58.7);
    vec![
        vec![ring(middle, 50.0, 400), ring(middle, -20.0, 90)],
        vec![ring(middle, 30.0, 7), ring(middle + 25.0, 30.0, 5)],
        vec![tangle(1, 9)],
        vec![tangle(2, 40)],
        vec![tangle(3, 12), tangle(4, 12), tangle(5, 3)],
        vec![ring(middle, 400.0, 11)],
        vec![Vec::new(), vec![middle], vec![middle, middle + 5.0]],
    ]
}

/// Whether a pixel's centre lies within `reach_px` of an edge.
fn is_at_edge(loops: &[Loop], x: u32, y: u32, reach_px: f64) -> bool {
    let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    loops.iter().flat_map(|l| polygon::edges(l)).any(|(a, b)| {
        let along = b - a;
        let share = ((centre - a).dot(along) / along.length_squared().max(1e-30)).clamp(0.0, 1.0);
        centre.distance(a + along * share) <= reach_px
    })
}

/// Pixels in which two masks differ.
fn differing(a: &Mask, b: &Mask) -> Vec<(u32, u32)> {
    (0..a.height())
        .flat_map(|y| (0..a.width()).map(move |x| (x, y)))
        .filter(|&(x, y)| a.get(x.into(), y.into()) != b.get(x.into(), y.into()))
        .collect()
}

/// Whether the device's mask is as good as the processor's.
fn agrees(drawn: &Mask, found: &Mask, loops: &[Loop]) -> Result<(), String> {
    agrees_within(drawn, found, loops, (tolerance::STENCIL_FILL, GRID_PX))
}

/// Whether the device's mask is as good as the path rasteriser's.
fn path_agrees(drawn: &Mask, found: &Mask, loops: &[Loop]) -> Result<(), String> {
    agrees_within(drawn, found, loops, (tolerance::PATH_FILL, PATH_GRID_PX))
}

fn agrees_within(
    drawn: &Mask,
    found: &Mask,
    loops: &[Loop],
    (allowed, reach_px): (Tolerance, f64),
) -> Result<(), String> {
    let wrong = differing(drawn, found);
    if wrong.len() > allowed.max_outliers() as usize {
        return Err(format!("{} pixels differ", wrong.len()));
    }
    match wrong
        .iter()
        .find(|&&(x, y)| !is_at_edge(loops, x, y, reach_px))
    {
        Some(at) => Err(format!("pixel {at:?} differs and is at no edge")),
        None => Ok(()),
    }
}

#[test]
fn fans_fill_what_the_processor_fills() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    let mut found = Mask::new(SIDE_PX, SIDE_PX);
    for (index, loops) in hard_shapes().into_iter().enumerate() {
        fill_non_zero(&loops, &mut found);
        let drawn = screen.mask(&loops);
        agrees(&drawn, &found, &loops).unwrap_or_else(|why| panic!("shape {index}: {why}"));
    }
}

#[test]
fn fans_fill_what_a_path_rasteriser_fills() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    for (index, loops) in hard_shapes().into_iter().enumerate() {
        let Some(found) = filled_by_skia(&loops) else {
            continue;
        };
        let drawn = screen.mask(&loops);
        path_agrees(&drawn, &found, &loops).unwrap_or_else(|why| panic!("shape {index}: {why}"));
    }
}

fn filled_by_skia(loops: &[Loop]) -> Option<Mask> {
    let mut path = tiny_skia::PathBuilder::new();
    for points in loops.iter().filter(|l| l.len() >= 3) {
        for (k, p) in points.iter().enumerate() {
            let (x, y) = (p.x as f32, p.y as f32);
            if k == 0 {
                path.move_to(x, y);
            } else {
                path.line_to(x, y);
            }
        }
        path.close();
    }
    let mut drawn = tiny_skia::Mask::new(SIDE_PX, SIDE_PX)?;
    drawn.fill_path(
        &path.finish()?,
        tiny_skia::FillRule::Winding,
        false,
        tiny_skia::Transform::identity(),
    );
    Some(mask_of(drawn.data(), SIDE_PX))
}

#[test]
fn a_moved_a_lost_and_a_differently_filled_loop_are_noticed() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    let loops = hard_shapes().swap_remove(1);
    let drawn = screen.mask(&loops);
    let mut found = Mask::new(SIDE_PX, SIDE_PX);
    let moved: Vec<Loop> = loops
        .iter()
        .map(|l| l.iter().map(|p| p + 2.0).collect())
        .collect();
    fill_non_zero(&moved, &mut found);
    assert!(agrees(&drawn, &found, &loops).is_err(), "moved by 2 px");
    fill_non_zero(&loops[..1], &mut found);
    assert!(agrees(&drawn, &found, &loops).is_err(), "a loop lost");
    fill_even_odd(&loops, &mut found);
    assert!(agrees(&drawn, &found, &loops).is_err(), "filled by parity");
}

/// Share of each pixel that the loops cover, of 255, by 16 × 16 samples.
fn covered_shares(loops: &[Loop]) -> Vec<u8> {
    const FINER: u32 = 16;
    let fine: Vec<Loop> = loops
        .iter()
        .map(|l| l.iter().map(|p| p * f64::from(FINER)).collect())
        .collect();
    let mut mask = Mask::new(SIDE_PX * FINER, SIDE_PX * FINER);
    fill_non_zero(&fine, &mut mask);
    let mut shares = Vec::new();
    for y in 0..SIDE_PX {
        for x in 0..SIDE_PX {
            let inside = (0..FINER * FINER)
                .filter(|k| {
                    let (i, j) = (x * FINER + k % FINER, y * FINER + k / FINER);
                    mask.get(i.into(), j.into())
                })
                .count();
            shares.push((inside * 255 / 256) as u8);
        }
    }
    shares
}

fn count_far(a: &[u8], b: &[u8], value: u8) -> u32 {
    a.iter()
        .zip(b)
        .filter(|(a, b)| a.abs_diff(**b) > value)
        .count() as u32
}

#[test]
fn soft_edges_cover_the_area_that_lies_inside() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    let middle = DVec2::new(60.2, 59.6);
    let shapes: [Vec<Loop>; 3] = [
        vec![ring(middle, 50.0, 200), ring(middle, -21.5, 60)],
        vec![ring(middle, 45.0, 3)],
        vec![ring(middle, 48.0, 4), ring(middle + 3.0, -20.0, 5)],
    ];
    // A camera that sees farther: the hull is still where the model's bounding sphere ends.
    let wide = Camera::fit_sphere(
        screen.camera.eye,
        DVec3::ZERO,
        1.6,
        None,
        (SIDE_PX, SIDE_PX),
    );
    let near = screen.camera;
    let cases = shapes.into_iter().flat_map(|shape| {
        let far = shape.clone();
        [(near, shape), (wide.clone().unwrap(), far)]
    });
    for (index, (camera, loops)) in cases.enumerate() {
        screen.camera = camera;
        let truth = covered_shares(&loops);
        let shape = ClipShape {
            loops: &loops,
            outline: &loops,
        };
        let soft = screen.alpha(Antialias::Soft, &shape);
        let allowed = tolerance::SOFT_COVERAGE;
        let far = count_far(&soft, &truth, allowed.value());
        assert!(
            far <= allowed.max_outliers(),
            "shape {index}: {far} pixels are off"
        );
        let off: i64 = soft
            .iter()
            .zip(&truth)
            .map(|(&a, &b)| i64::from(a) - i64::from(b))
            .sum();
        let edge_pixels = truth.iter().filter(|v| !matches!(v, 0 | 255)).count() as i64;
        assert!(
            off.abs() <= 4 * edge_pixels,
            "shape {index}: a bias of {off} over {edge_pixels}"
        );

        let sampled = screen.alpha(Antialias::Msaa, &shape);
        let allowed_sampled = tolerance::SAMPLED_COVERAGE;
        let far = count_far(&sampled, &truth, allowed_sampled.value());
        assert!(
            far <= allowed_sampled.max_outliers(),
            "shape {index}: {far} sampled pixels are off"
        );

        let binary = screen.alpha(Antialias::None, &shape);
        assert!(
            count_far(&binary, &truth, allowed.value()) > 2 * allowed.max_outliers(),
            "shape {index}: unsmoothed edges pass for smooth ones"
        );
    }
}

/// The mask's pixels that have a neighbour of the other kind.
fn is_boundary(mask: &Mask, x: u32, y: u32) -> bool {
    let (x, y) = (i64::from(x), i64::from(y));
    let here = mask.get(x, y);
    (-1..=1).any(|dy| (-1..=1).any(|dx| mask.get(x + dx, y + dy) != here))
}

#[test]
fn captured_masks_are_the_processors_but_for_boundary_pixels() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let mut checked = 0;
    for mesh in [models::torus(3000), models::trefoil_knot(5000)] {
        let bounds = mesh.bounds();
        let cameras = view_sphere(&bounds, 3.0 * bounds.radius, 9, 200).unwrap();
        let mut order = Vec::new();
        GpuCapture::new(&gpu, &mesh)
            .unwrap()
            .capture(&cameras, &mut |view, drawn| {
                order.push(view);
                let found = by_processor(&mesh, &cameras[view]);
                let wrong = differing(&drawn, &found);
                assert!(
                    wrong.len() <= tolerance::CAPTURE_MASK.max_outliers() as usize,
                    "view {view}: {} pixels differ",
                    wrong.len()
                );
                for (x, y) in wrong {
                    assert!(
                        is_boundary(&found, x, y),
                        "view {view}: ({x}, {y}) is no boundary"
                    );
                }
                let other = by_processor(&mesh, &cameras[(view + 1) % cameras.len()]);
                assert!(
                    differing(&drawn, &other).len()
                        > 10 * tolerance::CAPTURE_MASK.max_outliers() as usize,
                    "another view passes for view {view}"
                );
                checked += 1;
                Ok(())
            })
            .unwrap();
        assert_eq!(order, (0..cameras.len()).collect::<Vec<_>>());
    }
    assert_eq!(checked, 18);
}

fn by_processor(mesh: &TriangleMesh, camera: &Camera) -> Mask {
    let mut mask = Mask::new(camera.width_px, camera.height_px);
    cpu::rasterise(mesh, camera, CoverageRule::Center, &mut mask).unwrap();
    mask
}

#[test]
fn a_whole_frame_is_the_hull_inside_the_interpolated_outline() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let asset = scene::asset(&gpu);
    let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
    renderer.load_asset(&gpu, &asset).unwrap();
    let side_px = 256;
    let bounds = Bounds {
        center: asset.map.center,
        radius: asset.map.radius,
        ..scene::model().bounds()
    };
    for (method, direction) in [
        (silmap_map::Method::Hull, DVec3::new(0.5, 0.8, 1.0)),
        (silmap_map::Method::Paper, DVec3::new(-1.0, 0.4, 0.2)),
    ] {
        let camera = scene::camera(&bounds, direction, 3.0, side_px);
        let params = FrameParams {
            background: Background::Transparent,
            method,
            ..scene::frame(camera, Mode::Clipped, Antialias::None)
        };
        let drawn = mask_of(&alpha_of(&renderer.render(&gpu, &params).unwrap()), side_px);
        let loops = outline_loops(&asset.map, &camera, method);
        let mut found = Mask::new(side_px, side_px);
        fill_non_zero(&loops, &mut found);
        found.intersect(&by_processor(&hull_mesh(&asset.hull), &camera));
        let wrong = differing(&drawn, &found).len();
        assert!(found.count() > 5000, "{method:?}: hardly anything is drawn");
        assert!(
            wrong <= 2 * tolerance::STENCIL_FILL.max_outliers() as usize,
            "{method:?}: {wrong} pixels differ"
        );
    }
}

fn outline_loops(map: &SilhouetteMap, camera: &Camera, method: silmap_map::Method) -> Vec<Loop> {
    let mut scratch = silmap_map::MapReader::new(map).unwrap();
    silmap_map::outline(map, camera, method, &mut scratch)
        .unwrap()
        .simple_loops()
        .to_vec()
}

fn hull_mesh(hull: &CoarseHull) -> TriangleMesh {
    TriangleMesh {
        positions: hull
            .positions
            .iter()
            .map(|p| DVec3::from_array(p.map(f64::from)))
            .collect(),
        faces: hull.faces.clone(),
        ..TriangleMesh::default()
    }
}

#[test]
fn what_cannot_be_drawn_is_an_error_and_the_next_frame_is_drawn() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    let camera = screen.camera;
    let mut try_camera = |camera: Camera, mode: Mode| {
        let params = scene::frame(camera, mode, Antialias::Soft);
        screen
            .renderer
            .render_shape(&screen.gpu, &params, &ClipShape::EMPTY)
    };
    let huge = Camera {
        width_px: 1_000_000,
        ..camera
    };
    let empty = Camera {
        height_px: 0,
        ..camera
    };
    let inside = Camera {
        eye: DVec3::new(0.0, 0.0, 0.5),
        ..camera
    };
    let tried = try_camera(huge, Mode::Clipped);
    assert!(
        matches!(tried, Err(RenderError::ImageTooLarge { .. })),
        "{tried:?}"
    );
    let tried = try_camera(empty, Mode::Clipped);
    assert!(matches!(tried, Err(RenderError::Camera(_))), "{tried:?}");
    let tried = try_camera(inside, Mode::Coarse);
    assert!(matches!(tried, Err(RenderError::Camera(_))), "{tried:?}");
    let tried = try_camera(camera, Mode::Original);
    assert!(
        matches!(tried, Err(RenderError::NoModel { .. })),
        "{tried:?}"
    );
    let picture = try_camera(camera, Mode::Coarse).unwrap();
    assert_eq!(picture.rgba.len(), 4 * (SIDE_PX * SIDE_PX) as usize);
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(mut screen) = Screen::open() else {
        return;
    };
    screen.gpu.device.destroy();
    let params = scene::frame(screen.camera, Mode::Coarse, Antialias::None);
    let drawn = screen
        .renderer
        .render_shape(&screen.gpu, &params, &ClipShape::EMPTY);
    assert!(matches!(drawn, Err(RenderError::Gpu(_))), "{drawn:?}");
}
