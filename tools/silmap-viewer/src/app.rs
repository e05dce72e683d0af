//! The program in its window, or on its page: files come in, and all is laid out.

use egui::{Align2, Color32, FontId, Panel};

use crate::loader::{Loading, News};
#[cfg(not(target_arch = "wasm32"))]
use crate::start::Opened;
use crate::start::Start;
use crate::viewer::Viewer;
use crate::{bar, left, panel, viewport};

/// Under this width the controls lie below the picture.
const NARROW: f32 = 640.0;

/// The program.
#[derive(Debug)]
pub struct App {
    pub(crate) viewer: Viewer,
    panel_is_set: bool,
    is_bare: bool,
    #[cfg(target_arch = "wasm32")]
    pub(crate) context: egui::Context,
    /// What a page asked to be opened.
    #[cfg(target_arch = "wasm32")]
    pub(crate) pending_address: Option<String>,
    /// What the keyboard is at, or what was done last, in words.
    #[cfg(target_arch = "wasm32")]
    pub(crate) described: String,
}

impl App {
    /// In a window, or on a page.
    #[must_use]
    pub fn new(context: &eframe::CreationContext<'_>, start: Start) -> Self {
        let (look, file) = match context.storage {
            Some(storage) => left::as_it_was(&|key| storage.get_string(key), &start),
            None => (start.look, start.file.clone()),
        };
        let mut viewer = Viewer::new(context.wgpu_render_state.as_ref(), look);
        viewer.hint_is_shown = !start.is_bare;
        let mut app = Self {
            viewer,
            panel_is_set: false,
            is_bare: start.is_bare,
            #[cfg(target_arch = "wasm32")]
            context: context.egui_ctx.clone(),
            #[cfg(target_arch = "wasm32")]
            pending_address: None,
            #[cfg(target_arch = "wasm32")]
            described: String::new(),
        };
        if let Some(file) = file {
            app.open(&context.egui_ctx, file);
        }
        app
    }

    /// What it knows.
    #[must_use]
    pub fn viewer(&self) -> &Viewer {
        &self.viewer
    }

    /// Opens a file in place of what is shown, once it is read.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn open(&mut self, context: &egui::Context, file: Opened) {
        let Some(stage) = &self.viewer.stage else {
            return;
        };
        let opening = crate::opening::Opening {
            opened: file,
            maker: stage.maker(),
            shape: self.viewer.wanted_of_next(),
            shown: self.viewer.scene.clone(),
        };
        self.viewer.loading = Some(crate::files::open(context, opening));
    }

    /// Opens an address.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn open(&mut self, context: &egui::Context, address: String) {
        let Some(stage) = &self.viewer.stage else {
            return;
        };
        let how = (stage.maker(), self.viewer.wanted_of_next());
        self.viewer.loading = Some(crate::fetch::fetch(context, address, how));
    }

    /// Sees what loading has to tell.
    fn hear(&mut self) {
        while let Some(loading) = &mut self.viewer.loading {
            match loading.next() {
                None => return,
                Some(News::Progress(..)) => {}
                Some(News::Preview(ready)) => self.viewer.show(*ready),
                Some(News::Done(ready)) => {
                    self.viewer.loading = None;
                    self.viewer.show(*ready);
                }
                Some(News::Stopped) => {
                    self.give_up();
                    self.viewer.say("stopped", false);
                }
                Some(News::Said(text)) => {
                    self.viewer.loading = None;
                    self.viewer.say(text, false);
                }
                Some(News::Failed(text)) => {
                    self.give_up();
                    self.viewer.say(text, true);
                }
            }
        }
    }

    /// What was begun does not come.
    fn give_up(&mut self) {
        let ended = self.viewer.loading.take();
        if let Some(asked) = ended.and_then(|loading| loading.reshapes) {
            self.viewer.fall_back(asked);
        }
    }

    /// Files that were dropped onto the window; the last one is opened.
    fn take_dropped(&mut self, context: &egui::Context) {
        let dropped = context.input(|input| input.raw.dropped_files.last().cloned());
        let Some(file) = dropped else { return };
        #[cfg(not(target_arch = "wasm32"))]
        {
            let path = file.path().to_owned();
            let opened = Opened {
                path,
                ..Opened::default()
            };
            self.open(context, opened);
        }
        #[cfg(target_arch = "wasm32")]
        {
            let Some(stage) = &self.viewer.stage else {
                return;
            };
            let how = (stage.maker(), self.viewer.wanted_of_next());
            self.viewer.loading = Some(crate::fetch::read_dropped(context, file, how));
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        if !self.panel_is_set {
            self.panel_is_set = true;
            self.viewer.panel_is_open = ui.available_width() >= NARROW && !self.is_bare;
        }
        self.hear();
        #[cfg(target_arch = "wasm32")]
        if let Some(address) = self.pending_address.take() {
            self.open(&context, address);
        }
        self.take_dropped(&context);
        self.viewer.catch_up(&context);
        bar::take_keys(&mut self.viewer, &context);
        let is_long = self.viewer.loading.as_ref().is_some_and(Loading::is_long);
        if !self.is_bare || is_long || self.viewer.message.is_some() {
            Panel::top("bar").show(ui, |ui| {
                if !self.is_bare {
                    bar::top_bar(&mut self.viewer, ui);
                }
                bar::loading_bar(&mut self.viewer, ui);
                bar::message_bar(&mut self.viewer, ui);
            });
        }
        let is_narrow = ui.available_width() < NARROW;
        if self.viewer.panel_is_open {
            let side = if is_narrow {
                let height = ui.available_height();
                Panel::bottom("controls")
                    .exact_size((0.45 * height).max(60.0))
                    .resizable(false)
            } else {
                Panel::right("controls").exact_size(270.0).resizable(false)
            };
            side.show(ui, |ui| {
                egui::ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| panel::controls(&mut self.viewer, ui));
            });
        }
        let frame = egui::Frame::new().fill(Color32::from_rgb(0xf4, 0xf5, 0xf7));
        egui::CentralPanel::no_frame().frame(frame).show(ui, |ui| {
            let rect = ui.max_rect();
            viewport::show(&mut self.viewer, ui);
            bar::welcome(&self.viewer, ui, rect);
        });
        bar::help_window(&mut self.viewer, &context);
        #[cfg(target_arch = "wasm32")]
        {
            let described = context.output(egui::PlatformOutput::events_description);
            if !described.is_empty() {
                self.described = described;
            }
        }
        if self.hovers_file(&context) {
            let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop"));
            let painter = context.layer_painter(layer);
            let rect = context.content_rect();
            painter.rect_filled(rect, 0.0, Color32::from_black_alpha(120));
            let font = FontId::proportional(24.0);
            painter.text(
                rect.center(),
                Align2::CENTER_CENTER,
                "Drop it to open it",
                font,
                Color32::WHITE,
            );
        }
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        for (key, value) in left::to_keep(self.viewer.link(), &self.viewer.scene) {
            storage.set_string(key, value);
        }
    }

    fn clear_color(&self, _: &egui::Visuals) -> [f32; 4] {
        [0.95, 0.96, 0.97, 1.0]
    }

    #[cfg(target_arch = "wasm32")]
    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(self)
    }
}

impl App {
    fn hovers_file(&self, context: &egui::Context) -> bool {
        context.input(|input| !input.raw.hovered_files.is_empty())
    }
}
