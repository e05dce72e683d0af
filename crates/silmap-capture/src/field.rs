//! How far outside of the hull a point is, by the votes of all views.
//!
//! A view says that a point is outside when it sees it beside the mask. A point that it does not see, beside its image or behind it,
//! is unknown to it. A point is outside of the hull when more than `outvoted` views say so: the field is the distance that the
//! (outvoted + 1)-th farthest view gives, negative inside. A point that few views see is outside too, as nothing else bounds a hull
//! there.
//!
//! Source: A. Laurentini. The Visual Hull Concept for Silhouette-Based Image Understanding. IEEE PAMI 16(2), 1994.
//! Deviations: some votes may be wrong; what is outside of the images is unknown.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::lens::Lens;
use crate::pinhole::Pinhole;
use crate::signed_distance::SignedDistance;
use crate::view::CaptureView;

/// A camera with distances to its mask's outline.
#[derive(Clone, Debug)]
pub(crate) struct FieldView {
    camera: Pinhole,
    /// The lens through which the mask was taken.
    lens: Option<Lens>,
    /// To the mask's outline, in the photograph.
    distances: Arc<SignedDistance>,
    /// Distances to the border of what its photograph shows, where that is not all of the image.
    known: Option<Arc<SignedDistance>>,
}

/// Interpolated distances are this much steeper than one pixel a pixel, at most: √2, and rounding.
const STEEPEST: f64 = 1.45;

/// And off by this much beside the outline itself, pixels.
const SLACK_PX: f64 = 1.0;

impl FieldView {
    pub(crate) fn new(view: &CaptureView) -> Self {
        Self {
            camera: view.camera,
            lens: view.lens,
            distances: Arc::new(SignedDistance::new(
                view.taken.as_ref().unwrap_or(&view.mask),
            )),
            known: (view.known.as_ref()).map(|known| Arc::new(SignedDistance::new(known))),
        }
    }

    /// The same mask with another camera.
    pub(crate) fn with_camera(&self, camera: Pinhole) -> Self {
        Self {
            camera,
            ..self.clone()
        }
    }

    /// The distance at an image point of the camera, pixels of the photograph; `None` where the lens shows it nowhere.
    fn distance(&self, image: DVec2) -> Option<f64> {
        let Some(lens) = &self.lens else {
            return Some(self.distances.at(image));
        };
        let photo = lens.photo_from_tangent(self.camera.tangent(image));
        photo.map(|photo| self.distances.at(photo))
    }

    /// The distance to the outline's cone, length units about; `None` where the view does not see the point.
    fn value(&self, point: DVec3) -> Option<f64> {
        let (image, depth) = self.camera.project(point)?;
        let is_seen = self.camera.shows(image)
            && (self.known.as_ref()).is_none_or(|known| known.at(image) <= 0.0);
        let distance = self.distance(image).filter(|_| is_seen)?;
        Some(distance * depth / self.camera.pixels_per_tangent())
    }

    /// What the view says about a block, a point being outside where it is farther than `outward` from the cone.
    fn say_about(&self, block: &Block, outward: f64) -> Word {
        let Some((middle, depth)) = self.camera.project(block.middle) else {
            return match self.is_behind(block) {
                true => Word::Unseen,
                false => Word::Undecided,
            };
        };
        let (mut low, mut high) = (middle, middle);
        let mut reach = 0.0_f64;
        for corner in block.corners() {
            let Some((image, _)) = self.camera.project(corner) else {
                return Word::Undecided;
            };
            low = low.min(image);
            high = high.max(image);
            reach = reach.max(image.distance(middle));
        }
        let size = DVec2::new(self.camera.width.into(), self.camera.height.into());
        if high.cmplt(DVec2::ZERO).any() || low.cmpgt(size).any() {
            return Word::Unseen;
        }
        if low.cmplt(DVec2::ZERO).any() || high.cmpgt(size).any() {
            return Word::Undecided;
        }
        let room = STEEPEST * reach + SLACK_PX;
        match self.known.as_ref().map(|known| known.at(middle)) {
            Some(distance) if distance > room => return Word::Unseen,
            Some(distance) if distance > -room => return Word::Undecided,
            _ => {}
        }
        let Some(distance) = self.distance(middle) else {
            return Word::Undecided;
        };
        let room = STEEPEST * reach * self.lens.map_or(1.0, |lens| lens.stretch()) + SLACK_PX;
        // Twice as much as in the middle is more than anywhere in a block that is in front of the camera as a whole.
        let outward_px = 2.0 * outward * self.camera.pixels_per_tangent() / depth;
        if distance > room + outward_px {
            Word::Outside
        } else if distance < -room {
            Word::Inside
        } else {
            Word::Undecided
        }
    }

    fn is_behind(&self, block: &Block) -> bool {
        let mut corners = block.corners().into_iter();
        corners.all(|corner| self.camera.camera_from_object(corner).z <= 0.0)
    }
}

/// What a view says about all points of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Word {
    Outside,
    Inside,
    Unseen,
    Undecided,
}

/// A cube of space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub(crate) middle: DVec3,
    pub(crate) half: f64,
}

impl Block {
    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            self.middle + self.half * DVec3::new(sign(0), sign(1), sign(2))
        })
    }
}

/// What is known about a block: the views that say different things about its points, and what the others say.
#[derive(Clone, Debug)]
pub(crate) struct Votes {
    undecided: Vec<u32>,
    outside: usize,
    seen: usize,
}

/// Where a block lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Outside,
    Inside,
    Mixed,
}

/// The field of some views.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field<'a> {
    pub(crate) views: &'a [&'a FieldView],
    /// So many views may say that a point is outside, and it is inside.
    pub(crate) outvoted: usize,
    /// A point that fewer views see is outside.
    pub(crate) least_seen: usize,
    /// Points this near to a view's cone are inside of it, length units.
    pub(crate) outward: f64,
}

impl Field<'_> {
    /// Nothing is known.
    pub(crate) fn all_undecided(&self) -> Votes {
        Votes {
            undecided: (0..self.views.len() as u32).collect(),
            outside: 0,
            seen: 0,
        }
    }

    /// What is known of a block within one of which `votes` are known.
    pub(crate) fn vote(&self, block: &Block, votes: &Votes) -> (Place, Votes) {
        let mut found = Votes {
            undecided: Vec::with_capacity(votes.undecided.len()),
            ..*votes
        };
        for &view in &votes.undecided {
            match self.views[view as usize].say_about(block, self.outward) {
                Word::Outside => {
                    found.outside += 1;
                    found.seen += 1;
                }
                Word::Inside => found.seen += 1,
                Word::Unseen => {}
                Word::Undecided => found.undecided.push(view),
            }
        }
        let may_be = found.undecided.len();
        let place = if found.outside > self.outvoted || found.seen + may_be < self.least_seen {
            Place::Outside
        } else if found.outside + may_be <= self.outvoted && found.seen >= self.least_seen {
            Place::Inside
        } else {
            Place::Mixed
        };
        (place, found)
    }

    /// The field at a point of a block of which `votes` are known, no farther from zero than `most`.
    pub(crate) fn value(&self, point: DVec3, votes: &Votes, most: f64, room: &mut Vec<f64>) -> f64 {
        room.clear();
        let undecided = votes.undecided.iter();
        room.extend(undecided.filter_map(|&v| self.views[v as usize].value(point)));
        if votes.seen + room.len() < self.least_seen {
            return most;
        }
        // Views that are decided say one thing for the whole block, and are far from changing their mind.
        let Some(left) = self.outvoted.checked_sub(votes.outside) else {
            return most;
        };
        if left >= room.len() {
            return -most;
        }
        let (_, found, _) = room.select_nth_unstable_by(left, |a, b| b.total_cmp(a));
        (*found - self.outward).clamp(-most, most)
    }
}
