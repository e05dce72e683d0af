//! Drawing what a captured camera sees: the plain camera that is drawn through, and how its image becomes the captured one.
//!
//! Most cameras are plain: their principal point and focal lengths are a [`Camera`]'s. A mirrored picture is drawn unmirrored and turned
//! round; one with skew, or one that a lens bends, is drawn without, somewhat larger, and resampled. Both images lie in one plane before
//! the eye: a point of it at (x, y, 1), right, down and forward, is in both.

use glam::{DVec2, DVec3};
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_geometry::{Camera, ColourImage, Loop};
use thiserror::Error;

use crate::border::{box_of_border, farthest};
use crate::lens::Lens;
use crate::pinhole::Pinhole;
use crate::resample::resampled;

/// Skew that moves nothing in the image by more than this is left out, pixels.
const LEAST_SKEW_PX: f64 = 0.01;

/// The image that is drawn may have so many times the sides of the captured one.
const MOST_ROOM: f64 = 4.0;

/// Pixels that are drawn beyond the captured image, for what lies between their centres.
const MARGIN_PX: f64 = 2.0;

/// A straight run of a loop is bent in pieces of this length, and at most so many of them.
const PIECE_PX: f64 = 4.0;
const MOST_PIECES: f64 = 4096.0;

/// Why nothing can be drawn through a captured camera.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DrawingFault {
    /// The plain image around the captured one would be huge.
    #[error("its skew of {skew} pixels makes an image that cannot be drawn")]
    Skew {
        /// Of the camera.
        skew: f64,
    },
    /// A lens without a domain.
    #[error("its lens shows nothing of its image: its distortion folds all of it")]
    Lens,
    /// A picture of another shape than the camera's image.
    #[error(
        "a picture of {width} × {height} pixels has not the shape of its image of {of_width} × {of_height}: one of {} × {} has",
        fitting.0, fitting.1
    )]
    Shape {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
        /// Columns of the camera's image.
        of_width: u32,
        /// Rows of the camera's image.
        of_height: u32,
        /// As many columns, and the rows that go with them.
        fitting: (u32, u32),
    },
}

/// A picture for a captured camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawing {
    /// What is drawn through.
    pub camera: Camera,
    /// The captured camera, in the size of the picture.
    captured: Pinhole,
    /// What bends the picture, and how many pixels of the picture one of the photograph has.
    lens: Option<(Lens, DVec2)>,
    /// Whether both images are the same.
    is_plain: bool,
}

impl Drawing {
    /// The picture of the captured size.
    ///
    /// # Errors
    /// When the camera has a skew beyond all measure.
    pub fn new(captured: &Pinhole) -> Result<Self, DrawingFault> {
        Self::through(captured, None)
    }

    /// The picture of another size and the same shape, to a pixel, bent by a lens where there is one.
    ///
    /// # Errors
    /// When it has another shape; when the camera has a skew beyond all measure, or the lens shows nothing.
    pub fn of_size(
        captured: &Pinhole,
        lens: Option<&Lens>,
        size: (u32, u32),
    ) -> Result<Self, DrawingFault> {
        let (width, height) = size;
        let of = size_of(captured);
        let scale = DVec2::new(width.into(), height.into()) / of;
        let fitting = |side: f64| (side.round() as u32).clamp(1, MAX_SIDE_PX);
        let (rows, columns) = (of.y * scale.x, of.x * scale.y);
        let is_near = |wanted: f64, side: u32| (wanted - f64::from(side)).abs() <= 1.0;
        if !(is_near(rows, height) || is_near(columns, width)) {
            return Err(DrawingFault::Shape {
                width,
                height,
                of_width: captured.width,
                of_height: captured.height,
                fitting: (width, fitting(rows)),
            });
        }
        let scaled = Pinhole {
            focal: captured.focal * scale,
            skew: captured.skew * scale.x,
            principal: captured.principal * scale,
            width,
            height,
            ..*captured
        };
        Self::through(&scaled, lens.map(|lens| (*lens, scale)))
    }

    fn through(captured: &Pinhole, lens: Option<(Lens, DVec2)>) -> Result<Self, DrawingFault> {
        let is_bent = skew_px(captured) > LEAST_SKEW_PX || lens.is_some();
        let is_mirrored = captured.focal.x < 0.0;
        let Pinhole {
            principal,
            width,
            height,
            ..
        } = *captured;
        let (principal, sides) = match (is_bent, is_mirrored) {
            (true, _) => {
                let (low, high) = drawn_box(captured, lens.as_ref())?;
                (
                    principal - low,
                    ((high - low).x as u32, (high - low).y as u32),
                )
            }
            (false, true) => {
                let from_right = f64::from(width) - principal.x;
                (DVec2::new(from_right, principal.y), (width, height))
            }
            (false, false) => (principal, (width, height)),
        };
        Ok(Self {
            camera: plain_camera(captured, principal, sides),
            captured: *captured,
            lens,
            is_plain: !(is_bent || is_mirrored),
        })
    }

    /// The direction (x, y, 1) that is seen at a place of the picture; `None` beyond the lens's domain.
    fn plane_from_image(&self, image: DVec2) -> Option<DVec2> {
        plane_from_image(&self.captured, self.lens.as_ref(), image)
    }

    /// Where a direction (x, y, 1) is seen in the picture; `None` beyond the lens's domain.
    fn image_from_plane(&self, plane: DVec2) -> Option<DVec2> {
        match &self.lens {
            Some((lens, scale)) => Some(lens.photo_from_tangent(plane)? * scale),
            None => Some(self.captured.image(plane)),
        }
    }

    /// Whether a lens bends the picture.
    #[must_use]
    pub fn is_distorted(&self) -> bool {
        self.lens.is_some()
    }

    /// Columns and rows of the picture.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.captured.width, self.captured.height)
    }

    /// Focal lengths, skew and principal point of the picture, pixels.
    #[must_use]
    pub fn intrinsics(&self) -> (DVec2, f64, DVec2) {
        let of = &self.captured;
        (of.focal, of.skew, of.principal)
    }

    /// The same with everything moved.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        Self {
            camera: self.camera.moved(by),
            captured: self.captured.moved(by),
            ..*self
        }
    }

    /// Where a point of the image that is drawn lies in the picture; of one beyond the lens's domain, where the nearest towards the axis
    /// does that is in it.
    #[must_use]
    pub fn image_from_drawn(&self, drawn: DVec2) -> DVec2 {
        if self.is_plain {
            return drawn;
        }
        let plane = (drawn - self.camera.principal_px()) / self.camera.focal_px();
        farthest(|share| self.image_from_plane(plane * share)).unwrap_or(self.captured.principal)
    }

    /// Where a point of the picture lies in the image that is drawn; `None` beyond the lens's domain.
    #[must_use]
    pub fn drawn_from_image(&self, image: DVec2) -> Option<DVec2> {
        if self.is_plain {
            return Some(image);
        }
        let plane = self.plane_from_image(image)?;
        Some(self.camera.principal_px() + plane * self.camera.focal_px())
    }

    /// Loops of the image that is drawn, in the picture: outer ones have positive area there too.
    #[must_use]
    pub fn loops_from_drawn(&self, loops: &[Loop]) -> Vec<Loop> {
        self.moved_loops(loops, |p| Some(self.image_from_drawn(p)))
    }

    /// Loops of the picture, in the image that is drawn. What lies beyond the lens's domain is left out.
    #[must_use]
    pub fn drawn_from_loops(&self, loops: &[Loop]) -> Vec<Loop> {
        self.moved_loops(loops, |p| self.drawn_from_image(p))
    }

    fn moved_loops(&self, loops: &[Loop], place: impl Fn(DVec2) -> Option<DVec2>) -> Vec<Loop> {
        let is_turned = self.captured.focal.x < 0.0;
        let moved = loops.iter().map(|points| {
            let mut moved = Loop::new();
            for (k, &from) in points.iter().enumerate() {
                let to = points[(k + 1) % points.len()];
                // A lens bends straight runs.
                let pieces = match self.lens {
                    Some(_) => (from.distance(to) / PIECE_PX)
                        .ceil()
                        .clamp(1.0, MOST_PIECES),
                    None => 1.0,
                };
                let along = |piece| from.lerp(to, f64::from(piece) / pieces);
                moved.extend((0..pieces as u32).filter_map(|piece| place(along(piece))));
            }
            if is_turned {
                moved.reverse();
            }
            moved
        });
        moved.filter(|points| points.len() > 2).collect()
    }

    /// The picture, of what was drawn: its pixels where both images are the same or mirrored, else between them; `nothing` where the lens
    /// shows nothing that was drawn.
    #[must_use]
    pub fn picture(&self, drawn: ColourImage, nothing: [u8; 4]) -> ColourImage {
        if self.is_plain {
            return drawn;
        }
        let size = DVec2::new(drawn.width.into(), drawn.height.into());
        let is_drawn = |p: &DVec2| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all();
        resampled(&drawn, self.size(), nothing, |centre| {
            self.drawn_from_image(centre).filter(is_drawn)
        })
    }
}

fn plane_from_image(
    captured: &Pinhole,
    lens: Option<&(Lens, DVec2)>,
    image: DVec2,
) -> Option<DVec2> {
    match lens {
        Some((lens, scale)) => lens.tangent_from_photo(image / scale),
        None => Some(captured.tangent(image)),
    }
}

/// The box of whole pixels around a bent picture in one that is not bent, unmirrored, with the same principal point.
fn drawn_box(
    captured: &Pinhole,
    lens: Option<&(Lens, DVec2)>,
) -> Result<(DVec2, DVec2), DrawingFault> {
    let (size, principal) = (size_of(captured), captured.principal);
    let around = box_of_border(size, |place| {
        // Beyond the lens's domain, the farthest place towards the axis that is in it.
        let plane =
            farthest(|share| plane_from_image(captured, lens, principal.lerp(place, share)))?;
        Some(principal + plane * captured.focal.abs())
    });
    let (low, high) = around.ok_or(DrawingFault::Lens)?;
    let (mut low, mut high) = ((low - MARGIN_PX).floor(), (high + MARGIN_PX).ceil());
    let most = (MOST_ROOM * size.max_element()).min(f64::from(MAX_SIDE_PX));
    if lens.is_some() {
        // Far corners of a fisheye lens are given up, and what lies nearest to its axis is kept.
        let middle = principal.clamp(low, high);
        low = low.max((middle - 0.5 * most).ceil());
        high = high.min((middle + 0.5 * most).floor());
    }
    let sides = high - low;
    if !(sides.is_finite() && sides.max_element() <= most && sides.min_element() >= 1.0) {
        let skew = captured.skew;
        return Err(DrawingFault::Skew { skew });
    }
    Ok((low, high))
}

/// By how much skew moves something in the image, at most, pixels.
fn skew_px(camera: &Pinhole) -> f64 {
    let rows = [
        -camera.principal.y,
        f64::from(camera.height) - camera.principal.y,
    ];
    let at = |row: f64| (camera.skew * row / camera.focal.y).abs();
    at(rows[0]).max(at(rows[1]))
}

fn size_of(camera: &Pinhole) -> DVec2 {
    DVec2::new(camera.width.into(), camera.height.into())
}

fn plain_camera(captured: &Pinhole, principal: DVec2, (width_px, height_px): (u32, u32)) -> Camera {
    let size = DVec2::new(width_px.into(), height_px.into());
    let [right, down, forward] = captured.axes;
    let offset = 2.0 * principal / size - 1.0;
    Camera {
        eye: captured.eye,
        right,
        up: -down,
        forward,
        half_tangent: size / (2.0 * captured.focal.abs()),
        center_offset: DVec2::new(offset.x, -offset.y),
        width_px,
        height_px,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lens::{Distortion, Projection};

    fn captured(focal_x: f64, skew: f64) -> Pinhole {
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 0.7);
        Pinhole {
            eye: DVec3::new(1.0, -2.0, 9.0),
            axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|a| turn * a),
            focal: DVec2::new(focal_x, 79.0),
            skew,
            principal: DVec2::new(35.0, 21.0),
            width: 64,
            height: 48,
        }
    }

    proptest! {
        /// A point is drawn where the captured camera sees it, mirrored, skewed, resized or not.
        #[test]
        fn points_are_drawn_where_they_were_seen(
            x in 0.0..64.0_f64, y in 0.0..48.0_f64, mirrored in any::<bool>(), skew in prop_oneof![Just(0.0), -20.0..20.0_f64],
            times in 1_u32..4,
        ) {
            let camera = captured(if mirrored { -80.0 } else { 80.0 }, skew);
            let drawing = Drawing::of_size(&camera, None, (64 * times, 48 * times)).unwrap();
            let at = DVec2::new(x, y);
            let point = camera.eye + 3.0 * camera.direction(at);
            let drawn = drawing.camera.image_from_object(point);
            // Where both images are taken to be the same, they may be so far apart.
            let apart = if drawing.is_plain { LEAST_SKEW_PX } else { 1e-9 } * f64::from(times);
            prop_assert!((drawing.image_from_drawn(drawn) / f64::from(times)).distance(at) <= apart);
            prop_assert!(drawing.drawn_from_image(at * f64::from(times)).unwrap().distance(drawn) <= apart);
            // All of the picture is drawn.
            let size = drawing.camera.size();
            prop_assert!(drawn.cmpge(DVec2::splat(-apart)).all() && drawn.cmple(size + apart).all());
            let frame = [drawing.camera.right, drawing.camera.up, drawing.camera.forward];
            prop_assert!(frame[0].cross(frame[2]).distance(frame[1]) < 1e-12);
        }
    }

    #[test]
    fn a_plain_camera_is_drawn_as_it_is() {
        for skew in [0.0, 1e-4] {
            let drawing = Drawing::new(&captured(80.0, skew)).unwrap();
            assert!(drawing.is_plain);
            assert_eq!(drawing.image_from_drawn(DVec2::ONE), DVec2::ONE);
            assert!(
                drawing
                    .camera
                    .principal_px()
                    .distance(DVec2::new(35.0, 21.0))
                    < 1e-12
            );
            assert!(drawing.camera.focal_px().distance(DVec2::new(80.0, 79.0)) < 1e-12);
        }
        assert!(!Drawing::new(&captured(80.0, 0.1)).unwrap().is_plain);
    }

    #[test]
    fn a_mirrored_picture_has_the_pixels_that_were_drawn() {
        let drawing = Drawing::new(&captured(-80.0, 0.0)).unwrap();
        let drawn = ColourImage {
            width: 64,
            height: 48,
            rgba: (0..64 * 48 * 4)
                .map(|k: u32| if k % 4 == 3 { 255 } else { (k * 7 % 251) as u8 })
                .collect(),
        };
        let picture = drawing.picture(drawn.clone(), [0; 4]);
        for (row, back) in drawn.rgba.chunks(256).zip(picture.rgba.chunks(256)) {
            assert!(row.chunks(4).eq(back.chunks(4).rev()));
        }
        let outer = vec![vec![DVec2::ZERO, DVec2::X, DVec2::ONE]];
        let seen = drawing.loops_from_drawn(&outer);
        let expected = [[63.0, 1.0], [63.0, 0.0], [64.0, 0.0]].map(DVec2::from);
        assert!(
            seen[0]
                .iter()
                .zip(expected)
                .all(|(a, b)| a.distance(b) < 1e-12)
        );
        let back = drawing.drawn_from_loops(&seen);
        let pairs = back.iter().flatten().zip(outer.iter().flatten());
        assert!(pairs.clone().count() == 3 && { pairs }.all(|(a, b)| a.distance(*b) < 1e-12));
    }

    /// A ramp along the columns is drawn without skew, and is slanted in the picture.
    #[test]
    fn a_skewed_picture_is_resampled() {
        let camera = captured(80.0, 12.0);
        let drawing = Drawing::new(&camera).unwrap();
        let (width, height) = (drawing.camera.width_px, drawing.camera.height_px);
        let drawn = ColourImage {
            width,
            height,
            rgba: (0..height)
                .flat_map(|_| (0..width).flat_map(|x| [x as u8, 40, 0, 255]))
                .collect(),
        };
        let picture = drawing.picture(drawn, [0; 4]);
        let red = |x: u32, y: u32| f64::from(picture.rgba[4 * (y * 64 + x) as usize]);
        let slant = red(30, 10) - red(30, 40);
        assert!((slant - 30.0 * 12.0 / 79.0).abs() <= 1.0, "{slant}");
        assert_eq!(picture.rgba[1], 40);
    }

    /// A point is drawn where the photograph shows it, and what lies beyond the lens is left empty.
    #[test]
    fn a_lens_bends_the_picture() {
        let camera = captured(80.0, 0.0);
        let of = |projection, k1| {
            let distortion = Distortion {
                projection,
                numerator: [k1, 0.0, 0.0, 0.0],
                ..Distortion::default()
            };
            Lens::new(distortion, (camera.focal, 0.0, camera.principal), (64, 48)).unwrap()
        };
        for lens in [
            of(Projection::Perspective, -0.2),
            of(Projection::Perspective, 0.15),
            of(Projection::Equidistant, 0.0),
        ] {
            let drawing = Drawing::of_size(&camera, Some(&lens), (128, 96)).unwrap();
            for at in [[3.0, 2.0], [35.0, 21.0], [60.0, 44.0]].map(DVec2::from) {
                let tangent = lens.tangent_from_photo(at).unwrap();
                let point = camera.eye + 2.0 * camera.direction(camera.image(tangent));
                let drawn = drawing.camera.image_from_object(point);
                assert!(drawing.image_from_drawn(drawn).distance(2.0 * at) < 1e-6);
                assert!(drawing.drawn_from_image(2.0 * at).unwrap().distance(drawn) < 1e-6);
            }
            let white = ColourImage {
                width: drawing.camera.width_px,
                height: drawing.camera.height_px,
                rgba: vec![255; 4 * (drawing.camera.width_px * drawing.camera.height_px) as usize],
            };
            let picture = drawing.picture(white, [0; 4]);
            assert!(picture.rgba.iter().all(|&v| v == 255), "all of it is drawn");
            let corner = DVec2::new(2.0, 90.0);
            let line = vec![vec![
                corner,
                DVec2::new(120.0, 90.0),
                DVec2::new(120.0, 92.0),
            ]];
            let bent = drawing.drawn_from_loops(&line);
            assert!(bent[0].len() > 30);
            let back = drawing.loops_from_drawn(&bent);
            assert!(back[0].iter().any(|p| p.distance(corner) < 1e-6));
        }
        // Of a part of a larger picture, far from its axis, all is drawn too.
        let aside = Pinhole {
            principal: DVec2::new(-150.3, 21.7),
            focal: DVec2::splat(300.0),
            ..camera
        };
        let fisheye = of(Projection::Equidistant, 0.0).distortion;
        let bent = Lens::new(fisheye, (aside.focal, 0.0, aside.principal), (64, 48)).unwrap();
        let drawing = Drawing::of_size(&aside, Some(&bent), (64, 48)).unwrap();
        let size = drawing.camera.size();
        for corner in [[0.0, 0.0], [64.0, 0.0], [64.0, 48.0], [0.0, 48.0]].map(DVec2::from) {
            let place = drawing.drawn_from_image(corner).unwrap();
            assert!(place.cmpge(DVec2::ZERO).all() && place.cmple(size).all());
        }
        // A lens that folds before the corners shows nothing there.
        let lens = of(Projection::Perspective, -3.0);
        let drawing = Drawing::of_size(&camera, Some(&lens), (64, 48)).unwrap();
        assert_eq!(drawing.drawn_from_image(DVec2::ZERO), None);
        assert!(drawing.image_from_drawn(DVec2::splat(-1e3)).is_finite());
        let white = ColourImage {
            width: drawing.camera.width_px,
            height: drawing.camera.height_px,
            rgba: vec![255; 4 * (drawing.camera.width_px * drawing.camera.height_px) as usize],
        };
        let picture = drawing.picture(white, [9, 9, 9, 9]);
        assert_eq!(
            (picture.rgba[0], picture.rgba[4 * (21 * 64 + 35)]),
            (9, 255)
        );
    }

    #[test]
    fn other_shapes_and_wild_skews_are_refused() {
        let camera = captured(80.0, 0.0);
        for size in [(32, 24), (33, 25), (32, 25), (640, 480), (1, 1), (640, 481)] {
            assert!(Drawing::of_size(&camera, None, size).is_ok(), "{size:?}");
        }
        let message = Drawing::of_size(&camera, None, (640, 640))
            .unwrap_err()
            .to_string();
        assert_eq!(
            message,
            "a picture of 640 × 640 pixels has not the shape of its image of 64 × 48: one of 640 × 480 has"
        );
        let wild = Drawing::new(&captured(80.0, 1e7)).unwrap_err().to_string();
        assert!(wild.starts_with("its skew of 10000000 pixels"), "{wild}");
    }
}
