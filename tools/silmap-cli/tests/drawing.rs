//! What the binary draws and measures from the full mesh: exact edges, pictures in all modes, benches.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;

use serde_json::Value;

use common::{
    check_fields, check_one_sentence, fixture, is_gpu_skipped, path, run, run_json, scratch,
};

/// The methods of `silmap edges`.
const EDGE_METHODS: &[&str; 9] = &[
    "brute",
    "brute-parallel",
    "list",
    "hash",
    "table",
    "cones",
    "jc",
    "dual",
    "dual-bar",
];

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
fn the_outline_of_edges_is_the_region_that_the_model_covers() {
    let (made, folder) = (fixture(), scratch("edges-outline"));
    let (model, asset) = (path(&made.model), path(&made.asset));
    let file = folder.join("outline.json");
    let area = |outline: &Value| -> f64 {
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(outline["loops"].clone()).unwrap();
        let doubled = |points: &Vec<[f64; 2]>| -> f64 {
            let next = points.iter().cycle().skip(1);
            points
                .iter()
                .zip(next)
                .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
                .sum()
        };
        loops.iter().map(|points| 0.5 * doubled(points)).sum()
    };
    let exact = |viewpoint: &str| -> Value {
        let to = ["--outline", path(&file), "--repeat", "2", "--json"];
        let told = run_json(&[&["edges", model, viewpoint][..], &to].concat());
        assert!(told["outline_seconds_median"].as_f64().unwrap() > 0.0);
        serde_json::from_slice(&fs::read(&file).unwrap()).unwrap()
    };
    let mut areas = Vec::new();
    for eye in ["--eye=0.4,0.5,4.5", "--eye=4,1.5,2"] {
        let outline = exact(eye);
        check_fields(&outline, &["camera.eye", "camera.fov_y_degrees", "seconds"]);
        let size = ["--size", "1024x1024"];
        let interpolated = run_json(&[&["contour", asset, eye][..], &size].concat());
        assert_eq!(outline["camera"], interpolated["camera"]);
        let (exact, interpolated) = (area(&outline), area(&interpolated));
        assert!(
            (interpolated / exact - 1.0).abs() < 0.12,
            "{exact} {interpolated}"
        );
        areas.push(exact);
    }
    assert!(
        (areas[0] / areas[1] - 1.0).abs() > 0.1,
        "both look the same: {areas:?}"
    );
    // From far away it is that of a direction, up to the scale: the sphere of the model fits in both pictures.
    let far = area(&exact("--eye=40000,50000,450000"));
    let direction = area(&exact("--direction=0.4,0.5,4.5"));
    assert!((far / direction - 1.0).abs() < 1e-4, "{far} {direction}");
}

#[test]
fn a_forest_is_kept_in_a_file_and_read_again() {
    let folder = scratch("edges-forest");
    let (model, file) = (path(&fixture().model), folder.join("m.cones"));
    let arguments = [
        "edges",
        model,
        "--eye=-1,2,3.5",
        "--method",
        "cones",
        "--forest",
        path(&file),
    ];
    let with_list = [&arguments[..], &["--list", "--json"]].concat();
    let mut built = run_json(&with_list);
    let bytes = fs::read(&file).unwrap();
    assert_eq!(built["forest"]["was_read"], false);
    assert_eq!(built["forest"]["bytes"], bytes.len());
    let mut read = run_json(&with_list);
    assert_eq!(read["forest"]["was_read"], true);
    assert!(read["forest"]["seconds"].as_f64().unwrap() > 0.0);
    assert_eq!(fs::read(&file).unwrap(), bytes, "reading changes nothing");
    for result in [&mut built, &mut read] {
        for changing in ["forest", "build_seconds", "seconds_median"] {
            result.as_object_mut().unwrap().remove(changing);
        }
    }
    assert_eq!(built, read);
    assert_eq!(
        built["edges"],
        run_json(&[&with_list[..3], &with_list[7..]].concat())["edges"]
    );
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);

    let other = folder.join("other.obj");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    fs::write(&other, text).unwrap();
    let refused = |arguments: &[&str], part: &str| {
        let ended = run(arguments);
        check_one_sentence(&ended, part);
        assert!(ended.err.contains(part), "{}", ended.err);
        assert!(ended.err.contains("m.cones"), "{}", ended.err);
    };
    let mut of_other = arguments;
    of_other[1] = path(&other);
    refused(&of_other, "another mesh");
    for (part, damaged) in [
        ("no cone forest", b"solid m".to_vec()),
        ("damaged", bytes[..bytes.len() - 1].to_vec()),
        ("version 9", [&bytes[..8], &[9], &bytes[9..]].concat()),
    ] {
        fs::write(&file, &damaged).unwrap();
        refused(&arguments, part);
        assert_eq!(fs::read(&file).unwrap(), damaged, "nothing is overwritten");
    }
    fs::remove_file(&file).unwrap();
    fs::create_dir(&file).unwrap();
    refused(&arguments, "m.cones");
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
fn a_shadow_darkens_the_ground_beside_the_model() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, folder) = (path(&fixture().asset), scratch("shadow"));
    let out = folder.join("shadow.png");
    let line = ["render", asset, "--eye", "3,4,5", "--fov", "60", "-o"];
    let line = [&line[..], &[path(&out), "--background", "#ffffff"]].concat();
    // Pixels of the grey that white has in the shadow; the model has colours.
    let grey = |more: &[&str]| {
        let ended = run(&[&line[..], more].concat());
        assert_eq!(ended.code, 0, "{more:?}: {}", ended.err);
        let picture = image::open(&out).unwrap().to_rgb8();
        let is_grey = |p: &&image::Rgb<u8>| p.0.iter().all(|c| c.abs_diff(188) <= 2);
        picture.pixels().filter(is_grey).count()
    };
    let (without, with) = (grey(&[]), grey(&["--shadow", "1,1,-2"]));
    assert!(
        with > without + 500,
        "{with} grey pixels, {without} without"
    );
    let upwards = grey(&["--shadow=-2,1,1", "--up", "0,0,1", "--mode", "coarse"]);
    assert!(upwards > without + 500, "{upwards} with another ground");
    fs::remove_file(&out).unwrap();
    for light in ["1,-1,0", "0,0,0", "nan,1,0", "1,0,0"] {
        let ended = run(&[&line[..], &["--shadow", light]].concat());
        check_one_sentence(&ended, light);
        assert!(ended.err.contains("--shadow"), "{}", ended.err);
    }
    let ended = run(&[&line[..], &["--shadow", "0,1,0", "--mode", "silhouette"]].concat());
    assert_eq!(ended.code, 2, "{}", ended.err);
    assert!(!out.exists());
}

#[test]
fn bench_of_a_scene_says_what_scripts_read() {
    if is_gpu_skipped() {
        return;
    }
    let (asset, model) = (path(&fixture().asset), path(&fixture().model));
    let scene = "--instances 5 --pixels 40 --size 96x96 --repeat 2 --json";
    let mut call = vec!["bench", model, "--asset", asset];
    call.extend(scene.split(' '));
    let measured = run_json(&call);
    check_fields(&measured, &["adapter", "timing", "instances", "ratios"]);
    let rows = measured["rows"].as_array().unwrap();
    let row = |name: &str| {
        let found = rows.iter().find(|r| r["name"] == name);
        found.unwrap_or_else(|| panic!("{name} is missing"))
    };
    for name in [
        "full",
        "lod-500",
        "lod-5000",
        "lod-equal-error",
        "hull",
        "clipped-stencil",
        "clipped-coverage",
        "each-a-pass",
    ] {
        let row = row(name);
        let times = ["seconds_median", "cpu_seconds_mean", "cpu_seconds_max"];
        for field in times {
            assert!(row[field].as_f64().unwrap() > 0.0, "{name}: {field}");
        }
        let parts = ["outlines", "upload", "encode"];
        let sum: f64 = parts
            .map(|part| row["cpu_parts"][part].as_f64().unwrap())
            .iter()
            .sum();
        let mean = row["cpu_seconds_mean"].as_f64().unwrap();
        assert!((sum - mean).abs() < 1e-9 + 1e-6 * mean, "{name}");
    }
    let error = |name: &str| row(name)["outline_error_px"]["mean"].as_f64().unwrap();
    // Clipping is what makes the outline right, and the mesh of the same error is no worse.
    assert!(error("clipped-stencil") < error("hull"));
    assert!(error("lod-equal-error") <= error("clipped-stencil"));
    assert!((error("clipped-stencil") - error("clipped-coverage")).abs() < 0.05);
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

    let small = ["--size", "64x64", "--repeat", "1", "--edges", "brute"];
    let bench = ["bench", model, "--asset", asset];
    let told = run(&[&bench[..], &small].concat());
    assert!(told.out.contains("clipped-tight-soft"), "{told:?}");
    assert!(measured.get("comparison").is_none() && !told.out.contains("same-time"));

    let measured = run_json(&[&bench[..], &small, &["--comparison", "--json"]].concat());
    let comparison = &measured["comparison"];
    assert_eq!(comparison["levels"].as_array().unwrap().len(), 2);
    for method in silmap_exact::ExtractionMethod::ALL {
        let pointer = format!("/frames/faces_in_the_same_time/{method}");
        let pairs = comparison.pointer(&pointer).unwrap().as_array().unwrap();
        assert_eq!((pairs.len(), &pairs[0][0]), (2, &500.into()), "{method}");
    }
}
