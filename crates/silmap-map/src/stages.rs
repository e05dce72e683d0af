//! Single stages of reading a map, one call each, so that benchmarks can time them apart.
//!
//! Each does what a frame does in that stage, with buffers that stay warm; a frame does it through [`crate::Scratch`].

use crate::epipolar::object_from_image;
use crate::loops::{DeepLoops, FlatLoops};
use crate::pair_cache::{RectifiedPair, Seen, TURN_TANGENT, assign_contours};
use crate::rule::{LinearScratch, Pairing};
use crate::sweep::intersection::IntersectScratch;
use crate::{Method, SilhouetteMap};

/// The buffers of all stages.
#[derive(Clone, Debug, Default)]
pub struct Stages {
    captured: [DeepLoops; 2],
    pair: RectifiedPair,
    linear: LinearScratch,
    edge: DeepLoops,
    intersect: IntersectScratch,
    simple: FlatLoops,
}

impl Stages {
    /// Brings the whole silhouettes of two views into their shared frame, cut into chains and sorted: what is done once for each
    /// polytope edge. Returns whether they can be.
    pub fn prepare_edge(&mut self, map: &SilhouetteMap, views: [u32; 2]) -> bool {
        let sphere = map.bounding_sphere();
        let views = views.map(|v| &map.views[v as usize]);
        for (loops, view) in self.captured.iter_mut().zip(views) {
            assign_contours(loops, view, sphere, 0);
        }
        let [one, two] = [0, 1].map(|k| Seen {
            eye: views[k].camera.eye,
            loops: &self.captured[k],
            object_from_loops: object_from_image(&views[k].camera),
        });
        let frame = self.pair.assign((one, two), sphere.center, TURN_TANGENT);
        frame.is_some()
    }

    /// Interpolates along the edge that was prepared last, `alpha` of the way from its first view; returns how many vertices the
    /// result has.
    pub fn linear_step(&mut self, map: &SilhouetteMap, alpha: f64, method: Method) -> usize {
        let pairing = match method {
            Method::Paper => Pairing::Cliques,
            Method::Hull => Pairing::Within {
                radius: Some(map.radius),
            },
            Method::Tight => Pairing::Tight,
        };
        self.linear
            .interpolate(&mut self.pair, alpha, pairing, &mut self.edge);
        self.edge.iter().map(<[_]>::len).sum()
    }

    /// Intersects the regions of three orders, in pixels; returns how many vertices the result has.
    pub fn intersect(&mut self, regions: [&FlatLoops; 3]) -> usize {
        self.intersect.intersect(regions, &mut self.simple);
        self.simple.iter().map(<[_]>::len).sum()
    }
}
