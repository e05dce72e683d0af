//! The map reader: the outline of a model for any eye.
//!
//! Source: Silhouette Mapping, section 5: find the triangle that faces the eye, interpolate between its views, map to the eye.
//! Deviation: off the polytope methods `tight` and `hull` do so for each sector of the picture; what comes out is tidied.

use glam::DVec3;
use silmap_geometry::{Camera, CameraError, Loop};

use crate::SilhouetteMap;
use crate::interpolation::{InterpolateError, Interpolation, Transfer};
use crate::locate::Location;
use crate::loops::{FlatLoops, SeenLoops};
use crate::off_polytope::join::OutlineJoin;
use crate::off_polytope::sectors::Sectors;
use crate::polytope::{Polytope, PolytopeError};
use crate::polytope_outline::{CapturedOutlines, PolytopeOutline};
use crate::rule::method::Method;
use crate::tidy::PieceCounts;
use crate::triangle::TriangleInterpolator;

/// The outline of the model from one eye.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The polytope triangle that faces the eye.
    pub triangle: u32,
    /// Weights of its three views.
    pub barycentric: [f64; 3],
    /// The level of detail of the contours it was interpolated from.
    pub level: u8,
    simple: Vec<Loop>,
}

impl Outline {
    /// The outline as simple loops that do not overlap.
    #[must_use]
    pub fn simple_loops(&self) -> &Vec<Loop> {
        &self.simple
    }
}

/// A map prepared for reading, with every buffer that reading needs.
#[derive(Clone, Debug)]
pub struct MapReader {
    polytope: Polytope,
    has_depth: bool,
    last_triangle: u32,
    triangle: TriangleInterpolator,
    /// Of each view.
    pieces: Vec<PieceCounts>,
    sectors: Sectors,
    /// From where the outline is looked at that is asked for, and how it looks from there.
    points: Vec<Location>,
    outlines: Vec<PolytopeOutline>,
    join: OutlineJoin,
}

impl MapReader {
    /// Prepares `map`.
    ///
    /// # Errors
    /// When its triangles are not a star-shaped polytope.
    pub fn new(map: &SilhouetteMap) -> Result<Self, PolytopeError> {
        Ok(Self {
            polytope: Polytope::new(map)?,
            has_depth: map.has_depth(),
            last_triangle: 0,
            triangle: TriangleInterpolator::default(),
            pieces: CapturedOutlines::default().piece_counts(map),
            sectors: Sectors::new(map),
            points: Vec::new(),
            outlines: Vec::new(),
            join: OutlineJoin::default(),
        })
    }

    /// Interpolates the outline and leaves it in [`MapReader::simple_loops`]; says where the eye was located. As [`outline`], but
    /// nothing is copied out.
    ///
    /// # Errors
    /// As [`outline`].
    pub fn interpolate(
        &mut self,
        map: &SilhouetteMap,
        camera: &Camera,
        how: Interpolation,
    ) -> Result<Location, InterpolateError> {
        let location = self.find_points(map, camera, how)?;
        let level = how.detail.level(map, camera);
        let count = self.points.len();
        if self.outlines.len() < count {
            (self.outlines).resize_with(count, PolytopeOutline::default);
        }
        for k in 0..count {
            let mut outline = std::mem::take(&mut self.outlines[k]);
            let at = self.points[k];
            let made = self.make_outline(map, &at, (how.method, level), &mut outline);
            self.outlines[k] = outline;
            made?;
        }
        let outlines = self.outlines[..count].iter();
        self.join.join(map, camera, how, outlines);
        Ok(location)
    }

    /// The directions from the map's center to the points of the polytope from which the outline that `camera` sees is looked at: each
    /// sector of the picture from its own. There is one where the eye is on the polytope or nearly so, or how the outline is carried
    /// to the eye asks for no more.
    ///
    /// # Errors
    /// As [`outline`].
    pub fn directions(
        &mut self,
        map: &SilhouetteMap,
        camera: &Camera,
        how: Interpolation,
    ) -> Result<impl ExactSizeIterator<Item = DVec3> + '_, InterpolateError> {
        self.find_points(map, camera, how)?;
        let center = map.center;
        let direction = move |at: &Location| (at.point - center).normalize_or_zero();
        Ok(self.points.iter().map(direction))
    }

    /// The outline from the point of the polytope in a direction from the map's center, at a level of detail.
    ///
    /// # Errors
    /// As [`outline`].
    pub fn interpolate_at(
        &mut self,
        map: &SilhouetteMap,
        direction: DVec3,
        (method, level): (Method, u8),
        outline: &mut PolytopeOutline,
    ) -> Result<(), InterpolateError> {
        self.check_method(method)?;
        let eye = map.center + direction * map.radius;
        let at = (self.polytope).locate(eye, self.last_triangle);
        let at = at.ok_or(CameraError::NotFinite)?;
        self.last_triangle = at.triangle;
        self.make_outline(map, &at, (method, level), outline)
    }

    /// Joins outlines from points of the polytope, one for each of the directions that [`MapReader::directions`] gave for this camera or
    /// for one nearby, and leaves what `camera` sees in [`MapReader::simple_loops`].
    pub fn join<'a>(
        &mut self,
        map: &SilhouetteMap,
        camera: &Camera,
        how: Interpolation,
        outlines: impl ExactSizeIterator<Item = &'a PolytopeOutline>,
    ) {
        self.join.join(map, camera, how, outlines);
    }

    fn check_method(&self, method: Method) -> Result<(), InterpolateError> {
        if method.needs_depth() && !self.has_depth {
            return Err(InterpolateError::NoDepths { method });
        }
        Ok(())
    }

    /// Finds from where the outline is looked at; returns where the eye faces the polytope.
    fn find_points(
        &mut self,
        map: &SilhouetteMap,
        camera: &Camera,
        how: Interpolation,
    ) -> Result<Location, InterpolateError> {
        self.check_method(how.method)?;
        let distance = camera.eye.distance(map.center);
        let location = self
            .polytope
            .locate(camera.eye, self.last_triangle)
            .filter(|_| distance > map.radius)
            .ok_or(CameraError::EyeInsideBounds {
                distance,
                radius: map.radius,
            })?;
        self.last_triangle = location.triangle;
        self.points.clear();
        if how.transfer == Transfer::Depths {
            let views = (map, &self.polytope);
            (self.sectors).aim(views, camera, &location, how.method, &mut self.points);
        } else {
            self.points.push(location);
        }
        Ok(location)
    }

    fn make_outline(
        &mut self,
        map: &SilhouetteMap,
        at: &Location,
        (method, level): (Method, u8),
        outline: &mut PolytopeOutline,
    ) -> Result<(), InterpolateError> {
        let views = map.triangles[at.triangle as usize];
        let most = |most: PieceCounts, v: u32| most.max(self.pieces[v as usize]);
        outline.pieces = views.into_iter().fold(PieceCounts::default(), most);
        (self.triangle).interpolate(map, at, (method, level), outline)
    }

    /// The outline that was interpolated last: simple loops that do not overlap, in pixels of the camera.
    #[must_use]
    pub fn simple_loops(&self) -> &FlatLoops {
        self.join.simple_loops()
    }

    /// The same outline with the inverse depths, in the camera, of the points that are seen there, zero where these are not known: a
    /// curve in space, that another eye nearby sees where it is.
    #[must_use]
    pub fn seen_loops(&self) -> &SeenLoops {
        self.join.seen_loops()
    }
}

/// The outline of the model that `map` describes, in pixels of `camera`.
///
/// `reader` was made from the same map; it keeps the last triangle, so that a moving eye is located by walking.
///
/// # Errors
/// When the eye lies in the model's bounding sphere, the method needs depths that the map has not, or the map is broken.
pub fn outline(
    map: &SilhouetteMap,
    camera: &Camera,
    how: impl Into<Interpolation>,
    reader: &mut MapReader,
) -> Result<Outline, InterpolateError> {
    let how = how.into();
    let location = reader.interpolate(map, camera, how)?;
    Ok(Outline {
        triangle: location.triangle,
        barycentric: location.barycentric,
        level: how.detail.level(map, camera),
        simple: reader.simple_loops().to_loops(),
    })
}
