//! The viewer as people use it: each control is worked, and pixels say what changed.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{Files, Window, changed};
use egui::{Key, Modifiers, PointerButton};
use glam::DVec3;
use image::RgbaImage;
use silmap_viewer::look::{Look, Shown};
use silmap_viewer::{Opened, Start};

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
    window.slide("Views", 8.0);
    assert_eq!(window.app().look().keep, Some(8));
    differs(&mut window, "eight views", 1e-4);
    let own = window.app().scene().loaded().unwrap().hull.faces.len();
    window.slide("Hull faces", 320.0);
    assert_eq!(window.app().look().faces, Some(320));
    let asset = window.app().scene().asset.clone().unwrap();
    let (faces, views) = (asset.hull.faces.len(), asset.map.views.len());
    assert!(
        (own + 1..=320).contains(&faces) && views == 8,
        "{faces} faces, {views} views"
    );
    differs(&mut window, "a finer hull", 1e-4);
    // A hull that cannot be as coarse as that is as coarse as it can be.
    window.slide("Hull faces", 20.0);
    let faces = window.hull_faces();
    assert!(faces < own, "{faces}");
    let coarsest = window.app().look().faces;
    assert_eq!(coarsest, Some(faces.max(20) as u32));
    window.slide("Hull faces", own as f64);
    assert_eq!(window.app().look().faces, None);
    differs(&mut window, "all faces", 1e-4);
    window.slide("Views", 32.0);
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
    window.choose("Layout", "Side by side");
    differs(&mut window, "two whole pictures", 0.02);
    window.choose("Show", "Clipped hull");
    window.choose("Show, right", "Clipped hull");
    let halves = |window: &mut Window| {
        let whole = window.picture();
        let half = whole.width() / 2;
        // Below the labels, above the hint, and without the line between them.
        let (width, height) = (half - 8, whole.height() - 80);
        let part = |x| image::imageops::crop_imm(&whole, x + 4, 40, width, height).to_image();
        changed(&part(0), &part(half))
    };
    assert!(halves(&mut window) < 2e-3, "the same twice");
    window.choose("Method, right", "Paper");
    assert!(halves(&mut window) > 2e-3, "another method on the right");
    window.choose("Method, right", "Best for the asset");
    window.choose("Layout", "Split at a line");
    window.choose("Show", "Clipped hull");
    before_again(&mut window, &mut differs);
    window.click("Beside another");
    window.click("Left");
    differs(&mut window, "the view from the left", 0.02);
    window.choose("Upwards", "z");
    differs(&mut window, "z upwards", 0.02);
    window.choose("Upwards", "As captured, or y");
    before_again(&mut window, &mut differs);
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
    // What is let go while it turns stands still, unless inertia is asked for.
    for (has_inertia, what) in [(false, "it stands"), (true, "it goes on")] {
        window.drag(center, by, PointerButton::Primary, Modifiers::NONE);
        let before = window.app().link();
        window.harness.run_steps(4);
        assert_eq!(window.app().link() != before, has_inertia, "{what}");
        window.click("Inertia");
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
fn windows_of_all_sizes_show_everything() {
    for size in [(320.0, 480.0), (900.0, 620.0), (1900.0, 1000.0)] {
        let files = Files::get();
        let start = Start {
            file: Some(Opened {
                path: files.path("organic.glb"),
                ..Opened::default()
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
