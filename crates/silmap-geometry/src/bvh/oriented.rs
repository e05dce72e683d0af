//! Oriented bounds for long thin faces that are not aligned with the axes.
//!
//! The faces around a vertex of high valence are needles. Boxes along the axes around needles across them nearly all overlap,
//! and a query would meet a share of all faces. Where a box is mostly empty, a second one, turned into the faces' own
//! directions, bounds them too; faces around one vertex are also bounded by a cone from there, because for a point beyond that
//! vertex all of them are equally far away.
//!
//! Source for the turned boxes: S. Gottschalk, M. C. Lin, D. Manocha. OBBTree. SIGGRAPH 1996.
//! Deviation: directions are those of the longest edge and of the mean normal, not of a covariance.

use glam::DVec3;

use super::{Bvh, NOT_ORIENTED, Node};

/// A box holds little when its faces' areas come to less than this share of half its surface: then a turned one is tried.
const SPARSE: f64 = 0.125;
/// A turned box is of use when its surface is below this share of the other's.
const WORTHWHILE: f64 = 0.5;
/// Faces around one vertex that are worth a cone.
const FAN_FACES: u32 = 32;
/// Cosine of the widest half angle of a cone that is of use.
const WIDEST_COSINE: f64 = 0.7;
/// Bound on what rounding does to sums of three products, relative to their size, with some to spare.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Of two faces around one vertex that are equally far away but for this share, either will do.
const EQUALLY_FAR_REL: f64 = 1e-12;

/// What bounds the faces of a node beside its box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oriented {
    turned: Option<Turned>,
    cone: Option<Cone>,
}

/// A box along axes of its own.
#[derive(Clone, Copy, Debug)]
struct Turned {
    center: DVec3,
    axes: [DVec3; 3],
    half: DVec3,
}

/// All points in directions near `axis` from `apex`.
#[derive(Clone, Copy, Debug)]
struct Cone {
    apex: DVec3,
    axis: DVec3,
    cosine: f64,
    sine: f64,
}

/// What nodes hold, for the choice of their bounds.
#[derive(Clone, Copy)]
struct Contents {
    /// Faces, and twice their areas.
    count: u32,
    double_area: f64,
    /// Sum of the faces' normals times twice their areas.
    normal: DVec3,
    /// The longest edge.
    longest: DVec3,
    /// Places that all faces have a corner at, as far as they are a number.
    common: [DVec3; 3],
}

impl Bvh {
    /// Finds further bounds for the nodes that need them.
    pub(super) fn orient(&mut self) {
        let contents = self.contents();
        // The ranges of faces below nodes: children lie behind their parents.
        let mut ranges = vec![(0, 0); self.nodes.len()];
        let mut apexes: Vec<Option<DVec3>> = vec![None; self.nodes.len()];
        for id in (0..self.nodes.len()).rev() {
            let node = &self.nodes[id];
            ranges[id] = match node.count {
                0 => (
                    ranges[node.first as usize].0,
                    ranges[node.first as usize + 1].1,
                ),
                count => (node.first as usize, (node.first + count) as usize),
            };
        }
        for id in 0..self.nodes.len() {
            if contents[id].count >= FAN_FACES && apexes[id].is_none() {
                apexes[id] = contents[id].common.into_iter().find(|p| !p.is_nan());
            }
            let node = self.nodes[id];
            if node.count == 0 {
                for child in [node.first, node.first + 1] {
                    apexes[child as usize] = apexes[id];
                }
            }
            let faces = &self.triangles[ranges[id].0..ranges[id].1];
            let (d, held) = (node.max - node.min, contents[id].double_area * 0.5);
            let surface = d.x * d.y + d.y * d.z + d.z * d.x;
            let turned = (held < SPARSE * surface)
                .then(|| Turned::around(faces, &contents[id]))
                .flatten()
                .filter(|t| t.surface() < WORTHWHILE * surface);
            let cone = apexes[id].and_then(|apex| Cone::around(faces, apex));
            if turned.is_some() || cone.is_some() {
                self.nodes[id].oriented = self.oriented.len() as u32;
                self.oriented.push(Oriented { turned, cone });
            }
        }
    }

    fn contents(&self) -> Vec<Contents> {
        let nothing = Contents {
            count: 0,
            double_area: 0.0,
            normal: DVec3::ZERO,
            longest: DVec3::ZERO,
            common: [DVec3::NAN; 3],
        };
        let mut contents = vec![nothing; self.nodes.len()];
        for id in (0..self.nodes.len()).rev() {
            let node = &self.nodes[id];
            contents[id] = if node.count == 0 {
                let first = node.first as usize;
                contents[first].joined(&contents[first + 1])
            } else {
                let faces = node.leaf().map(|i| Contents::of_face(&self.triangles[i]));
                faces.reduce(|a, b| a.joined(&b)).unwrap_or(nothing)
            };
        }
        contents
    }

    /// As near as the faces of a node can be to a point, squared and scaled; `near` is what the node's box says. Infinity where
    /// nothing nearer than the squared distance `limit` of a face that was found is to be had.
    pub(super) fn refine_distance(
        &self,
        node: &Node,
        p: DVec3,
        near: f64,
        limit: Option<f64>,
    ) -> f64 {
        if node.oriented == NOT_ORIENTED {
            return near;
        }
        let Oriented { turned, cone } = &self.oriented[node.oriented as usize];
        let mut near = near;
        if let Some(turned) = turned {
            near = near.max((turned.distance(p) * self.scale).powi(2));
        }
        if let Some(cone) = cone {
            near = near.max((cone.distance(p) * self.scale).powi(2));
            if limit.is_some_and(|limit| near >= limit * (1.0 - EQUALLY_FAR_REL)) {
                return f64::INFINITY;
            }
        }
        near
    }

    /// Whether a ray may meet the faces of a node between `near` and `far`, where it meets the node's box.
    pub(super) fn may_meet(
        &self,
        node: &Node,
        (origin, direction): (DVec3, DVec3),
        (near, far): (f64, f64),
    ) -> bool {
        if node.oriented == NOT_ORIENTED {
            return true;
        }
        let turned = &self.oriented[node.oriented as usize].turned;
        turned
            .as_ref()
            .is_none_or(|turned| turned.may_meet(origin, direction, (near, far)))
    }
}

impl Bvh {
    /// Whether faces of a node may meet the convex hull of some points.
    pub(super) fn may_hold(&self, node: &Node, points: &[DVec3]) -> bool {
        node.oriented == NOT_ORIENTED
            || (self.oriented[node.oriented as usize].turned.as_ref())
                .is_none_or(|turned| turned.may_hold(points))
    }
}

impl Contents {
    fn of_face(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        let normal = (b - a).cross(c - a);
        let edges = [b - a, c - b, a - c];
        Self {
            count: 1,
            double_area: normal.length(),
            normal,
            longest: edges.into_iter().fold(DVec3::ZERO, longer),
            common: *corners,
        }
    }

    fn joined(&self, other: &Self) -> Self {
        let is_common = |p: &DVec3| other.common.contains(p);
        Self {
            count: self.count + other.count,
            double_area: self.double_area + other.double_area,
            normal: self.normal + other.normal,
            longest: longer(self.longest, other.longest),
            common: self
                .common
                .map(|p| if is_common(&p) { p } else { DVec3::NAN }),
        }
    }
}

fn longer(a: DVec3, b: DVec3) -> DVec3 {
    if b.length_squared() > a.length_squared() {
        b
    } else {
        a
    }
}

/// A bound on what rounding does to a product of a unit vector with `v`.
fn rounding(v: DVec3) -> f64 {
    ROUNDING * v.abs().element_sum()
}

impl Turned {
    fn around(faces: &[[DVec3; 3]], contents: &Contents) -> Option<Self> {
        let along = contents.longest.try_normalize()?;
        let up = contents.normal - along * contents.normal.dot(along);
        let up = up.try_normalize().unwrap_or(along.any_orthonormal_vector());
        let axes = [along, up.cross(along).try_normalize()?, up];
        let base = faces.first()?[0];
        let in_axes = |p: DVec3| DVec3::from(axes.map(|axis| axis.dot(p - base)));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut slack = 0.0_f64;
        for &p in faces.as_flattened() {
            let place = in_axes(p);
            (low, high) = (low.min(place), high.max(place));
            slack = slack.max(rounding(p - base));
        }
        let middle = (low + high) * 0.5;
        let center = base + axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        // The center is rounded as well, in coordinates that may be large.
        slack += rounding(center) + rounding(base);
        let half = (high - low) * 0.5 + slack;
        half.is_finite().then_some(Self { center, axes, half })
    }

    /// Whether no side of the box parts it from the convex hull of some points.
    fn may_hold(&self, points: &[DVec3]) -> bool {
        self.axes
            .iter()
            .zip(self.half.to_array())
            .all(|(axis, half)| {
                let beyond = |p: &DVec3| {
                    let offset = *p - self.center;
                    (axis.dot(offset), half + rounding(offset))
                };
                let is_above = |p| {
                    let (at, half) = beyond(p);
                    at > half
                };
                let is_below = |p| {
                    let (at, half) = beyond(p);
                    at < -half
                };
                !points.iter().all(is_above) && !points.iter().all(is_below)
            })
    }

    /// Half the surface.
    fn surface(&self) -> f64 {
        let h = self.half;
        4.0 * (h.x * h.y + h.y * h.z + h.z * h.x)
    }

    /// A bound below the distance from a point.
    fn distance(&self, p: DVec3) -> f64 {
        let offset = p - self.center;
        let slack = rounding(offset);
        let beyond = DVec3::from(self.axes.map(|axis| axis.dot(offset))).abs() - self.half - slack;
        beyond.max(DVec3::ZERO).length() * (1.0 - ROUNDING)
    }

    fn may_meet(&self, origin: DVec3, direction: DVec3, (near, far): (f64, f64)) -> bool {
        let offset = origin - self.center;
        // Places along the ray are no better known than this, as far as they are in the node's box.
        let slack = rounding(offset) + rounding(direction) * near.abs().max(far.abs());
        let (mut near, mut far) = (near, far);
        for (axis, half) in self.axes.iter().zip(self.half.to_array()) {
            let (at, step) = (axis.dot(offset), axis.dot(direction));
            let half = half + slack;
            if step == 0.0 {
                if at.abs() > half {
                    return false;
                }
                continue;
            }
            let (a, b) = ((-half - at) / step, (half - at) / step);
            let (enter, leave) = (a.min(b), a.max(b));
            near = near.max(enter - enter.abs() * ROUNDING);
            far = far.min(leave + leave.abs() * ROUNDING);
        }
        near <= far
    }
}

impl Cone {
    fn around(faces: &[[DVec3; 3]], apex: DVec3) -> Option<Self> {
        let directions = || {
            let others = faces.as_flattened().iter().filter(move |&&p| p != apex);
            others.map(move |&p| (p - apex).normalize_or_zero())
        };
        let axis = directions().sum::<DVec3>().try_normalize()?;
        let cosine = directions()
            .map(|d| d.dot(axis))
            .fold(f64::INFINITY, f64::min)
            - ROUNDING;
        (WIDEST_COSINE..=1.0).contains(&cosine).then(|| Self {
            apex,
            axis,
            cosine,
            sine: (1.0 - cosine * cosine).max(0.0).sqrt(),
        })
    }

    /// A bound below the distance from a point.
    fn distance(&self, p: DVec3) -> f64 {
        let offset = p - self.apex;
        let along = offset.dot(self.axis);
        let aside = (offset - self.axis * along).length();
        let distance = if along * self.cosine + aside * self.sine <= 0.0 {
            offset.length() * (1.0 - ROUNDING)
        } else {
            aside * self.cosine - along * self.sine - rounding(offset)
        };
        distance.max(0.0)
    }
}

#[cfg(test)]
#[path = "oriented_tests.rs"]
mod tests;
