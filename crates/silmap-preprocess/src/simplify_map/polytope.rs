//! The polytope while views are removed from it: half-edge collapses, and which triangle each removed view lies in.

use glam::DVec3;
use silmap_map::SilhouetteMap;
use silmap_map::epipolar::{EpipolarFrame, MIN_FORWARD_COSINE};

use super::predict::Prediction;

/// Removing one view by collapsing an edge onto its other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Collapse {
    /// The view that goes.
    pub(super) removed: u32,
    /// The neighbour that its triangles are pulled to.
    pub(super) onto: u32,
}

/// A triangle's volume with the center must stay above this share of the product of its arms: below, a ray from the
/// center meets it at a grazing angle and rounding decides.
const MIN_VOLUME_SHARE: f64 = 1e-6;

/// The polytope of the views that are left.
#[derive(Clone, Debug)]
pub(super) struct SimplifiedPolytope {
    /// Eyes relative to the center.
    arms: Vec<DVec3>,
    radius: f64,
    triangles: Vec<Option<[u32; 3]>>,
    /// Per triangle: removed views whose eyes it faces.
    members: Vec<Vec<u32>>,
    /// Per view: its triangles; empty when the view is gone.
    stars: Vec<Vec<u32>>,
    versions: Vec<u32>,
    view_count: usize,
}

impl SimplifiedPolytope {
    pub(super) fn new(map: &SilhouetteMap) -> Self {
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
            triangles: map.triangles.iter().copied().map(Some).collect(),
            members: vec![Vec::new(); map.triangles.len()],
            versions: vec![0; map.views.len()],
            view_count: map.views.len(),
            stars,
        }
    }

    pub(super) fn view_count(&self) -> usize {
        self.view_count
    }

    /// Changes whenever the triangles around a view do.
    pub(super) fn version(&self, view: u32) -> u32 {
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

    pub(super) fn is_edge(&self, collapse: Collapse) -> bool {
        self.star(collapse.removed)
            .any(|(_, t)| t.contains(&collapse.onto))
    }

    /// All edges, in both directions, in a fixed order.
    pub(super) fn collapses(&self) -> impl Iterator<Item = Collapse> + '_ {
        (0..self.stars.len() as u32).flat_map(|removed| {
            self.neighbours(removed)
                .into_iter()
                .map(move |onto| Collapse { removed, onto })
        })
    }

    /// The triangles that a collapse leaves where the removed view was; `None` when the result would not be a manifold, not
    /// star-shaped, or have an edge too long to rectify.
    pub(super) fn triangles_after(&self, collapse: Collapse) -> Option<Vec<[u32; 3]>> {
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
            let [a, b, c] = moved.map(|v| self.arms[v as usize]);
            if a.dot(b.cross(c)) <= MIN_VOLUME_SHARE * a.length() * b.length() * c.length() {
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
    pub(super) fn views_around(&self, view: u32) -> Vec<u32> {
        let mut views: Vec<u32> = self.stars[view as usize]
            .iter()
            .flat_map(|&t| &self.members[t as usize])
            .copied()
            .collect();
        views.push(view);
        views.sort_unstable();
        views
    }

    /// Carries a collapse out. `predictions` tell which of the new triangles (in the order of
    /// [`Self::triangles_after`]) each view around it lies in. Returns the edges that are new, in both directions.
    pub(super) fn apply(
        &mut self,
        collapse: Collapse,
        predictions: &[Prediction],
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
        for p in predictions {
            self.members[moved[p.triangle] as usize].push(p.view);
        }
        for &v in &ring {
            self.versions[v as usize] += 1;
        }
        self.view_count -= 1;
        let new = ring
            .into_iter()
            .filter(|&v| v != onto && before.binary_search(&v).is_err());
        new.flat_map(|v| {
            [
                Collapse {
                    removed: onto,
                    onto: v,
                },
                Collapse { removed: v, onto },
            ]
        })
        .collect()
    }

    /// The views that are left, ascending, and the triangles over their new numbers, in a fixed order.
    pub(super) fn compact(&self) -> (Vec<u32>, Vec<[u32; 3]>) {
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

    /// Fails when the polytope is not closed, star-shaped, and home to every removed view exactly once.
    #[cfg(test)]
    pub(super) fn check(&self) {
        let (kept, triangles) = self.compact();
        let arms = kept.iter().map(|&v| self.arms[v as usize]).collect();
        silmap_map::Polytope::from_parts(DVec3::ZERO, arms, triangles).unwrap();
        assert_eq!(kept.len(), self.view_count);
        let mut housed: Vec<u32> = self.members.iter().flatten().copied().collect();
        housed.extend(&kept);
        housed.sort_unstable();
        assert_eq!(housed, (0..self.stars.len() as u32).collect::<Vec<_>>());
    }
}
