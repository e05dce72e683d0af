//! Where one or two pictures are in the window.

use egui::{Rect, vec2};

use crate::look::{Layout, Look};

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

impl Default for Panes {
    /// Before there is a window.
    fn default() -> Self {
        Self {
            rect: Rect::ZERO,
            pictures: [Rect::ZERO; 2],
            seen: [Rect::ZERO; 2],
            origin_px: [0.0; 2],
            size_px: (1, 1),
            split_px: 0.0,
            shift_px: 0.0,
        }
    }
}

impl Panes {
    /// Width over height of a picture.
    pub(crate) fn aspect(&self) -> f64 {
        f64::from(self.size_px.0) / f64::from(self.size_px.1)
    }

    /// In the room that is left, as links say, no picture larger than a device can draw; `None` where there is no room.
    pub(crate) fn of(look: &Look, rect: Rect, per_point: f32, most_px: u32) -> Option<Self> {
        // Whole pixels of the window.
        let edge = |x: f32| (x * per_point).round();
        let origin_px = [edge(rect.min.x), edge(rect.min.y)];
        let pixels = |low: f32, high: f32| ((edge(high) - low).max(0.0) as u32).min(most_px);
        let (width, height) = (
            pixels(origin_px[0], rect.max.x),
            pixels(origin_px[1], rect.max.y),
        );
        let is_beside = look.beside.is_some();
        let is_apart = is_beside && look.layout == Layout::Sides;
        let own_width = if is_apart { width / 2 } else { width };
        if own_width == 0 || height == 0 {
            return None;
        }
        let shift_px = if is_apart { own_width as f32 } else { 0.0 };
        let split_px = match (is_beside, is_apart) {
            (false, _) => 2.0 * width as f32,
            (true, true) => shift_px,
            (true, false) => look.split * width as f32,
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
