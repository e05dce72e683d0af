//! Refining a pose: the camera from which a model's outline fits an outline in an image.
//!
//! Where the rim of a solid is seen, a small motion of the solid moves the outline by the motion of the touching points along the
//! outline's normal; that the touching points change does not matter to first order. So each round projects the exact outline,
//! pairs its points with the nearest ones of the given outline, and solves for the motion that brings them together along
//! the normals.
//!
//! Source: Pop, Duncan, Barequet, Goodrich, Huang, Kumar. Efficient Perspective-Accurate Silhouette Computation and
//! Applications. SoCG 2001, section 4.3, measures a pose by the distance of silhouette points to the nearest edge of an X-ray
//! image. Deviations: only the outer outline is compared; distances count along normals, in both directions, and far ones
//! count less (Tukey's weights), so that a step is a least-squares problem in six unknowns.

use glam::{DMat3, DVec2, DVec3};
use silmap_geometry::polygon::Loop;
use silmap_geometry::{Camera, ClosedMesh, Interrupted, Watch};
use thiserror::Error;

use crate::watch::{Counter, FIT};
use crate::{EdgeMesh, ExtractionMethod, Extractor, OutlineError, Outliner, Viewpoint};

mod rim;
mod solve;

use rim::{ImageOutline, RimPoint, rim_points};
use solve::NormalEquations;

/// How a pose is refined.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignParams {
    /// Most rounds from one start.
    pub rounds: u32,
    /// A round that moves the model by less than this, radians and radii, is the last.
    pub least_step: f64,
    /// Outlines farther apart than this on average, pixels, are tried again from poses turned a little.
    pub good_distance_px: f64,
    /// How far these are turned, radians.
    pub turn_rad: f64,
    /// Outlines farther apart than this on average, pixels, do not fit: the pose is no result. None for
    /// [`FITS_WITHIN_REL`] of the outline's size, and at least [`FITS_WITHIN_PX`].
    pub fits_within_px: Option<f64>,
}

/// Share of the diagonal of an outline's bounding box that a model's outline may be away from it on average: several times what is left
/// on photographs whose model is right.
pub const FITS_WITHIN_REL: f64 = 0.01;

/// Masks are no better than that, pixels.
pub const FITS_WITHIN_PX: f64 = 1.0;

impl Default for AlignParams {
    fn default() -> Self {
        Self {
            rounds: 60,
            least_step: 1e-6,
            good_distance_px: 0.5,
            turn_rad: 4.0_f64.to_radians(),
            fits_within_px: None,
        }
    }
}

/// A refined pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The camera, with the image and the field of view that it started with.
    pub camera: Camera,
    /// Mean distance between the two outlines, pixels, both ways.
    pub distance_px: f64,
    /// Rounds made, from all starts.
    pub rounds: u32,
    /// The largest distance that counts as a fit, pixels.
    pub fits_within_px: f64,
}

impl Pose {
    /// Whether the outlines came close enough to each other for the pose to mean something.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.distance_px <= self.fits_within_px
    }
}

/// The largest distance that counts as a fit to this outline, pixels, by default.
fn usual_bound_px(outline: &[Loop]) -> f64 {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) =
        (outline.iter().flatten()).fold(start, |(low, high), &p| (low.min(p), high.max(p)));
    FITS_WITHIN_PX.max(FITS_WITHIN_REL * (high - low).length())
}

/// Why a pose cannot be refined.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AlignError {
    /// There is nothing to fit to.
    #[error("the image shows no outline")]
    NoOutline,
    /// The camera stands in the model, or looks away from it.
    #[error(transparent)]
    Outline(#[from] OutlineError),
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The model's outline is nowhere near.
    #[error("no part of the model's outline lies near the image's: start from a closer pose")]
    NothingNear,
}

/// Refines the pose of `start` until the outline of `mesh` fits `outline`, pixels of its image: outer loops have positive area,
/// holes negative. The stage [`FIT`] counts rounds; most starts need fewer than its estimate.
///
/// # Errors
/// When there is no outline on either side, the two are nowhere near each other, or the caller asks to stop.
pub fn refine_pose(
    mesh: &ClosedMesh,
    outline: &[Loop],
    start: &Camera,
    params: &AlignParams,
    watch: &Watch<'_>,
) -> Result<Pose, AlignError> {
    let target = ImageOutline::new(outline);
    if target.points.is_empty() {
        return Err(AlignError::NoOutline);
    }
    let edge_mesh = EdgeMesh::from(mesh);
    let bounds = mesh.bounds();
    let mut fit = Fit {
        extractor: Extractor::new(&edge_mesh, ExtractionMethod::BruteParallel),
        outliner: Outliner::new(edge_mesh.positions()),
        mesh: &edge_mesh,
        target,
        center: bounds.center,
        radius: bounds.radius,
        rounds: 0,
        counter: Counter::start(watch, FIT, STARTS * u64::from(params.rounds), 1),
    };
    let mut best = fit.descend(start, params)?;
    let axes = [start.right, start.up, start.forward];
    for axis in axes.into_iter().flat_map(|axis| [axis, -axis]) {
        if best.distance_px <= params.good_distance_px {
            break;
        }
        let turn = DMat3::from_axis_angle(axis, params.turn_rad);
        match fit.descend(&moved(start, fit.center, turn, DVec3::ZERO), params) {
            Ok(other) if other.distance_px < best.distance_px => best = other,
            Err(AlignError::Interrupted(stop)) => return Err(stop.into()),
            Ok(_) | Err(_) => {}
        }
    }
    fit.counter.finish();
    Ok(Pose {
        rounds: fit.rounds,
        fits_within_px: (params.fits_within_px).unwrap_or_else(|| usual_bound_px(outline)),
        ..best
    })
}

/// A model and what it is fitted to.
struct Fit<'m> {
    /// Rounds made, from all starts.
    rounds: u32,
    counter: Counter<'m>,
    mesh: &'m EdgeMesh,
    extractor: Extractor<'m>,
    outliner: Outliner<'m>,
    target: ImageOutline,
    center: DVec3,
    radius: f64,
}

/// The pose given, and three turns both ways.
const STARTS: u64 = 7;

/// Points of the two outlines whose normals agree less than this do not belong together.
const LEAST_COSINE: f64 = 0.4;

/// Distances beyond this many times their usual size count for nothing.
const TUKEY_SIZES: f64 = 4.7;

/// The usual size of distances is never taken to be smaller, pixels: outlines of masks are that rough.
const LEAST_SIZE_PX: f64 = 0.3;

/// Points this close, pixels, lie apart by their distance along the normal: more than half the distance between points taken.
const BESIDE_PX: f64 = 3.0;

/// A point of the model's rim, and the point of the other outline that it should be seen at.
struct Match<'a> {
    rim: &'a RimPoint,
    /// Along the rim's normal, pixels.
    distance: f64,
}

impl Fit<'_> {
    /// Goes from `start` to where the outlines fit best.
    fn descend(&mut self, start: &Camera, params: &AlignParams) -> Result<Pose, AlignError> {
        let mut camera = *start;
        let mut best: Option<Pose> = None;
        for _ in 0..params.rounds {
            self.counter.tell_done(u64::from(self.rounds))?;
            self.rounds += 1;
            let rim = self.rim(&camera)?;
            let (distance_px, step) = self.step(&rim, &camera)?;
            if best.is_none_or(|b| distance_px < b.distance_px) {
                best = Some(Pose {
                    camera,
                    distance_px,
                    rounds: self.rounds,
                    // Known when all starts are through.
                    fits_within_px: f64::INFINITY,
                });
            }
            let (turn, shift) = step;
            let angle = turn.length();
            if angle.max(shift.length()) < params.least_step {
                break;
            }
            let rotation = turn
                .try_normalize()
                .map_or(DMat3::IDENTITY, |axis| DMat3::from_axis_angle(axis, angle));
            camera = moved(&camera, self.center, rotation, shift * self.radius);
        }
        best.ok_or(AlignError::NothingNear)
    }

    fn rim(&mut self, camera: &Camera) -> Result<Vec<RimPoint>, AlignError> {
        let mut edges = Vec::new();
        self.extractor
            .extract(&Viewpoint::Eye(camera.eye), &mut edges);
        // The order of edges depends on no thread, but the points' must not depend on the method either.
        edges.sort_unstable();
        let loops = self.outliner.outline(&edges, camera)?;
        Ok(rim_points(self.mesh.positions(), &edges, &loops, camera))
    }

    /// The mean distance between the outlines, and the motion of the model that would bring them together: a rotation vector about
    /// the center, and a shift in radii.
    fn step(&self, rim: &[RimPoint], camera: &Camera) -> Result<(f64, (DVec3, DVec3)), AlignError> {
        let from_target = self.target.points.iter().filter_map(|p| {
            let near = |q: &&RimPoint| q.normal.dot(p.normal) > LEAST_COSINE;
            let rim = nearest(rim.iter().filter(near), |q| q.at.distance_squared(p.at))?;
            Some((rim, p.at))
        });
        let from_rim = rim.iter().filter_map(|q| {
            let near = |p: &&rim::ImagePoint| q.normal.dot(p.normal) > LEAST_COSINE;
            let found = nearest(self.target.points.iter().filter(near), |p| {
                q.at.distance_squared(p.at)
            })?;
            Some((q, found.at))
        });
        let (mut sum, mut matches) = (0.0, Vec::new());
        for (rim, at) in from_target.chain(from_rim) {
            let (distance, whole) = (rim.normal.dot(at - rim.at), rim.at.distance(at));
            // Beside each other along the outline points lie as it happens.
            sum += if whole <= BESIDE_PX {
                distance.abs()
            } else {
                whole
            };
            matches.push(Match { rim, distance });
        }
        if matches.is_empty() {
            return Err(AlignError::NothingNear);
        }
        let mut sizes: Vec<f64> = matches.iter().map(|m| m.distance.abs()).collect();
        let middle = sizes.len() / 2;
        sizes.select_nth_unstable_by(middle, f64::total_cmp);
        // Of a normal distribution the median is 0.6745 of the deviation.
        let reach = TUKEY_SIZES * (sizes[middle] / 0.6745).max(LEAST_SIZE_PX);
        let mut equations = NormalEquations::default();
        for Match { rim, distance } in &matches {
            let rest = 1.0 - (distance / reach).powi(2);
            if rest > 0.0 {
                let pull = rim.pull(camera);
                let lever = (rim.position - self.center).cross(pull);
                equations.add(lever, pull * self.radius, *distance, rest * rest);
            }
        }
        Ok((sum / matches.len() as f64, equations.solve()))
    }
}

fn nearest<T>(items: impl Iterator<Item = T>, key: impl Fn(&T) -> f64) -> Option<T> {
    items
        .map(|item| (key(&item), item))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, item)| item)
}

/// The camera that sees the model as `camera` would, were it turned about `center` and then shifted.
fn moved(camera: &Camera, center: DVec3, turn: DMat3, shift: DVec3) -> Camera {
    let back = turn.transpose();
    let axis = |v: DVec3| (back * v).normalize_or_zero();
    let forward = axis(camera.forward);
    // Kept at right angles, however many times it is moved.
    let right = forward.cross(axis(camera.up)).normalize_or_zero();
    Camera {
        eye: back * (camera.eye - center - shift) + center,
        right,
        up: right.cross(forward),
        forward,
        ..*camera
    }
}

/// The angle in radians between the directions of two cameras' frames: how far one must turn to be the other.
#[must_use]
pub fn angle_between(one: &Camera, two: &Camera) -> f64 {
    let trace = one.right.dot(two.right) + one.up.dot(two.up) + one.forward.dot(two.forward);
    (0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests;
