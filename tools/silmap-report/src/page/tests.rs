//! The page and the numbers of a small report.

use silmap_geometry::{Camera, ColourImage, CoverageRule, Mask, TriangleMesh};
use silmap_map::{
    Asset, BuildRecord, CapturedView, CoarseHull, Placement, SilhouetteMap, TextureSet, ViewContour,
};
use silmap_measure::{
    ColourRow, Conditions, ContourTime, DirectionErrors, Measured, PolytopeLevel, StrayView,
    Straying, StrayingSummary, TextureFigures, TurntableFrame,
};

use super::*;

/// Views of nothing in particular from the corners of a tetrahedron.
fn asset() -> Asset {
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let view = |corner: [f64; 3]| {
        let eye = DVec3::from_array(corner) * 3.0;
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (64, 64)).unwrap();
        let points = [[20.0, 20.0], [44.0, 20.0], [44.0, 44.0], [20.0, 44.0]];
        CapturedView {
            camera,
            contours: vec![ViewContour {
                points: points.map(Into::into).to_vec(),
                depths: vec![eye.length(); 4],
                ..ViewContour::default()
            }],
            photographed: None,
        }
    };
    Asset {
        record: BuildRecord {
            model_faces: 69_674,
            captured_views: 1024,
            error_curve: vec![(1024, 0.001), (128, 0.01)],
            ..BuildRecord::default()
        },
        map: SilhouetteMap {
            center: [0.0; 3].into(),
            radius: 1.0,
            resolution_px: 64,
            tolerance_px: 0.5,
            coverage: CoverageRule::Center,
            views: corners.map(view).to_vec(),
            triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        },
        hull: CoarseHull::default(),
        textures: TextureSet::default(),
        placement: Placement::default(),
    }
}

/// A frame in two greys.
fn turntable_frame(value: u8) -> TurntableFrame {
    let plain = |value: u8| ColourImage {
        width: 8,
        height: 6,
        rgba: vec![value; 8 * 6 * 4],
    };
    TurntableFrame {
        model: plain(value),
        clipped: plain(value / 2),
    }
}

fn report<'a>(asset: &'a Asset, model: &'a TriangleMesh) -> Report<'a> {
    let sample = |method: &str, misclassified: f64| ErrorSample {
        method: method.to_owned(),
        eye: DVec3::new(0.0, 0.5, 4.0),
        misclassified,
        escaped: 0.002,
        straying: Some(Straying {
            mean_px: 0.5,
            p99_px: 4.0,
            largest_px: 12.3,
            place: glam::DVec2::new(20.0, 40.0),
            nearest: glam::DVec2::new(30.0, 40.0),
        }),
    };
    let camera = asset.map.views[0].camera;
    Report {
        title: "A <model> & more".to_owned(),
        asset,
        model,
        measured: Measured {
            bytes: vec![
                ("silhouettes".to_owned(), 12_345),
                ("whole file".to_owned(), 54_321),
            ],
            uniform_curve: Some(vec![(1024, 0.001), (128, 0.02)]),
            polytopes: vec![PolytopeLevel {
                label: "four views".to_owned(),
                eyes: asset.map.views.iter().map(|v| v.camera.eye).collect(),
                triangles: asset.map.triangles.clone(),
            }],
            places: vec![PlaceErrors {
                place: "polytope".to_owned(),
                description: "somewhere".to_owned(),
                viewpoints: 7,
                methods: vec![MethodErrors {
                    method: "tight".to_owned(),
                    misclassified: [0.0123, 0.01, 0.05],
                    escaped: [0.0001, 0.002],
                    straying: Some(StrayingSummary {
                        mean: 0.55,
                        p99_median: 4.5,
                        largest_median: 11.1,
                        largest_p90: 33.3,
                        largest: 77.7,
                    }),
                }],
                samples: vec![sample("tight", 0.0123), sample("tight", 0.05)],
            }],
            directions: vec![DirectionErrors {
                method: "tight".to_owned(),
                samples: vec![(DVec3::Z, 0.01), (DVec3::X, 0.04)],
            }],
            worst: vec![WorstView {
                sample: sample("tight", 0.05),
                camera,
                truth: Mask::new(64, 64),
                predicted: Mask::new(64, 64),
            }],
            strays: vec![StrayView {
                sample: sample("tight", 0.05),
                camera,
                truth: Vec::new(),
                predicted: Vec::new(),
                drawn: None,
            }],
            turntable: [90, 200].map(turntable_frame).to_vec(),
            textures: Some(TextureFigures {
                atlas_share: 0.0123,
                discontinuities: vec![("closest-point".to_owned(), 6.54)],
                colours: vec![ColourRow {
                    paint: "blended".to_owned(),
                    mean: [1.0, 3.21, 2.0],
                    worst: 4.56,
                }],
                ..TextureFigures::default()
            }),
            contour_times: vec![ContourTime {
                method: "tight".to_owned(),
                median: 0.000_25,
                most: 0.0005,
                calls: 9,
            }],
            conditions: Conditions {
                machine: "a machine".to_owned(),
                threads: 2,
                ..Conditions::default()
            },
        },
        seconds: vec![("capture".to_owned(), 1.5)],
        rows: vec![PictureRow {
            caption: "from the left".to_owned(),
            pictures: vec![Picture {
                label: "clipped".to_owned(),
                image: ColourImage {
                    width: 1,
                    height: 1,
                    rgba: vec![1, 2, 3, 255],
                },
            }],
        }],
        scenes: Vec::new(),
        comparison: None,
        notes: vec!["A note.".to_owned()],
    }
}

#[test]
fn the_page_holds_what_it_was_given() {
    let (asset, model) = (asset(), TriangleMesh::default());
    let html = crate::html(&report(&asset, &model));
    for part in [
        "A &lt;model&gt; &amp; more",
        "69,674",
        "12,345",
        "1.50",
        "from the left",
        "data:image/png;base64,",
        "1.230",
        "0.010",
        "A note.",
        "a machine",
        "0.250",
        "spread evenly",
        "four views",
        "Simplification curve",
        "Error by direction, method tight",
        "A contour in space",
        "Epipolar lines of view",
        "halfway",
        "eye 0,0.5,4",
        "How far the outline strays",
        "33.3",
        "11.1 px",
        "six times closer: 12.3 px",
        "for want of a graphics adapter",
        "All around",
        "<source media=\"(prefers-reduced-motion: reduce)\" srcset=\"data:image/webp;base64,",
        "width=\"24\" height=\"6\" src=\"data:image/webp;base64,",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
}

#[test]
fn the_page_loads_nothing() {
    let (asset, model) = (asset(), TriangleMesh::default());
    let html = crate::html(&report(&asset, &model));
    for start in ["src=\"", "srcset=\"", "href=\"", "url("] {
        for (at, _) in html.match_indices(start) {
            let address = &html[at + start.len()..];
            let is_inside = address.starts_with("data:") || address.starts_with('#');
            assert!(is_inside, "{}", &address[..address.len().min(60)]);
        }
    }
    for word in ["http:", "https:", "@import", "<script", "<link", "NaN"] {
        assert!(!html.contains(word), "{word} is in the page");
    }
}

#[test]
fn an_asset_of_which_little_is_known_has_a_page_too() {
    let (mut asset, model) = (asset(), TriangleMesh::default());
    asset.record.error_curve.clear();
    for view in &mut asset.map.views {
        view.contours.iter_mut().for_each(|c| c.depths.clear());
    }
    let mut little = report(&asset, &model);
    little.measured.uniform_curve = None;
    little.measured.places.clear();
    little.measured.directions.clear();
    little.measured.worst.clear();
    little.measured.strays.clear();
    little.measured.turntable.clear();
    little.measured.contour_times.clear();
    little.measured.polytopes.clear();
    let html = crate::html(&little);
    assert!(
        html.contains("Sizes")
            && !html.contains("Worst")
            && !html.contains("stray")
            && !html.contains("All around")
            && !html.contains("in space")
    );
}

#[test]
fn numbers_are_those_of_the_report() {
    let (asset, model) = (asset(), TriangleMesh::default());
    let text = crate::json(&report(&asset, &model));
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (pointer, value) in [
        ("/places/polytope/methods/tight/misclassified_mean", 0.0123),
        ("/places/polytope/per_viewpoint/1/misclassified", 0.05),
        (
            "/places/polytope/methods/tight/deviation_px/largest_p90",
            33.3,
        ),
        (
            "/places/polytope/per_viewpoint/1/deviation_px/largest",
            12.3,
        ),
        ("/bytes/silhouettes", 12_345.0),
        ("/curve/uniform/1/1", 0.02),
        ("/contours/vertices_median", 4.0),
        ("/contours/vertices_total", 16.0),
        ("/seconds/contour/tight/median", 0.000_25),
    ] {
        let found = json.pointer(pointer).and_then(serde_json::Value::as_f64);
        assert_eq!(found, Some(value), "{pointer} in {text}");
    }
}

#[test]
fn numbers_are_written_for_people() {
    assert_eq!(
        [0.0, 3.0, 1234.5, 0.012_344, -0.5, 120_000.0].map(significant),
        ["0", "3", "1234", "0.01234", "-0.5", "120000"]
    );
    assert_eq!(
        [7, 1000, 1_234_567].map(grouped),
        ["7", "1,000", "1,234,567"]
    );
}

#[test]
fn figures_of_textures_are_on_the_page_and_among_the_numbers() {
    let (asset, model) = (asset(), TriangleMesh::default());
    let mut report = report(&asset, &model);
    let html = page(&report).into_string();
    for text in ["1.23 %", "6.54", "3.21", "4.56", "closest-point"] {
        assert!(html.contains(text), "{text}");
    }
    let numbers = crate::numbers::numbers(&report);
    let at = |pointer: &str| numbers.pointer(pointer).and_then(|v| v.as_f64());
    assert_eq!(at("/textures/atlas_share"), Some(0.0123));
    assert_eq!(
        at("/textures/colour_difference/blended/largest_channel"),
        Some(3.21)
    );
    report.measured.textures = None;
    assert!(!page(&report).into_string().contains("Textures"));
}
