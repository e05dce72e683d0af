//! Passes from lights. Depths that a light sees against rays, their outline against the full mesh seen by the light; and the shadow on the
//! ground against the exact one, the full mesh pressed flat along the light.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DQuat, DVec2, DVec3, Vec3};
use silmap_geometry::polygon::{fill_non_zero, signed_area};
use silmap_geometry::{Bounds, Bvh, Camera, CoverageRule, Mask, TriangleMesh};
use silmap_gpu::{Gpu, Readback, wgpu};
use silmap_map::{Asset, BoundingSphere, Method};
use silmap_preprocess::capture::cpu;
use silmap_runtime::{
    ClipBy, DepthDirection, DepthTarget, Instance, Outline, Renderer, RendererOptions,
    TargetFormats, Transform, View,
};
use silmap_study::{
    Antialias, Background, FrameParams, Mode, PictureOptions, PictureRenderer, RenderError,
    ShadowParams,
};
use silmap_tests::dense_maps::dense;
use silmap_tests::{device, scene};

const SIDE_PX: u32 = 300;

/// How far the shadow's edge may be from the exact one: a pixel for where centres fall, and what the outline is off.
const WITHIN_PX: f64 = 1.5;

/// Alpha over which a pixel counts as in the shadow: half of a full one.
const HALF_ALPHA: u8 = 64;

struct Stage {
    gpu: Gpu,
    asset: Asset,
    mesh: TriangleMesh,
    renderer: PictureRenderer,
    camera: Camera,
}

impl Stage {
    fn open() -> Option<Self> {
        let gpu = device::open_or_skip()?;
        let mesh = scene::model();
        let mut asset = scene::asset(&gpu);
        (asset.map, _) = dense(&mesh, 96, 256, 0.5, CoverageRule::Center);
        let mut renderer = PictureRenderer::new(&gpu, PictureOptions::default());
        renderer.load_asset(&gpu, &asset).unwrap();
        let bounds = mesh.bounds();
        let roomy = Bounds {
            radius: 2.0 * bounds.radius,
            ..bounds
        };
        let camera = scene::camera(&roomy, DVec3::new(0.3, 0.8, 1.0), 2.5, SIDE_PX);
        Some(Self {
            gpu,
            asset,
            mesh,
            renderer,
            camera,
        })
    }

    /// Alpha of a picture.
    fn alpha(&mut self, mode: Mode, shadow: Option<ShadowParams>) -> Vec<u8> {
        let params = FrameParams {
            background: Background::Transparent,
            method: Method::Tight,
            shadow,
            ..scene::frame(self.camera, mode, Antialias::None)
        };
        let picture = self.renderer.render(&self.gpu, &params).unwrap();
        picture.rgba.chunks_exact(4).map(|p| p[3]).collect()
    }

    /// Where the exact shadow lies.
    fn exact(&self, shadow: &ShadowParams) -> Mask {
        let (to_light, up) = (shadow.to_light, shadow.up.normalize_or_zero());
        let surface = self.asset.hull.surface_points.iter();
        let heights = surface.map(|&p| Vec3::from(p).as_dvec3().dot(up));
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let mut flat = self.mesh.clone();
        for p in &mut flat.positions {
            *p -= to_light * ((p.dot(up) - lowest) / to_light.dot(up));
        }
        let mut mask = Mask::new(SIDE_PX, SIDE_PX);
        cpu::rasterise(&flat, &self.camera, CoverageRule::Center, &mut mask).unwrap();
        mask
    }

    /// How far pixels of the shadow, or without it, are from where the exact one says so; and how many pixels the shadow has beside the
    /// object.
    fn worst_px(&mut self, mode: Mode, drawn: &ShadowParams, exact: &ShadowParams) -> (f64, usize) {
        let object = self.alpha(mode, None);
        let both = self.alpha(mode, Some(*drawn));
        let exact = self.exact(exact);
        let side = i64::from(SIDE_PX);
        let (mut worst, mut pixels) = (0.0_f64, 0);
        for (i, (&alone, &with_shadow)) in (0..).zip(object.iter().zip(&both)) {
            let (x, y) = (i % side, i / side);
            if alone > 0 {
                assert_eq!(alone, with_shadow, "the shadow is behind the object");
                continue;
            }
            let is_in = with_shadow > HALF_ALPHA;
            pixels += usize::from(is_in);
            if is_in != exact.get(x, y) {
                worst = worst.max(distance_to(&exact, (x, y), is_in));
            }
        }
        (worst, pixels)
    }
}

/// How far the nearest pixel inside, or outside, of a mask is; 20 where that is farther.
fn distance_to(mask: &Mask, (x, y): (i64, i64), is_in: bool) -> f64 {
    let near = (-20..=20).flat_map(|dy| (-20..=20).map(move |dx| (dx, dy)));
    let agreeing = near.filter(|&(dx, dy)| mask.get(x + dx, y + dy) == is_in);
    let distances = agreeing.map(|(dx, dy)| ((dx * dx + dy * dy) as f64).sqrt());
    distances.fold(20.0, f64::min)
}

/// Depths of an asset as a view sees them, drawn by a pass without colours.
fn depths(
    gpu: &Gpu,
    (asset, outline): (&Asset, Outline<'_>),
    how: &RendererOptions,
    view: &View,
) -> Vec<f32> {
    let mut renderer = Renderer::new(&gpu.device, how.clone()).unwrap();
    let loaded = renderer.load(&gpu.device, &gpu.queue, asset).unwrap();
    let instance = Instance {
        outline,
        ..Instance::new(&loaded, Transform::IDENTITY)
    };
    let stats = renderer.prepare(&gpu.device, &gpu.queue, view, &[instance]);
    assert_eq!(stats.unwrap().drawn, 1);
    let target = how.formats.depth.unwrap();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("depths"),
        size: wgpu::Extent3d {
            width: SIDE_PX,
            height: SIDE_PX,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: target.format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let attached = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &attached,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(nothing(target.direction)),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        renderer.draw(&mut pass);
    }
    let readback = Readback::new(gpu, (SIDE_PX, SIDE_PX), target.format).unwrap();
    let (bytes, _) = readback.start(gpu, encoder, &texture).wait(gpu).unwrap();
    bytes
        .chunks_exact(4)
        .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
        .collect()
}

/// The depth of nothing.
fn nothing(direction: DepthDirection) -> f32 {
    match direction {
        DepthDirection::Forward => 1.0,
        DepthDirection::Reversed => 0.0,
    }
}

/// What of the full mesh a view sees.
fn seen_by(view: &View, mesh: &TriangleMesh) -> Mask {
    let pixel = |p: &DVec3| {
        let seen = view.clip_from_world.project_point3(*p).truncate();
        (seen * DVec2::new(0.5, -0.5) + 0.5) * f64::from(SIDE_PX)
    };
    let pixels: Vec<DVec2> = mesh.positions.iter().map(pixel).collect();
    let faces = mesh.faces.iter().map(|face| {
        let mut corners = face.map(|v| pixels[v as usize]);
        if signed_area(&corners) < 0.0 {
            corners.reverse();
        }
        corners
    });
    let mut mask = Mask::new(SIDE_PX, SIDE_PX);
    fill_non_zero(faces, &mut mask);
    mask
}

#[test]
fn a_pass_without_colours_has_the_depths_that_a_light_sees() {
    let Some(stage) = Stage::open() else {
        return;
    };
    let (gpu, asset) = (&stage.gpu, &stage.asset);
    let point = |p: &[f32; 3]| Vec3::from(*p).as_dvec3();
    let hull = TriangleMesh {
        positions: asset.hull.positions.iter().map(point).collect(),
        faces: asset.hull.faces.clone(),
        ..TriangleMesh::default()
    };
    let bvh = Bvh::new(&hull);
    let bounds = hull.bounds();
    let sphere = BoundingSphere {
        center: bounds.center,
        radius: bounds.radius,
    };
    let to_light = DVec3::new(0.5, 1.0, 0.3);
    for direction in [DepthDirection::Forward, DepthDirection::Reversed] {
        let target = DepthTarget {
            format: wgpu::TextureFormat::Depth32Float,
            direction,
        };
        let how = RendererOptions {
            clip: ClipBy::Coverage,
            method: Some(Method::Tight),
            reuse_error_px: 0.0,
            ..RendererOptions::new(TargetFormats {
                colour: None,
                depth: Some(target),
                samples: 1,
            })
        };
        let place = sphere.center + to_light * 2.5 * sphere.radius;
        for view in [
            View::directional(to_light, sphere, SIDE_PX, direction),
            View::spot(place, sphere, SIDE_PX, direction),
        ] {
            let view = view.unwrap();
            let world_from_clip = view.clip_from_world.inverse();
            let drawn = depths(gpu, (asset, Outline::OfAsset), &how, &view);
            let exact = seen_by(&view, &stage.mesh);
            let (mut pixels, mut wrong_depths, mut worst) = (0, 0, 0.0_f64);
            for (i, &depth) in (0..).zip(&drawn) {
                let (x, y) = (i % i64::from(SIDE_PX), i / i64::from(SIDE_PX));
                let is_in = depth != nothing(direction);
                if is_in != exact.get(x, y) {
                    worst = worst.max(distance_to(&exact, (x, y), is_in));
                }
                if !is_in {
                    continue;
                }
                pixels += 1;
                let centre = (DVec2::new(x as f64, y as f64) + 0.5) / f64::from(SIDE_PX);
                let seen = centre * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
                let mut ends = [0.0, 1.0].map(|z| world_from_clip.project_point3(seen.extend(z)));
                if direction == DepthDirection::Reversed {
                    ends.reverse();
                }
                let [from, to] = ends;
                let hit = bvh.first_hit(from, to - from, 0.0, 1.0);
                let place = hit.map(|hit| from.lerp(to, hit.t));
                let wanted = place.map(|p| view.clip_from_world.project_point3(p).z);
                let is_right = wanted.is_some_and(|z| (z - f64::from(depth)).abs() < 1e-5);
                wrong_depths += usize::from(!is_right);
            }
            assert!(pixels > 10_000, "{pixels} pixels");
            // Pixels at edges of faces are seen by the one or the other.
            assert!(wrong_depths < pixels / 200, "{wrong_depths} of {pixels}");
            assert!(worst <= WITHIN_PX, "the outline is {worst} pixels off");
            // The whole hull is larger.
            let whole = depths(gpu, (asset, Outline::Whole), &how, &view);
            let far = (0..).zip(&whole).filter(|&(i, &depth)| {
                let (x, y) = (i % i64::from(SIDE_PX), i / i64::from(SIDE_PX));
                let is_in = depth != nothing(direction);
                is_in != exact.get(x, y) && distance_to(&exact, (x, y), is_in) > WITHIN_PX
            });
            assert!(far.count() > 100, "the whole hull passes");
        }
    }
}

#[test]
fn the_shadow_is_that_of_the_exact_silhouette_from_the_light() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let lights = [
        (DVec3::new(0.6, 1.0, -0.3), DVec3::Y),
        (DVec3::new(-8.0, 6.0, -3.0), DVec3::Y),
        (DVec3::new(0.4, 0.7, -0.6), DVec3::new(0.1, 2.0, 0.3)),
    ];
    for (to_light, up) in lights {
        let shadow = ShadowParams { to_light, up };
        let (off, pixels) = stage.worst_px(Mode::Clipped, &shadow, &shadow);
        eprintln!("light from {to_light}: {off} pixels off at most, {pixels} pixels");
        assert!(pixels > 2000, "hardly any shadow: {pixels} pixels");
        assert!(off <= WITHIN_PX, "{off} pixels off from {to_light}");
        // A light six degrees aside, and the shadow of the whole hull.
        let axis = to_light.normalize_or_zero().any_orthonormal_vector();
        let turn = DQuat::from_axis_angle(axis, 0.1);
        let aside = ShadowParams {
            to_light: turn * to_light,
            up,
        };
        let (aside_off, _) = stage.worst_px(Mode::Clipped, &aside, &shadow);
        assert!(aside_off > WITHIN_PX, "another light passes: {aside_off}");
        let (hull_off, _) = stage.worst_px(Mode::Textured, &shadow, &shadow);
        assert!(hull_off > WITHIN_PX, "the whole hull passes: {hull_off}");
    }
}

#[test]
fn from_below_the_ground_there_is_none_and_what_is_no_light_is_refused() {
    let Some(mut stage) = Stage::open() else {
        return;
    };
    let shadow = |to_light: DVec3| ShadowParams {
        to_light,
        up: DVec3::Y,
    };
    let above = stage.camera;
    let bounds = stage.mesh.bounds();
    stage.camera = scene::camera(&bounds, DVec3::new(0.3, -0.8, 1.0), 4.0, SIDE_PX);
    let object = stage.alpha(Mode::Clipped, None);
    assert_eq!(object, stage.alpha(Mode::Clipped, Some(shadow(DVec3::Y))));
    stage.camera = above;
    let mut refused = |mode: Mode, to_light: DVec3| {
        let params = FrameParams {
            light: None,
            shadow: Some(shadow(to_light)),
            ..scene::frame(above, mode, Antialias::Soft)
        };
        stage.renderer.render(&stage.gpu, &params).unwrap_err()
    };
    let below = refused(Mode::Clipped, DVec3::new(1.0, -0.1, 0.0));
    assert!(matches!(below, RenderError::LightBelowGround), "{below}");
    for nowhere in [DVec3::ZERO, DVec3::NAN] {
        let error = refused(Mode::Coarse, nowhere);
        assert!(matches!(error, RenderError::Light(_)), "{error}");
    }
    let error = refused(Mode::Silhouette, DVec3::Y);
    assert!(matches!(error, RenderError::NoShadow { .. }), "{error}");
}
