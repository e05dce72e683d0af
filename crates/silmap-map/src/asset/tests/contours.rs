//! Contours of several parts as bits: small, whole, and not to be made to claim much.

use std::f64::consts::TAU;

use super::super::packing::Encoder;
use super::super::rounding::MapHeader;
use super::super::{contours, silhouettes};
use super::*;

/// Views about a wavy body: contours of so many vertices and two parts.
fn wavy_map(views: usize, vertices: usize) -> SilhouetteMap {
    let side = 512;
    let view = |v: usize| {
        let turn = TAU * v as f64 / views as f64;
        let eye = DVec3::new(turn.cos(), 0.3, turn.sin()) * 3.0;
        let contour = |part: u16| {
            let angles = (0..vertices).map(|k| TAU * k as f64 / vertices as f64);
            let wave = move |a: f64| (3.0 * a + turn).sin() + 0.3 * (11.0 * a).cos();
            let on_grid = |x: f64| (x * 16.0).round() / 16.0;
            let middle = DVec2::new(200.0 + 90.0 * f64::from(part), 256.0);
            let place = move |a: f64| middle + DVec2::from_angle(-a) * (100.0 + 20.0 * wave(a));
            ViewContour {
                part,
                points: (angles.clone())
                    .map(|a| place(a).to_array().map(on_grid).into())
                    .collect(),
                depths: angles.map(|a| 3.0 + 0.1 * wave(a)).collect(),
                levels: (0..vertices)
                    .map(|k| (k.trailing_zeros() as u8).min(ViewContour::COARSEST_LEVEL))
                    .collect(),
            }
        };
        CapturedView {
            camera: Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (side, side)).unwrap(),
            contours: vec![contour(0), contour(1)],
            photographed: None,
        }
    };
    SilhouetteMap {
        center: DVec3::ZERO,
        radius: 1.0,
        resolution_px: side,
        tolerance_px: 0.5,
        coverage: CoverageRule::Center,
        views: (0..views).map(view).collect(),
        triangles: Vec::new(),
    }
}

#[test]
fn contours_of_parts_take_less_than_whole_bytes_would() {
    let map = wavy_map(12, 256);
    let bits = contours::encode(&map).unwrap();
    let levels = super::super::levels::encode(&map).unwrap().unwrap();
    let bytes = silhouettes::encode(&map).unwrap().len() + levels.len();
    let share = bits.len() as f64 / bytes as f64;
    assert!(share < 0.6, "{share}");
    // Points are as exact as in whole bytes, depths to half a step.
    let back = contours::decode(&MapHeader::of(&map), &bits).unwrap();
    for (a, b) in map.views.iter().zip(&back.views) {
        for (a, b) in a.contours.iter().zip(&b.contours) {
            assert!(a.points == b.points && a.levels == b.levels && a.part == b.part);
            let off = a.depths.iter().zip(&b.depths).map(|(x, y)| (x - y).abs());
            assert!(off.fold(0.0, f64::max) <= 0.5 / 1024.0 + 1e-9);
        }
    }
}

#[test]
fn finer_captures_have_finer_depths() {
    let steps = [64, 512, 513, 1024, 2048, 4096].map(contours::depth_bits);
    assert_eq!(steps, [10, 10, 11, 11, 12, 12]);
}

proptest! {
    /// Whatever the bits are: nothing panics, what is let in can be written, and few bytes do not become many vertices.
    #[test]
    fn bits_are_not_believed(bits in prop_oneof![
        prop::collection::vec(any::<u8>(), 0..60),
        // The most probable bits at every step.
        prop::collection::vec(Just(0_u8), 0..60),
        prop::collection::vec(Just(255_u8), 0..60),
    ], has_levels: bool) {
        let mut map = wavy_map(2, 8);
        map.views.iter_mut().for_each(|view| view.contours.clear());
        let mut out = Encoder::default();
        out.count(2);
        for x in map.views.iter().flat_map(|view| view.camera.eye.to_array()) {
            out.double(x);
        }
        out.count(0);
        out.byte(10);
        out.byte(u8::from(has_levels));
        let mut bytes = out.finish();
        bytes.extend(&bits);
        if let Ok(read) = contours::decode(&MapHeader::of(&map), &bytes) {
            let contours = || read.views.iter().flat_map(|view| &view.contours);
            let vertices: usize = contours().map(|c| c.points.len()).sum();
            prop_assert!(vertices <= 200 * (bits.len() + 8), "{vertices} of {} bytes", bits.len());
            prop_assert!(contours::encode(&read).is_ok());
        }
    }
}
