//! Moved lights: a hull that is lit anew is as bright as the full mesh by the same light, whatever it is painted with and wherever the
//! eye is.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::OnceLock;

use glam::{DMat4, DQuat, DVec3};
use silmap_geometry::{Camera, ClosedMesh, ColourImage, Watch};
use silmap_gpu::Gpu;
use silmap_map::Asset;
use silmap_models as models;
use silmap_preprocess::capture::Backend;
use silmap_preprocess::pipeline::{BuildParams, build};
use silmap_runtime::{DepthDirection, Instance, Paint, PrepareError, Transform, View};
use silmap_study::{Antialias, FrameParams, Mode, PictureOptions, PictureRenderer, RenderError};
use silmap_tests::instances::{draw, outliers, renderer};
use silmap_tests::pass::view_of;
use silmap_tests::{device, scene, tolerance};

/// Side of the pictures.
const SIDE_PX: u32 = 192;

/// By how much a hull lit anew may differ from the full mesh, on average over the pixels that both cover: of 255.
const AS_THE_MESH: f64 = 3.0;
/// As far, where colours or normals lie on the hull and not on the model.
const ON_THE_HULL: f64 = 6.0;

/// A torus in one colour, and its asset.
fn torus() -> &'static (ClosedMesh, Asset) {
    static TORUS: OnceLock<(ClosedMesh, Asset)> = OnceLock::new();
    TORUS.get_or_init(|| {
        let mesh = ClosedMesh::try_from(models::torus(4000)).unwrap();
        let mut params = BuildParams {
            views: 64,
            resolution_px: 96,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        params.map.keep = 40;
        params.hull.target_faces = 200;
        params.textures.size_px = 192;
        params.textures.relief_px = 192;
        params.textures.atlas_px = 256;
        params.textures.candidates = 60;
        let (asset, _) = build(&mesh, "torus", &params, &Watch::silent()).unwrap();
        (mesh, asset)
    })
}

fn camera(asset: &Asset, k: u32) -> Camera {
    let t = f64::from(k);
    let direction = DVec3::new((2.3 * t).cos(), 0.9 * (1.7 * t).sin(), (2.3 * t).sin());
    let eye = asset.map.center + direction.normalize_or_zero() * 3.0 * asset.map.radius;
    let size = (SIDE_PX, SIDE_PX);
    Camera::fit_sphere(eye, asset.map.center, asset.map.radius, None, size).unwrap()
}

fn stage(gpu: &Gpu, asset: &Asset, relight: bool) -> PictureRenderer {
    let options = PictureOptions {
        relight,
        ..PictureOptions::default()
    };
    let mut stage = PictureRenderer::new(gpu, options);
    stage.load_asset(gpu, asset).unwrap();
    stage.load_model(gpu, torus().0.mesh()).unwrap();
    stage
}

fn frame(asset: &Asset, k: u32, mode: Mode, light: Option<DVec3>) -> FrameParams {
    FrameParams {
        light,
        background: silmap_study::Background::Transparent,
        ..scene::frame(camera(asset, k), mode, Antialias::None)
    }
}

/// Mean difference of the largest channel where both pictures show something, of 255.
fn apart(a: &ColourImage, b: &ColourImage) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in a.rgba.chunks(4).zip(b.rgba.chunks(4)) {
        if a[3] == 255 && b[3] == 255 {
            let largest = (0..3).map(|c| a[c].abs_diff(b[c])).max();
            sum += f64::from(largest.unwrap_or(0));
            count += 1.0;
        }
    }
    assert!(count > 2000.0, "{count} pixels are shown");
    sum / count
}

const LIGHTS: [DVec3; 3] = [
    DVec3::X,
    DVec3::new(-3.0, 1.0, 0.5),
    DVec3::new(0.1, 0.2, -0.1),
];

#[test]
fn a_hull_lit_anew_is_as_the_mesh_lit_so() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = torus();
    let mut stage = stage(&gpu, asset, true);
    let paints = [
        (Paint::Relief, AS_THE_MESH),
        (Paint::Blended, ON_THE_HULL),
        (Paint::Nearest, ON_THE_HULL),
        (Paint::Tiles, ON_THE_HULL),
    ];
    for light in LIGHTS {
        for k in 0..3 {
            let mut show = |mode, paint, light| {
                let params = frame(asset, k, mode, light);
                stage
                    .render(&gpu, &FrameParams { paint, ..params })
                    .unwrap()
            };
            let [wanted, opposite, studio] = [Some(light), Some(-light), None]
                .map(|light| show(Mode::Original, Paint::Relief, light));
            for (paint, most) in paints {
                let found = show(Mode::Clipped, paint, Some(light));
                let off = apart(&found, &wanted);
                let [from_opposite, from_studio] =
                    [&opposite, &studio].map(|other| apart(&found, other));
                eprintln!("{paint:?} {light} {k}: {off:.2}, {from_opposite:.1}, {from_studio:.1}");
                assert!(off < most, "{paint:?} by {light} from {k}: {off}");
                // Controls: other lights are something else.
                assert!(from_opposite > 4.0 * off && from_opposite > 25.0);
                assert!(from_studio > 2.0 * off, "{from_studio}");
            }
        }
    }
}

#[test]
fn light_of_its_own_stays_as_it_was() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = torus();
    let [mut with, mut without] = [true, false].map(|relight| stage(&gpu, asset, relight));
    for paint in [Paint::Relief, Paint::Blended, Paint::Tiles] {
        let params = FrameParams {
            paint,
            ..frame(asset, 1, Mode::Clipped, None)
        };
        let [a, b] = [&mut with, &mut without].map(|s| s.render(&gpu, &params).unwrap());
        assert!(a.rgba == b.rgba, "{paint:?}");
    }
}

#[test]
fn normals_of_the_atlas_stand_in_for_those_of_views() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = torus();
    let mut without = asset.clone();
    without.textures.relief = None;
    let mut stage_of_atlas = stage(&gpu, &without, true);
    let mut show = |mode| {
        let params = frame(asset, 1, mode, Some(DVec3::X));
        stage_of_atlas.render(&gpu, &params)
    };
    let [found, wanted] = [Mode::Clipped, Mode::Original].map(|mode| show(mode).unwrap());
    let off = apart(&found, &wanted);
    assert!(off < ON_THE_HULL, "{off}");
    // Without either there is no light to move, but for a hull that is not painted.
    without.textures.atlas.as_mut().unwrap().normals = None;
    let mut dark = stage(&gpu, &without, true);
    let mut unasked = stage(&gpu, asset, false);
    let lit = frame(asset, 1, Mode::Clipped, Some(DVec3::X));
    for stage in [&mut dark, &mut unasked] {
        let refused = stage.render(&gpu, &lit);
        assert!(matches!(refused, Err(RenderError::NotRelit)), "{refused:?}");
        stage
            .render(
                &gpu,
                &FrameParams {
                    mode: Mode::Coarse,
                    ..lit.clone()
                },
            )
            .unwrap();
    }
}

#[test]
fn a_turned_world_looks_the_same() {
    let Some(gpu) = device::open_or_skip() else {
        return;
    };
    let (_, asset) = torus();
    let mut renderer = renderer(&gpu, |options| options.relight = true);
    let loaded = renderer.load(&gpu.device, &gpu.queue, asset).unwrap();
    assert!(loaded.can_relight());
    let view = view_of(
        &camera(asset, 2),
        1.1 * asset.map.radius,
        DepthDirection::Forward,
    );
    let light = DVec3::new(1.0, 0.4, -0.2);
    let mut show = |turn: DQuat, light: DVec3| {
        let turned = View {
            clip_from_world: view.clip_from_world * DMat4::from_quat(turn.inverse()),
            ..view
        };
        let instance = Instance {
            light: Some(light),
            ..Instance::new(&loaded, Transform::new(1.0, turn, DVec3::ZERO).unwrap())
        };
        draw(&gpu, &mut renderer, &turned, &[instance])
    };
    let wanted = show(DQuat::IDENTITY, light);
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    let most = 4 * tolerance::STENCIL_FILL.max_outliers();
    let found = show(turn, 7.0 * (turn * light));
    assert!(outliers(&wanted, &found, 4) as u64 <= most as u64);
    // A control: a light that stays while the world turns.
    assert!(outliers(&wanted, &show(turn, light), 4) as u64 > 10 * most as u64);
    // What is no direction is refused.
    for light in [DVec3::ZERO, DVec3::NAN] {
        let instance = Instance {
            light: Some(light),
            ..Instance::new(&loaded, Transform::IDENTITY)
        };
        let refused = renderer.plan(&view, &[instance]);
        assert_eq!(refused.unwrap_err(), PrepareError::NoLight);
    }
}
