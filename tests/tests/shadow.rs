//! The shadow on the ground against the exact one: the full mesh pressed flat along the light, drawn by the processor.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DQuat, DVec3, Vec3};
use silmap_geometry::{Bounds, Camera, CoverageRule, Mask, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::{Asset, Method};
use silmap_preprocess::capture::cpu;
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
                let near = (-20..=20).flat_map(|dy| (-20..=20).map(move |dx| (dx, dy)));
                let agreeing = near.filter(|&(dx, dy)| exact.get(x + dx, y + dy) == is_in);
                let distances = agreeing.map(|(dx, dy)| ((dx * dx + dy * dy) as f64).sqrt());
                worst = worst.max(distances.fold(20.0, f64::min));
            }
        }
        (worst, pixels)
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
