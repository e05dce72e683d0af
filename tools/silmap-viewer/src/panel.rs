//! The controls beside the picture.

use egui::{ComboBox, RichText, Slider, Ui};
use glam::DVec3;

use crate::look::{Look, MethodChoice, Named, Shown};
use crate::orbit::StandardView;
use crate::viewer::Viewer;
use silmap_study::{Antialias, Paint};

/// A list to choose from.
fn choice<T: Named>(ui: &mut Ui, label: &str, value: &mut T, can: impl Fn(T) -> bool) -> bool {
    let before = *value;
    ComboBox::from_label(label)
        .selected_text(value.label())
        .width(150.0)
        .show_ui(ui, |ui| {
            for &(one, _, name) in T::ALL {
                ui.add_enabled_ui(can(one), |ui| {
                    ui.selectable_value(value, one, name);
                });
            }
        });
    *value != before
}

/// All of them.
pub(crate) fn controls(viewer: &mut Viewer, ui: &mut Ui) {
    let has_asset = viewer.scene.asset.is_some();
    let has_model = viewer.scene.model.is_some();
    let can_show = move |shown: Shown| {
        (!shown.needs_asset() || has_asset) && (!shown.needs_model() || has_model)
    };
    ui.heading("Picture");
    choice(ui, "Show", &mut viewer.look.shown, can_show);
    let mut is_beside = viewer.look.beside.is_some();
    if ui.checkbox(&mut is_beside, "Beside another").changed() {
        viewer.look.toggle_beside(has_model);
    }
    if let Some(beside) = &mut viewer.look.beside {
        choice(ui, "Right", beside, can_show);
        ui.add(
            Slider::new(&mut viewer.look.split, 0.02..=0.98)
                .text("Line")
                .show_value(false),
        );
    }
    ui.add_enabled_ui(has_asset, |ui| asset_controls(viewer, ui));
    light_controls(viewer, ui);
    ui.separator();
    ui.heading("Overlays");
    ui.add_enabled_ui(has_asset, |ui| {
        for (_, label, is_on) in viewer.look.overlays.flags() {
            ui.checkbox(is_on, label);
        }
    });
    ui.separator();
    ui.heading("View");
    ui.horizontal_wrapped(|ui| {
        for view in StandardView::ALL {
            if ui.small_button(view.name()).clicked() {
                viewer.orbit.look_from(view);
            }
        }
    });
    ui.checkbox(&mut viewer.is_turning, "Turn by itself");
    if ui.button("Copy a link to this view").clicked() {
        ui.ctx().copy_text(viewer.link());
    }
    #[cfg(not(target_arch = "wasm32"))]
    ui.horizontal(|ui| {
        if ui.button("Save picture").clicked() {
            crate::export::save_picture(viewer);
        }
        let name = egui::TextEdit::singleline(&mut viewer.export.name).desired_width(130.0);
        let name = ui.add(name);
        name.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::TextInput, true, "File of the picture")
        });
    });
    #[cfg(not(target_arch = "wasm32"))]
    ui.add_enabled_ui(viewer.loading.is_none() && !viewer.scene.is_empty(), |ui| {
        let turn = ui.button("Save a turn");
        if turn
            .on_hover_text("an animated WebP, under the same name")
            .clicked()
        {
            crate::export::save_turn(viewer, ui.ctx());
        }
    });
    ui.separator();
    facts(viewer, ui);
}

fn asset_controls(viewer: &mut Viewer, ui: &mut Ui) {
    let has_depth = viewer
        .scene
        .asset
        .as_ref()
        .is_some_and(|a| a.map.has_depth());
    let can_use = |choice: MethodChoice| has_depth || choice.0 != Some(silmap_map::Method::Tight);
    choice(ui, "Method", &mut viewer.look.method, can_use);
    choice(ui, "Paint", &mut viewer.look.paint, |_: Paint| true);
    let mut is_many = viewer.look.instances > 1;
    // Many are always drawn by samples.
    ui.add_enabled_ui(!is_many, |ui| {
        choice(ui, "Edges", &mut viewer.look.antialias, |_: Antialias| true);
    });
    if ui.checkbox(&mut is_many, "A thousand instances").changed() {
        viewer.set_instances(if is_many { 1000 } else { 1 });
    }
    let whole = viewer.whole.as_ref().or(viewer.scene.asset.as_ref());
    let can_keep =
        whole.is_some_and(|a| a.record.order.is_some()) && cfg!(not(target_arch = "wasm32"));
    if let Some(all) = whole.map(|a| a.map.views.len() as u32).filter(|_| can_keep) {
        let mut keep = viewer.look.keep.unwrap_or(all).min(all);
        let least = 8.min(all);
        let slider = ui.add(Slider::new(&mut keep, least..=all).text("Views"));
        if slider.changed() {
            viewer.look.keep = (keep < all).then_some(keep);
        }
        // The asset is loaded anew for it: not for each number that is dragged over.
        if slider.drag_stopped() || slider.changed() && !slider.dragged() {
            viewer.apply_keep();
        }
    }
}

fn light_controls(viewer: &mut Viewer, ui: &mut Ui) {
    let mut is_moved = viewer.look.light.is_some();
    if ui.checkbox(&mut is_moved, "Move the light").changed() {
        viewer.look.light = is_moved.then_some(DVec3::new(0.5, 0.8, 0.6));
        viewer.apply_light();
    }
    if let Some(light) = &mut viewer.look.light {
        let mut azimuth = light.x.atan2(light.z).to_degrees();
        let mut elevation = (light.y / light.length()).asin().to_degrees();
        let turned = ui.add(
            Slider::new(&mut azimuth, -180.0..=180.0)
                .text("Around")
                .suffix("°")
                .fixed_decimals(0),
        );
        let raised = ui.add(
            Slider::new(&mut elevation, -90.0..=90.0)
                .text("Above")
                .suffix("°")
                .fixed_decimals(0),
        );
        if turned.changed() || raised.changed() {
            let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
            let (sin_e, cos_e) = elevation.to_radians().sin_cos();
            *light = DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
        }
    }
}

/// What is known of what is shown, and how long it takes.
fn facts(viewer: &mut Viewer, ui: &mut Ui) {
    let row = |ui: &mut Ui, what: &str, value: String| {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(what).weak());
            ui.label(value);
        });
    };
    if let Some(asset) = &viewer.scene.asset {
        row(ui, "Asset", kilobytes(viewer.scene.bytes));
        let (views, faces) = (asset.map.views.len(), asset.hull.faces.len());
        row(ui, "Views", views.to_string());
        row(ui, "Hull", format!("{faces} faces"));
        row(
            ui,
            "Made from",
            format!("{} faces", asset.record.model_faces),
        );
    }
    if let Some(model) = &viewer.scene.model {
        row(ui, "Mesh", format!("{} faces", model.faces.len()));
    }
    #[cfg(not(target_arch = "wasm32"))]
    if let (Some(asset), Some(model)) = (&viewer.scene.asset, &viewer.scene.model) {
        let eye = viewer.orbit.eye();
        let method = viewer.scene.method(viewer.look.method.0);
        let known = viewer.error.ask(ui.ctx(), (eye, method), (asset, model));
        let side = crate::live_error::SIDE_PX;
        let (share, off) = match known.map(|(found, is_now)| (found, found.straying, is_now)) {
            Some((found, Some(straying), is_now)) => {
                let note = if is_now { "" } else { " …" };
                let off = format!(
                    "{:.2} px mean, {:.1} px largest{note}",
                    straying.mean_px, straying.largest_px
                );
                (
                    format!("{:.2} % of its pixels{note}", 100.0 * found.misclassified),
                    off,
                )
            }
            _ => ("…".to_owned(), "…".to_owned()),
        };
        row(ui, "Error from here", share);
        row(ui, &format!("Outline off, {side}²"), off);
    }
    let stats = viewer
        .stage
        .as_ref()
        .and_then(crate::stage::Stage::crowd_stats);
    if let Some(stats) = stats.filter(|_| viewer.look.instances > 1) {
        let (drawn, new) = (stats.drawn, stats.interpolated);
        row(ui, "Drawn", format!("{drawn} of {}", viewer.look.instances));
        row(
            ui,
            "New outlines",
            format!("{new} in {} draw calls", stats.draw_calls),
        );
    }
    let (processor, device) = viewer.timing.means();
    let millis = |seconds: Option<f64>| {
        seconds.map_or("not measured".to_owned(), |s| format!("{:.2} ms", 1e3 * s))
    };
    row(ui, "Processor", millis(processor));
    row(ui, "Until drawn", millis(device));
    if let Some(stage) = &viewer.stage {
        row(ui, "Device", stage.gpu.adapter_name());
    }
    let (width, height) = viewer.picture_px;
    row(ui, "Picture", format!("{width} × {height} pixels"));
}

fn kilobytes(bytes: u64) -> String {
    format!("{:.0} KiB", bytes as f64 / 1024.0)
}

impl Look {
    /// Two pictures beside each other, the original on the left where it is there, or one again.
    pub(crate) fn toggle_beside(&mut self, has_model: bool) {
        if let Some(beside) = self.beside.take() {
            self.shown = beside;
        } else {
            self.beside = Some(self.shown);
            self.shown = match self.shown {
                Shown::Original => Shown::Clipped,
                _ if has_model => Shown::Original,
                Shown::Textured => Shown::Clipped,
                _ => Shown::Textured,
            };
        }
    }
}
