//! The real binary: what it prints and what it leaves on disk.
//!
//! Meshes are generated, small, and made once for all tests of this file.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;

use common::{
    SMALL_BUILD, check_fields, check_one_sentence, fixture, path, run, run_json, scratch,
};
use serde_json::Value;

#[test]
fn help_is_as_it_was() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let actual = root.join("target/image-tests/actual");
    let mut changed = Vec::new();
    for command in [
        "", "demo", "build", "attach", "render", "contour", "inspect", "evaluate", "report",
        "hull", "edges", "simplify", "align", "bench", "generate",
    ] {
        let arguments: Vec<&str> = [command, "--help"]
            .into_iter()
            .filter(|a| !a.is_empty())
            .collect();
        let ended = run(&arguments);
        assert_eq!(ended.code, 0, "{command}: {}", ended.err);
        assert!(ended.out.contains("Example"), "{command} shows no example");
        let name = match command {
            "" => "help.txt".to_owned(),
            _ => format!("help-{command}.txt"),
        };
        let expected = fs::read_to_string(root.join("tests/golden").join(&name));
        if expected.unwrap_or_default() != ended.out {
            fs::create_dir_all(&actual).unwrap();
            fs::write(actual.join(&name), &ended.out).unwrap();
            changed.push(name);
        }
    }
    assert!(
        changed.is_empty(),
        "the help has changed; when that is right: cargo xtask bless {}",
        changed.join(" ")
    );
}

#[test]
fn wrong_usage_ends_in_2() {
    let asset = path(&fixture().asset);
    for arguments in [
        &["build"][..],
        &["paint"],
        &["build", "m.ply", "-o", "o.glb", "--views", "0"],
        &[
            "build",
            "m.ply",
            "-o",
            "o.glb",
            "--keep",
            "9",
            "--max-error",
            "1%",
        ],
        &[
            "build", "m.ply", "-o", "o.glb", "--views", "100", "--keep", "101",
        ],
        &["build", "m.ply", "-o", "o.glb", "--max-error", "2"],
        &["build", "-o", "o.glb"],
        &["build", "--from", asset, "-o", "o.glb"],
        &[
            "build", "m.ply", "--from", asset, "-o", "o.glb", "--keep", "9",
        ],
        &[
            "build", "--from", asset, "-o", "o.glb", "--keep", "9", "--views", "64",
        ],
        &["build", "m.ply", "-o", "o.glb", "--tighten", "best"],
        &["contour", asset, "--eye", "1,2"],
        &["contour", asset, "--eye", "0,0,3", "--size", "0x5"],
        &["contour", asset, "--eye", "0,0,3", "--method", "exact"],
        &["contour", asset, "--eye", "0,0,3", "--detail", "7"],
        &["contour", asset],
        &["edges", "m.ply"],
        &["bench", "m.ply", "--repeat", "0"],
        &["bench", "m.ply", "--edges", "guess"],
        &["bench", "m.ply", "--pixels", "9", "--edges", "brute"],
        &["bench", "m.ply", "--pixels", "9", "--comparison"],
        &["bench", "m.ply", "--pixels", "9", "--size", "64x32"],
        &["bench", "m.ply", "--still"],
        &["edges", "m.ply", "--eye", "0,0,3", "--direction", "0,0,1"],
        &["edges", "m.ply", "--eye", "0,0,3", "--method", "guess"],
        &["edges", "m.ply", "--eye", "0,0,3", "--walk", "0"],
        &["edges", "m.ply", "--direction", "0,0,0"],
        &["edges", "m.ply", "--eye", "0,0,3", "--forest", "m.cones"],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--mode", "original",
        ],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--mode", "exact",
        ],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--light", "0,0,0",
        ],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--light", "1,inf,0",
        ],
        &[
            "render",
            asset,
            "--eye",
            "0,0,3",
            "-o",
            "o.png",
            "--light",
            "1,0,0",
            "--mode",
            "silhouette",
        ],
    ] {
        let ended = run(arguments);
        assert_eq!(ended.code, 2, "{arguments:?}: {}", ended.err);
        assert_eq!(ended.out, "", "{arguments:?}");
    }
}

#[test]
fn build_and_inspect_say_what_scripts_read() {
    let made = &fixture().build;
    check_fields(
        made,
        &[
            "out",
            "bytes",
            "seconds.load",
            "seconds.capture",
            "seconds.contours",
            "seconds.map",
            "seconds.hull",
            "seconds.textures",
            "seconds.write",
            "seconds.total",
            "views",
            "kept",
            "hull_faces",
            "volume_ratio",
            "hull_verified",
            "textures.seen_share",
            "textures.atlas_share",
            "textures.view_texels_per_radius",
            "textures.atlas_texels_per_radius",
            "textures.picture_bytes",
            "error.misclassified_mean",
            "error.misclassified_max",
            "warnings",
        ],
    );
    let asset = &fixture().asset;
    assert_eq!(made["bytes"], fs::metadata(asset).unwrap().len());
    assert!(made["volume_ratio"].as_f64().unwrap() > 1.0);

    let inspected = run_json(&["inspect", path(asset), "--full", "--json"]);
    check_fields(
        &inspected,
        &[
            "format_version",
            "model.name",
            "model.faces",
            "model.vertices",
            "model.center",
            "model.radius",
            "map.views",
            "map.triangles",
            "map.resolution",
            "map.contour_vertices_mean",
            "map.contour_vertices_max",
            "map.level_vertices_mean",
            "map.has_depth",
            "map.bytes",
            "map.fewest_views",
            "hull.faces",
            "hull.vertices",
            "hull.volume_ratio",
            "hull.bytes",
            "textures.views",
            "textures.size",
            "textures.atlas_size",
            "textures.bytes",
            "textures.merit",
            "textures.atlas_share",
            "bytes",
            "views.0.eye",
            "views.0.contour_vertices",
            "triangles.0",
            "error_curve",
            "order_curve.0.1",
            "uniform_curve",
        ],
    );
    assert_eq!(inspected["map"]["views"], made["kept"]);
    assert_eq!(inspected["hull"]["faces"], made["hull_faces"]);
    assert_eq!(inspected["bytes"], made["bytes"]);
    let views = inspected["views"].as_array().unwrap().len();
    assert_eq!(
        inspected["triangles"].as_array().unwrap().len(),
        2 * views - 4
    );
    assert_eq!(inspected["model"]["name"], "torus");

    let brief = run_json(&["inspect", path(asset), "--json"]);
    for long in [
        "views",
        "triangles",
        "error_curve",
        "order_curve",
        "uniform_curve",
    ] {
        assert!(brief.get(long).is_none(), "{long} without --full");
    }
    let told = run(&["inspect", path(asset)]);
    assert!(told.code == 0 && told.out.contains("hull"), "{}", told.out);
}

#[test]
fn the_curve_of_even_views_is_measured_when_it_is_asked_for() {
    let folder = scratch("uniform-curve");
    let (out, again) = (folder.join("with.glb"), folder.join("without.glb"));
    let mut arguments = vec!["build", path(&fixture().model), "-o", path(&out), "--json"];
    arguments.extend(SMALL_BUILD);
    arguments.push("--uniform-curve");
    run_json(&arguments);
    let curve = |asset: &Path| {
        let inspected = run_json(&["inspect", path(asset), "--full", "--json"]);
        inspected["uniform_curve"].as_array().unwrap().clone()
    };
    assert_eq!(curve(&fixture().asset), Vec::<Value>::new());
    let with = curve(&out);
    assert_eq!((with.len(), &with[0][0]), (1, &16.into()), "{with:?}");
    assert!(with[0][1].as_f64().unwrap() > 0.0, "{with:?}");
    // It is not among what an asset is built again by.
    let from = ["--params-from", path(&out), "-o", path(&again), "--json"];
    run_json(&[&["build", path(&fixture().model)][..], &from].concat());
    assert!(fs::read(&again).unwrap() == fs::read(&fixture().asset).unwrap());
}

#[test]
fn an_asset_loses_views_without_its_model() {
    let folder = scratch("from");
    let out = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let asset = path(&fixture().asset);
    let lower = |from: &str, goal: [&str; 2], to: &str| {
        run_json(&[
            "build", "--from", from, goal[0], goal[1], "-o", to, "--json",
        ])
    };
    let (half_way, two_steps, at_once) = (out("14.glb"), out("two.glb"), out("one.glb"));
    let made = lower(asset, ["--keep", "14"], &half_way);
    assert_eq!((&made["kept"], &made["views"]), (&14.into(), &64.into()));
    for (name, number) in [
        ("hull_faces", "hull_faces"),
        ("volume_ratio", "volume_ratio"),
    ] {
        assert_eq!(made[name], fixture().build[number]);
    }
    let error = |made: &Value| made["error"]["misclassified_mean"].as_f64().unwrap();
    assert!(error(&made) > error(&fixture().build));
    lower(&half_way, ["--keep", "10"], &two_steps);
    let fewer = lower(asset, ["--keep", "10"], &at_once);
    assert!(
        fs::read(&two_steps).unwrap() == fs::read(&at_once).unwrap(),
        "two steps down are not one"
    );
    assert!(fs::read(&half_way).unwrap() != fs::read(&at_once).unwrap());
    // The smaller asset is one like any other.
    let contour = run_json(&["contour", &at_once, "--eye", "1,2,4"]);
    assert!(!contour["loops"].as_array().unwrap().is_empty());

    let limit = error(&fewer).to_string();
    let by_error = lower(asset, ["--max-error", &limit], &out("error.glb"));
    assert!(by_error["kept"].as_u64().unwrap() <= 11, "{by_error}");

    for (goal, words) in [
        (["--keep", "21"], "it has 20 views"),
        (["--keep", "4"], "can go down to"),
        (["--max-error", "0.0001%"], "more than"),
    ] {
        let ended = run(&[
            "build",
            "--from",
            asset,
            goal[0],
            goal[1],
            "-o",
            &out("no.glb"),
        ]);
        check_one_sentence(&ended, words);
        assert!(
            ended.err.contains(words) && ended.err.contains(asset),
            "{}",
            ended.err
        );
        assert!(!folder.join("no.glb").exists());
    }
}

#[test]
fn both_ways_to_write_an_eye_give_the_same_contour() {
    let asset = path(&fixture().asset);
    let mut contours = [
        &["contour", asset, "--eye", "-1,0.5,-4"][..],
        &["contour", asset, "--eye=-1,0.5,-4"],
        &["contour", asset, "--eye=-1,0.5,-4", "--format", "json"],
    ]
    .map(run_json);
    for contour in &mut contours {
        check_fields(
            contour,
            &[
                "method",
                "camera.eye",
                "camera.target",
                "camera.up",
                "camera.fov_y_degrees",
                "camera.width",
                "camera.height",
                "triangle.2",
                "barycentric.2",
                "level",
                "loops.0.0.1",
                "seconds",
            ],
        );
        contour["seconds"] = Value::Null;
    }
    assert_eq!(contours[0], contours[1]);
    assert_eq!(contours[0], contours[2]);
    assert_eq!(
        contours[0]["camera"]["eye"],
        serde_json::json!([-1.0, 0.5, -4.0])
    );
    let sum: f64 = contours[0]["barycentric"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w.as_f64().unwrap())
        .sum();
    assert!((sum - 1.0).abs() < 1e-9);
}

#[test]
fn small_pictures_have_contours_of_less_detail() {
    let asset = path(&fixture().asset);
    let contour = |size: &str, more: &[&str]| {
        let options = ["contour", asset, "--eye", "1,2,4", "--size", size];
        run_json(&[&options, more].concat())
    };
    let vertices = |contour: &Value| -> usize {
        let loops = contour["loops"].as_array().unwrap();
        loops.iter().map(|l| l.as_array().unwrap().len()).sum()
    };
    let (large, small) = (contour("512x512", &[]), contour("8x8", &[]));
    assert_eq!(large["level"], 0);
    assert!(small["level"].as_u64().unwrap() > 1, "{}", small["level"]);
    // The same picture size with the finest and with the coarsest contours.
    let fine = contour("512x512", &["--detail", "0"]);
    let coarse = contour("512x512", &["--detail", "6"]);
    assert_eq!(fine["loops"], large["loops"]);
    assert_eq!(coarse["level"], 6);
    assert!(vertices(&coarse) < vertices(&fine));
    let inspected = run_json(&["inspect", asset, "--json"]);
    let means = inspected["map"]["level_vertices_mean"].as_array().unwrap();
    let means: Vec<f64> = means.iter().map(|n| n.as_f64().unwrap()).collect();
    assert_eq!(
        means[0],
        inspected["map"]["contour_vertices_mean"].as_f64().unwrap()
    );
    assert!(means.len() == 7 && means.is_sorted_by(|a, b| a >= b) && means[6] < means[0]);
}

#[test]
fn a_contour_is_also_a_drawing_and_a_mask() {
    let (asset, folder) = (path(&fixture().asset), scratch("contour"));
    let svg = run(&["contour", asset, "--eye", "1,3,2", "--format", "svg"]);
    assert!(
        svg.out.starts_with("<svg") && svg.out.contains("<path"),
        "{}",
        svg.out
    );
    let png = folder.join("mask.png");
    let ended = run(&[
        "contour",
        asset,
        "--eye",
        "1,3,2",
        "--format",
        "png",
        "--size",
        "90x60",
        "-o",
        path(&png),
    ]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let mask = image::open(&png).unwrap().to_luma8();
    assert_eq!(mask.dimensions(), (90, 60));
    let white = mask.pixels().filter(|p| p.0[0] == 255).count();
    assert!((300..4000).contains(&white), "{white} pixels are inside");
    assert_eq!(mask.get_pixel(0, 0).0[0], 0);
}

#[test]
fn evaluate_measures_textures() {
    let made = fixture();
    let mut arguments = vec!["evaluate", path(&made.asset), "--model", path(&made.model)];
    arguments.extend(["--viewpoints", "1", "--resolution", "96", "--textures", "2"]);
    arguments.push("--json");
    let ended = run(&arguments);
    // Without a graphics adapter it says so.
    if ended.code == 3 {
        return;
    }
    let found: Value = serde_json::from_str(&ended.out).unwrap();
    let textures = &found["textures"];
    assert_eq!(textures["viewpoints"], 2);
    for paint in ["blended", "nearest", "views", "tiles"] {
        let errors = &textures["colour_difference"][paint];
        let [mean, worst] =
            ["largest_channel", "worst_viewpoint"].map(|name| errors[name].as_f64().unwrap());
        assert!(
            0.0 < mean && mean <= worst && worst < 60.0,
            "{paint}: {errors}"
        );
    }
    for how in ["normal-shooting", "closest-point"] {
        let jumps = textures["discontinuities_per_1000"][how].as_f64();
        assert!(jumps.is_some_and(|j| (0.0..200.0).contains(&j)), "{how}");
    }
}

#[test]
fn evaluate_says_what_scripts_read() {
    let (asset, model) = (path(&fixture().asset), path(&fixture().model));
    for place in ["polytope", "sphere", "shell"] {
        let evaluation = run_json(&[
            "evaluate",
            asset,
            "--model",
            model,
            "--viewpoints",
            "5",
            "--where",
            place,
            "--resolution",
            "128",
            "--json",
        ]);
        assert_eq!(evaluation["viewpoints"], 5);
        assert_eq!(evaluation["where"], place);
        for method in ["paper", "hull", "tight"] {
            let row = &evaluation["methods"][method];
            check_fields(
                row,
                &[
                    "misclassified_mean",
                    "misclassified_median",
                    "misclassified_max",
                    "escaped_mean",
                    "escaped_max",
                    "deviation_px.mean",
                    "deviation_px.p99_median",
                ],
            );
            let off = |name: &str| row["deviation_px"][name].as_f64().unwrap();
            let rising = ["mean", "largest_median", "largest_p90", "largest"].map(off);
            assert!(
                rising.is_sorted() && rising[0] > 0.0 && rising[3] < 128.0,
                "{row}"
            );
            let mean = row["misclassified_mean"].as_f64().unwrap();
            assert!(mean > 0.0 && mean < 0.5, "{place}, {method}: {mean}");
        }
        let each = evaluation["per_viewpoint"].as_array().unwrap();
        assert_eq!(each.len(), 15);
        check_fields(&each[0], &["eye", "method", "misclassified", "escaped"]);
        let off = [
            "deviation_px.p99",
            "deviation_px.largest",
            "deviation_px.at.1",
        ];
        check_fields(&each[0], &off);
    }
    let one = run_json(&[
        "evaluate",
        asset,
        "--model",
        model,
        "--viewpoints",
        "2",
        "--method",
        "hull",
        "--json",
    ]);
    assert!(one["methods"].get("paper").is_none());
}

#[test]
fn another_model_than_the_assets_is_said() {
    let folder = scratch("another");
    let other = folder.join("knot.ply");
    assert_eq!(
        run(&[
            "generate",
            "trefoil-knot",
            "--faces",
            "800",
            "-o",
            path(&other)
        ])
        .code,
        0
    );
    let ended = run(&[
        "evaluate",
        path(&fixture().asset),
        "--model",
        path(&other),
        "--viewpoints",
        "1",
    ]);
    assert!(
        ended.err.contains("knot.ply: this is not the mesh"),
        "{}",
        ended.err
    );
    let same = run(&[
        "evaluate",
        path(&fixture().asset),
        "--model",
        path(&fixture().model),
        "--viewpoints",
        "1",
    ]);
    assert!(!same.err.contains("warning"), "{}", same.err);
}
