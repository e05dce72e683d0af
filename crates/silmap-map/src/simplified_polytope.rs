//! The polytope under half-edge collapses, and the triangle that holds each removed view.

use glam::DVec3;

use crate::epipolar::{EpipolarFrame, MIN_FORWARD_COSINE};
use crate::polytope::Polytope;
use crate::silhouette_map::SilhouetteMap;

/// Removing one view by collapsing an edge onto its other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Collapse {
    /// The view that goes.
    pub removed: u32,
    /// The neighbour that its triangles are pulled to.
    pub onto: u32,
}

impl Collapse {
    /// Along an edge, both ways.
    #[must_use]
    pub fn along([a, b]: [u32; 2]) -> [Self; 2] {
        [(a, b), (b, a)].map(|(removed, onto)| Self { removed, onto })
    }
}

/// Some triangles that others take the place of, with the same border.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Numbers of the triangles that go.
    old: Vec<u32>,
    /// The triangles that come, as many.
    pub new: Vec<[u32; 3]>,
    /// The removed views whose prediction changes.
    pub views: Vec<u32>,
    /// The removed view that is kept from now on.
    pub kept: Option<u32>,
}

/// A triangle's volume with the center must stay above this share of the product of its arms: below, a ray from the
/// center meets it at a grazing angle and rounding decides.
const MIN_VOLUME_SHARE: f64 = 1e-6;

/// How far beyond the bounding sphere's picture a contour may reach, in pixels, before it is simplified: the pixel at its rim.
const RIM_PX: f64 = 1.5;

/// The radius about the center that all contours of a map stay in: that of the model, and what pixels and simplification add.
#[must_use]
pub fn contour_radius(map: &SilhouetteMap) -> f64 {
    let pixel = 2.0 * map.radius / f64::from(map.resolution_px.max(1));
    map.radius + (RIM_PX + map.tolerance_px.max(0.0)) * pixel
}

/// Whether all places of a triangle with these corners, relative to the center, can be looked from: the sphere about the center,
/// seen from any of them, lies in front of the frame shared with any other. The frame of two places is nearest to lying beside
/// the sphere where their line passes nearest to it, and no line in the triangle passes nearer than its plane; of places in a
/// plane the farthest see the sphere most from aside.
#[must_use]
pub fn is_readable([a, b, c]: [DVec3; 3], radius: f64) -> bool {
    let across = (b - a).cross(c - a);
    let plane = a.dot(across) / across.length();
    [a, b, c].iter().all(|arm| {
        let distance = arm.length();
        radius < distance && {
            let aside = (plane / distance).clamp(-1.0, 1.0).acos();
            aside + (radius / distance).asin() < MIN_FORWARD_COSINE.acos()
        }
    })
}

/// A removed view, and which of some new triangles it faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// The view.
    pub view: u32,
    /// Index of the triangle.
    pub triangle: usize,
}

/// What triangles must be like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// All their places can be looked from.
    Readable,
    /// Silhouettes at the ends of each side can be interpolated: all that earlier versions asked for, whose orders are carried out.
    Sides,
}

/// The polytope of the views that are left.
#[derive(Clone, Debug)]
pub struct SimplifiedPolytope {
    /// Eyes relative to the center.
    arms: Vec<DVec3>,
    radius: f64,
    contour_radius: f64,
    rule: Rule,
    triangles: Vec<Option<[u32; 3]>>,
    /// Per triangle: removed views whose eyes it faces.
    members: Vec<Vec<u32>>,
    /// Per view: its triangles; empty when the view is gone.
    stars: Vec<Vec<u32>>,
    versions: Vec<u32>,
    view_count: usize,
    /// Per view: whether it was one at the beginning, and so may be one again.
    may_be_kept: Vec<bool>,
}

impl SimplifiedPolytope {
    /// That of a map, with all views that are on it.
    #[must_use]
    pub fn new(map: &SilhouetteMap, rule: Rule) -> Self {
        let mut stars = vec![Vec::new(); map.views.len()];
        for (t, triangle) in (0_u32..).zip(&map.triangles) {
            for &v in triangle {
                stars[v as usize].push(t);
            }
        }
        Self {
            arms: map
                .views
                .iter()
                .map(|v| v.camera.eye - map.center)
                .collect(),
            radius: map.radius,
            contour_radius: contour_radius(map),
            rule,
            triangles: map.triangles.iter().copied().map(Some).collect(),
            members: vec![Vec::new(); map.triangles.len()],
            versions: vec![0; map.views.len()],
            view_count: stars.iter().filter(|star| !star.is_empty()).count(),
            may_be_kept: stars.iter().map(|star| !star.is_empty()).collect(),
            stars,
        }
    }

    /// How many views are left.
    #[must_use]
    pub fn view_count(&self) -> usize {
        self.view_count
    }

    /// The views that are not left, ascending.
    #[must_use]
    pub fn gone(&self) -> Vec<u32> {
        (0..self.stars.len() as u32)
            .filter(|&v| self.stars[v as usize].is_empty())
            .collect()
    }

    /// Says which triangle a view that is not left faces.
    pub fn place(&mut self, view: u32, triangle: u32) {
        self.members[triangle as usize].push(view);
    }

    /// Changes whenever the triangles around a view do.
    #[must_use]
    pub fn version(&self, view: u32) -> u32 {
        self.versions[view as usize]
    }

    fn star(&self, view: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        self.stars[view as usize]
            .iter()
            .filter_map(|&t| Some((t, self.triangles[t as usize]?)))
    }

    /// Views connected to `view`, ascending.
    fn neighbours(&self, view: u32) -> Vec<u32> {
        let mut found: Vec<u32> = self
            .star(view)
            .flat_map(|(_, t)| t)
            .filter(|&v| v != view)
            .collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whether it goes along an edge.
    #[must_use]
    pub fn is_edge(&self, collapse: Collapse) -> bool {
        self.star(collapse.removed)
            .any(|(_, t)| t.contains(&collapse.onto))
    }

    /// All edges, in both directions, in a fixed order.
    pub fn collapses(&self) -> impl Iterator<Item = Collapse> + '_ {
        (0..self.stars.len() as u32).flat_map(|removed| {
            self.neighbours(removed)
                .into_iter()
                .map(move |onto| Collapse { removed, onto })
        })
    }

    /// The triangles that a collapse leaves where the removed view was; `None` when the result would not be a manifold, not
    /// star-shaped, or have an edge too long to rectify or places that cannot be looked from.
    #[must_use]
    pub fn triangles_after(&self, collapse: Collapse) -> Option<Vec<[u32; 3]>> {
        let Collapse { removed, onto } = collapse;
        let (ring, other_ring) = (self.neighbours(removed), self.neighbours(onto));
        let common = ring
            .iter()
            .filter(|v| other_ring.binary_search(v).is_ok())
            .count();
        if common != 2 || self.view_count <= 4 {
            return None;
        }
        let mut triangles = Vec::with_capacity(ring.len());
        for (_, triangle) in self.star(removed).filter(|(_, t)| !t.contains(&onto)) {
            let moved = triangle.map(|v| if v == removed { onto } else { v });
            if !self.is_allowed(moved) {
                return None;
            }
            triangles.push(moved);
        }
        let fits = ring
            .iter()
            .filter(|&&v| v != onto && other_ring.binary_search(&v).is_err())
            .all(|&v| self.is_rectifiable(onto, v));
        fits.then_some(triangles)
    }

    /// Whether the whole bounding sphere, seen from both views, lies in front of the frame they share.
    fn is_rectifiable(&self, one: u32, two: u32) -> bool {
        let (p, q) = (self.arms[one as usize], self.arms[two as usize]);
        let Some(frame) = EpipolarFrame::new(p, q, DVec3::ZERO) else {
            return false;
        };
        [p, q].iter().all(|arm| {
            let sine = (self.radius / arm.length()).min(1.0);
            let to_center = (-arm.dot(frame.f) / arm.length()).clamp(-1.0, 1.0).acos();
            to_center + sine.asin() < MIN_FORWARD_COSINE.acos()
        })
    }

    /// The original views whose prediction changes when `view` is removed: itself, and the removed ones in its star.
    #[must_use]
    pub fn views_around(&self, view: u32) -> Vec<u32> {
        let mut views: Vec<u32> = self.stars[view as usize]
            .iter()
            .flat_map(|&t| &self.members[t as usize])
            .copied()
            .collect();
        views.push(view);
        views.sort_unstable();
        views
    }

    /// The views that are left, ascending.
    #[must_use]
    pub fn kept(&self) -> Vec<u32> {
        (0..self.stars.len() as u32)
            .filter(|&v| !self.stars[v as usize].is_empty())
            .collect()
    }

    /// The edges, each once, in a fixed order.
    #[must_use]
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let both = self.collapses().map(|c| [c.removed, c.onto]);
        both.filter(|[a, b]| a < b).collect()
    }

    /// The edges of the triangles around `view`, each once, in a fixed order.
    #[must_use]
    pub fn edges_around(&self, view: u32) -> Vec<[u32; 2]> {
        let corners = self.star(view).map(|(_, t)| t);
        let sides = corners.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Whether a triangle may be part of the polytope.
    fn is_allowed(&self, triangle: [u32; 3]) -> bool {
        let corners = triangle.map(|v| self.arms[v as usize]);
        let [a, b, c] = corners;
        a.dot(b.cross(c)) > MIN_VOLUME_SHARE * a.length() * b.length() * c.length()
            && (self.rule == Rule::Sides || is_readable(corners, self.contour_radius))
    }

    /// The edge turned in the quadrangle of its two triangles; `None` where that leaves no polytope.
    #[must_use]
    pub fn flip(&self, [a, b]: [u32; 2]) -> Option<Patch> {
        let directed = |from: u32, to: u32| {
            self.star(from).find_map(|(t, triangle)| {
                let k = triangle.iter().position(|&v| v == from)?;
                (triangle[(k + 1) % 3] == to).then_some((t, triangle[(k + 2) % 3]))
            })
        };
        let ((left, c), (right, d)) = (directed(a, b)?, directed(b, a)?);
        let new = vec![[a, d, c], [d, b, c]];
        let is_allowed = c != d
            && !self.is_edge(Collapse {
                removed: c,
                onto: d,
            })
            && new.iter().all(|&t| self.is_allowed(t))
            && self.is_rectifiable(c, d);
        is_allowed.then(|| Patch {
            views: self.members_of(&[left, right]),
            old: vec![left, right],
            new,
            kept: None,
        })
    }

    /// Removed views whose eyes some triangles face, ascending.
    fn members_of(&self, triangles: &[u32]) -> Vec<u32> {
        let members = triangles.iter().flat_map(|&t| &self.members[t as usize]);
        let mut views: Vec<u32> = members.copied().collect();
        views.sort_unstable();
        views
    }

    /// At most `count` removed views in the triangles around `view`, the nearest to the middle of its neighbours first.
    #[must_use]
    pub fn views_beside(&self, view: u32, count: usize) -> Vec<u32> {
        let middle: DVec3 = (self.neighbours(view).iter())
            .map(|&v| self.arms[v as usize].normalize_or_zero())
            .sum();
        let mut views = self.members_of(&self.stars[view as usize]);
        views.retain(|&v| self.may_be_kept[v as usize]);
        let nearness = |v: &u32| self.arms[*v as usize].normalize_or_zero().dot(middle);
        views.sort_by(|a, b| nearness(b).total_cmp(&nearness(a)).then(a.cmp(b)));
        views.truncate(count);
        views
    }

    /// The triangles around `view` drawn to a removed view instead; `None` where that leaves no polytope.
    #[must_use]
    pub fn replacement(&self, view: u32, other: u32) -> Option<Patch> {
        let old = self.stars[view as usize].clone();
        let new: Vec<[u32; 3]> = self
            .star(view)
            .map(|(_, t)| t.map(|v| if v == view { other } else { v }))
            .collect();
        let is_allowed = new.iter().all(|&t| self.is_allowed(t))
            && self
                .neighbours(view)
                .iter()
                .all(|&v| self.is_rectifiable(other, v));
        let mut views = self.members_of(&old);
        views.retain(|&v| v != other);
        // First, because its error grows most: it was none.
        views.insert(0, view);
        is_allowed.then_some(Patch {
            old,
            new,
            views,
            kept: Some(other),
        })
    }

    /// Carries a patch out. `facing` says of each of its views which new triangle it faces.
    pub fn apply_patch(&mut self, patch: &Patch, facing: impl IntoIterator<Item = Facing>) {
        for (&t, &new) in patch.old.iter().zip(&patch.new) {
            for v in self.triangles[t as usize]
                .replace(new)
                .into_iter()
                .flatten()
            {
                self.stars[v as usize].retain(|&other| other != t);
            }
            for v in new {
                self.stars[v as usize].push(t);
                self.versions[v as usize] += 1;
            }
            self.members[t as usize].clear();
        }
        for p in facing {
            self.members[patch.old[p.triangle] as usize].push(p.view);
        }
    }

    /// Carries a collapse out. `facing` says which of the new triangles (in the order of
    /// [`Self::triangles_after`]) each view around it faces. Returns the edges that are new, in both directions.
    pub fn apply(
        &mut self,
        collapse: Collapse,
        facing: impl IntoIterator<Item = Facing>,
    ) -> Vec<Collapse> {
        let Collapse { removed, onto } = collapse;
        let before = self.neighbours(onto);
        let ring = self.neighbours(removed);
        let star = std::mem::take(&mut self.stars[removed as usize]);
        let mut moved = Vec::new();
        for t in star {
            self.members[t as usize].clear();
            let Some(triangle) = self.triangles[t as usize] else {
                continue;
            };
            if triangle.contains(&onto) {
                self.triangles[t as usize] = None;
                for v in triangle.into_iter().filter(|&v| v != removed) {
                    self.stars[v as usize].retain(|&other| other != t);
                }
            } else {
                self.triangles[t as usize] =
                    Some(triangle.map(|v| if v == removed { onto } else { v }));
                self.stars[onto as usize].push(t);
                moved.push(t);
            }
        }
        for p in facing {
            self.members[moved[p.triangle] as usize].push(p.view);
        }
        for &v in &ring {
            self.versions[v as usize] += 1;
        }
        self.view_count -= 1;
        let new = ring
            .into_iter()
            .filter(|&v| v != onto && before.binary_search(&v).is_err());
        new.flat_map(|v| Collapse::along([onto, v])).collect()
    }

    /// The views that are left, ascending, and the triangles over their new numbers, in a fixed order.
    #[must_use]
    pub fn compact(&self) -> (Vec<u32>, Vec<[u32; 3]>) {
        let kept: Vec<u32> = (0..self.stars.len() as u32)
            .filter(|&v| !self.stars[v as usize].is_empty())
            .collect();
        let number = |v: u32| kept.partition_point(|&k| k < v) as u32;
        let mut triangles: Vec<[u32; 3]> = self
            .triangles
            .iter()
            .flatten()
            .map(|t| {
                let mut renumbered = t.map(number);
                let first = (0..3).min_by_key(|&k| renumbered[k]).unwrap_or(0);
                renumbered.rotate_left(first);
                renumbered
            })
            .collect();
        triangles.sort_unstable();
        (kept, triangles)
    }

    /// Whether the polytope is closed, star-shaped, and home to every removed view exactly once.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let (kept, triangles) = self.compact();
        let arms = kept.iter().map(|&v| self.arms[v as usize]).collect();
        let is_star_shaped = Polytope::from_parts(DVec3::ZERO, arms, triangles).is_ok();
        let mut housed: Vec<u32> = self.members.iter().flatten().copied().collect();
        housed.extend(&kept);
        housed.sort_unstable();
        is_star_shaped
            && kept.len() == self.view_count
            && housed.into_iter().eq(0..self.stars.len() as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three places about an axis, so high that their plane is at a height of its own.
    fn corners(height: f64) -> [DVec3; 3] {
        let reach = (9.0 - height * height).sqrt();
        let half = 0.75_f64.sqrt();
        [(1.0, 0.0), (-0.5, half), (-0.5, -half)]
            .map(|(x, y)| DVec3::new(x * reach, y * reach, height))
    }

    #[test]
    fn a_plane_that_comes_near_the_sphere_is_not_readable() {
        assert!(is_readable(corners(2.0), 1.0));
        assert!(is_readable(corners(1.07), 1.0));
        // Rays beside the sphere would lie almost beside the frame, then the plane cuts the sphere, then it has the center behind it.
        for height in [1.04, 0.9, 0.0, -2.0] {
            assert!(!is_readable(corners(height), 1.0), "{height}");
        }
        assert!(!is_readable(corners(2.0), 3.1), "an eye in the sphere");
        // What can be looked from everywhere can be rectified everywhere.
        let [a, b, c] = corners(1.07);
        for (p, q) in [(a, b), (a, (b + c) * 0.5), ((a + b) * 0.5, c)] {
            let frame = EpipolarFrame::new(p, q, DVec3::ZERO).unwrap();
            for eye in [p, q] {
                let aside = (-eye.dot(frame.f) / eye.length()).acos();
                let rim = aside + (1.0 / eye.length()).asin();
                assert!(rim.cos() > MIN_FORWARD_COSINE, "{rim}");
            }
        }
    }
}
