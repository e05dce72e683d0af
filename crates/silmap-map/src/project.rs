//! From loops with depths to the image of a camera.

use glam::{DMat3, DVec2, DVec3};

use crate::loops::{DeepLoops, FlatLoops};

/// A map from loops with inverse depths to an image: homogeneous image coordinates are `matrix`·(x, y, 1) + inverse depth · `shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    pub matrix: DMat3,
    /// Zero for a map by the plane of some homography.
    pub shift: DVec3,
}

impl Projection {
    /// The same for loops in other coordinates, given the matrix from these.
    pub(crate) fn after(&self, matrix: DMat3) -> Self {
        Self {
            matrix: self.matrix * matrix,
            ..*self
        }
    }
}

/// Projects loops to image coordinates, cutting off what lies behind the camera.
pub(crate) fn project_loops(loops: &DeepLoops, to: &Projection, output: &mut FlatLoops) {
    let project = |p: DVec3| to.matrix * DVec3::new(p.x, p.y, 1.0) + to.shift * p.z;
    output.clear();
    for points in loops.iter() {
        let (least, most) = points
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), p| {
                let z = project(*p).z;
                (low.min(z), high.max(z.abs()))
            });
        let near = NEAR_SHARE * most;
        if least > near {
            for &p in points {
                let q = project(p);
                output.push(DVec2::new(q.x, q.y) / q.z);
            }
            output.close();
            continue;
        }
        let mut previous = project(points[points.len() - 1]);
        for &p in points {
            let q = project(p);
            if (q.z > near) != (previous.z > near) {
                let cut = previous.lerp(q, (near - previous.z) / (q.z - previous.z));
                output.push(DVec2::new(cut.x, cut.y) / near);
            }
            if q.z > near {
                output.push(DVec2::new(q.x, q.y) / q.z);
            }
            previous = q;
        }
        output.close();
    }
}

/// Points nearer to the camera's plane than this share of the loop's farthest are cut off.
const NEAR_SHARE: f64 = 1e-4;
