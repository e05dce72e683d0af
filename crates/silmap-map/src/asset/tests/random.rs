//! Random assets, with numbers that hurt.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use silmap_geometry::{Camera, CoverageRule};

use super::super::*;
use crate::{CapturedView, ViewContour};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nnot really";
const JPEG: &[u8] = b"\xff\xd8\xffnot really";

pub(super) fn picture(is_png: bool, tail: u8) -> EncodedImage {
    let (mime_type, start) = match is_png {
        true => ("image/png", PNG),
        false => ("image/jpeg", JPEG),
    };
    let mut bytes = start.to_vec();
    bytes.push(tail);
    EncodedImage {
        mime_type: mime_type.into(),
        bytes,
    }
}

/// Coordinates that hurt: whole pixels, sixteenths, halves of sixteenths, far outside, huge.
fn any_coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => (-8_i32..520).prop_map(f64::from),
        4 => (-128_i32..9000).prop_map(|q| f64::from(q) / 16.0),
        2 => (0_i32..16_384).prop_map(|q| f64::from(q) / 32.0),
        2 => -10.0..600.0_f64,
        1 => -1e9..1e9_f64,
    ]
}

fn any_contour() -> impl Strategy<Value = ViewContour> {
    let vertex = (
        any_coordinate(),
        any_coordinate(),
        -3.0..12.0_f64,
        0..=ViewContour::COARSEST_LEVEL,
    );
    (
        prop::collection::vec(vertex, 0..20),
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(|(vertices, has_depth, has_levels)| ViewContour {
            part: 0,
            points: vertices.iter().map(|v| DVec2::new(v.0, v.1)).collect(),
            depths: match has_depth {
                true => vertices.iter().map(|v| v.2).collect(),
                false => Vec::new(),
            },
            // Three vertices are there at any level.
            levels: vertices
                .iter()
                .enumerate()
                .filter(|_| has_levels)
                .map(|(k, v)| {
                    if k < 3 {
                        ViewContour::COARSEST_LEVEL
                    } else {
                        v.3
                    }
                })
                .collect(),
        })
}

prop_compose! {
    fn any_map()(
        center in prop::array::uniform3(-100.0..100.0_f64),
        radius in prop_oneof![Just(1.0), 1e-6..1e6_f64],
        resolution_px in 1_u32..2000,
        any_coverage: bool,
        part_step in 0_u16..100,
        is_of_photographs: bool,
        tolerance_px in 0.0..2.0_f64,
        views in prop::collection::vec(
            (prop::array::uniform3(-1.0..1.0_f64), prop::collection::vec(any_contour(), 0..6), 0_u32..=1000),
            0..8,
        ),
        triangles in prop::collection::vec(any::<[u32; 3]>(), 0..10),
    ) -> SilhouetteMap {
        let center = DVec3::from_array(center);
        let views: Vec<_> = views
            .into_iter()
            .map(|(direction, mut contours, share)| {
                for (k, contour) in (0_u16..).zip(&mut contours) {
                    // Some have several contours, some none.
                    contour.part = k / 2 * part_step;
                }
                let direction = DVec3::from_array(direction).try_normalize().unwrap_or(DVec3::X);
                let eye = center + direction * (3.0 * radius);
                let size = (resolution_px, resolution_px);
                let camera = Camera::fit_sphere(eye, center, radius, None, size).unwrap();
                let photographed = is_of_photographs.then_some(f64::from(share) / 1000.0);
                CapturedView { camera, contours, photographed }
            })
            .collect();
        let count = views.len() as u32;
        SilhouetteMap {
            center,
            radius,
            resolution_px,
            tolerance_px,
            coverage: if any_coverage { CoverageRule::Any } else { CoverageRule::Center },
            triangles: match count {
                0 => Vec::new(),
                _ => triangles.into_iter().map(|t| t.map(|v| v % count)).collect(),
            },
            views,
        }
    }
}

prop_compose! {
    fn any_hull()(
        positions in prop::collection::vec(prop::array::uniform3(-4.0..4.0_f32), 1..20),
        faces in prop::collection::vec(any::<[u32; 3]>(), 1..20),
        has_points: bool,
        volume_ratio in 1.0..2.0_f64,
    ) -> CoarseHull {
        let count = positions.len() as u32;
        CoarseHull {
            faces: faces.into_iter().map(|f| f.map(|v| v % count)).collect(),
            surface_points: match has_points {
                true => positions.iter().map(|p| p.map(|x| x * 0.9)).collect(),
                false => Vec::new(),
            },
            positions,
            volume_ratio,
        }
    }
}

fn any_texture_view() -> impl Strategy<Value = TextureView> {
    (1_u32..2000, 1_u32..2000, any::<bool>(), any::<u8>()).prop_map(|(w, h, is_png, tail)| {
        let eye = DVec3::new(f64::from(tail) + 2.0, 1.0, 0.3);
        TextureView {
            camera: Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (w, h)).unwrap(),
            image: picture(is_png, tail),
        }
    })
}

prop_compose! {
    /// Removes the views of a map one by one, with numbers for errors that only have to survive.
    fn any_order(view_count: usize)(
        removed in Just((0..view_count as u32).collect::<Vec<_>>()).prop_shuffle(),
        length: prop::sample::Index,
        turned in prop::collection::vec(0_usize..3, view_count),
        shares in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), view_count + 1),
    ) -> CollapseOrder {
        let errors = |k: usize| CapturedErrors { mean: shares[k].0, max: shares[k].1 };
        let step_count = match view_count {
            0 | 1 => 0,
            _ => length.index(view_count),
        };
        let steps = (0..step_count).map(|k| {
            let left = &removed[k + 1..];
            CollapseStep {
                removed: removed[k],
                onto: left[k % left.len()],
                turned: vec![[left[0], left[left.len() - 1]]; turned[k]],
                errors: errors(k + 1),
            }
        });
        CollapseOrder { errors: errors(0), steps: steps.collect() }
    }
}

fn map_and_order() -> impl Strategy<Value = (SilhouetteMap, Option<CollapseOrder>)> {
    any_map().prop_flat_map(|map| {
        let order = any_order(map.views.len());
        (Just(map), proptest::option::of(order))
    })
}

prop_compose! {
    pub(super) fn any_asset()(
        (map, order) in map_and_order(),
        hull in any_hull(),
        views in prop::collection::vec(any_texture_view(), 0..12),
        has_bits: bool,
        bits: u64,
        uvs in proptest::option::of(prop::array::uniform2(0.0..1.0_f32)),
        name in ".{0,12}",
        options in "[\"\\\\a:]{0,12}|\"checksum\":\"00000000\"",
        numbers: (u64, u64, u32, u32),
        curves in prop::array::uniform2(prop::collection::vec((any::<u32>(), 0.0..1.0_f64), 0..5)),
    ) -> Asset {
        let [error_curve, uniform_curve] = curves;
        let face_count = hull.faces.len();
        let used = (1_u64 << views.len()) - 1;
        Asset {
            record: BuildRecord {
                name,
                model_faces: numbers.0,
                model_vertices: numbers.1,
                model_crc32: numbers.2,
                captured_views: numbers.3,
                error_curve,
                uniform_curve,
                order,
                generator: "silmap test".into(),
                params: match numbers.0 % 3 {
                    0 => serde_json::Value::Null,
                    n => serde_json::json!({ "aView": n, "b": 2.0, "images": [0.1, "x"] }),
                },
                options,
            },
            map,
            textures: TextureSet {
                visible_views: match has_bits {
                    true => (0..face_count as u32).map(|f| bits.rotate_left(f) & used).collect(),
                    false => Vec::new(),
                },
                relief: (numbers.1 % 2 == 1).then(|| Relief {
                    bits: 9,
                    width_px: 3,
                    height_px: 2,
                    views: views
                        .iter()
                        .map(|_| DepthPicture {
                            near: 0.5,
                            far: 2.0,
                            codes: vec![0, 511, 1, 7, 0, 300],
                        })
                        .collect(),
                }),
                views,
                atlas: uvs.map(|[u, v]| Atlas {
                    image: picture(true, 7),
                    normals: (numbers.0 % 2 == 1).then(|| picture(false, 9)),
                    size_px: [64, 32],
                    // Some corners share a coordinate, others do not.
                    corner_uvs: (0..face_count)
                        .map(|f| [[u, v], [v, u], [u, (f % 3) as f32]])
                        .collect(),
                }),
            },
            hull,
            placement: Placement {
                in_model: DVec3::splat(f64::from(numbers.3 % 3) * 1e6),
                in_scene: DVec3::new(f64::from(numbers.2 % 5) - 2.0, 0.1, 0.0),
            },
        }
    }
}
