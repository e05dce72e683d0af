//! The hull clipped by the exact silhouette against the full mesh, both drawn by the device: the outline is the same but for
//! pixel centres within the rasteriser's grid of an edge.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec2, DVec3};
use silmap_exact::{chain_loops, decompose_loops, image_loops, silhouette_edges};
use silmap_geometry::{Camera, ColourImage, Loop, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_study::{
    Antialias, Background, ClipShape, FrameParams, Mode, PictureOptions, PictureRenderer,
    RenderError,
};
use silmap_tests::{device, scene};

/// Side of the pictures.
const SIDE_PX: u32 = 400;
/// Share of the true inside that may be on the wrong side; the promise for large models.
const MISCLASSIFIED: f64 = 0.0002;

struct Stage {
    gpu: Gpu,
    renderer: PictureRenderer,
    mesh: TriangleMesh,
}

impl Stage {
    fn open() -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mesh = scene::model();
        let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
        renderer.load_asset(&gpu, &scene::asset(&gpu)).unwrap();
        renderer.load_model(&gpu, &mesh).unwrap();
        Some(Self {
            gpu,
            renderer,
            mesh,
        })
    }

    fn cameras(&self) -> Vec<Camera> {
        let bounds = self.mesh.bounds();
        [
            ([0.3, 1.0, 0.2], 3.0),
            ([1.0, 0.1, 0.4], 2.2),
            ([-0.6, -0.5, 0.7], 6.0),
            ([0.2, 0.3, -1.0], 1.3),
        ]
        .map(|(d, distance)| scene::camera(&bounds, DVec3::from_array(d), distance, SIDE_PX))
        .to_vec()
    }

    fn loops(&self, camera: &Camera) -> Vec<Loop> {
        let edges = silhouette_edges(&self.mesh, camera.eye);
        image_loops(&chain_loops(&edges).unwrap(), &self.mesh.positions, camera).unwrap()
    }

    fn draw(&mut self, camera: &Camera, how: (Mode, Antialias), shape: &ClipShape<'_>) -> Vec<u8> {
        let params = FrameParams {
            background: Background::Transparent,
            ..scene::frame(*camera, how.0, how.1)
        };
        let drawn = self.renderer.render_shape(&self.gpu, &params, shape);
        alpha_of(&drawn.unwrap())
    }
}

fn alpha_of(picture: &ColourImage) -> Vec<u8> {
    picture.rgba.chunks(4).map(|pixel| pixel[3]).collect()
}

fn shape(loops: &[Loop]) -> ClipShape<'_> {
    ClipShape {
        loops,
        ..ClipShape::EMPTY
    }
}

/// Pixels inside, and pixels on the wrong side of half coverage.
fn misclassified(drawn: &[u8], truth: &[u8]) -> (usize, usize) {
    let inside = truth.iter().filter(|&&a| a > 127).count();
    let wrong = (drawn.iter().zip(truth)).filter(|&(&a, &b)| (a > 127) != (b > 127));
    (inside, wrong.count())
}

#[test]
fn the_exactly_clipped_hull_covers_what_the_mesh_covers() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let (mut inside, mut wrong, mut shifted_wrong) = (0, 0, 0);
    for camera in stage.cameras() {
        let truth = stage.draw(
            &camera,
            (Mode::Original, Antialias::None),
            &ClipShape::EMPTY,
        );
        let whole = stage.loops(&camera);
        let (pieces, _) = decompose_loops(&whole);
        let mut pictures = Vec::new();
        for loops in [&whole, &pieces] {
            pictures.push(stage.draw(&camera, (Mode::Exact, Antialias::None), &shape(loops)));
        }
        for picture in &pictures {
            let (pixels, different) = misclassified(picture, &truth);
            inside += pixels;
            wrong += different;
        }
        let moved: Vec<Loop> = (pieces.iter())
            .map(|l| l.iter().map(|p| p + 0.5).collect())
            .collect();
        let drawn = stage.draw(&camera, (Mode::Exact, Antialias::None), &shape(&moved));
        shifted_wrong += misclassified(&drawn, &truth).1;
    }
    let share = wrong as f64 / inside as f64;
    eprintln!(
        "{wrong} of {inside} pixels are on the wrong side: {:.4} %",
        100.0 * share
    );
    assert!(share <= MISCLASSIFIED, "{wrong} of {inside} pixels");
    let shifted_share = 2.0 * shifted_wrong as f64 / inside as f64;
    assert!(
        shifted_share > 10.0 * MISCLASSIFIED,
        "loops moved by half a pixel pass: {shifted_wrong} pixels"
    );
}

#[test]
fn a_lost_loop_is_noticed() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let camera = stage.cameras()[0];
    let truth = stage.draw(
        &camera,
        (Mode::Original, Antialias::None),
        &ClipShape::EMPTY,
    );
    let loops = stage.loops(&camera);
    let mut most = 0;
    for lost in 0..loops.len() {
        let mut left = loops.clone();
        left.remove(lost);
        let how = (Mode::Exact, Antialias::None);
        let drawn = stage.draw(&camera, how, &shape(&left));
        let (inside, wrong) = misclassified(&drawn, &truth);
        most = most.max(100 * wrong / inside);
    }
    assert!(most > 10, "{most} % at most");
}

#[test]
fn smooth_edges_cover_as_much_as_those_of_the_mesh() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    for camera in stage.cameras() {
        let truth = stage.draw(
            &camera,
            (Mode::Original, Antialias::Msaa),
            &ClipShape::EMPTY,
        );
        let loops = stage.loops(&camera);
        let edges = silhouette_edges(&stage.mesh, camera.eye);
        let outline = silmap_exact::Outliner::new(&stage.mesh.positions)
            .outline(&edges, &camera)
            .unwrap();
        let shape = ClipShape {
            outline: &outline,
            ..shape(&loops)
        };
        // Sample by sample the same; the ramp by distance rounds otherwise, but covers as much.
        let sampled = stage.draw(&camera, (Mode::Exact, Antialias::Msaa), &shape);
        let (inside, wrong) = misclassified(&sampled, &truth);
        assert!(
            wrong as f64 <= MISCLASSIFIED * inside as f64,
            "{wrong} of {inside}"
        );
        let soft = stage.draw(&camera, (Mode::Exact, Antialias::Soft), &shape);
        let none = stage.draw(&camera, (Mode::Exact, Antialias::None), &shape);
        let bias = |a: &[u8]| {
            let off: i64 = (a.iter().zip(&truth))
                .map(|(&a, &b)| i64::from(a) - i64::from(b))
                .sum();
            off as f64 / (255.0 * inside as f64)
        };
        assert!(bias(&soft).abs() < 0.002, "a bias of {}", bias(&soft));
        let far = |a: &[u8]| {
            (a.iter().zip(&truth))
                .filter(|(a, b)| a.abs_diff(**b) > 80)
                .count()
        };
        assert!(
            3 * far(&soft) < far(&none),
            "{} and {}",
            far(&soft),
            far(&none)
        );
    }
}

#[test]
fn loops_must_be_given() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let params = scene::frame(stage.cameras()[0], Mode::Exact, Antialias::None);
    let drawn = stage.renderer.render(&stage.gpu, &params);
    assert!(
        matches!(drawn, Err(RenderError::NoLoops { .. })),
        "{drawn:?}"
    );
}

/// More edges than the soft function of the outline can number: fans draw them, and it says so.
#[test]
fn an_outline_of_very_many_points_is_drawn_by_samples_or_refused() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let camera = stage.cameras()[0];
    let circle: Loop = (0..70_000)
        .map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 70_000.0))
        .map(|p| p * 100.0 + 200.0)
        .collect();
    let few: Loop = circle.iter().copied().step_by(100).collect();
    let (many, few) = ([circle], [few]);
    for antialias in [Antialias::None, Antialias::Msaa] {
        let how = (Mode::Exact, antialias);
        let drawn = stage.draw(&camera, how, &shape(&many));
        let wanted = stage.draw(&camera, how, &shape(&few));
        let (inside, wrong) = misclassified(&drawn, &wanted);
        assert!(inside > 5000 && wrong < 10, "{wrong} of {inside}");
    }
    let params = scene::frame(camera, Mode::Exact, Antialias::Soft);
    let refused = (stage.renderer).render_shape(&stage.gpu, &params, &shape(&many));
    assert!(
        matches!(
            refused,
            Err(RenderError::OutlineTooDetailed { points: 70_000 })
        ),
        "{refused:?}"
    );
}

/// More layers in front of each other than any model of these tests has: the count must not wrap to nothing.
#[test]
fn a_hundred_windings_are_inside() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let camera = stage.cameras()[0];
    let square: Loop = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        .map(|p| DVec2::from_array(p) * f64::from(SIDE_PX))
        .to_vec();
    let hull = stage.draw(&camera, (Mode::Coarse, Antialias::None), &ClipShape::EMPTY);
    for (count, is_inside) in [(1, true), (64, true), (255, true), (256, false)] {
        let loops = vec![square.clone(); count];
        let drawn = stage.draw(&camera, (Mode::Exact, Antialias::None), &shape(&loops));
        let (inside, wrong) = misclassified(&drawn, &hull);
        assert_eq!(
            wrong,
            if is_inside { 0 } else { inside },
            "{count} windings"
        );
    }
}
