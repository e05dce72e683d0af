//! A pair of silhouettes in the frame that they share.
//!
//! Source: Silhouette Mapping, section 5.2, "Epipolar decomposition".

use glam::{DMat3, DVec3};

use crate::epipolar::{EpipolarFrame, MIN_FORWARD_COSINE, object_from_image, project};
use crate::loops::DeepLoops;
use crate::rule::prepared_pair::PreparedPair;
use crate::rule::span_pairs::Room;
use crate::rule::visual_hull::SphereParallax;
use crate::sweep::monotone_chain::MonotoneChains;
use crate::tidy::double_area;
use crate::{BoundingSphere, CapturedView, SilhouetteMap};

/// Turns of a contour by less height than this are levelled: a third of a pixel of a 512² capture, less than contours are
/// simplified. It keeps stretches along the scanlines from falling apart into chains.
pub(crate) const TURN_TANGENT: f64 = 5e-4;

/// A silhouette seen from somewhere, with the map from its coordinates to rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewedSilhouette<'a> {
    /// Viewpoint, object space.
    pub eye: DVec3,
    /// The silhouette's loops, even-odd in each part, with inverse depths: those of points at (ray / inverse depth) from the eye.
    pub loops: &'a DeepLoops,
    /// From coordinates of the loops (with a 1 appended) to rays from `eye`.
    pub object_from_loops: DMat3,
}

/// How a pair of silhouettes is rectified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RectifyParams {
    /// The point that the frame looks at, object space.
    pub center: DVec3,
    /// Radius of the sphere about the center that holds the model; without one nothing is known.
    pub radius: Option<f64>,
    /// Turns of a contour by less height than this, in tangents, are levelled.
    pub turn_tangent: f64,
}

/// A pair of silhouettes in a shared frame.
#[derive(Clone, Debug, Default)]
pub struct RectifiedPair {
    /// The silhouettes of each part in that frame.
    parts: Vec<PreparedPair>,
    /// How many parts there are.
    part_count: usize,
    frame: Option<EpipolarFrame>,
}

impl RectifiedPair {
    /// Rectifies two silhouettes; returns `None` when they cannot be: viewpoints and center in line.
    pub(crate) fn assign(
        &mut self,
        views: [ViewedSilhouette<'_>; 2],
        params: &RectifyParams,
    ) -> Option<EpipolarFrame> {
        self.frame = None;
        let center = params.center;
        let [one, two] = views.map(|view| view.eye);
        let frame = EpipolarFrame::new(one, two, center)?;
        let baseline = one.distance(two);
        let parallax = SphereParallax {
            baseline,
            center_depth: (center - (one + two) * 0.5).dot(frame.f),
            radius: params.radius,
        };
        self.part_count = 0;
        for (k, view) in views.iter().enumerate() {
            let matrix = frame.epipolar_from_object() * view.object_from_loops;
            for (part, points) in view.loops.of_parts() {
                let pair = self.part(part.into(), parallax);
                if double_area(points) > 0.0 {
                    pair.count_piece(k);
                }
                let chains = &mut pair.chains_mut()[k];
                for &p in points {
                    let ray = matrix * DVec3::new(p.x, p.y, 1.0);
                    let q = project(in_front(ray))?;
                    chains.push(DVec3::new(q.x, q.y, baseline * p.z / ray.z));
                }
                chains.close(params.turn_tangent);
            }
        }
        for part in &mut self.parts[..self.part_count] {
            part.chains_mut().iter_mut().for_each(MonotoneChains::seal);
        }
        self.frame = Some(frame);
        self.frame
    }

    /// A part to write to; those up to it that are new are empty.
    fn part(&mut self, part: usize, parallax: SphereParallax) -> &mut PreparedPair {
        if self.parts.len() <= part {
            self.parts.resize_with(part + 1, PreparedPair::default);
        }
        while self.part_count <= part {
            let fresh = &mut self.parts[self.part_count];
            fresh.restart(parallax);
            self.part_count += 1;
        }
        &mut self.parts[part]
    }

    /// The silhouettes of every part, by its number.
    pub fn parts_mut(&mut self) -> &mut [PreparedPair] {
        &mut self.parts[..self.part_count]
    }

    /// The largest capacity of a part without another allocation.
    pub(crate) fn room(&self) -> Room {
        (self.parts.iter().map(PreparedPair::room)).fold(Room::default(), Room::max)
    }

    /// Clears everything, and reserves capacity for contours of so many vertices in each part, and for their pairs.
    pub(crate) fn make_room(&mut self, n_vertices: &[usize], room: Room) {
        self.part_count = 0;
        if self.parts.len() < n_vertices.len() {
            (self.parts).resize_with(n_vertices.len(), PreparedPair::default);
        }
        for (part, &n) in self.parts.iter_mut().zip(n_vertices) {
            part.make_room(n, room);
        }
    }

    /// Rectifies the silhouettes of two views of a map at a level of detail; returns `None` when they cannot be.
    ///
    /// `captured` is a buffer.
    pub fn assign_views(
        &mut self,
        map: &SilhouetteMap,
        views: [u32; 2],
        level: u8,
        captured: &mut [DeepLoops; 2],
    ) -> Option<EpipolarFrame> {
        let sphere = map.bounding_sphere();
        let views = views.map(|v| &map.views[v as usize]);
        for (loops, view) in captured.iter_mut().zip(views) {
            assign_contours(loops, view, sphere, level);
        }
        let seen = [0, 1].map(|k| ViewedSilhouette {
            eye: views[k].camera.eye,
            loops: &captured[k],
            object_from_loops: object_from_image(&views[k].camera),
        });
        let params = RectifyParams {
            center: sphere.center,
            radius: Some(sphere.radius),
            turn_tangent: TURN_TANGENT,
        };
        self.assign(seen, &params)
    }

    /// The shared frame, where the pair could be rectified.
    pub(crate) fn frame(&self) -> Option<&EpipolarFrame> {
        self.frame.as_ref()
    }
}

/// A ray of the frame, turned in front of it where it lies beside it: what an interpolated silhouette has there is not of the model,
/// and the rest of the outline need not be lost with it.
fn in_front(ray: DVec3) -> DVec3 {
    let least = 1.01 * MIN_FORWARD_COSINE * ray.x.hypot(ray.y);
    ray.with_z(ray.z.max(least))
}

/// The matrix from rectified coordinates of `frame` (with a 1 appended) to rays.
#[must_use]
pub(crate) fn object_from_epipolar(frame: &EpipolarFrame) -> DMat3 {
    DMat3::from_cols(frame.b, frame.u, frame.f)
}

/// Copies a view's contours at a level of detail with inverse depths, zero where it has none.
///
/// Every point of the model lies in its bounding sphere: a depth outside, as a file may hold, is the nearest in it.
pub(crate) fn assign_contours(
    loops: &mut DeepLoops,
    view: &CapturedView,
    sphere: BoundingSphere,
    level: u8,
) {
    let distance = view.camera.eye.distance(sphere.center);
    let (nearest, farthest) = (distance - sphere.radius, distance + sphere.radius);
    loops.clear();
    for contour in &view.contours {
        let has_depth = contour.depths.len() == contour.points.len();
        for k in contour.vertices_at(level) {
            let inverse = if has_depth {
                1.0 / contour.depths[k].max(nearest).min(farthest)
            } else {
                0.0
            };
            loops.push(contour.points[k].extend(inverse).extend(0.0));
        }
        loops.set_part(contour.part);
        loops.close();
    }
}
