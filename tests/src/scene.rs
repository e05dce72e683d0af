//! A small asset made by hand: a torus, a blown-up coarse torus for its hull, pictures of it for paint, and its outlines
//! from an unsimplified sphere of views.

use glam::DVec3;

use silmap_geometry::Watch;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Bounds, Bvh, Camera, ClosedMesh, ColourImage, CoverageRule, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::{
    Asset, BuildRecord, CapturedView, CoarseHull, EncodedImage, Placement, SilhouetteMap,
    TextureSet, TextureView, ViewContour,
};
use silmap_models as models;
use silmap_preprocess::capture::{self, CaptureParams};
use silmap_preprocess::dense_map::{self, DenseMapParams};
use silmap_preprocess::simplify_contour::{SimplifyContourParams, simplify_contours};
use silmap_study::{
    Antialias, Background, EdgeParams, FrameParams, Mode, Paint, PictureOptions, PictureRenderer,
};

/// Faces of the model.
const MODEL_FACES: usize = 4096;
/// Faces of its hull.
const HULL_FACES: usize = 320;
/// How far the hull is pushed out, of the model's radius: more than its chords cut into the model.
const PUSH_REL: f64 = 0.09;
/// Side of the capture images and of the paint.
const CAPTURE_PX: u32 = 256;
/// Pixels by which the paint goes past the model's rim.
const PAINT_MARGIN_PX: u32 = 6;
/// Views of the map.
const MAP_VIEWS: u32 = 96;
/// Pictures for paint.
const PAINT_VIEWS: u32 = 13;
/// Distance of all views from the middle, in radii.
const VIEW_DISTANCE_REL: f64 = 3.0;
/// Cosine under which a view is too flat to paint a face.
const LEAST_COSINE: f64 = 0.2;
/// How far before a point the model may be hit for the point to be seen still, in radii.
const HIDDEN_SLACK_REL: f64 = 0.05;

/// The model: a torus that is red on one side and green on the other, so that a mistaken texture view shows.
#[must_use]
pub fn model() -> TriangleMesh {
    let mut mesh = models::torus(MODEL_FACES);
    let radius = mesh.bounds().radius;
    mesh.appearance.corner_colours = mesh
        .faces
        .iter()
        .map(|face| {
            face.map(|v| {
                let p = mesh.positions[v as usize] / radius;
                [
                    0.45 + 0.4 * p.x as f32,
                    0.45 - 0.4 * p.x as f32,
                    0.3 + 0.2 * p.y as f32,
                ]
            })
        })
        .collect();
    mesh
}

/// A camera about the model.
///
/// # Panics
/// When the direction is zero or the model empty.
#[must_use]
pub fn camera(bounds: &Bounds, direction: DVec3, distance_rel: f64, side_px: u32) -> Camera {
    let eye = bounds.center + direction.normalize_or_zero() * bounds.radius * distance_rel;
    Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (side_px, side_px))
        .expect("the eye is outside")
}

/// A frame's parameters.
#[must_use]
pub fn frame(camera: Camera, mode: Mode, antialias: Antialias) -> FrameParams {
    FrameParams {
        camera,
        mode,
        method: silmap_map::Method::Hull,
        paint: Paint::default(),
        antialias,
        background: Background::Colour([255; 3]),
        edges: EdgeParams::default(),
        light: None,
        shadow: None,
    }
}

/// The asset of [`model`], painted by this device.
///
/// # Panics
/// When the device fails or the model cannot be captured.
#[must_use]
pub fn asset(gpu: &Gpu) -> Asset {
    let mesh = model();
    let bounds = mesh.bounds();
    let hull = hull();
    let textures = textures(gpu, &mesh, &hull);
    Asset {
        record: BuildRecord::default(),
        map: map(&mesh, &bounds),
        hull,
        textures,
        placement: Placement::default(),
    }
}

/// A coarse torus pushed outwards.
#[must_use]
pub fn hull() -> CoarseHull {
    let coarse = models::torus(HULL_FACES);
    let push = coarse.bounds().radius * PUSH_REL;
    let single = |p: DVec3| p.as_vec3().to_array();
    let normals = coarse.vertex_normals();
    CoarseHull {
        positions: (coarse.positions.iter().zip(&normals))
            .map(|(&p, &n)| single(p + n * push))
            .collect(),
        faces: coarse.faces.clone(),
        surface_points: coarse.positions.iter().map(|&p| single(p)).collect(),
        volume_ratio: 1.5,
    }
}

fn textures(gpu: &Gpu, mesh: &TriangleMesh, hull: &CoarseHull) -> TextureSet {
    let bounds = mesh.bounds();
    let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
    renderer.load_model(gpu, mesh).expect("the model fits");
    let distance = bounds.radius * VIEW_DISTANCE_REL;
    let views: Vec<TextureView> = capture::view_sphere(&bounds, distance, PAINT_VIEWS, CAPTURE_PX)
        .expect("the sphere is larger than the model")
        .into_iter()
        .map(|camera| {
            let params = FrameParams {
                background: Background::Transparent,
                ..frame(camera, Mode::Original, Antialias::None)
            };
            let mut picture = renderer.render(gpu, &params).expect("the device draws");
            spread_colours(&mut picture);
            TextureView {
                camera,
                image: png(&picture),
            }
        })
        .collect();
    let bvh = Bvh::new(mesh);
    let slack = bounds.radius * HIDDEN_SLACK_REL;
    let visible_views = hull
        .faces
        .iter()
        .map(|face| {
            let corners = face.map(|v| point(hull.surface_points[v as usize]));
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let middle = (a + b + c) / 3.0;
            (0..).zip(&views).fold(0, |bits, (k, view)| {
                let eye = view.camera.eye;
                let cosine = (eye - middle).normalize_or_zero().dot(normal);
                let is_seen = |p: DVec3| {
                    let way = p - eye;
                    let end = 1.0 - slack / way.length();
                    bvh.first_hit(eye, way, 0.0, end).is_none()
                };
                let is_visible = cosine > LEAST_COSINE && corners.into_iter().all(is_seen);
                bits | u64::from(is_visible) << k
            })
        })
        .collect();
    TextureSet {
        views,
        visible_views,
        atlas: None,
        relief: None,
    }
}

/// Gives empty pixels near the model the mean colour of their neighbours, so that no background shows at its rim.
fn spread_colours(picture: &mut ColourImage) {
    let (width, height) = (i64::from(picture.width), i64::from(picture.height));
    for _ in 0..PAINT_MARGIN_PX {
        let before = picture.rgba.clone();
        let at = |x: i64, y: i64| {
            let inside = (0..width).contains(&x) && (0..height).contains(&y);
            inside.then(|| &before[4 * (y * width + x) as usize..][..4])
        };
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0_u32; 4];
                for k in 0..9 {
                    if let Some(near) = at(x + k % 3 - 1, y + k / 3 - 1).filter(|p| p[3] > 0) {
                        (0..3).for_each(|c| sum[c] += u32::from(near[c]));
                        sum[3] += 1;
                    }
                }
                let pixel = &mut picture.rgba[4 * (y * width + x) as usize..][..4];
                if pixel[3] == 0 && sum[3] > 0 {
                    (0..3).for_each(|c| pixel[c] = (sum[c] / sum[3]) as u8);
                    pixel[3] = 255;
                }
            }
        }
    }
}

/// The outlines of [`model`] from a sphere of views.
///
/// # Panics
/// When the model cannot be captured.
#[must_use]
pub fn outlines() -> SilhouetteMap {
    let mesh = model();
    map(&mesh, &mesh.bounds())
}

fn map(mesh: &TriangleMesh, bounds: &Bounds) -> SilhouetteMap {
    let distance = bounds.radius * VIEW_DISTANCE_REL;
    let cameras = capture::view_sphere(bounds, distance, MAP_VIEWS, CAPTURE_PX)
        .expect("the sphere is larger than the model");
    let closed = ClosedMesh::try_from(mesh.clone()).expect("the model is closed");
    let masks = capture::capture(
        &closed,
        &cameras,
        &CaptureParams::default(),
        &Watch::silent(),
    )
    .expect("the model is in view");
    let tolerance_px = 0.5;
    let params = SimplifyContourParams {
        tolerance_px,
        outward_only: false,
    };
    let views = cameras
        .into_iter()
        .zip(&masks)
        .map(|(camera, mask)| CapturedView {
            camera,
            contours: simplify_contours(&trace_contours(mask), &params)
                .into_iter()
                .map(|points| ViewContour {
                    points,
                    depths: Vec::new(),
                    ..ViewContour::default()
                })
                .collect(),
            photographed: None,
        })
        .collect();
    let params = DenseMapParams {
        center: bounds.center,
        radius: bounds.radius,
        resolution_px: CAPTURE_PX,
        tolerance_px,
        coverage: CoverageRule::Center,
    };
    dense_map::build(views, &params).expect("the views surround the model")
}

fn point(p: [f32; 3]) -> DVec3 {
    DVec3::new(p[0].into(), p[1].into(), p[2].into())
}

/// A picture as a PNG file.
///
/// # Panics
/// When the picture has not the pixels that it says.
#[must_use]
pub fn png(picture: &ColourImage) -> EncodedImage {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(picture.width, picture.height, picture.rgba.clone())
        .expect("four bytes a pixel")
        .write_to(&mut bytes, image::ImageFormat::Png)
        .expect("memory takes everything");
    EncodedImage {
        mime_type: "image/png".to_owned(),
        bytes: bytes.into_inner(),
    }
}
