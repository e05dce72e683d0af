//! From outlines seen from points of the polytope to the one that a camera sees.

use glam::{DVec2, DVec3};
use silmap_geometry::Camera;

use crate::SilhouetteMap;
use crate::epipolar::{image_from_object, object_from_image};
use crate::interpolation::{Interpolation, Transfer};
use crate::loops::{DeepLoops, FlatLoops, SeenLoops};
use crate::off_polytope::merge::SectorMerge;
use crate::off_polytope::sectors::{PICTURE_PX, facing_center};
use crate::polytope_outline::{OutlineCarrier, PolytopeOutline};
use crate::project::{Projection, project_loops};
use crate::tidy::{CrumbScratch, PieceCounts, is_speck};

/// Joins outlines. Everything is kept between them.
#[derive(Clone, Debug, Default)]
pub(crate) struct OutlineJoin {
    carrier: OutlineCarrier,
    merge: SectorMerge,
    merged: DeepLoops,
    region: SeenLoops,
    crumbs: CrumbScratch,
    seen: SeenLoops,
    simple: FlatLoops,
}

impl OutlineJoin {
    /// Joins what sectors look at, in their order, or carries the one outline that there is.
    pub(crate) fn join<'a>(
        &mut self,
        map: &SilhouetteMap,
        camera: &Camera,
        how: Interpolation,
        mut outlines: impl ExactSizeIterator<Item = &'a PolytopeOutline>,
    ) {
        let count = outlines.len();
        let upright = facing_center(camera, map).filter(|_| count > 1);
        let mut most = PieceCounts::default();
        let mut is_of_parts = false;
        let region = match upright {
            None => match outlines.next() {
                Some(outline) => {
                    most = outline.pieces;
                    is_of_parts = outline.is_of_parts();
                    self.carrier.carry(outline, map, camera, how.transfer)
                }
                None => {
                    self.region.clear();
                    &self.region
                }
            },
            Some(upright) => {
                let middle = DVec2::splat(0.5 * f64::from(PICTURE_PX));
                self.merge.start(middle, count);
                for (k, outline) in outlines.enumerate() {
                    let seen = (self.carrier).carry(outline, map, &upright, Transfer::Depths);
                    self.merge.add(k, seen);
                    most = most.max(outline.pieces);
                    is_of_parts |= outline.is_of_parts();
                }
                self.merge.finish(&mut self.merged);
                let to_camera = Projection {
                    matrix: image_from_object(camera) * object_from_image(&upright),
                    shift: DVec3::ZERO,
                    round: None,
                    keeps_depth: true,
                };
                project_loops(&self.merged, &to_camera, &mut self.region);
                &self.region
            }
        };
        if how.method.is_tidied() {
            (self.crumbs).leave_out_crumbs((region, is_of_parts), most, is_speck, &mut self.seen);
        } else {
            (self.seen).assign(region.iter().filter(|l| !is_speck(l)));
        }
        self.seen.flatten_to(&mut self.simple);
    }

    /// What was joined last: simple loops that do not overlap, in pixels of the camera.
    pub(crate) fn simple_loops(&self) -> &FlatLoops {
        &self.simple
    }

    /// The same with inverse depths.
    pub(crate) fn seen_loops(&self) -> &SeenLoops {
        &self.seen
    }
}
