//! What is drawn over the picture: the outline, the polytope of viewpoints, its current triangle with three contours, and cameras.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};
use glam::{DVec2, DVec3};
use silmap_geometry::Camera;
use silmap_map::{Asset, CapturedView, Outline};

const OUTLINE: Color32 = Color32::from_rgb(20, 90, 220);
const POLYTOPE: Color32 = Color32::from_rgb(120, 120, 130);
const CURRENT: Color32 = Color32::from_rgb(230, 90, 20);
const CAMERAS: Color32 = Color32::from_rgb(20, 140, 80);

/// Side of an inset with a contour, points.
const INSET: f32 = 96.0;

/// A picture in the window.
pub(crate) struct View<'a> {
    pub(crate) painter: &'a Painter,
    /// Where the picture is, points.
    pub(crate) rect: Rect,
    /// Its camera.
    pub(crate) camera: &'a Camera,
    /// Pixels of the picture in a point.
    pub(crate) px_per_point: f32,
}

impl View<'_> {
    /// Where a pixel of the picture is in the window.
    fn place(&self, px: DVec2) -> Pos2 {
        let scale = 1.0 / self.px_per_point;
        self.rect.min + vec2(px.x as f32, px.y as f32) * scale
    }

    /// A segment in space, cut off before it reaches the eye.
    fn segment(&self, a: DVec3, b: DVec3, stroke: Stroke) {
        let near = 1e-3 * self.camera.eye.distance(a).max(self.camera.eye.distance(b));
        let (za, zb) = (self.camera.depth(a) - near, self.camera.depth(b) - near);
        if za <= 0.0 && zb <= 0.0 {
            return;
        }
        let cut = || a + (b - a) * (za / (za - zb));
        let (a, b) = (
            if za > 0.0 { a } else { cut() },
            if zb > 0.0 { b } else { cut() },
        );
        let ends = [a, b].map(|p| self.place(self.camera.image_from_object(p)));
        // Far out of the window nothing is seen, and numbers become too large to draw.
        let room = self.rect.expand(4.0 * self.rect.size().max_elem());
        if ends.iter().all(|p| p.is_finite() && room.contains(*p)) {
            self.painter.line_segment(ends, stroke);
        } else if let Some(ends) = clipped(ends, room) {
            self.painter.line_segment(ends, stroke);
        }
    }

    /// The outline as lines.
    pub(crate) fn outline(&self, outline: &Outline) {
        let stroke = Stroke::new(1.5, OUTLINE);
        for points in outline.simple_loops() {
            let points = points.iter().map(|&p| self.place(p)).collect();
            self.painter.add(Shape::closed_line(points, stroke));
        }
    }

    /// The polytope's edges.
    pub(crate) fn polytope(&self, asset: &Asset) {
        let map = &asset.map;
        for [a, b, c] in &map.triangles {
            for (i, j) in [(a, b), (b, c), (c, a)] {
                // Once from each side.
                if i < j {
                    self.segment(map.eye(*i), map.eye(*j), Stroke::new(1.0, POLYTOPE));
                }
            }
        }
    }

    /// The triangle that faces the eye, and the contours of its corners with their weights.
    pub(crate) fn triangle(&self, asset: &Asset, outline: &Outline) {
        let map = &asset.map;
        let Some(&corners) = map.triangles.get(outline.triangle as usize) else {
            return;
        };
        let stroke = Stroke::new(2.0, CURRENT);
        for k in 0..3 {
            self.segment(map.eye(corners[k]), map.eye(corners[(k + 1) % 3]), stroke);
        }
        let side = INSET.min(self.rect.width() / 3.5);
        let bottom = self.rect.left_bottom() + vec2(8.0, -8.0 - side);
        for (k, (&view, &weight)) in corners.iter().zip(&outline.barycentric).enumerate() {
            let corner = bottom + vec2(k as f32 * (side + 6.0), 0.0);
            let inset = Rect::from_min_size(corner, Vec2::splat(side));
            inset_contour(self.painter, inset, &map.views[view as usize]);
            let label = format!("view {view}: {:.0} %", 100.0 * weight);
            let at = inset.left_top() + vec2(3.0, 2.0);
            self.painter.text(
                at,
                Align2::LEFT_TOP,
                label,
                FontId::proportional(10.0),
                CURRENT,
            );
        }
    }

    /// The cameras of the views, as small pyramids.
    pub(crate) fn cameras(&self, asset: &Asset) {
        let map = &asset.map;
        let length = 0.12 * map.radius;
        for view in &map.views {
            let camera = &view.camera;
            let eye = camera.eye;
            let corner = |x: f64, y: f64| {
                eye + (camera.forward
                    + camera.right * (x * camera.half_tangent.x)
                    + camera.up * (y * camera.half_tangent.y))
                    * length
            };
            let frame = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            self.pyramid(eye, frame.map(|(x, y)| corner(x, y)));
        }
    }

    /// A camera: its eye, and where the corners of its picture lie.
    pub(crate) fn pyramid(&self, eye: DVec3, frame: [DVec3; 4]) {
        let stroke = Stroke::new(1.0, CAMERAS);
        for k in 0..4 {
            self.segment(eye, frame[k], stroke);
            self.segment(frame[k], frame[(k + 1) % 4], stroke);
        }
    }

    /// Where a point in space is in the window; `None` of one that is not well in front of the eye, or far out of the window.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn point(&self, point: DVec3) -> Option<Pos2> {
        let near = 1e-3 * self.camera.eye.distance(point);
        let place = (self.camera.depth(point) > near)
            .then(|| self.place(self.camera.image_from_object(point)))?;
        let room = self.rect.expand(4.0 * self.rect.size().max_elem());
        (place.is_finite() && room.contains(place)).then_some(place)
    }
}

/// The contours of a view in a small square.
fn inset_contour(painter: &Painter, inset: Rect, view: &CapturedView) {
    painter.rect_filled(
        inset,
        3.0,
        Color32::from_rgba_unmultiplied(255, 255, 255, 225),
    );
    let scale = inset.width() / view.camera.width_px.max(1) as f32;
    for contour in &view.contours {
        let place = |p: &DVec2| inset.min + vec2(p.x as f32, p.y as f32) * scale;
        let points = contour.points.iter().map(place).collect();
        painter.add(Shape::closed_line(points, Stroke::new(1.0, OUTLINE)));
    }
    painter.rect_stroke(
        inset,
        3.0,
        Stroke::new(1.0, CURRENT),
        egui::StrokeKind::Inside,
    );
}

/// The part of a segment within a rectangle.
fn clipped([a, b]: [Pos2; 2], room: Rect) -> Option<[Pos2; 2]> {
    if !(a.is_finite() && b.is_finite()) {
        return None;
    }
    let (mut from, mut to) = (0.0_f32, 1.0_f32);
    let by = b - a;
    for (start, step, low, high) in [
        (a.x, by.x, room.min.x, room.max.x),
        (a.y, by.y, room.min.y, room.max.y),
    ] {
        if step == 0.0 {
            if start < low || start > high {
                return None;
            }
            continue;
        }
        let (enter, leave) = ((low - start) / step, (high - start) / step);
        from = from.max(enter.min(leave));
        to = to.min(enter.max(leave));
    }
    let at = |t: f32| pos2(a.x + by.x * t, a.y + by.y * t);
    (from < to).then(|| [at(from), at(to)])
}
