//! Results beside a capture's masks and photographs: `evaluate --camera`, `render --photograph`, `--distorted`.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::Path;

use common::captured::{
    SIZE, VIEWS, cameras, capture, inside, number, overlap, through, write_cameras, write_pictures,
};
use common::{
    check_fields, check_one_sentence, fixture, is_gpu_skipped, path, run, run_json, scratch,
};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use silmap_capture::{Distortion, Lens, Pinhole, silhouette};

#[test]
fn masks_are_what_an_asset_is_measured_against() {
    let (folder, asset) = (capture(), path(&fixture().asset));
    let told = run_json(&["evaluate", asset, "--camera", path(folder), "--json"]);
    check_fields(
        &told,
        &[
            "viewpoints",
            "where",
            "camera",
            "methods.tight.misclassified_mean",
            "methods.hull.overlap_mean",
        ],
    );
    assert_eq!(
        (&told["viewpoints"], &told["where"]),
        (&json!(6), &json!("capture"))
    );
    let rows = told["per_viewpoint"].as_array().unwrap();
    assert_eq!(rows.len(), 6 * told["methods"].as_object().unwrap().len());
    for row in rows.iter().filter(|r| r["method"] == "tight") {
        let (wrong, overlap) = (number(row, "/misclassified"), number(row, "/overlap"));
        assert!(wrong < 0.05 && overlap > 0.95, "{row}");
        // Both are of the same pixels.
        let escaped = number(row, "/escaped");
        let from_shares = (1.0 - escaped) / (1.0 + wrong - escaped);
        assert!((overlap - from_shares).abs() < 1e-9, "{row}");
    }
    let some = through(&["evaluate", asset, "--json"], folder, "mirr");
    let some = run_json(&[&some[..], &["--view", "side.png", "--method", "tight"]].concat());
    let names: Vec<&Value> = some["per_viewpoint"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| &r["view"])
        .collect();
    assert_eq!(names, [&json!("mirrored"), &json!("side")]);
    let tight = ["evaluate", asset, "--method", "tight", "--camera"];
    let table = run(&[&tight[..], &[path(folder)]].concat());
    assert!(
        table.out.contains("6 views of the capture"),
        "{}",
        table.out
    );
    assert!(table.out.contains("cut-off  tight "), "{}", table.out);

    // Masks whose object is black, beside those that say so.
    let black = scratch("captured-photographs-black");
    write_cameras(&black, DVec3::ZERO, true);
    for name in VIEWS {
        let file = black.join(format!("masks/{name}.png"));
        let mut mask = inside(&file);
        mask.pixels_mut().for_each(|p| p.0[0] = 255 - p.0[0]);
        mask.save(&file).unwrap();
    }
    let words = ["evaluate", asset, "--json", "--camera", path(&black)];
    let inverted = run_json(&[&words[..], &["--mask-inverted"]].concat());
    assert_eq!(inverted["methods"], told["methods"]);

    // Cameras that look 12 pixels aside are far off.
    let aside = scratch("captured-photographs-aside");
    write_cameras(&aside, DVec3::ZERO, true);
    let file = aside.join("cameras.json");
    let mut cameras: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    for view in cameras["views"].as_array_mut().unwrap() {
        for k in 0..4 {
            let moved = number(&view["P"], &format!("/0/{k}"))
                + 12.0 * number(&view["P"], &format!("/2/{k}"));
            view["P"][0][k] = moved.into();
        }
    }
    fs::write(&file, cameras.to_string()).unwrap();
    let off = run_json(&[&tight[..], &[path(&file), "--json"]].concat());
    let [right, wrong] = [&told, &off].map(|v| number(v, "/methods/tight/misclassified_mean"));
    assert!(wrong > 5.0 * right, "{right}, {wrong}");
}

#[test]
fn photographs_are_shown_behind_and_beside() {
    if is_gpu_skipped() {
        return;
    }
    let (folder, asset) = (capture(), path(&fixture().asset));
    for (place, width) in [("behind", SIZE.0), ("beside", 3 * SIZE.0 + 16)] {
        for name in ["front", "mirrored", "skewed", "cut-off"] {
            let out = folder.join(format!("{name}-{place}.png"));
            let words = ["render", asset, "--photograph", place, "-o", path(&out)];
            let told = run_json(&through(&[&words[..], &["--json"]].concat(), folder, name));
            assert!(number(&told, "/overlap") > 0.94, "{name} {told}");
            assert_eq!(
                (&told["width"], &told["view"]),
                (&json!(width), &json!(name))
            );
            let picture = image::open(&out).unwrap().into_rgb8();
            assert_eq!(picture.dimensions(), (width, SIZE.1));
            // A corner of the photograph, which is behind as it is beside.
            assert_eq!(picture.get_pixel(0, 159).0, [20; 3]);
        }
    }
    // Without a photograph there is nothing to show.
    let bare = scratch("captured-photographs-bare");
    write_cameras(&bare, DVec3::ZERO, false);
    let out = bare.join("no.png");
    let words = through(&["render", asset, "-o", path(&out)], &bare, "front");
    let ended = run(&[&words[..], &["--photograph", "beside"]].concat());
    check_one_sentence(&ended, "no photograph");
    assert!(
        ended.err.contains("front.png") && !out.exists(),
        "{}",
        ended.err
    );
    // But cameras need neither photographs nor masks.
    assert_eq!(run(&words).code, 0);
    assert_eq!(image::image_dimensions(&out).unwrap(), SIZE);
    let ended = run(&["evaluate", asset, "--camera", path(&bare)]);
    check_one_sentence(&ended, "no masks");
}

/// Writes a capture whose lens bends straight lines by several pixels.
fn write_bent(folder: &Path) {
    let model = silmap_models::torus(1200);
    const FINE: u32 = 4;
    let k1 = -0.35;
    let mut frames = Vec::new();
    for (k, camera) in cameras(DVec3::ZERO).iter().take(2).enumerate() {
        let distortion = Distortion {
            numerator: [k1, 0.0, 0.0, 0.0],
            ..Distortion::default()
        };
        let lens = Lens::new(distortion, (camera.focal, 0.0, camera.principal), SIZE).unwrap();
        // What a camera without the lens sees, in small pixels.
        let fine = Pinhole {
            focal: camera.focal * f64::from(FINE),
            principal: camera.principal * f64::from(FINE),
            width: camera.width * FINE,
            height: camera.height * FINE,
            ..*camera
        };
        let straight = silhouette(&model, &fine).unwrap();
        let is_inside = |x: u32, y: u32| {
            let photo = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let image = lens
                .tangent_from_photo(photo)
                .map(|tangent| fine.image(tangent));
            // The corners lie beyond the lens's domain.
            image.is_some_and(|p| straight.get(p.x as i64, p.y as i64))
        };
        write_pictures(folder, &format!("bent{k}"), is_inside);
        let [right, down, forward] = camera.axes;
        let row = |c: usize| json!([right[c], -down[c], -forward[c], camera.eye[c]]);
        frames.push(json!({"file_path": format!("photos/bent{k}.png"),
            "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]}));
    }
    let [front, ..] = &cameras(DVec3::ZERO)[..] else {
        unreachable!()
    };
    let file = json!({"w": SIZE.0, "h": SIZE.1, "fl_x": front.focal.x, "fl_y": front.focal.y,
        "cx": front.principal.x, "cy": front.principal.y, "camera_model": "OPENCV",
        "k1": k1, "k2": 0.0, "p1": 0.0, "p2": 0.0, "frames": frames});
    fs::write(folder.join("transforms.json"), file.to_string()).unwrap();
}

#[test]
fn a_lens_bends_pictures_where_it_is_asked_to() {
    let folder = scratch("captured-photographs-bent");
    write_bent(&folder);
    let asset = path(&fixture().asset);
    let mask = inside(&folder.join("masks/bent1.png"));
    let contour = |more: &[&str]| {
        let out = folder.join("contour.png");
        let words = ["contour", asset, "--format", "png", "-o", path(&out)];
        let ended = run(&through(&[&words[..], more].concat(), &folder, "bent1"));
        assert_eq!(ended.code, 0, "{}", ended.err);
        overlap(&inside(&out), &mask)
    };
    let (bent, straight) = (contour(&["--distorted"]), contour(&[]));
    assert!(bent > 0.95 && straight < bent - 0.02, "{bent}, {straight}");
    let words = ["evaluate", asset, "--camera", path(&folder), "--json"];
    let told = run_json(&[&words[..], &["--method", "tight"]].concat());
    assert!(number(&told, "/methods/tight/overlap_min") > 0.95, "{told}");
    let mask = folder.join("masks/bent1.png");
    let model = path(&fixture().model);
    let words = ["align", model, "--mask", path(&mask), "--json"];
    let told = run_json(&through(&words, &folder, "bent1"));
    assert!(number(&told, "/captured/distance_px") < 0.6, "{told}");
    assert!(number(&told, "/captured/moved") < 0.06, "{told}");
    if is_gpu_skipped() {
        return;
    }
    for more in [&["--distorted"][..], &[]] {
        let out = folder.join("beside.png");
        let words = ["render", asset, "--json", "-o", path(&out)];
        let words = [&words[..], &["--photograph", "beside"], more].concat();
        let told = run_json(&through(&words, &folder, "bent1"));
        assert!(number(&told, "/overlap") > 0.94, "{more:?}: {told}");
    }
}

/// On photographs: an asset's outline is as near to each mask as the carved hull, or nearer.
#[test]
fn real_photographs_lie_under_their_renders() {
    let Some(capture) = common::outside::shared("captures/squirrel") else {
        return;
    };
    let folder = scratch("captured-photographs-squirrel");
    let asset = folder.join("squirrel.glb");
    let options = "--no-photographs --voxels 96 --backend cpu --views 200 --keep 80 --resolution 256 --faces 200 --texture-views 4 \
                   --texture-size 32 --json";
    let mut words = vec!["build", path(&capture), "-o", path(&asset)];
    words.extend(options.split_whitespace());
    let built = run_json(&words);
    let words = ["evaluate", path(&asset), "--camera", path(&capture)];
    let told = run_json(&[&words[..], &["--method", "tight", "--json"]].concat());
    let masks = built["masks"].as_array().unwrap();
    let views = told["per_viewpoint"].as_array().unwrap();
    assert_eq!((masks.len(), views.len()), (36, 36));
    for (mask, view) in masks.iter().zip(views) {
        assert_eq!(mask["name"], view["view"]);
        let (hull, asset) = (number(mask, "/overlap"), number(view, "/overlap"));
        assert!(
            asset > hull - 0.01,
            "{}: {asset} beside {hull}",
            mask["name"]
        );
    }
    if is_gpu_skipped() {
        return;
    }
    let out = folder.join("image_9.png");
    let words = ["render", path(&asset), "--json", "-o", path(&out)];
    let words = [&words[..], &["--photograph", "beside", "--size", "320x240"]].concat();
    let told = run_json(&through(&words, &capture, "image_9.jpg"));
    assert!(
        number(&told, "/overlap") > number(&masks[9], "/overlap") - 0.01,
        "{told}"
    );
    assert_eq!(image::image_dimensions(&out).unwrap(), (3 * 320 + 16, 240));
}
