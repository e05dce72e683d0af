//! The picture: mouse, touch and keys move the camera, two pictures meet at a line that can be dragged, overlays lie on top.

use egui::{
    Align2, Color32, CursorIcon, EventFilter, FontId, Id, Key, Modifiers, PointerButton, Rect,
    Sense, Stroke, Ui, pos2, vec2,
};
use glam::DVec2;
use silmap_geometry::Camera;
use silmap_map::{Interpolation, Method};
use silmap_study::{Background, EdgeParams, FrameParams};
use web_time::Instant;

use crate::crowd::CrowdParams;
use crate::look::{Layout, Named, Shown};
use crate::overlays;
use crate::panes::Panes;
use crate::stage::Picture;
use crate::viewer::Viewer;

/// Behind the model, sRGB.
pub(crate) const BACKGROUND: [u8; 3] = [0xf4, 0xf5, 0xf7];

/// So far from the line it can be taken, points.
const GRIP: f32 = 6.0;

/// Radians, or a factor, for a press of a key.
const KEY_TURN_RAD: f64 = 0.0873;
const KEY_ZOOM: f64 = 1.15;

/// Radians in a second, where it turns by itself.
const TURN_RAD: f64 = 0.6;

/// A turn that is let go slows to a part of e in so many seconds, and ends below so many points in a second.
const SPIN_SECONDS: f32 = 0.4;
const LEAST_SPIN: f32 = 8.0;

/// Draws it into the room that is left.
pub(crate) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let rect = ui.available_rect_before_wrap();
    let per_point = ui.ctx().pixels_per_point();
    let device = viewer.stage.as_ref().map(|stage| &stage.gpu.device);
    let most_px = device.map_or(1, |device| device.limits().max_texture_dimension_2d);
    let Some(panes) = Panes::of(&viewer.look, rect, per_point, most_px) else {
        return;
    };
    viewer.panes = panes;
    let id = Id::unique("picture");
    let response = ui.interact(rect, id, Sense::click_and_drag());
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture of the model"));
    viewer.orbit.upwards = viewer.upwards();
    if viewer.frames_next && !viewer.scene.is_empty() {
        viewer.frames_next = false;
        place_camera(viewer);
    }
    if !viewer.scene.is_empty() {
        let split = split_line(viewer, ui, rect);
        take_pointer(viewer, ui, &response, split);
        take_keys(viewer, ui, id, response.has_focus());
    }
    if response.clicked() || response.drag_started() {
        response.request_focus();
        viewer.hint_is_shown = false;
    }
    turn_on(viewer, ui, &response);
    viewer.orbit.keep_outside(viewer.scene.sphere());
    let camera = viewer.orbit.camera(panes.size_px);
    draw(viewer, ui, &panes, &camera);
    draw_overlays(viewer, ui, &panes, &camera);
    labels(viewer, ui, &panes);
}

/// Turns by itself, or as it was let go.
fn turn_on(viewer: &mut Viewer, ui: &Ui, response: &egui::Response) {
    let seconds = ui.input(|i| i.stable_dt).min(0.1);
    let is_free = !viewer.scene.is_empty() && !response.is_pointer_button_down_on();
    if viewer.is_turning && !viewer.scene.is_empty() {
        viewer.orbit.azimuth_rad += TURN_RAD * f64::from(seconds);
        ui.ctx().request_repaint();
    }
    if !viewer.has_inertia {
        viewer.spin = egui::Vec2::ZERO;
    } else if is_free && viewer.spin != egui::Vec2::ZERO {
        let by = viewer.spin * seconds;
        let height = f64::from(response.rect.height());
        viewer
            .orbit
            .orbit(DVec2::new(by.x.into(), by.y.into()), height);
        viewer.spin *= (-seconds / SPIN_SECONDS).exp();
        if viewer.spin.length() < LEAST_SPIN {
            viewer.spin = egui::Vec2::ZERO;
        }
        ui.ctx().request_repaint();
    }
}

/// Sets the camera once a scene is there: as the link says, or so that all is seen.
fn place_camera(viewer: &mut Viewer) {
    viewer.frame();
    let Some(pose) = viewer.look.pose.take() else {
        return;
    };
    let origin = viewer.scene.origin;
    let target = pose
        .target
        .map_or(viewer.scene.sphere().center, |t| t - origin);
    let fov = pose.fov_y_degrees.map_or_else(
        || {
            // As `silmap render` does without --fov.
            let sphere = viewer.scene.sphere();
            let eye = pose.eye - origin;
            let fit = Camera::fit_sphere(
                eye,
                sphere.center,
                sphere.radius,
                pose.up,
                viewer.panes.size_px,
            );
            fit.map_or(viewer.orbit.fov_y_rad, |camera| camera.fov_y_rad())
        },
        f64::to_radians,
    );
    viewer.orbit = (viewer.orbit).looking(pose.eye - origin, target, pose.up, fov);
}

/// The line between two pictures; whether it is being dragged.
fn split_line(viewer: &mut Viewer, ui: &mut Ui, rect: Rect) -> bool {
    if viewer.look.beside.is_none() || viewer.look.layout == Layout::Sides {
        return false;
    }
    let x = rect.left() + viewer.look.split * rect.width();
    let grip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, rect.y_range());
    let line = ui.interact(grip, Id::unique("split"), Sense::drag());
    line.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Slider, true, "Line between the pictures")
    });
    if line.hovered() || line.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    if line.dragged() {
        let by = line.drag_delta().x / rect.width().max(1.0);
        viewer.look.split = (viewer.look.split + by).clamp(0.02, 0.98);
    }
    if line.has_focus() {
        let filter = EventFilter {
            horizontal_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|m| m.set_focus_lock_filter(line.id, filter));
        let by = ui.input(|i| {
            f32::from(
                i16::from(i.key_pressed(Key::ArrowRight))
                    - i16::from(i.key_pressed(Key::ArrowLeft)),
            )
        });
        viewer.look.split = (viewer.look.split + 0.02 * by).clamp(0.02, 0.98);
    }
    line.dragged()
}

fn take_pointer(viewer: &mut Viewer, ui: &Ui, response: &egui::Response, split_is_dragged: bool) {
    let height = f64::from(response.rect.height());
    let sphere = viewer.scene.sphere();
    let drag = response.drag_delta();
    let drag = DVec2::new(drag.x.into(), drag.y.into());
    let touches = ui.input(|i| i.multi_touch());
    if let Some(touch) = touches.filter(|_| response.contains_pointer() || response.dragged()) {
        viewer.orbit.zoom(f64::from(touch.zoom_delta), sphere);
        viewer.orbit.roll(f64::from(-touch.rotation_delta));
        let by = touch.translation_delta;
        viewer
            .orbit
            .pan(DVec2::new(by.x.into(), by.y.into()), height);
        return;
    }
    if drag != DVec2::ZERO && !split_is_dragged {
        let modifiers = ui.input(|i| i.modifiers);
        let moves = response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
            || modifiers.shift;
        if moves {
            viewer.orbit.pan(drag, height);
        } else if modifiers.command || modifiers.ctrl {
            viewer
                .orbit
                .roll(drag.x * std::f64::consts::PI / f64::from(response.rect.width()).max(1.0));
        } else {
            viewer.orbit.orbit(drag, height);
            let seconds = ui.input(|i| i.stable_dt).max(1e-3);
            viewer.spin = response.drag_delta() / seconds;
        }
    } else if response.is_pointer_button_down_on() {
        // Held still.
        viewer.spin = egui::Vec2::ZERO;
    }
    // On a page the wheel scrolls the page, unless the picture has the keyboard.
    let is_ours = !cfg!(target_arch = "wasm32") || ui.input(|i| i.focused);
    if response.hovered() && is_ours {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = f64::from(pinch) * (f64::from(scroll) / 240.0).exp();
        if factor != 1.0 {
            viewer.orbit.zoom(factor, sphere);
        }
    }
    if response.double_clicked() {
        viewer.frame();
    }
}

fn take_keys(viewer: &mut Viewer, ui: &Ui, id: Id, has_focus: bool) {
    let is_free = ui.memory(|m| m.focused().is_none());
    if !has_focus && !is_free {
        return;
    }
    if has_focus {
        let filter = EventFilter {
            horizontal_arrows: true,
            vertical_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|m| m.set_focus_lock_filter(id, filter));
    }
    let height = f64::from(viewer.panes.size_px.1);
    let presses = |key| {
        ui.input(|i| {
            if i.modifiers.command {
                0
            } else {
                i.num_presses(key)
            }
        }) as f64
    };
    let across = presses(Key::ArrowRight) - presses(Key::ArrowLeft);
    let down = presses(Key::ArrowDown) - presses(Key::ArrowUp);
    let step = DVec2::new(across, down) * KEY_TURN_RAD * height / std::f64::consts::PI;
    if step != DVec2::ZERO {
        if ui.input(|i| i.modifiers.matches_logically(Modifiers::SHIFT)) {
            viewer.orbit.pan(step, height);
        } else {
            viewer.orbit.orbit(step, height);
        }
    }
    let nearer = presses(Key::Plus) + presses(Key::Equals) - presses(Key::Minus);
    if nearer != 0.0 {
        viewer
            .orbit
            .zoom(KEY_ZOOM.powf(nearer), viewer.scene.sphere());
    }
    let roll = presses(Key::Comma) - presses(Key::Period);
    if roll != 0.0 {
        viewer.orbit.roll(roll * KEY_TURN_RAD);
    }
}

/// What a pane shows.
pub(crate) fn picture(
    viewer: &Viewer,
    (shown, method): (Shown, Method),
    camera: &Camera,
) -> Picture {
    let background = Background::Colour(BACKGROUND);
    let mode = shown.mode();
    let is_ready = viewer.stage.as_ref().is_some_and(|s| s.can_relight());
    let can_be_lit = is_ready && viewer.can_relight != Some(false);
    let is_lit = can_be_lit && (mode.shows_hull() || shown == Shown::Original);
    let light = viewer.look.light.filter(|_| is_lit);
    let crowd = viewer.stage.as_ref().and_then(|stage| stage.crowd_method());
    let crowd = crowd.filter(|_| viewer.look.instances > 1 && shown == Shown::Clipped);
    if let Some(method) = crowd {
        return Picture::Crowd(CrowdParams {
            camera: *camera,
            count: viewer.look.instances,
            upwards: viewer.upwards(),
            method,
            paint: viewer.look.paint,
            background,
            light,
        });
    }
    Picture::Single(FrameParams {
        camera: *camera,
        mode,
        method,
        paint: viewer.look.paint,
        antialias: viewer.look.antialias,
        background,
        edges: EdgeParams::default(),
        light,
        shadow: None,
    })
}

fn draw(viewer: &mut Viewer, ui: &Ui, panes: &Panes, camera: &Camera) {
    if viewer.scene.is_empty() {
        return;
    }
    let asked = [Some(viewer.look.shown), viewer.look.beside];
    let pictures: [_; 2] = std::array::from_fn(|pane| {
        let how = (viewer.shown(asked[pane]?), viewer.method_of(pane));
        Some(picture(viewer, how, camera))
    });
    let Some(stage) = &mut viewer.stage else {
        return;
    };
    let mut failure = None;
    for (pane, picture) in pictures.iter().enumerate() {
        let Some(picture) = picture else { continue };
        let since = Instant::now();
        match stage.draw(pane, panes.size_px, picture) {
            Ok(true) if pane == 0 => viewer.timing.submitted(since, &stage.gpu.queue),
            Ok(_) => {}
            Err(error) => failure = Some(error.to_string()),
        }
    }
    let places = (panes.split_px, panes.shift_px);
    if let Some(callback) = stage.callback(panes.origin_px, places) {
        let shape = egui_wgpu::Callback::new_paint_callback(panes.rect, callback);
        ui.painter().add(shape);
    }
    if let Err(error) = stage.check() {
        failure = Some(error.to_string());
    }
    if let Some(text) = failure {
        viewer.say(text, true);
    }
}

fn draw_overlays(viewer: &mut Viewer, ui: &Ui, panes: &Panes, camera: &Camera) {
    let wanted = viewer.look.overlays;
    // What is the same on both sides of the line is drawn once.
    let is_one = panes.shift_px == 0.0 && viewer.method_of(0) == viewer.method_of(1);
    let seen = match is_one {
        true => &[panes.rect][..],
        false => &panes.seen[..],
    };
    for (pane, seen) in seen.iter().enumerate() {
        let painter = ui.painter().with_clip_rect(*seen);
        let view = overlays::View {
            painter: &painter,
            rect: panes.pictures[pane],
            camera,
            px_per_point: ui.ctx().pixels_per_point(),
        };
        #[cfg(not(target_arch = "wasm32"))]
        if wanted.photographs && !viewer.scene.shots.is_empty() {
            let about = (&viewer.scene, &viewer.orbit);
            viewer.photographs.draw(ui.ctx(), &view, about);
        }
        let method = viewer.method_of(pane);
        let (Some(asset), Some(reader)) = (viewer.scene.asset.clone(), &mut viewer.reader) else {
            continue;
        };
        if wanted.polytope {
            view.polytope(&asset);
        }
        if wanted.cameras {
            view.cameras(&asset);
        }
        if wanted.outline || wanted.triangle {
            let how = Interpolation::from(method);
            let outline = silmap_map::outline(&asset.map, camera, how, reader);
            if let Ok(outline) = outline {
                if wanted.triangle {
                    view.triangle(&asset, &outline);
                }
                if wanted.outline {
                    view.outline(&outline);
                }
            }
        }
    }
}

/// What the pictures are, and what to do first.
fn labels(viewer: &Viewer, ui: &Ui, panes: &Panes) {
    let rect = panes.rect;
    if viewer.scene.is_empty() {
        return;
    }
    let painter = ui.painter().with_clip_rect(rect);
    let text = |at, align, text: &str| {
        let font = FontId::proportional(13.0);
        let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::from_gray(40));
        let place = align_place(align, at, galley.size());
        let back = Rect::from_min_size(place, galley.size()).expand2(vec2(4.0, 2.0));
        painter.rect_filled(
            back,
            3.0,
            Color32::from_rgba_unmultiplied(255, 255, 255, 200),
        );
        painter.galley(place, galley, Color32::from_gray(40));
    };
    if let Some(beside) = viewer.look.beside {
        let x = panes.seen[0].right();
        let line = Stroke::new(2.0, Color32::from_gray(90));
        painter.line_segment([pos2(x, rect.top()), pos2(x, rect.bottom())], line);
        if viewer.look.layout == Layout::Split {
            painter.circle(pos2(x, rect.center().y), 7.0, Color32::WHITE, line);
        }
        // Many are all drawn by one method.
        let names_method = viewer.look.beside_method.is_some() && viewer.look.instances == 1;
        let label = |pane: usize, asked| {
            let shown = viewer.shown(asked);
            if names_method && shown.mode().needs_outline() {
                format!("{}, {}", shown.label(), viewer.method_of(pane).name())
            } else {
                shown.label().to_owned()
            }
        };
        text(
            pos2(x - 10.0, rect.top() + 6.0),
            Align2::RIGHT_TOP,
            &label(0, viewer.look.shown),
        );
        text(
            pos2(x + 10.0, rect.top() + 6.0),
            Align2::LEFT_TOP,
            &label(1, beside),
        );
    }
    if viewer.hint_is_shown {
        let hint = if rect.width() < 620.0 {
            "drag: turn, pinch: nearer, H: help"
        } else {
            "drag: turn   right drag: move   wheel: nearer   F: frame   B: two pictures   H: help"
        };
        // At the bottom, but for the three contours that may be there.
        if viewer.look.overlays.triangle {
            let below_labels = rect.top() + 32.0;
            text(
                pos2(rect.center().x, below_labels),
                Align2::CENTER_TOP,
                hint,
            );
        } else {
            let above_rim = rect.bottom() - 8.0;
            text(
                pos2(rect.center().x, above_rim),
                Align2::CENTER_BOTTOM,
                hint,
            );
        }
    }
}

fn align_place(align: Align2, at: egui::Pos2, size: egui::Vec2) -> egui::Pos2 {
    align.anchor_size(at, size).min
}
