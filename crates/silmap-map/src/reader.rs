//! The map reader: the outline of a model for any eye.
//!
//! Source: Silhouette Mapping, section 5: find the triangle that faces the eye, interpolate between its views, map to the eye.
//! Deviation: off the polytope methods `tight` and `hull` do so for each sector of the picture; what comes out is tidied.

use silmap_geometry::{Camera, CameraError, Loop};

use crate::SilhouetteMap;
use crate::interpolation::{InterpolateError, Interpolation, Transfer};
use crate::locate::Location;
use crate::loops::{FlatLoops, SeenLoops};
use crate::off_polytope::sectors::{SectorRequest, Sectors, Views};
use crate::polytope::{Polytope, PolytopeError};
use crate::tidy::{CrumbScratch, PieceCounts, is_speck};
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
    crumbs: CrumbScratch,
    sectors: Sectors,
    seen: SeenLoops,
    simple: FlatLoops,
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
            pieces: map.views.iter().map(PieceCounts::of_view).collect(),
            crumbs: CrumbScratch::default(),
            sectors: Sectors::new(map),
            seen: SeenLoops::default(),
            simple: FlatLoops::default(),
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
        if how.method.needs_depth() && !self.has_depth {
            return Err(InterpolateError::NoDepths { method: how.method });
        }
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
        let views = Views {
            map,
            polytope: &self.polytope,
            pieces: &self.pieces,
        };
        let off_polytope = match how.transfer {
            Transfer::Depths => self.sectors.interpolate(
                &views,
                &mut self.triangle,
                &SectorRequest {
                    location: &location,
                    camera,
                    how,
                },
            )?,
            Transfer::FacingPoint | Transfer::Homography => None,
        };
        let (region, most) = match off_polytope {
            Some(seen) => seen,
            None => {
                let ids = map.triangles[location.triangle as usize];
                let pieces = ids.map(|v| self.pieces[v as usize]);
                let most = pieces.into_iter().fold(pieces[0], PieceCounts::max);
                let region = self.triangle.interpolate(map, &location, camera, how)?;
                (region, most)
            }
        };
        if how.method.is_tidied() {
            (self.crumbs).leave_out_crumbs(region, most, is_speck, &mut self.seen);
        } else {
            (self.seen).assign(region.iter().filter(|l| !is_speck(l)));
        }
        self.seen.flatten_to(&mut self.simple);
        Ok(location)
    }

    /// The outline that was interpolated last: simple loops that do not overlap, in pixels of the camera.
    #[must_use]
    pub fn simple_loops(&self) -> &FlatLoops {
        &self.simple
    }

    /// The same outline with the inverse depths, in the camera, of the points that are seen there, zero where these are not known: a
    /// curve in space, that another eye nearby sees where it is.
    #[must_use]
    pub fn seen_loops(&self) -> &SeenLoops {
        &self.seen
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
        simple: reader.simple.to_loops(),
    })
}
