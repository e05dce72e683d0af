//! The real binary: what it prints, what it leaves on disk, and how it ends.
//!
//! Meshes are generated, small, and made once for all tests of this file.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{
    Ended, SMALL_BUILD, bare, check_fields, check_one_sentence, fixture, is_gpu_skipped, path, run,
    run_json, scratch,
};
use serde_json::Value;

/// The methods of `silmap edges`.
const EDGE_METHODS: &[&str; 8] = &[
    "brute",
    "brute-parallel",
    "list",
    "hash",
    "table",
    "cones",
    "jc",
    "dual",
];

#[test]
fn help_is_as_it_was() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let actual = root.join("target/image-tests/actual");
    let mut changed = Vec::new();
    for command in [
        "", "demo", "build", "render", "contour", "inspect", "evaluate", "report", "hull", "edges",
        "simplify", "align", "bench", "generate",
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
        &["edges", "m.ply", "--eye", "0,0,3", "--direction", "0,0,1"],
        &["edges", "m.ply", "--eye", "0,0,3", "--method", "guess"],
        &["edges", "m.ply", "--eye", "0,0,3", "--walk", "0"],
        &["edges", "m.ply", "--direction", "0,0,0"],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--mode", "original",
        ],
        &[
            "render", asset, "--eye", "0,0,3", "-o", "o.png", "--mode", "exact",
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
            "uniform_curve.0.1",
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
                ],
            );
            let mean = row["misclassified_mean"].as_f64().unwrap();
            assert!(mean > 0.0 && mean < 0.5, "{place}, {method}: {mean}");
        }
        let each = evaluation["per_viewpoint"].as_array().unwrap();
        assert_eq!(each.len(), 15);
        check_fields(&each[0], &["eye", "method", "misclassified", "escaped"]);
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

#[test]
fn every_method_finds_the_same_edges() {
    let model = path(&fixture().model);
    let mut lists = Vec::new();
    for viewpoint in ["--eye=-1,2,3.5", "--direction=-1,2,3.5"] {
        for method in EDGE_METHODS {
            let arguments = [
                "edges", model, viewpoint, "--method", method, "--list", "--json",
            ];
            let result = run_json(&arguments);
            check_fields(
                &result,
                &[
                    "method",
                    "silhouette_edges",
                    "tested_edges",
                    "visited_nodes",
                    "data_bytes",
                    "build_seconds",
                    "seconds_median",
                    "edges.0.1",
                    "vertices.0.2",
                ],
            );
            assert_eq!(result["method"], *method);
            let edges = result["edges"].as_array().unwrap().clone();
            assert_eq!(result["silhouette_edges"], edges.len());
            assert!(edges.len() > 20, "{method}: {}", edges.len());
            lists.push(edges);
        }
    }
    let (near, far) = lists.split_at(EDGE_METHODS.len());
    assert!(near.iter().all(|l| *l == near[0]));
    assert!(far.iter().all(|l| *l == far[0]));
    assert_ne!(near[0], far[0]);
}

#[test]
fn a_walk_of_edges_is_measured_and_the_last_ones_are_drawn() {
    let folder = scratch("edges-walk");
    let (model, svg) = (path(&fixture().model), folder.join("lines.svg"));
    let walk = |method: &str| {
        let result = run_json(&[
            "edges",
            model,
            "--eye=-1,2,3.5",
            "--method",
            method,
            "--walk",
            "20",
            "--repeat",
            "2",
            "--svg",
            path(&svg),
            "--json",
        ]);
        check_fields(
            &result,
            &[
                "walk.viewpoints",
                "walk.silhouette_edges_mean",
                "walk.tested_edges_mean",
                "walk.visited_nodes_mean",
            ],
        );
        let text = fs::read_to_string(&svg).unwrap();
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
        assert!(
            text.matches('Z').count() >= 2,
            "a torus has two loops or more"
        );
        (result["silhouette_edges"].clone(), text)
    };
    let drawn = EDGE_METHODS.map(walk);
    assert!(drawn.iter().all(|d| *d == drawn[0]));
    // Edges have a meaning within the model, pictures of it have none.
    let inside = ["edges", model, "--eye", "1,0,0"];
    assert_eq!(run(&inside).code, 0);
    let ended = run(&[&inside[..], &["--svg", path(&svg)]].concat());
    check_one_sentence(&ended, "a picture from within");
    assert!(ended.err.contains("--eye 1,0,0"), "{}", ended.err);
}

#[test]
fn pictures_have_the_size_asked_for_and_differ_by_mode() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, model, folder) = (
        path(&fixture().asset),
        path(&fixture().model),
        scratch("render"),
    );
    let mut seen: Vec<Vec<u8>> = Vec::new();
    for mode in [
        "original",
        "coarse",
        "textured",
        "clipped",
        "exact",
        "silhouette",
        "difference",
        "edges-equal",
        "edges-wireframe",
        "edges-translate",
        "edges-fatten",
        "edges-charcoal",
    ] {
        let out = folder.join(format!("{mode}.png"));
        let ended = run(&[
            "render",
            asset,
            "--eye",
            "1,3,2",
            "--size",
            "96x64",
            "--mode",
            mode,
            "--model",
            model,
            "--antialias",
            "none",
            "-o",
            path(&out),
        ]);
        assert_eq!(ended.code, 0, "{mode}: {}", ended.err);
        let picture = image::open(&out).unwrap().to_rgba8();
        assert_eq!(picture.dimensions(), (96, 64), "{mode}");
        assert_eq!(
            picture.get_pixel(0, 0).0,
            [255; 4],
            "{mode}: the background"
        );
        let bytes = picture.into_raw();
        assert!(!seen.contains(&bytes), "{mode} looks like another mode");
        seen.push(bytes);
    }
}

#[test]
fn the_exact_mode_tells_of_its_fans() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, model, folder) = (
        path(&fixture().asset),
        path(&fixture().model),
        scratch("exact"),
    );
    let out = folder.join("exact.png");
    let drawn = run_json(&[
        "render",
        asset,
        "--eye",
        "1,3,2",
        "--mode",
        "exact",
        "--model",
        model,
        "--json",
        "-o",
        path(&out),
    ]);
    let number = |name: &str| drawn["fans"][name].as_f64().unwrap();
    assert!(number("loops") >= 1.0 && number("loops_decomposed") >= number("loops"));
    assert!(number("fan_area_decomposed") <= number("fan_area"));
    assert!(number("fan_area_decomposed") > 1000.0);
}

#[test]
fn lines_are_drawn_of_a_model_alone_and_of_faces_turned_any_way() {
    if is_gpu_skipped() {
        return;
    }
    let folder = scratch("lines");
    // An open box whose sides are turned this way and that: no other command takes it.
    let soup = folder.join("soup.obj");
    fs::write(
        &soup,
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
         f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\n",
    )
    .unwrap();
    let draw = |name: &str, model: &Path, more: &[&str]| {
        let out = folder.join(name);
        let mut arguments = vec!["render", "--model", path(model), "--eye", "4,3,2", "--size"];
        arguments.extend(["96x96", "--mode", "edges-fatten", "-o", path(&out)]);
        arguments.extend(more);
        let ended = run(&arguments);
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
        let picture = image::open(&out).unwrap().to_luma8();
        picture.pixels().filter(|p| p.0[0] < 128).count()
    };
    let model = &fixture().model;
    let (thin, wide) = (
        draw("thin.png", model, &["--width", "1"]),
        draw("wide.png", model, &["--width", "4"]),
    );
    assert!(thin > 50 && wide > 2 * thin, "{thin} and {wide}");
    assert!(draw("soup.png", &soup, &["--soup"]) > 50);

    let out = folder.join("never.png");
    let line = [
        "render",
        "--model",
        path(&soup),
        "--eye",
        "4,3,2",
        "-o",
        path(&out),
    ];
    for more in [
        &["--mode", "clipped"][..],
        &["--mode", "original", "--soup"],
        &["--mode", "edges-fatten", "--soup", "--close-holes"],
        &["--mode", "edges-fatten", "--width", "0"],
    ] {
        let ended = run(&[&line[..], more].concat());
        assert_eq!(ended.code, 2, "{more:?}: {}", ended.err);
    }
    let ended = run(&[&line[..], &["--mode", "edges-fatten"]].concat());
    check_one_sentence(&ended, "an open model without --soup");
    assert!(!out.exists());
}

#[test]
fn bench_says_what_scripts_read() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, model) = (path(&fixture().asset), path(&fixture().model));
    let faces = run_json(&["inspect", asset, "--json"])["model"]["faces"].clone();
    let finer = (4 * faces.as_u64().unwrap()).to_string();
    let measured = run_json(&[
        "bench",
        model,
        "--asset",
        asset,
        "--faces-full",
        &finer,
        "--size",
        "160x120",
        "--repeat",
        "3",
        "--instances",
        "2",
        "--edges",
        "brute",
        "--edges",
        "dual",
        "--json",
    ]);
    check_fields(&measured, &["adapter", "timing", "ratios"]);
    let rows = measured["rows"].as_array().unwrap();
    let row = |name: &str| {
        let found = rows.iter().find(|r| r["name"] == name);
        found.unwrap_or_else(|| panic!("{name} is missing"))
    };
    let number = |name: &str, field: &str| row(name)[field].as_f64().unwrap();
    for name in [
        "full",
        "simplified",
        "hull",
        "clipped-tight-soft",
        "clipped-hull-none",
        "clipped-paper-msaa",
        "exact-brute",
        "exact-dual",
    ] {
        assert!(number(name, "seconds_median") > 0.0, "{name}");
        assert!(number(name, "cpu_seconds_median") > 0.0, "{name}");
        assert_eq!(number(name, "repeat"), 3.0, "{name}");
        if name != "full" {
            let ratio = &measured["ratios"][format!("full/{name}")];
            assert!(ratio.as_f64().unwrap() > 0.0, "{name}");
        }
    }
    for name in [
        "edges-brute",
        "edges-dual",
        "contour-tight",
        "contour-hull",
        "contour-paper",
    ] {
        assert!(number(name, "seconds_median") > 0.0, "{name}");
        assert_eq!(number(name, "repeat"), 6.0, "{name}");
    }
    assert_eq!(number("full", "faces").to_string(), finer);
    assert_eq!(
        number("edges-brute", "silhouette_edges"),
        number("edges-dual", "silhouette_edges")
    );
    // What is exact has no error to speak of, what is interpolated some, and the bare hull the most.
    let [exact, tight, hull] =
        ["exact-dual", "clipped-tight-none", "hull"].map(|n| number(n, "outline_error"));
    assert!(
        exact < 0.01 && number("full", "outline_error") < 0.01,
        "{exact}"
    );
    assert!(exact < tight && tight < hull, "{exact}, {tight}, {hull}");
    assert!((tight - number("contour-tight", "outline_error")).abs() < 0.1);
    let simplified = number("simplified", "outline_error");
    assert!(0.01 < simplified && simplified < hull, "{simplified}");
    assert!(number("simplified", "faces") <= number("hull", "faces"));

    let told = run(&[
        "bench", model, "--asset", asset, "--size", "64x64", "--repeat", "1", "--edges", "brute",
    ]);
    assert!(told.out.contains("clipped-tight-soft"), "{told:?}");
}

#[test]
fn an_eye_that_sees_nothing_is_refused() {
    let (asset, folder) = (path(&fixture().asset), scratch("eye"));
    let out = folder.join("never.png");
    let center = run_json(&["inspect", asset, "--json"])["model"]["center"].clone();
    let center: Vec<String> = center
        .as_array()
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    for eye in ["0.6,0,0", &center.join(","), "nan,0,3", "inf,0,0"] {
        let eye = format!("--eye={eye}");
        for arguments in [
            vec!["contour", asset, &eye],
            vec!["contour", asset, &eye, "--fov", "40"],
            vec!["render", asset, &eye, "-o", path(&out)],
        ] {
            let ended = run(&arguments);
            check_one_sentence(&ended, &format!("{arguments:?}"));
            assert_eq!(ended.out, "");
        }
    }
    for (option, value) in [
        ("--fov", "0"),
        ("--fov", "180"),
        ("--up", "0,0,0"),
        ("--up", "0,0,5"),
    ] {
        let ended = run(&["contour", asset, "--eye", "0,0,4", option, value]);
        check_one_sentence(&ended, &format!("{option} {value}"));
    }
    assert!(!out.exists());
}

#[test]
fn a_broken_asset_is_refused() {
    let folder = scratch("broken");
    let file = folder.join("broken.glb");
    let good = fs::read(&fixture().asset).unwrap();
    let mut broken: Vec<(String, Vec<u8>)> = vec![
        ("empty".to_owned(), Vec::new()),
        ("not one".to_owned(), b"a text".to_vec()),
        ("longer".to_owned(), [&good[..], b"more"].concat()),
    ];
    for part in [
        1,
        11,
        12,
        19,
        20,
        good.len() / 3,
        good.len() - 4,
        good.len() - 1,
    ] {
        broken.push((format!("cut at {part}"), good[..part].to_vec()));
    }
    let stride = good.len() / 300;
    for place in (0..24).chain((0..300).map(|k| k * stride + 7)) {
        let mut bytes = good.clone();
        bytes[place] ^= 0x10;
        broken.push((format!("byte {place} flipped"), bytes));
    }
    for (what, bytes) in broken {
        fs::write(&file, bytes).unwrap();
        let ended = run(&["inspect", path(&file)]);
        check_one_sentence(&ended, &what);
        assert!(ended.err.contains("broken.glb"), "{what}: {}", ended.err);
    }
    let missing = run(&["inspect", path(&folder.join("missing.glb"))]);
    check_one_sentence(&missing, "missing");
    // A mesh where an asset is needed.
    check_one_sentence(&run(&["inspect", path(&fixture().model)]), "a mesh");
}

#[test]
fn what_cannot_be_written_is_said_before_the_work() {
    let folder = scratch("unwritable");
    let model = path(&fixture().model);
    let file = folder.join("file");
    fs::write(&file, "a file, not a folder").unwrap();
    let outs = [
        folder.join("missing/out.glb"),
        file.join("out.glb"),
        folder.clone(),
        PathBuf::from("/proc/out.glb"),
    ];
    for out in &outs {
        // The full settings would take a minute.
        let since = Instant::now();
        let ended = run(&["build", model, "-o", path(out)]);
        check_one_sentence(&ended, path(out));
        assert!(
            since.elapsed() < Duration::from_secs(10),
            "{}",
            out.display()
        );
    }
    for (out, says) in [
        (&outs[0], "the folder does not exist"),
        (&outs[1], "not a directory"),
        (
            &folder.join("out.xyz"),
            "out.xyz: cannot be written as this kind of file",
        ),
    ] {
        let ended = run(&["hull", model, "-o", path(out)]);
        check_one_sentence(&ended, path(out));
        assert!(ended.err.contains(says), "{}", ended.err);
        assert!(!ended.err.contains(".part"), "{}", ended.err);
    }
    for command in [
        vec!["hull", model, "-o", path(&outs[1])],
        vec!["generate", "torus", "-o", path(&outs[1])],
        vec!["demo", "-o", path(&file)],
    ] {
        check_one_sentence(&run(&command), &format!("{command:?}"));
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said() {
    let ended = run(&[
        "contour",
        path(&fixture().asset),
        "--eye",
        "0,0,4",
        "-o",
        "/dev/full",
    ]);
    check_one_sentence(&ended, "/dev/full");
}

#[test]
fn a_failed_build_leaves_what_was_there() {
    let folder = scratch("failed");
    let (model, out) = (folder.join("open.obj"), folder.join("out.glb"));
    fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(&out, "what was there").unwrap();
    let ended = run(&["build", path(&model), "-o", path(&out)]);
    check_one_sentence(&ended, "an open mesh");
    assert!(ended.err.contains("open.obj"), "{}", ended.err);
    assert_eq!(fs::read(&out).unwrap(), b"what was there");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn without_an_adapter_only_pictures_are_impossible() {
    let (asset, model, folder) = (
        path(&fixture().asset),
        path(&fixture().model),
        scratch("adapter"),
    );
    let without = |arguments: &[&str]| {
        let mut command = bare();
        command.args(arguments).env("WGPU_BACKEND", "vulkan");
        for name in ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
            command.env(name, "/nonexistent/driver.json");
        }
        Ended::of(&mut command)
    };
    let picture = folder.join("never.png");
    let ended = without(&["render", asset, "--eye", "0,0,4", "-o", path(&picture)]);
    assert_eq!(ended.code, 3, "{}", ended.err);
    assert!(ended.err.contains("mesa-vulkan-drivers"), "{}", ended.err);
    assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
    assert!(!picture.exists());

    let out = folder.join("again.glb");
    let mut build = vec!["build", model, "-o", path(&out)];
    build.extend(SMALL_BUILD);
    assert_eq!(without(&build).code, 0);
    assert_eq!(without(&["contour", asset, "--eye", "0,0,4"]).code, 0);
    assert_eq!(without(&["inspect", asset]).code, 0);
    let evaluate = ["evaluate", asset, "--model", model, "--viewpoints", "1"];
    assert_eq!(without(&evaluate).code, 0);

    build.extend(["--backend", "gpu"]);
    let refused = without(&build);
    assert_eq!(refused.code, 3, "{}", refused.err);
}

#[cfg(unix)]
#[test]
fn an_interrupted_build_leaves_nothing() {
    let folder = scratch("interrupted");
    let model = folder.join("big.ply");
    let made = run(&["generate", "torus", "--faces", "60000", "-o", path(&model)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let out = folder.join("out.glb");
    // Far more work than the test waits for.
    let mut child = bare()
        .args(["build", path(&model), "-o", path(&out), "--views", "20000"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(2500));
    assert!(child.try_wait().unwrap().is_none(), "it ended too early");
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let since = Instant::now();
    let status = child.wait().unwrap();
    assert!(since.elapsed() < Duration::from_secs(20));
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert_eq!(status.code(), Some(130), "{err}");
    assert_eq!(err, "silmap: interrupted\n");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn nobody_listening_is_no_panic() {
    let mut child = bare()
        .args(["inspect", path(&fixture().asset), "--full"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let status = child.wait().unwrap();
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert_eq!((status.code(), err.as_str()), (Some(0), ""));
}
