//! The viewer as people use it: files are opened and dropped, each control is worked, and pixels say what changed.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers, PointerButton, Pos2, Rect};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use image::RgbaImage;
use silmap_geometry::{ClosedMesh, Watch};
use silmap_map::asset;
use silmap_preprocess::pipeline::{self, BuildParams};
use silmap_viewer::files::Opened;
use silmap_viewer::look::{Look, Shown};
use silmap_viewer::{App, Start, Viewer};

const SIZE: (f32, f32) = (900.0, 620.0);

/// An asset and its mesh, made once for all tests.
struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    fn get() -> &'static Self {
        static FILES: std::sync::OnceLock<Files> = std::sync::OnceLock::new();
        FILES.get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let model = silmap_models::organic(4000);
            let model = ClosedMesh::try_from(model).unwrap();
            let mut params = BuildParams {
                views: 128,
                resolution_px: 192,
                ..BuildParams::default()
            };
            params.map.keep = 32;
            params.hull.target_faces = 160;
            params.textures.views = 6;
            params.textures.size_px = 128;
            let (made, _) = pipeline::build(&model, "organic", &params, &Watch::silent()).unwrap();
            std::fs::write(
                folder.path().join("organic.glb"),
                asset::write(&made).unwrap(),
            )
            .unwrap();
            let mesh = silmap_mesh_io::encode(Path::new("organic.ply"), model.mesh()).unwrap();
            std::fs::write(folder.path().join("organic.ply"), mesh).unwrap();
            Self { folder }
        })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// What is dropped.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// The program in a window that is not there.
struct Window {
    harness: Harness<'static, App>,
}

impl Window {
    fn of(size: (f32, f32), start: Start) -> Self {
        let harness = Harness::builder()
            .with_size([size.0, size.1])
            .with_max_steps(8)
            .wgpu()
            .build_eframe(|context| App::new(context, start));
        let mut window = Self { harness };
        window.settle();
        window
    }

    /// An asset, or what `name` is, looked at as a link says.
    fn open(name: &str, model: Option<&str>, link: &str) -> Self {
        let files = Files::get();
        let start = Start {
            look: Look::read_link(link).unwrap(),
            is_given: true,
            is_bare: false,
            file: Some(Opened {
                path: files.path(name),
                model: model.map(|m| files.path(m)),
            }),
        };
        Self::of(SIZE, start)
    }

    /// Waits until nothing is loaded any more, and draws.
    fn settle(&mut self) {
        let since = Instant::now();
        self.harness.run_steps(2);
        while self.app().is_loading() {
            assert!(
                since.elapsed() < Duration::from_secs(240),
                "it does not end"
            );
            std::thread::sleep(Duration::from_millis(20));
            self.harness.run_steps(1);
        }
        self.harness.run_steps(3);
    }

    fn app(&self) -> &Viewer {
        self.harness.state().viewer()
    }

    fn drop_file(&mut self, path: PathBuf) {
        (self.harness.input_mut().dropped_files).push(Arc::new(Dropped(path)));
        self.harness.run_steps(1);
        self.settle();
    }

    fn press(&mut self, key: Key) {
        self.harness.key_press(key);
        self.harness.run_steps(3);
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.harness.run_steps(3);
    }

    /// Chooses from a list.
    fn choose(&mut self, list: &str, choice: &str) {
        self.click(list);
        self.click(choice);
    }

    /// Where the picture is.
    fn rect(&self) -> Rect {
        self.harness.get_by_label("Picture of the model").rect()
    }

    /// The picture's pixels.
    fn picture(&mut self) -> RgbaImage {
        // The pointer, and what it points at, is no part of the picture.
        self.harness.remove_cursor();
        self.harness.run_steps(2);
        let rect = self.rect();
        let whole = self.harness.render().unwrap();
        let at = |x: f32| x.round().max(0.0) as u32;
        let (x, y) = (at(rect.min.x), at(rect.min.y));
        let (width, height) = (at(rect.max.x) - x, at(rect.max.y) - y);
        image::imageops::crop_imm(&whole, x, y, width, height).to_image()
    }

    fn drag(&mut self, from: Pos2, by: egui::Vec2, button: PointerButton, modifiers: Modifiers) {
        let event = |pos, pressed| egui::Event::PointerButton {
            pos,
            button,
            pressed,
            modifiers,
        };
        self.harness.event(egui::Event::ModifiersChanged(modifiers));
        self.harness.event(egui::Event::PointerMoved(from));
        self.harness.run_steps(1);
        self.harness.event(event(from, true));
        self.harness.run_steps(1);
        self.harness
            .event(egui::Event::PointerMoved(from + 0.5 * by));
        self.harness.run_steps(1);
        self.harness.event(egui::Event::PointerMoved(from + by));
        self.harness.run_steps(1);
        self.harness.event(event(from + by, false));
        self.harness.run_steps(1);
        self.harness
            .event(egui::Event::ModifiersChanged(Modifiers::NONE));
        self.harness.run_steps(2);
    }
}

/// Pixels that differ by more than a little, as a share of all.
fn changed(a: &RgbaImage, b: &RgbaImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differs = |(p, q): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        p.0.iter().zip(q.0).any(|(x, y)| x.abs_diff(y) > 24)
    };
    let count = a.pixels().zip(b.pixels()).filter(differs).count();
    count as f64 / f64::from(a.width() * a.height())
}

#[test]
fn the_picture_is_the_one_that_render_draws() {
    // Without the hint and without panels over it.
    let mut window = Window::open("organic.glb", None, "eye=1.5,1,3");
    window.press(Key::F);
    let rect = window.rect();
    window.drag(
        rect.center(),
        egui::vec2(40.0, 10.0),
        PointerButton::Primary,
        Modifiers::NONE,
    );
    let seen = window.picture();
    let link = window.app().link();
    let look = Look::read_link(&link).unwrap();
    let pose = look.pose.unwrap();
    let asset = window.app().scene().asset.clone().unwrap();
    let gpu = pollster::block_on(silmap_gpu::Gpu::request()).unwrap();
    let mut renderer =
        silmap_study::PictureRenderer::new(&gpu, silmap_study::PictureOptions::default());
    renderer.load_asset(&gpu, &asset).unwrap();
    let mut render = |eye: DVec3| {
        let origin = asset.placement.in_scene;
        let camera = silmap_geometry::Camera::look_at(
            eye - origin,
            pose.target.unwrap() - origin,
            pose.up,
            pose.fov_y_degrees.unwrap().to_radians(),
            seen.dimensions(),
        );
        let params = silmap_study::FrameParams {
            camera: camera.unwrap(),
            mode: silmap_study::Mode::Clipped,
            method: silmap_map::Method::best_for(&asset.map),
            paint: silmap_study::Paint::default(),
            antialias: silmap_study::Antialias::default(),
            background: silmap_study::Background::Colour([0xf4, 0xf5, 0xf7]),
            edges: silmap_study::EdgeParams::default(),
            light: None,
            shadow: None,
        };
        let picture = renderer.render(&gpu, &params).unwrap();
        RgbaImage::from_raw(picture.width, picture.height, picture.rgba).unwrap()
    };
    let same = changed(&seen, &render(pose.eye));
    assert!(same < 1e-3, "{same} of the pixels differ");
    // An eye a little beside it sees another picture.
    let other = changed(&seen, &render(pose.eye + DVec3::new(0.1, 0.0, 0.0)));
    assert!(other > 10.0 * same.max(2e-4), "{other} beside {same}");
}

#[test]
fn each_control_changes_what_it_says() {
    let mut window = Window::open("organic.glb", Some("organic.ply"), "");
    let mut before = window.picture();
    let mut differs = |window: &mut Window, what: &str, least: f64| {
        let after = window.picture();
        let share = changed(&before, &after);
        assert!(share >= least, "{what} changed {share} of the pixels");
        before = after;
    };
    window.choose("Show", "Coarse hull");
    assert_eq!(window.app().look().shown, Shown::Coarse);
    differs(&mut window, "the hull's facets", 0.02);
    window.choose("Show", "Original mesh");
    differs(&mut window, "the full mesh", 0.02);
    window.choose("Show", "Difference");
    differs(&mut window, "differences", 0.02);
    window.choose("Show", "Silhouette");
    differs(&mut window, "the silhouette", 0.02);
    window.choose("Show", "Clipped hull");
    differs(&mut window, "the clipped hull", 0.02);
    window.choose("Paint", "One colour, lit");
    differs(&mut window, "one colour", 0.02);
    window.choose("Paint", "Relief");
    differs(&mut window, "relief", 0.02);
    window.choose("Method", "Paper");
    differs(&mut window, "the paper's method", 1e-4);
    window.choose("Method", "Best for the asset");
    differs(&mut window, "the best method", 1e-4);
    window.choose("Edges", "None");
    differs(&mut window, "hard edges", 1e-4);
    window.choose("Edges", "Soft");
    differs(&mut window, "soft edges", 1e-4);
    (window
        .harness
        .get_by_role_and_label(egui::Role::Slider, "Views"))
    .set_value_accesskit(8.0);
    window.harness.run_steps(3);
    assert_eq!(window.app().look().keep, Some(8));
    differs(&mut window, "eight views", 1e-4);
    (window
        .harness
        .get_by_role_and_label(egui::Role::Slider, "Views"))
    .set_value_accesskit(32.0);
    window.harness.run_steps(3);
    assert_eq!(window.app().look().keep, None);
    differs(&mut window, "all views", 1e-4);
    for (overlay, least) in [
        ("Outline", 1e-3),
        ("Current triangle and its contours", 0.01),
        ("Polytope of viewpoints", 1e-3),
        ("Captured cameras", 1e-3),
    ] {
        // From far away, so that the polytope is in the picture.
        window.click(overlay);
        if least <= 1e-3 && overlay != "Outline" {
            for _ in 0..14 {
                window.press(Key::Minus);
            }
        }
        differs(&mut window, overlay, least);
        window.click(overlay);
        window.press(Key::F);
        let _ = window.picture();
        before_again(&mut window, &mut differs);
    }
    window.click("Beside another");
    assert!(window.app().look().beside.is_some());
    differs(&mut window, "another picture beside it", 1e-3);
    window.click("Beside another");
    window.click("Left");
    differs(&mut window, "the view from the left", 0.02);
    window.click("A thousand instances");
    differs(&mut window, "a thousand instances", 0.02);
    window.click("Move the light");
    differs(&mut window, "the light of many", 0.005);
    window.click("A thousand instances");
    differs(&mut window, "one of them", 0.02);
    window.click("Move the light");
    differs(&mut window, "the light of one", 0.01);
}

/// Takes the picture as it is now for the next comparison.
fn before_again(window: &mut Window, differs: &mut impl FnMut(&mut Window, &str, f64)) {
    differs(window, "nothing", 0.0);
}

#[test]
fn mouse_and_keys_move_the_camera() {
    let mut window = Window::open("organic.glb", None, "");
    let center = window.rect().center();
    let by = egui::vec2(60.0, 25.0);
    let ways = [
        ("turn", PointerButton::Primary, Modifiers::NONE),
        ("move", PointerButton::Secondary, Modifiers::NONE),
        ("move", PointerButton::Middle, Modifiers::NONE),
        ("roll", PointerButton::Primary, Modifiers::CTRL),
        ("move", PointerButton::Primary, Modifiers::SHIFT),
    ];
    for (what, button, modifiers) in ways {
        let before = Look::read_link(&window.app().link()).unwrap().pose.unwrap();
        window.drag(center, by, button, modifiers);
        let after = Look::read_link(&window.app().link()).unwrap().pose.unwrap();
        let has_moved = after.target.unwrap().distance(before.target.unwrap()) > 1e-3;
        let has_turned = after.eye.distance(before.eye) > 1e-3 && !has_moved;
        let has_rolled = after.up != before.up;
        assert_eq!(has_moved, what == "move", "{what} {button:?} {modifiers:?}");
        assert_eq!(
            has_turned,
            what == "turn",
            "{what} {button:?} {modifiers:?}"
        );
        assert_eq!(
            has_rolled && !has_moved && !has_turned,
            what == "roll",
            "{what} {button:?}: {before:?} {after:?}"
        );
    }
    window.press(Key::F);
    let framed = window.app().link();
    for key in [
        Key::ArrowLeft,
        Key::ArrowUp,
        Key::Plus,
        Key::Comma,
        Key::Num1,
        Key::Num5,
    ] {
        let before = window.app().link();
        window.press(key);
        assert_ne!(window.app().link(), before, "{key:?}");
    }
    assert_ne!(window.app().link(), framed);
    let view = |window: &Window| Look::read_link(&window.app().link()).unwrap().pose.unwrap();
    let before = view(&window);
    window.harness.hover_at(center);
    window.harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 120.0),
        modifiers: Modifiers::NONE,
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
    });
    window.harness.run_steps(20);
    let near = |v: &silmap_viewer::look::Pose| v.eye.distance(v.target.unwrap());
    assert!(
        near(&view(&window)) < near(&before),
        "the wheel comes nearer"
    );
    // Two fingers that part and turn: nearer, and the picture turns with them.
    window.press(Key::Num1);
    let before = view(&window);
    let touch = |id: u64, phase, at: egui::Vec2| egui::Event::Touch {
        device_id: egui::TouchDeviceId(0),
        id: egui::TouchId(id),
        phase,
        pos: center + at,
        force: None,
    };
    use egui::TouchPhase::{End, Move, Start};
    let fingers = |turn: f32, apart: f32| apart * egui::Vec2::angled(turn);
    for (id, side) in [(1, 1.0), (2, -1.0)] {
        window
            .harness
            .event(touch(id, Start, side * fingers(0.0, 60.0)));
    }
    window.harness.run_steps(1);
    for step in 1..=8 {
        let share = step as f32 / 8.0;
        for (id, side) in [(1, 1.0), (2, -1.0)] {
            let at = side * fingers(0.6 * share, 60.0 + 50.0 * share);
            window.harness.event(touch(id, Move, at));
        }
        window.harness.run_steps(1);
    }
    for (id, side) in [(1, 1.0), (2, -1.0)] {
        window
            .harness
            .event(touch(id, End, side * fingers(0.6, 110.0)));
    }
    window.harness.run_steps(2);
    let after = view(&window);
    assert!(
        near(&after) < near(&before),
        "fingers that part come nearer"
    );
    // The picture has turned clockwise with them: what is up in it now was on its upper left.
    let up = after.up.unwrap();
    assert!(up.x < -0.3 && up.y > 0.5, "the picture turned by {up}");
}

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
            model: None,
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
fn windows_of_all_sizes_show_everything() {
    for size in [(320.0, 480.0), (900.0, 620.0), (1900.0, 1000.0)] {
        let files = Files::get();
        let start = Start {
            file: Some(Opened {
                path: files.path("organic.glb"),
                model: None,
            }),
            ..Start::default()
        };
        let mut window = Window::of(size, start);
        let rect = window.rect();
        assert!(
            rect.width() >= 300.0 && rect.height() > 150.0,
            "{size:?}: {rect:?}"
        );
        // To nothing and back.
        window.harness.set_size(egui::vec2(0.0, 0.0));
        window.harness.run_steps(2);
        window.harness.set_size(egui::vec2(size.0, size.1));
        window.harness.run_steps(3);
        assert_eq!(window.rect(), rect);
        assert!(
            window.app().message().is_none(),
            "{:?}",
            window.app().message()
        );
        let whole = window.harness.render().unwrap();
        if let Ok(folder) = std::env::var("SILMAP_PICTURES") {
            whole
                .save(format!("{folder}/window-{}.png", size.0))
                .unwrap();
        }
    }
}

#[test]
fn a_hundred_assets_one_after_the_other_leave_nothing_behind() {
    let mut window = Window::open("organic.glb", None, "");
    let path = Files::get().path("organic.glb");
    let mut before = 0;
    for k in 0..100 {
        window.drop_file(path.clone());
        assert!(window.app().message().is_none());
        if k == 20 {
            let _ = window.picture();
            before = resident_bytes();
        }
    }
    let _ = window.picture();
    let grown = resident_bytes().saturating_sub(before);
    // Twenty assets had been dropped by then: what grows, grows by their share.
    assert!(grown < 48 << 20, "{} MiB more after 79 assets", grown >> 20);
}

/// Memory that this process has, where the system says so.
fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

#[test]
fn a_picture_and_a_turn_are_written() {
    let mut window = Window::open("organic.glb", None, "");
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("seen.png");
    let field = window.harness.get_by_label("File of the picture");
    field.focus();
    window.harness.run_steps(2);
    window
        .harness
        .key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.harness.run_steps(1);
    (window.harness.get_by_label("File of the picture")).type_text(name.to_str().unwrap());
    window.harness.run_steps(2);
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
