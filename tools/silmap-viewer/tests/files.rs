//! The viewer and files: opened, dropped and written, good ones and bad ones.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::time::{Duration, Instant};

use common::{Files, SIZE, Window, changed};
use egui::Key;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use silmap_viewer::look::Look;
use silmap_viewer::{App, Opened, Start};

#[test]
fn what_cannot_be_opened_is_said_and_what_was_there_stays() {
    let mut window = Window::open("organic.glb", None, "");
    let before = window.picture();
    let files = Files::get();
    let whole = std::fs::read(files.path("organic.glb")).unwrap();
    let broken = files.path("broken.glb");
    std::fs::write(&broken, &whole[..whole.len() / 2]).unwrap();
    let newer = files.path("newer.glb");
    std::fs::write(&newer, of_version(&whole, 99)).unwrap();
    let text = files.path("notes.txt");
    std::fs::write(&text, "no mesh").unwrap();
    for (path, says) in [
        (broken, "broken.glb"),
        (newer, "format version 99"),
        (text, "notes.txt"),
        (files.path("missing.glb"), "missing.glb"),
    ] {
        window.drop_file(path);
        let message = window.app().message().unwrap().clone();
        assert!(
            message.is_error && message.text.contains(says),
            "{}",
            message.text
        );
        assert_eq!(message.text.lines().count(), 1, "{}", message.text);
        window.click("Close");
        assert_eq!(window.app().scene().name, "organic.glb");
    }
    assert!(changed(&before, &window.picture()) < 1e-3);
}

/// The same file, as if a later version had written it.
fn of_version(file: &[u8], version: u32) -> Vec<u8> {
    let text = "\"formatVersion\":3";
    let at = file.windows(text.len()).position(|w| w == text.as_bytes());
    let at = at.expect("the version is in the JSON");
    let mut other = file.to_vec();
    // As many bytes as before: a space of the JSON's padding makes room.
    let new = format!("\"formatVersion\":{version}");
    other.splice(at..at + text.len(), new.bytes());
    let length = u32::from_le_bytes(other[12..16].try_into().unwrap()) as usize;
    let added = new.len() - text.len();
    let padded = (length + added).next_multiple_of(4);
    let end = 20 + length + added;
    other.splice(end..end, std::iter::repeat_n(b' ', padded - length - added));
    other[12..16].copy_from_slice(&(padded as u32).to_le_bytes());
    let total = other.len() as u32;
    other[8..12].copy_from_slice(&total.to_le_bytes());
    other
}

#[test]
fn a_mesh_is_shown_and_built_and_the_build_can_be_stopped() {
    let files = Files::get();
    let start = Start {
        file: Some(Opened {
            path: files.path("organic.ply"),
            ..Opened::default()
        }),
        ..Start::default()
    };
    let harness = Harness::builder()
        .with_size([SIZE.0, SIZE.1])
        .wgpu()
        .build_eframe(|context| App::new(context, start));
    let mut window = Window { harness };
    let since = Instant::now();
    while window.app().scene().model.is_none() {
        assert!(since.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
        window.harness.run_steps(1);
    }
    assert!(window.app().is_loading(), "the asset is built now");
    let mesh = window.picture();
    // What takes but a moment is not said.
    while window.harness.query_by_label("Cancel").is_none() {
        assert!(window.app().is_loading());
        std::thread::sleep(Duration::from_millis(20));
        window.harness.run_steps(1);
    }
    window.click("Cancel");
    window.settle();
    assert!(window.app().scene().asset.is_none());
    assert_eq!(window.app().message().unwrap().text, "stopped");
    window.click("Close");
    // The mesh is shown, and goes on to be.
    let empty = image::RgbaImage::from_pixel(
        mesh.width(),
        mesh.height(),
        image::Rgba([0xf4, 0xf5, 0xf7, 255]),
    );
    assert!(changed(&mesh, &empty) > 0.05);
}

#[test]
fn a_picture_and_a_turn_are_written() {
    let mut window = Window::open("organic.glb", None, "");
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("seen.png");
    window.name_file(name.to_str().unwrap());
    window.click("Save picture");
    let written = image::open(&name).unwrap().to_rgba8();
    window.click("Close");
    assert!(
        changed(&window.picture(), &written) < 0.02,
        "the hint alone is not in the file"
    );
    window.click("Save a turn");
    window.settle();
    let said = window.app().message().unwrap().clone();
    assert!(
        !said.is_error && said.text.contains("60 frames"),
        "{}",
        said.text
    );
    let turn = std::fs::read(name.with_extension("webp")).unwrap();
    assert_eq!(&turn[..4], b"RIFF");
    assert_eq!(turn.windows(4).filter(|w| w == b"ANMF").count(), 60);
    // What cannot be written is said.
    window.click("Close");
    std::fs::remove_dir_all(folder.path()).unwrap();
    window.click("Save picture");
    assert!(window.app().message().unwrap().is_error);
}

#[test]
fn an_asset_and_its_mesh_belong_together() {
    let files = Files::get();
    let mut window = Window::open("organic.glb", None, "");
    window.press(Key::Num3);
    let before = window.app().link();
    // The mesh that it was made from is compared with it.
    window.drop_file(files.path("organic.ply"));
    let message = window.app().message().unwrap().clone();
    assert!(
        !message.is_error && message.text.contains("is compared with it"),
        "{}",
        message.text
    );
    let scene = window.app().scene();
    assert_eq!(scene.name, "organic.glb");
    assert!(scene.asset.is_some() && scene.model.is_some());
    assert_eq!(window.app().link(), before);
    // The mesh stays where the asset is opened again.
    window.drop_file(files.path("organic.glb"));
    assert!(window.app().scene().model.is_some());
    // Another mesh is another thing to look at.
    let other = silmap_models::torus(600);
    let path = files.path("torus.ply");
    std::fs::write(&path, silmap_mesh_io::encode(&path, &other).unwrap()).unwrap();
    window.begin_drop(path);
    window.wait_until(|viewer| viewer.scene().name == "torus.ply");
    assert!(window.app().is_loading() && window.app().scene().asset.is_none());
}

#[test]
fn a_folder_of_photographs_is_carved_and_its_photographs_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = write_capture(folder.path());
    let mut window = Window::of(SIZE, Start::default());
    window.begin_drop(folder.path().to_owned());
    window.wait_until(|viewer| viewer.scene().model.is_some());
    // The photographs are there once they coloured the hull.
    window.wait_until(|_| false);
    let scene = window.app().scene();
    assert!(scene.asset.is_some(), "{:?}", window.app().message());
    // Looked at from a camera the outline is the photograph's own.
    window.press(Key::CloseBracket);
    let look = Look::read_link(&window.app().link()).unwrap();
    assert!(look.pose.unwrap().eye.distance(cameras[0].eye) < 1e-6);
    assert!(look.overlays.photographs);
    window.slide("Opacity", 0.0);
    let clipped = window.picture();
    window.slide("Opacity", 1.0);
    window.wait_a_little();
    let photograph = window.picture();
    let object = |picture: &image::RgbaImage| picture.pixels().map(is_red).collect::<Vec<_>>();
    let (seen, taken) = (object(&clipped), object(&photograph));
    let union = seen.iter().zip(&taken).filter(|(a, b)| **a || **b).count();
    let both = seen.iter().zip(&taken).filter(|(a, b)| **a && **b).count();
    assert!(both * 100 > 96 * union && both > 5000, "{both} of {union}");
    // From elsewhere all of them stand around it.
    window.press(Key::Num1);
    for _ in 0..9 {
        window.press(Key::Minus);
    }
    let with = window.picture();
    if let Ok(folder) = std::env::var("SILMAP_PICTURES") {
        let whole = window.harness.render().unwrap();
        whole.save(format!("{folder}/photographs.png")).unwrap();
        photograph.save(format!("{folder}/photograph.png")).unwrap();
        clipped
            .save(format!("{folder}/from-photograph.png"))
            .unwrap();
    }
    window.press(Key::G);
    assert!(changed(&with, &window.picture()) > 0.005);
    // Another hull is painted with the photographs again.
    window.press(Key::F);
    let faces = window.hull_faces();
    window.slide("Hull faces", 300.0);
    let fewer = window.hull_faces();
    assert!(fewer <= 300 && faces > 300, "{faces}, {fewer}");
    assert!(window.picture().pixels().filter(|p| is_red(p)).count() > 3000);
}

/// Whether a pixel shows the object of [`write_capture`].
fn is_red(pixel: &image::Rgba<u8>) -> bool {
    let [r, g, b, _] = pixel.0;
    i32::from(r) > 40 + i32::from(g.max(b))
}

/// Writes photographs of a red torus before grey, with their masks as alpha, and `cameras.json`.
fn write_capture(folder: &std::path::Path) -> Vec<silmap_capture::Pinhole> {
    use glam::{DVec2, DVec3};

    let (size, mesh) = ((200, 160), silmap_models::torus(1500));
    let cameras: Vec<_> = (0..20)
        .map(|k| {
            let turn = 2.4 * f64::from(k);
            let height = -0.8 + 1.6 * (f64::from(k) + 0.5) / 20.0;
            let ring = (1.0 - height * height).sqrt();
            let eye = 6.0 * DVec3::new(ring * turn.cos(), height, ring * turn.sin());
            let forward = -eye.normalize_or_zero();
            let right = forward.cross(DVec3::Y).normalize_or_zero();
            let axes = [right, forward.cross(right), forward];
            let lens = (DVec2::splat(260.0), DVec2::new(96.0, 83.0));
            silmap_capture::Pinhole::from_pose(eye, axes, lens, size).unwrap()
        })
        .collect();
    let mut views = Vec::new();
    for (k, camera) in cameras.iter().enumerate() {
        let mask = silmap_capture::silhouette(&mesh, camera).unwrap();
        let picture = image::RgbaImage::from_fn(size.0, size.1, |x, y| {
            if mask.get(x.into(), y.into()) {
                image::Rgba([200, 60, 50, 255])
            } else {
                image::Rgba([90, 90, 90, 0])
            }
        });
        picture.save(folder.join(format!("{k}.png"))).unwrap();
        let rows = camera.to_matrix().map(|row| format!("{row:?}"));
        let rows = rows.join(",");
        views.push(format!(
            r#"{{"name":"v{k}","photo":"{k}.png","P":[{rows}]}}"#
        ));
    }
    let (width, height) = size;
    let views = views.join(",");
    let text = format!(r#"{{"width":{width},"height":{height},"views":[{views}]}}"#);
    std::fs::write(folder.join("cameras.json"), text).unwrap();
    cameras
}

#[test]
fn the_asset_is_written_as_it_is_shown() {
    let mut window = Window::open("organic.glb", None, "keep=12");
    let folder = tempfile::tempdir().unwrap();
    window.name_file(folder.path().join("seen.png").to_str().unwrap());
    window.click("Save asset");
    let message = window.app().message().unwrap().clone();
    assert!(!message.is_error, "{}", message.text);
    let bytes = std::fs::read(folder.path().join("seen.glb")).unwrap();
    let asset = silmap_map::asset::read(&bytes).unwrap();
    assert_eq!(asset.map.views.len(), 12);
}

/// What a window keeps from one time to the next, in memory alone.
#[derive(Default)]
struct Kept(std::collections::BTreeMap<String, String>);

impl eframe::Storage for Kept {
    fn get_string(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.0.insert(key.to_owned(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.0.remove(key);
    }

    fn flush(&mut self) {}
}

#[test]
fn what_is_open_is_kept_and_what_is_dropped_is_looked_at_anew() {
    let files = Files::get();
    let mut window = Window::open("organic.glb", None, "keep=12");
    assert_eq!(window.app().look().keep, Some(12));
    window.drop_file(files.path("organic.ply"));
    // Its mesh came to it: it is the asset that is open, with as many views as before.
    let asset = window.app().scene().asset.clone().unwrap();
    assert_eq!(asset.map.views.len(), 12);
    let mut kept = Kept::default();
    eframe::App::save(window.harness.state_mut(), &mut kept);
    assert!(kept.0["silmap-file"].ends_with("organic.glb"));
    assert!(kept.0["silmap-model"].ends_with("organic.ply"));
    // Another file, even of the same name, is framed, with all its views.
    for _ in 0..6 {
        window.press(Key::Minus);
    }
    let far = Look::read_link(&window.app().link()).unwrap().pose.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let same_name = folder.path().join("organic.glb");
    std::fs::copy(files.path("organic.glb"), &same_name).unwrap();
    window.drop_file(same_name);
    let near = Look::read_link(&window.app().link()).unwrap().pose.unwrap();
    assert!(near.eye.length() < 0.7 * far.eye.length());
    assert_eq!(window.app().look().keep, None);
    assert_eq!(
        window.app().scene().asset.as_ref().unwrap().map.views.len(),
        32
    );
}

#[test]
fn a_light_that_cannot_be_had_is_said_once() {
    let files = Files::get();
    let model = silmap_geometry::ClosedMesh::try_from(silmap_models::torus(600)).unwrap();
    let mut params = silmap_preprocess::pipeline::BuildParams {
        views: 64,
        resolution_px: 96,
        ..Default::default()
    };
    params.map.keep = 16;
    params.textures.views = 3;
    params.textures.size_px = 64;
    params.textures.relief_px = 0;
    params.textures.normals = false;
    let watch = silmap_geometry::Watch::silent();
    let (asset, _) = silmap_preprocess::pipeline::build(&model, "plain", &params, &watch).unwrap();
    let path = files.path("plain.glb");
    std::fs::write(&path, silmap_map::asset::write(&asset).unwrap()).unwrap();
    let mut window = Window::open("plain.glb", None, "light=0,1,0");
    let message = window.app().message().unwrap().clone();
    assert!(
        message.is_error && message.text.contains("cannot be lit anew"),
        "{}",
        message.text
    );
    assert_eq!(window.app().look().light, None);
    window.click("Close");
    assert!(window.app().message().is_none());
    // The picture is drawn, and follows the camera.
    let before = window.picture();
    window.press(Key::Num3);
    assert!(changed(&before, &window.picture()) > 0.02);
}

#[test]
fn what_is_chosen_while_something_is_made_comes_next() {
    let mut window = Window::open("organic.glb", Some("organic.ply"), "");
    let put = |window: &mut Window, label: &str, value: f64| {
        let slider = (window.harness).get_by_role_and_label(egui::Role::Slider, label);
        slider.set_value_accesskit(value);
        window.harness.run_steps(2);
    };
    put(&mut window, "Hull faces", 320.0);
    assert!(window.app().is_loading(), "the hull is made");
    put(&mut window, "Views", 10.0);
    put(&mut window, "Hull faces", 240.0);
    window.settle();
    window.settle();
    let asset = window.app().scene().asset.clone().unwrap();
    assert_eq!(window.app().look().keep, Some(10));
    assert_eq!(window.app().look().faces, Some(240));
    assert_eq!(asset.map.views.len(), 10);
    assert!(asset.hull.faces.len() <= 240);
}
