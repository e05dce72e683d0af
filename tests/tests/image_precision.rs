//! Silhouette edges at image precision: how wide lines are along the exact outline, that they lie at silhouettes, and that
//! faces turned any way give the same lines by the item buffer.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec2, DVec3};
use silmap_exact::{Outliner, silhouette_edges};
use silmap_geometry::polygon::{self, fill_even_odd};
use silmap_geometry::{Camera, Loop, Mask, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_models::{self as models, ModelKind};
use silmap_study::{
    Antialias, Background, EdgeParams, EdgeStyle, FrameParams, Mode, PictureOptions,
    PictureRenderer, RenderError,
};
use silmap_tests::{device, scene};

/// StripSide of the pictures.
const SIDE_PX: u32 = 400;
/// Width asked for.
const WIDTH_PX: f64 = 5.0;
/// Length of outline over which one width is measured.
const BIN_PX: f64 = 20.0;

const STYLES: [EdgeStyle; 5] = [
    EdgeStyle::Equal,
    EdgeStyle::Wireframe,
    EdgeStyle::Translate,
    EdgeStyle::Fatten,
    EdgeStyle::Charcoal,
];

struct Stage {
    gpu: Gpu,
    renderer: PictureRenderer,
}

impl Stage {
    fn open(mesh: &TriangleMesh) -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
        renderer.load_edge_model(&gpu, mesh).unwrap();
        Some(Self { gpu, renderer })
    }

    /// Pixels that a line covers: drawn on and dark.
    fn ink(&mut self, camera: &Camera, style: EdgeStyle, by_item_buffer: bool) -> Mask {
        let params = FrameParams {
            background: Background::Transparent,
            edges: EdgeParams {
                width_px: WIDTH_PX as f32,
                by_item_buffer,
            },
            ..scene::frame(*camera, Mode::Edges(style), Antialias::None)
        };
        let picture = self.renderer.render(&self.gpu, &params).unwrap();
        let mut ink = Mask::new(SIDE_PX, SIDE_PX);
        for (i, pixel) in (0..).zip(picture.rgba.chunks(4)) {
            // Charcoal is as light as this where a face is seen edge-on.
            let darkest = if style == EdgeStyle::Charcoal { 87 } else { 60 };
            ink.set(
                i % SIDE_PX,
                i / SIDE_PX,
                pixel[3] > 127 && pixel[0] < darkest,
            );
        }
        ink
    }
}

fn cameras(mesh: &TriangleMesh) -> Vec<Camera> {
    [([0.3, 1.0, 0.2], 3.0), ([0.2, 0.3, 1.0], 5.0)]
        .map(|(d, distance)| scene::camera(&mesh.bounds(), DVec3::from_array(d), distance, SIDE_PX))
        .to_vec()
}

fn outline(mesh: &TriangleMesh, camera: &Camera) -> Vec<Loop> {
    let edges = silhouette_edges(mesh, camera.eye);
    let mut outliner = Outliner::new(&mesh.positions);
    outliner.outline(&edges, camera).unwrap()
}

/// The nearest place on the segments: distance, and which bin of the outline's length it is in.
fn nearest(segments: &[(DVec2, DVec2, f64)], p: DVec2) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0.0);
    for &(a, b, start) in segments {
        let along = b - a;
        let length = along.length();
        let s = ((p - a).dot(along) / (length * length).max(1e-30)).clamp(0.0, 1.0);
        let distance = p.distance(a + along * s);
        if distance < best.0 {
            best = (distance, start + s * length);
        }
    }
    (best.0, (best.1 / BIN_PX) as usize)
}

/// Which side of the outline is measured.
#[derive(Clone, Copy, PartialEq)]
enum StripSide {
    Outside,
    Inside,
}

/// Widths of the ink on one side of the outline, one for each stretch of it: its area over that of the strip that has the
/// width asked for, so that corners do not count as wider or narrower.
fn widths_along(loops: &[Loop], ink: &Mask, side: StripSide) -> Vec<f64> {
    let mut inside = Mask::new(SIDE_PX, SIDE_PX);
    fill_even_odd(loops, &mut inside);
    let mut segments = Vec::new();
    let mut total = 0.0;
    for (a, b) in loops.iter().flat_map(|l| polygon::edges(l)) {
        segments.push((a, b, total));
        total += a.distance(b);
    }
    let mut areas = vec![[0.0, 0.0]; (total / BIN_PX) as usize + 1];
    for (x, y) in (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y))) {
        if inside.get(x.into(), y.into()) == (side == StripSide::Outside) {
            continue;
        }
        let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let (distance, bin) = nearest(&segments, p);
        if ink.get(x.into(), y.into()) {
            areas[bin][0] += 1.0;
        }
        if distance < WIDTH_PX {
            areas[bin][1] += 1.0;
        }
    }
    // A stretch of a few pixels, at the end, says nothing.
    let full = areas.iter().filter(|[_, strip]| *strip > BIN_PX);
    full.map(|[ink, strip]| WIDTH_PX * ink / strip).collect()
}

fn farthest_from_width(widths: &[f64]) -> f64 {
    let off = widths.iter().map(|w| (w - WIDTH_PX).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn fattened_lines_are_equally_wide_along_the_outline_and_translated_ones_are_not() {
    let mut most_spread = 0.0_f64;
    for mesh in [scene::model(), models::generate(ModelKind::Organic, 8000)] {
        let Some(mut stage) = Stage::open(&mesh) else {
            return;
        };
        for camera in cameras(&mesh) {
            let loops = outline(&mesh, &camera);
            let ink = stage.ink(&camera, EdgeStyle::Fatten, false);
            let fat = widths_along(&loops, &ink, StripSide::Outside);
            assert!(fat.len() > 40, "{} stretches", fat.len());
            let off = farthest_from_width(&fat);
            let count = fat.len();
            eprintln!("fattened: {off:.3} px off at most over {count} stretches");
            assert!(off <= 0.5, "{off} px off: {fat:?}");
            // Translated lines lie inside, thin in some places and wide in others.
            let ink = stage.ink(&camera, EdgeStyle::Translate, false);
            let translated = widths_along(&loops, &ink, StripSide::Inside);
            let off = farthest_from_width(&translated);
            assert!(off > 1.0, "translated: {off} px");
            most_spread = most_spread.max(spread(&translated));
        }
    }
    eprintln!("translated: widths differ by {most_spread:.2} px");
    assert!(
        most_spread > 1.0,
        "translated lines are as even: {most_spread} px"
    );
}

fn spread(widths: &[f64]) -> f64 {
    let high = widths.iter().copied().fold(0.0, f64::max);
    let drawn = widths.iter().copied().filter(|w| *w > 0.0);
    high - drawn.fold(f64::INFINITY, f64::min)
}

#[test]
fn every_style_draws_at_silhouettes_and_nowhere_else() {
    let mesh = scene::model();
    let Some(mut stage) = Stage::open(&mesh) else {
        return;
    };
    for camera in cameras(&mesh) {
        let edges: Vec<(DVec2, DVec2, f64)> = silhouette_edges(&mesh, camera.eye)
            .iter()
            .map(|e| {
                let [a, b] =
                    [e.from, e.to].map(|v| camera.image_from_object(mesh.positions[v as usize]));
                (a, b, 0.0)
            })
            .collect();
        for style in STYLES {
            let ink = stage.ink(&camera, style, false);
            let mut far = 0;
            for (x, y) in (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y))) {
                if ink.get(x.into(), y.into()) {
                    let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    // Charcoal strokes follow grazing faces some way inside.
                    let reach = WIDTH_PX
                        + if style == EdgeStyle::Charcoal {
                            6.0
                        } else {
                            1.0
                        };
                    far += u32::from(nearest(&edges, p).0 > reach);
                }
            }
            let count = ink.count();
            assert!(count > 300, "{style:?}: {count} pixels of line");
            assert!(
                far * 50 < count as u32,
                "{style:?}: {far} of {count} are elsewhere"
            );
        }
    }
}

/// Share of the pixels of either mask that only one has.
fn disagreement(a: &Mask, b: &Mask) -> f64 {
    a.count_different(b) as f64 / a.count().max(b.count()) as f64
}

#[test]
fn by_item_buffer_the_orientation_of_faces_does_not_matter() {
    let mesh = scene::model();
    let mut soup = mesh.clone();
    for face in soup.faces.iter_mut().step_by(3) {
        face.swap(0, 1);
    }
    let (Some(mut stage), Some(mut of_soup)) = (Stage::open(&mesh), Stage::open(&soup)) else {
        return;
    };
    for camera in cameras(&mesh) {
        for style in [EdgeStyle::Wireframe, EdgeStyle::Fatten] {
            let wanted = stage.ink(&camera, style, false);
            let found = of_soup.ink(&camera, style, true);
            let off = disagreement(&wanted, &found);
            assert!(off < 0.1, "{style:?}: {off}");
            let by_orientation = of_soup.ink(&camera, style, false);
            let off = disagreement(&wanted, &by_orientation);
            assert!(
                off > 0.5,
                "{style:?}: turned faces pass by orientation: {off}"
            );
        }
    }
}

#[test]
fn an_item_buffer_frame_cannot_be_recorded_unprepared() {
    let mesh = scene::model();
    let Some(mut stage) = Stage::open(&mesh) else {
        return;
    };
    let params = FrameParams {
        edges: EdgeParams {
            by_item_buffer: true,
            ..EdgeParams::default()
        },
        ..scene::frame(
            cameras(&mesh)[0],
            Mode::Edges(EdgeStyle::Fatten),
            Antialias::None,
        )
    };
    let format = PictureOptions::default().target_format;
    let texture = device::target(&stage.gpu, format, SIDE_PX);
    let view = texture.create_view(&silmap_gpu::wgpu::TextureViewDescriptor::default());
    let mut encoder = (stage.gpu.device)
        .create_command_encoder(&silmap_gpu::wgpu::CommandEncoderDescriptor::default());
    let mut record = |stage: &mut Stage, params: &FrameParams| {
        stage
            .renderer
            .record(&stage.gpu, &mut encoder, &view, params)
    };
    let refused = record(&mut stage, &params);
    assert!(
        matches!(refused, Err(RenderError::NoNearestFaces)),
        "{refused:?}"
    );
    stage.renderer.render(&stage.gpu, &params).unwrap();
    record(&mut stage, &params).unwrap();
}
