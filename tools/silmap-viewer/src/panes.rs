//! Where one or two pictures are in the window.

use egui::{Rect, vec2};

use crate::look::Layout;
use crate::viewer::Viewer;

/// Where one or two pictures are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panes {
    /// All of the room, points.
    pub(crate) rect: Rect,
    /// Where each picture begins, and what is seen of it, points.
    pub(crate) pictures: [Rect; 2],
    pub(crate) seen: [Rect; 2],
    /// Top left of the first, pixels of the window.
    pub(crate) origin_px: [f32; 2],
    /// Each picture's size, pixels.
    pub(crate) size_px: (u32, u32),
    /// The column at which the second one begins, and how far to the right of the first it lies, pixels.
    pub(crate) split_px: f32,
    pub(crate) shift_px: f32,
}

impl Panes {
    /// In the room that is left; `None` where there is none.
    pub(crate) fn of(viewer: &Viewer, rect: Rect, per_point: f32) -> Option<Self> {
        // Whole pixels of the window.
        let edge = |x: f32| (x * per_point).round();
        let origin_px = [edge(rect.min.x), edge(rect.min.y)];
        let limit = viewer
            .stage
            .as_ref()
            .map_or(1, |s| s.gpu.device.limits().max_texture_dimension_2d);
        let pixels = |low: f32, high: f32| ((edge(high) - low).max(0.0) as u32).min(limit);
        let (width, height) = (
            pixels(origin_px[0], rect.max.x),
            pixels(origin_px[1], rect.max.y),
        );
        let is_beside = viewer.look.beside.is_some();
        let is_apart = is_beside && viewer.look.layout == Layout::Sides;
        let own_width = if is_apart { width / 2 } else { width };
        if own_width == 0 || height == 0 {
            return None;
        }
        let shift_px = if is_apart { own_width as f32 } else { 0.0 };
        let split_px = match (is_beside, is_apart) {
            (false, _) => 2.0 * width as f32,
            (true, true) => shift_px,
            (true, false) => viewer.look.split * width as f32,
        };
        let shift = vec2(shift_px / per_point, 0.0);
        let own = vec2(own_width as f32 / per_point, rect.height());
        let left = Rect::from_min_size(rect.min, own);
        let pictures = [left, left.translate(shift)];
        let seen = if is_beside {
            let (first, second) = rect.split_left_right_at_x(rect.left() + split_px / per_point);
            [first, second]
        } else {
            [rect, Rect::NOTHING]
        };
        Some(Self {
            rect,
            pictures,
            seen,
            origin_px,
            size_px: (own_width, height),
            split_px,
            shift_px,
        })
    }
}
