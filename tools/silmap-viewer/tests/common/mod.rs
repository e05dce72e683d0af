//! The program in a window that is not there, files to open in it, and what its pictures differ by.
#![allow(
    clippy::unwrap_used,
    dead_code,
    reason = "a test may panic, and not every one uses everything"
)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers, PointerButton, Pos2, Rect};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use image::RgbaImage;
use silmap_geometry::{ClosedMesh, Watch};
use silmap_map::asset;
use silmap_preprocess::pipeline::{self, BuildParams};
use silmap_viewer::look::Look;
use silmap_viewer::{App, Opened, Start, Viewer};

pub(crate) const SIZE: (f32, f32) = (900.0, 620.0);

/// An asset and its mesh, made once for all tests.
pub(crate) struct Files {
    pub(crate) folder: tempfile::TempDir,
}

impl Files {
    pub(crate) fn get() -> &'static Self {
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

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// What is dropped.
#[derive(Debug)]
pub(crate) struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// The program in a window that is not there.
pub(crate) struct Window {
    pub(crate) harness: Harness<'static, App>,
}

impl Window {
    pub(crate) fn of(size: (f32, f32), start: Start) -> Self {
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
    pub(crate) fn open(name: &str, model: Option<&str>, link: &str) -> Self {
        let files = Files::get();
        let start = Start {
            look: Look::read_link(link).unwrap(),
            is_given: true,
            is_bare: false,
            file: Some(Opened {
                path: files.path(name),
                model: model.map(|m| files.path(m)),
                capture: None,
            }),
        };
        Self::of(SIZE, start)
    }

    /// Waits until nothing is loaded any more, and draws.
    pub(crate) fn settle(&mut self) {
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

    pub(crate) fn app(&self) -> &Viewer {
        self.harness.state().viewer()
    }

    /// Faces of the hull that is shown.
    pub(crate) fn hull_faces(&self) -> usize {
        self.app().scene().asset.as_ref().unwrap().hull.faces.len()
    }

    pub(crate) fn drop_file(&mut self, path: PathBuf) {
        (self.harness.input_mut().dropped_files).push(Arc::new(Dropped(path)));
        self.harness.run_steps(1);
        self.settle();
    }

    /// Drops a file and does not wait for it.
    pub(crate) fn begin_drop(&mut self, path: PathBuf) {
        (self.harness.input_mut().dropped_files).push(Arc::new(Dropped(path)));
        self.harness.run_steps(2);
    }

    /// Waits until something holds, or until nothing is loaded any more.
    pub(crate) fn wait_until(&mut self, holds: impl Fn(&Viewer) -> bool) {
        let since = Instant::now();
        while !holds(self.app()) && self.app().is_loading() {
            assert!(
                since.elapsed() < Duration::from_secs(400),
                "it does not end"
            );
            std::thread::sleep(Duration::from_millis(20));
            self.harness.run_steps(1);
        }
        self.harness.run_steps(3);
    }

    /// Gives a thread that reads a small picture the time for it.
    pub(crate) fn wait_a_little(&mut self) {
        for _ in 0..20 {
            std::thread::sleep(Duration::from_millis(50));
            self.harness.run_steps(1);
        }
    }

    /// Types the name that pictures are saved under.
    pub(crate) fn name_file(&mut self, name: &str) {
        let field = self.harness.get_by_label("File of the picture");
        field.focus();
        self.harness.run_steps(2);
        self.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        self.harness.run_steps(1);
        (self.harness.get_by_label("File of the picture")).type_text(name);
        self.harness.run_steps(2);
    }

    pub(crate) fn press(&mut self, key: Key) {
        self.harness.key_press(key);
        self.harness.run_steps(3);
    }

    pub(crate) fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.harness.run_steps(3);
        self.settle();
    }

    /// Puts a slider somewhere.
    pub(crate) fn slide(&mut self, label: &str, value: f64) {
        let slider = self
            .harness
            .get_by_role_and_label(egui::Role::Slider, label);
        slider.set_value_accesskit(value);
        self.harness.run_steps(3);
        self.settle();
    }

    /// Chooses from a list.
    pub(crate) fn choose(&mut self, list: &str, choice: &str) {
        self.click(list);
        self.click(choice);
    }

    /// Where the picture is.
    pub(crate) fn rect(&self) -> Rect {
        self.harness.get_by_label("Picture of the model").rect()
    }

    /// The picture's pixels.
    pub(crate) fn picture(&mut self) -> RgbaImage {
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

    pub(crate) fn drag(
        &mut self,
        from: Pos2,
        by: egui::Vec2,
        button: PointerButton,
        modifiers: Modifiers,
    ) {
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
pub(crate) fn changed(a: &RgbaImage, b: &RgbaImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differs = |(p, q): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        p.0.iter().zip(q.0).any(|(x, y)| x.abs_diff(y) > 24)
    };
    let count = a.pixels().zip(b.pixels()).filter(differs).count();
    count as f64 / f64::from(a.width() * a.height())
}
