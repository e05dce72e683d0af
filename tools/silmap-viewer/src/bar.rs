//! What is around the picture: the bar, what goes on and what is said, help, and keys that work everywhere.

use egui::{Align2, Color32, FontId, Key, RichText, vec2};

use crate::orbit::StandardView;
use crate::viewer::Viewer;

pub(crate) fn top_bar(viewer: &mut Viewer, ui: &mut egui::Ui) {
    ui.horizontal_wrapped(|ui| {
        let controls = ui.selectable_label(viewer.panel_is_open, "Controls");
        if controls
            .on_hover_text("show or hide the controls (M)")
            .clicked()
        {
            viewer.panel_is_open ^= true;
        }
        if ui
            .button("Frame")
            .on_hover_text("look at all of it (F)")
            .clicked()
        {
            viewer.frame();
        }
        let help = ui.selectable_label(viewer.help_is_open, "Help");
        if help.on_hover_text("mouse, touch and keys (H)").clicked() {
            viewer.help_is_open ^= true;
        }
        if !viewer.scene.is_empty() {
            ui.separator();
            let name = RichText::new(&viewer.scene.name).strong();
            ui.add(egui::Label::new(name).truncate());
        }
    });
}

pub(crate) fn loading_bar(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let Some(loading) = viewer.loading.as_ref().filter(|l| l.is_long()) else {
        return;
    };
    let (what, share) = &loading.progress;
    ui.horizontal_wrapped(|ui| {
        ui.spinner();
        if ui.button("Cancel").clicked() {
            loading.stop();
        }
        if let Some(share) = share {
            let width = ui.available_width().clamp(60.0, 180.0);
            let bar = egui::ProgressBar::new(*share).desired_width(width);
            ui.add(bar.show_percentage());
        }
        ui.label(format!("{what}: {}", loading.name));
    });
}

pub(crate) fn message_bar(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let Some(message) = viewer.message.clone() else {
        return;
    };
    ui.horizontal_top(|ui| {
        if ui.button("Close").clicked() {
            viewer.message = None;
        }
        let colour = if message.is_error {
            ui.visuals().error_fg_color
        } else {
            ui.visuals().warn_fg_color
        };
        egui::ScrollArea::vertical()
            .max_height(90.0)
            .show(ui, |ui| {
                ui.add(egui::Label::new(RichText::new(&message.text).color(colour)).wrap());
            });
    });
}

pub(crate) fn help_window(viewer: &mut Viewer, context: &egui::Context) {
    let mut is_open = viewer.help_is_open;
    egui::Window::new("Help")
        .open(&mut is_open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(context, |ui| {
            // What a small window has room for, with a title above; the rest is scrolled to.
            let room = context.content_rect().size() - vec2(24.0, 56.0);
            let width = room.x.min(HELP_WIDTH);
            let column = width * 0.5 - 12.0;
            egui::ScrollArea::vertical()
                .max_height(room.y)
                .show(ui, |ui| {
                    egui::Grid::new("keys")
                        .num_columns(2)
                        .max_col_width(column)
                        .striped(true)
                        .show(ui, |ui| {
                            for (what, does) in HELP {
                                ui.add(egui::Label::new(RichText::new(*what).strong()).wrap());
                                ui.add(egui::Label::new(*does).wrap());
                                ui.end_row();
                            }
                        });
                });
        });
    viewer.help_is_open = is_open;
}

/// What to do first, while there is nothing to see.
pub(crate) fn welcome(viewer: &Viewer, ui: &egui::Ui, rect: egui::Rect) {
    if !viewer.scene.is_empty() || viewer.loading.is_some() {
        return;
    }
    let text = if cfg!(target_arch = "wasm32") {
        "Drop an asset (.glb) here"
    } else {
        "Drop an asset (.glb), a mesh or a folder of photographs here"
    };
    // In the colour of labels over the picture, whose background is light.
    let colour = Color32::from_gray(40);
    let (font, width) = (FontId::proportional(18.0), 0.9 * rect.width());
    let mut job = egui::text::LayoutJob::simple(text.to_owned(), font, colour, width);
    job.halign = egui::Align::Center;
    let galley = ui.painter().layout_job(job);
    let place = rect.center() - vec2(0.0, 0.5 * galley.size().y);
    ui.painter().galley(place, galley, colour);
}

/// Keys that work wherever no text is typed.
pub(crate) fn take_keys(viewer: &mut Viewer, context: &egui::Context) {
    if context.text_edit_focused() {
        return;
    }
    let pressed = |key: Key| context.input(|i| i.key_pressed(key) && !i.modifiers.any());
    let sides = [
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::Num4,
        Key::Num5,
        Key::Num6,
    ];
    for (key, view) in sides.into_iter().zip(StandardView::ALL) {
        if pressed(key) {
            viewer.orbit.look_from(view);
        }
    }
    if pressed(Key::F) {
        viewer.frame();
    }
    let flags = [
        (Key::O, &mut viewer.look.overlays.outline),
        (Key::P, &mut viewer.look.overlays.polytope),
        (Key::T, &mut viewer.look.overlays.triangle),
        (Key::C, &mut viewer.look.overlays.cameras),
        (Key::G, &mut viewer.look.overlays.photographs),
        (Key::H, &mut viewer.help_is_open),
        (Key::R, &mut viewer.is_turning),
        (Key::M, &mut viewer.panel_is_open),
    ];
    for (key, flag) in flags {
        if pressed(key) {
            *flag ^= true;
        }
    }
    #[cfg(not(target_arch = "wasm32"))]
    for (key, forward) in [(Key::OpenBracket, false), (Key::CloseBracket, true)] {
        if pressed(key) {
            viewer.step_shots(forward);
        }
    }
    if pressed(Key::B) {
        viewer.look.toggle_beside(viewer.scene.model.is_some());
    }
    if pressed(Key::I) && viewer.scene.asset.is_some() {
        let many = viewer.look.instances == 1;
        viewer.set_instances(if many { 1000 } else { 1 });
    }
    if pressed(Key::Escape) {
        if viewer.help_is_open {
            viewer.help_is_open = false;
        } else if let Some(loading) = &viewer.loading {
            loading.stop();
        } else {
            viewer.message = None;
        }
    }
}

/// The help's lines are broken beyond this width, points.
const HELP_WIDTH: f32 = 520.0;

const HELP: &[(&str, &str)] = &[
    ("drag, one finger", "turn"),
    ("right or middle drag, two fingers", "move"),
    ("wheel, pinch", "nearer, farther"),
    ("Ctrl + drag, two fingers turned", "roll"),
    ("arrows", "turn; with Shift: move"),
    ("+  −", "nearer, farther"),
    (",  .", "roll"),
    ("F", "look at all of it"),
    ("1 to 6", "front, back, left, right, top, bottom"),
    ("B", "two pictures beside each other"),
    ("O  P  T  C", "outline, polytope, triangle, cameras"),
    #[cfg(not(target_arch = "wasm32"))]
    ("G  [  ]", "photographs; the one before, the next"),
    ("I", "a thousand instances"),
    ("R", "turn by itself"),
    ("M  H  Esc", "controls, help, cancel"),
];
