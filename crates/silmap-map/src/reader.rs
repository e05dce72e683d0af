//! The outline for any eye: a map made ready for reading, and reading it.
//!
//! Source: Silhouette Mapping, section 5: find the triangle that faces the eye, interpolate between its views, map to the eye.
//! Deviation: off the polytope [`Method::Tight`] and [`Method::Hull`] do so for each sector of the picture; what comes out is tidied.

use silmap_geometry::camera::in_short;
use silmap_geometry::{Camera, Loop};
use thiserror::Error;

use crate::SilhouetteMap;
use crate::interpolation::{Interpolation, Method, Transfer};
use crate::loops::FlatLoops;
use crate::off_polytope::sectors::{Sectors, Views};
use crate::polytope::{Location, Polytope, PolytopeError};
use crate::sweep::intersection::{IntersectScratch, is_speck};
use crate::tidy::{CrumbScratch, PieceCounts};
use crate::triangle::TriangleInterpolator;

/// Why there is no outline.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InterpolateError {
    /// The eye lies in the model's bounding sphere.
    #[error(
        "the eye is {} from the center, inside the bounding sphere of radius {}: move it farther out",
        in_short(*.distance),
        in_short(*.radius)
    )]
    EyeInsideBounds {
        /// Distance from the eye to the center, model units.
        distance: f64,
        /// Radius of the bounding sphere, model units.
        radius: f64,
    },
    /// The map's triangles are not a star-shaped polytope.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// The method needs depths, and the map has none.
    #[error("the silhouettes have no depths, which method {} needs: use hull or paper", .method.name())]
    NoDepths {
        /// The method asked for.
        method: Method,
    },
    /// Two views are too far apart to be rectified.
    #[error("views {one} and {two} of the silhouette map are too far apart to interpolate between")]
    ViewsTooFarApart {
        /// One view.
        one: u32,
        /// The other.
        two: u32,
    },
}

/// The outline of the model from one eye.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The polytope triangle that faces the eye.
    pub triangle: u32,
    /// Weights of its three views.
    pub barycentric: [f64; 3],
    /// The level of detail of the contours it was interpolated from.
    pub level: u8,
    /// Regions in pixels of the camera, all of which cover what is inside: three for [`Method::Hull`] on the polytope, else one. The loops of a region are simple, do not overlap, and have positive area outside and negative area for holes.
    pub layers: Vec<Vec<Loop>>,
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
pub struct Scratch {
    polytope: Polytope,
    has_depth: bool,
    last_triangle: u32,
    triangle: TriangleInterpolator,
    intersect: IntersectScratch,
    /// Of each view.
    pieces: Vec<PieceCounts>,
    crumbs: CrumbScratch,
    sectors: Sectors,
    /// What all sectors outline, before it is tidied.
    region: FlatLoops,
    is_by_sectors: bool,
    simple: FlatLoops,
}

impl Scratch {
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
            intersect: IntersectScratch::default(),
            pieces: map.views.iter().map(PieceCounts::of_view).collect(),
            crumbs: CrumbScratch::default(),
            sectors: Sectors::new(map),
            region: FlatLoops::default(),
            is_by_sectors: false,
            simple: FlatLoops::default(),
        })
    }

    /// Interpolates the outline and leaves it in [`Scratch::simple_loops`]; says where the eye was located. As [`outline`], but
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
            .ok_or(InterpolateError::EyeInsideBounds {
                distance,
                radius: map.radius,
            })?;
        self.last_triangle = location.triangle;
        self.is_by_sectors = false;
        if how.method != Method::Paper && how.transfer == Transfer::Depths {
            let views = Views {
                map,
                polytope: &self.polytope,
                pieces: &self.pieces,
            };
            let seen = (&location, camera);
            let most = (self.sectors).interpolate(
                &views,
                &mut self.triangle,
                seen,
                how,
                &mut self.region,
            )?;
            if let Some(most) = most {
                self.is_by_sectors = true;
                let crumbs = (how.method == Method::Tight).then_some((&mut self.crumbs, most));
                tidy(&self.region, crumbs, &mut self.simple);
                return Ok(location);
            }
        }
        let ids = map.triangles[location.triangle as usize];
        let layers = self
            .triangle
            .interpolate(map, ids, &location, camera, how)
            .map_err(|(i, j)| InterpolateError::ViewsTooFarApart {
                one: ids[i],
                two: ids[j],
            })?;
        match layers {
            [a, b, c] => self.intersect.intersect([a, b, c], &mut self.simple),
            [] => self.simple.clear(),
            [region, ..] => {
                let views = ids.map(|v| self.pieces[v as usize]);
                let most = views.into_iter().fold(views[0], PieceCounts::max);
                let crumbs = (how.method == Method::Tight).then_some((&mut self.crumbs, most));
                tidy(region, crumbs, &mut self.simple);
            }
        }
        Ok(location)
    }

    /// The outline that was interpolated last: simple loops that do not overlap, in pixels of the camera.
    #[must_use]
    pub fn simple_loops(&self) -> &FlatLoops {
        &self.simple
    }
}

/// The outline of the model that `map` describes, in pixels of `camera`.
///
/// `scratch` was made from the same map; it remembers the last triangle, so that a moving eye is located by walking.
///
/// # Errors
/// When the eye lies in the model's bounding sphere, the method needs depths that the map has not, or the map is broken.
pub fn outline(
    map: &SilhouetteMap,
    camera: &Camera,
    how: impl Into<Interpolation>,
    scratch: &mut Scratch,
) -> Result<Outline, InterpolateError> {
    let how = how.into();
    let location = scratch.interpolate(map, camera, how)?;
    let layers = if scratch.is_by_sectors {
        std::slice::from_ref(&scratch.region)
    } else {
        scratch.triangle.layers(how.method)
    };
    Ok(Outline {
        triangle: location.triangle,
        barycentric: location.barycentric,
        level: how.detail.level(map, camera),
        layers: layers.iter().map(FlatLoops::to_loops).collect(),
        simple: scratch.simple.to_loops(),
    })
}

/// Copies what is something of a region to `simple`; with `crumbs` without those either that no view shows, each having at most so
/// many pieces.
fn tidy(
    region: &FlatLoops,
    crumbs: Option<(&mut CrumbScratch, PieceCounts)>,
    simple: &mut FlatLoops,
) {
    match crumbs {
        Some((scratch, most)) => scratch.leave_out_crumbs(region, most, is_speck, simple),
        None => simple.assign(region.iter().filter(|l| !is_speck(l))),
    }
}
