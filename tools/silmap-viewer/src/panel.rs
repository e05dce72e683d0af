//! The controls beside the picture.

use egui::{ComboBox, RichText, Slider, SliderClamping, Ui};
use glam::{DQuat, DVec3};

use crate::look::{FACES, Layout, Look, MethodChoice, Named, Shown, Upwards};
use crate::orbit::StandardView;
use crate::viewer::Viewer;
use silmap_study::{Antialias, Paint};

/// A list to choose from.
fn choice<T: Named>(ui: &mut Ui, label: &str, value: &mut T, can: impl Fn(T) -> bool) {
    let shown = *value;
    choice_of(ui, label, (value, shown), can);
}

/// A list to choose from, where something else may be shown than what is asked for.
fn choice_of<T: Named>(
    ui: &mut Ui,
    label: &str,
    (value, shown): (&mut T, T),
    can: impl Fn(T) -> bool,
) {
    let list = ComboBox::from_label(label)
        .selected_text(shown.label())
        .width(150.0)
        .show_ui(ui, |ui| {
            for &(one, _, name) in T::ALL {
                ui.add_enabled_ui(can(one), |ui| {
                    ui.selectable_value(value, one, name);
                });
            }
        });
    if cfg!(target_arch = "wasm32") {
        // A page has words alone to say it by: of the list itself they are its value without its name.
        let now = format!("{label}: {}", shown.label());
        list.response
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, now.as_str()));
    }
}

/// All of them.
pub(crate) fn controls(viewer: &mut Viewer, ui: &mut Ui) {
    let has_asset = viewer.scene.asset.is_some();
    let has_model = viewer.scene.model.is_some();
    let can_show = move |shown: Shown| {
        (!shown.needs_asset() || has_asset) && (!shown.needs_model() || has_model)
    };
    ui.heading("Picture");
    let shown = viewer.shown(viewer.look.shown);
    choice_of(ui, "Show", (&mut viewer.look.shown, shown), can_show);
    let mut is_beside = viewer.look.beside.is_some();
    if ui.checkbox(&mut is_beside, "Beside another").changed() {
        viewer.look.toggle_beside(has_model);
    }
    let right = viewer.look.beside.map(|beside| viewer.shown(beside));
    if let (Some(beside), Some(right)) = (&mut viewer.look.beside, right) {
        choice_of(ui, "Show, right", (beside, right), can_show);
        choice(ui, "Layout", &mut viewer.look.layout, |_: Layout| true);
        let split = Slider::new(&mut viewer.look.split, 0.02..=0.98);
        let is_split = viewer.look.layout == Layout::Split;
        ui.add_enabled(is_split, split.text("Line").show_value(false));
    }
    ui.add_enabled_ui(has_asset, |ui| asset_controls(viewer, ui));
    light_controls(viewer, ui);
    ui.separator();
    ui.heading("Overlays");
    ui.add_enabled_ui(has_asset, |ui| {
        for (_, label, is_on) in &mut viewer.look.overlays.flags()[..4] {
            ui.checkbox(is_on, *label);
        }
    });
    #[cfg(not(target_arch = "wasm32"))]
    if !viewer.scene.shots.is_empty() {
        photograph_controls(viewer, ui);
    }
    ui.separator();
    ui.heading("View");
    ui.horizontal_wrapped(|ui| {
        for view in StandardView::ALL {
            if ui.small_button(view.name()).clicked() {
                viewer.orbit.look_from(view);
            }
        }
    });
    choice(ui, "Upwards", &mut viewer.look.upwards, |_: Upwards| true);
    ui.checkbox(&mut viewer.is_turning, "Turn by itself");
    ui.checkbox(&mut viewer.has_inertia, "Inertia")
        .on_hover_text("what is let go while it turns goes on turning for a moment");
    if ui.button("Copy a link to this view").clicked() {
        ui.ctx().copy_text(viewer.link());
    }
    let can_save = viewer.loading.is_none() && !viewer.scene.is_empty();
    #[cfg(target_arch = "wasm32")]
    if (ui.add_enabled(can_save, egui::Button::new("Save picture"))).clicked() {
        crate::download::save_picture(viewer, ui.ctx());
    }
    #[cfg(not(target_arch = "wasm32"))]
    ui.horizontal(|ui| {
        if (ui.add_enabled(can_save, egui::Button::new("Save picture"))).clicked() {
            crate::export::save_picture(viewer, ui.ctx());
        }
        let name = egui::TextEdit::singleline(&mut viewer.export.name).desired_width(130.0);
        let name = ui.add(name);
        name.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::TextInput, true, "File of the picture")
        });
    });
    #[cfg(not(target_arch = "wasm32"))]
    ui.add_enabled_ui(can_save, |ui| {
        let turn = ui.button("Save a turn");
        if turn
            .on_hover_text("an animated WebP, under the same name")
            .clicked()
        {
            crate::export::save_turn(viewer, ui.ctx());
        }
        let has_asset = viewer.scene.asset.is_some();
        let asset = ui.add_enabled(has_asset, egui::Button::new("Save asset"));
        if asset
            .on_hover_text("the asset as it is shown, under the same name with .glb")
            .clicked()
        {
            crate::export::save_asset(viewer, ui.ctx());
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
    if viewer.look.beside.is_some() {
        let mut method = viewer.look.beside_method.unwrap_or(viewer.look.method);
        // Many are all drawn alike.
        ui.add_enabled_ui(viewer.look.instances == 1, |ui| {
            choice(ui, "Method, right", &mut method, can_use);
        });
        viewer.look.beside_method = Some(method).filter(|&m| m != viewer.look.method);
    }
    choice(ui, "Paint", &mut viewer.look.paint, |_: Paint| true);
    let mut is_many = viewer.look.instances > 1;
    // Many are always drawn by samples.
    ui.add_enabled_ui(!is_many, |ui| {
        choice(ui, "Edges", &mut viewer.look.antialias, |_: Antialias| true);
    });
    if ui.checkbox(&mut is_many, "A thousand instances").changed() {
        viewer.set_instances(if is_many { 1000 } else { 1 });
    }
    views_control(viewer, ui);
    faces_control(viewer, ui);
}

/// The number of views that the map keeps.
fn views_control(viewer: &mut Viewer, ui: &mut Ui) {
    let loaded = viewer.scene.loaded();
    let loaded = loaded.filter(|asset| asset.record.order.is_some());
    let Some(all) = loaded.map(|asset| asset.map.views.len() as u32) else {
        return;
    };
    let shown = viewer.dragged.views.or(viewer.look.keep).unwrap_or(all);
    let (dragged, rests) = at_rest(ui, "Views", shown.min(all), 8.min(all)..=all);
    viewer.dragged.views = dragged;
    if let Some(keep) = rests {
        viewer.look.keep = (keep < all).then_some(keep);
    }
}

/// The level of the progressive hull, by its number of faces.
fn faces_control(viewer: &mut Viewer, ui: &mut Ui) {
    if !viewer.scene.can_have_other_hull() {
        return;
    }
    let Some(own) = (viewer.scene.loaded()).map(|asset| asset.hull.faces.len() as u32) else {
        return;
    };
    let most = (viewer.scene.model.as_ref()).map_or(own, |model| model.mesh().faces.len() as u32);
    let most = most.min(4000).max(own);
    let shown = viewer.dragged.faces.or(viewer.look.faces).unwrap_or(own);
    let range = (*FACES.start()).min(own)..=most;
    let (dragged, rests) = at_rest(ui, "Hull faces", shown, range);
    viewer.dragged.faces = dragged;
    if let Some(faces) = rests {
        viewer.look.faces = (faces != own).then_some(faces);
    }
}

/// A slider for what takes long to make: where it is dragged to, and, once it rests, where.
fn at_rest(
    ui: &mut Ui,
    text: &str,
    mut value: u32,
    range: std::ops::RangeInclusive<u32>,
) -> (Option<u32>, Option<u32>) {
    // As fine for few as for many.
    let is_wide = *range.end() > 50 * *range.start();
    let slider = Slider::new(&mut value, range).logarithmic(is_wide);
    // What a link asks for may be more or less.
    let slider = slider.clamping(SliderClamping::Edits);
    let response = ui.add(slider.text(text));
    if response.dragged() {
        (Some(value), None)
    } else if response.drag_stopped() || response.changed() {
        (None, Some(value))
    } else {
        (None, None)
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn photograph_controls(viewer: &mut Viewer, ui: &mut Ui) {
    ui.checkbox(&mut viewer.look.overlays.photographs, "Photographs");
    let opacity = Slider::new(&mut viewer.photographs.opacity, 0.0..=1.0).text("Opacity");
    ui.add(opacity);
    let shots = std::sync::Arc::clone(&viewer.scene.shots);
    let at_eye = (viewer.photographs).at_eye(&viewer.scene, &viewer.orbit);
    let mut chosen = None;
    ComboBox::from_label("Look from")
        .selected_text(at_eye.map_or("–", |k| shots[k].name()))
        .width(150.0)
        .show_ui(ui, |ui| {
            for (k, shot) in shots.iter().enumerate() {
                if ui
                    .selectable_label(at_eye == Some(k), shot.name())
                    .clicked()
                {
                    chosen = Some(k);
                }
            }
        });
    ui.horizontal(|ui| {
        if ui.button("Previous").on_hover_text("[").clicked() {
            viewer.step_shots(false);
        }
        if ui.button("Next").on_hover_text("]").clicked() {
            viewer.step_shots(true);
        }
    });
    if let Some(k) = chosen {
        viewer.look_from_shot(k);
    }
}

fn light_controls(viewer: &mut Viewer, ui: &mut Ui) {
    let mut is_moved = viewer.look.light.is_some();
    let can_move = viewer.can_relight != Some(false);
    let is_moving = egui::Checkbox::new(&mut is_moved, "Move the light");
    if ui.add_enabled(can_move, is_moving).changed() {
        viewer.look.light = is_moved.then_some(DVec3::new(0.5, 0.8, 0.6));
    }
    let basis = DQuat::from_rotation_arc(DVec3::Y, viewer.upwards());
    if let Some(light) = &mut viewer.look.light {
        let own = basis.inverse() * *light;
        let mut azimuth = own.x.atan2(own.z).to_degrees();
        let mut elevation = (own.y / own.length()).clamp(-1.0, 1.0).asin().to_degrees();
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
            *light = basis * DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
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
        row(ui, "File", kilobytes(viewer.scene.bytes));
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
        row(ui, "Mesh", format!("{} faces", model.mesh().faces.len()));
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
    let (width, height) = viewer.panes.size_px;
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
