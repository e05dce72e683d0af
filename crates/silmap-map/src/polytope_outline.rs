//! The outline seen from a point of the polytope, as interpolated there: it can be carried to any eye that looks at the object from
//! about there.
//!
//! Source: Silhouette Mapping, section 5: the silhouette at p_t, before it is mapped to the eye.

use glam::{DMat3, DVec3, DVec4, Vec4};
use silmap_geometry::Camera;

use crate::epipolar::image_from_object;
use crate::interpolation::Transfer;
use crate::loops::{DeepLoops, SeenLoops};
use crate::project::{Projection, Round, project_loops};
use crate::sweep::intersection::RegionIntersection;
use crate::sweep::union::PartUnion;
use crate::tidy::PieceCounts;
use crate::{CapturedView, SilhouetteMap};

/// Regions that all hold the outline: one for each order of the triangle's views, or one.
pub(crate) const MOST_REGIONS: usize = 3;

/// An outline seen from a point of the polytope.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolytopeOutline {
    /// p_t
    pub(crate) point: DVec3,
    /// Normal of the polytope's triangle.
    pub(crate) normal: DVec3,
    /// Whether its loops have depths.
    pub(crate) has_depth: bool,
    /// The most pieces that any of the three views has.
    pub(crate) pieces: PieceCounts,
    /// How many regions there are.
    pub(crate) count: usize,
    pub(crate) regions: [PolytopeRegion; MOST_REGIONS],
}

/// One of the regions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PolytopeRegion {
    pub(crate) loops: DeepLoops,
    /// From coordinates of the loops, with a 1 appended.
    pub(crate) rays_from_loops: DMat3,
    /// Whether that is a rotation.
    pub(crate) is_frame: bool,
}

/// Slits and hairs of a picture between parts are left out where they are narrower than this: contours are not that precise.
const HAIR_PX: f64 = 0.5;

/// An eye closer than this to the polytope's point, in radii of the bounding sphere, is there.
const ON_POLYTOPE: f64 = 1e-9;

impl PolytopeOutline {
    /// Whether it is of several parts.
    pub(crate) fn is_of_parts(&self) -> bool {
        (self.regions[..self.count].iter()).any(|region| region.loops.may_overlap())
    }

    /// How a region is carried to an eye.
    fn projection(
        &self,
        region: &PolytopeRegion,
        map: &SilhouetteMap,
        camera: &Camera,
        transfer: Transfer,
    ) -> Projection {
        let image_from_rays = image_from_object(camera);
        let to_camera = if self.has_depth && transfer != Transfer::Homography {
            let offset = camera.eye - self.point;
            let radius = map.radius;
            let round = Round { offset, radius };
            Projection {
                matrix: image_from_rays,
                shift: -(image_from_rays * offset),
                round: (offset.length() > ON_POLYTOPE * radius).then_some(round),
                keeps_depth: true,
            }
        } else {
            let homography = plane_homography(map.center, self.normal, self.point, camera.eye);
            Projection {
                matrix: image_from_rays * homography,
                shift: DVec3::ZERO,
                round: None,
                keeps_depth: false,
            }
        };
        if region.is_frame {
            to_camera.after_frame(region.rays_from_loops)
        } else {
            to_camera.after(region.rays_from_loops)
        }
    }

    /// Appends all of it, in single precision, as rows of four numbers, which [`PolytopeOutline::unpack`] reads.
    pub fn pack(&self, rows: &mut Vec<[f32; 4]>) {
        let mut push = |v: DVec3, w: f64| rows.push(v.extend(w).as_vec4().to_array());
        // The rest of a number that single precision cuts off.
        let rest = self.point - self.point.as_vec3().as_dvec3();
        push(self.point, self.count as f64);
        push(rest, f64::from(u8::from(self.has_depth)));
        let [outer, holes] = self.pieces.to_array().map(|n| n as f64);
        push(self.normal.normalize_or_zero(), outer);
        push(DVec3::ZERO, holes);
        for region in &self.regions[..self.count] {
            let matrix = &region.rays_from_loops;
            push(matrix.x_axis, f64::from(u8::from(region.is_frame)));
            push(matrix.y_axis, region.loops.iter().count() as f64);
            push(matrix.z_axis, 0.0);
            for (part, points) in region.loops.of_parts() {
                push(DVec3::X * f64::from(part), points.len() as f64);
                points.iter().for_each(|p| push(p.truncate(), p.w));
            }
        }
    }

    /// Becomes what was packed; there are no regions where `rows` are not what [`PolytopeOutline::pack`] writes.
    pub fn unpack(&mut self, rows: &[[f32; 4]]) {
        let mut rows = rows.iter().map(|&row| Vec4::from(row).as_dvec4());
        self.count = self.read(&mut rows).unwrap_or(0);
    }

    /// Returns the number of regions.
    fn read(&mut self, rows: &mut impl Iterator<Item = DVec4>) -> Option<usize> {
        let head = [rows.next()?, rows.next()?, rows.next()?, rows.next()?];
        self.point = head[0].truncate() + head[1].truncate();
        self.has_depth = head[1].w != 0.0;
        self.normal = head[2].truncate();
        self.pieces = PieceCounts::from_array([head[2].w, head[3].w].map(|n| n as usize));
        let count = (head[0].w as usize).min(MOST_REGIONS);
        for region in &mut self.regions[..count] {
            let axes = [rows.next()?, rows.next()?, rows.next()?];
            let [x, y, z] = axes.map(DVec4::truncate);
            region.rays_from_loops = DMat3::from_cols(x, y, z);
            region.is_frame = axes[0].w != 0.0;
            region.loops.clear();
            for _ in 0..axes[1].w as usize {
                let head = rows.next()?;
                region.loops.set_part(head.x as u16);
                for _ in 0..head.w as usize {
                    region.loops.push(rows.next()?);
                }
                region.loops.close();
            }
        }
        Some(count)
    }
}

/// Carries outlines to cameras.
#[derive(Clone, Debug, Default)]
pub(crate) struct OutlineCarrier {
    regions: [SeenLoops; MOST_REGIONS],
    union: PartUnion,
    united: SeenLoops,
    intersection: RegionIntersection,
    shared: SeenLoops,
}

impl OutlineCarrier {
    /// The outline as `camera` sees it: simple loops that do not overlap where it is the intersection of several regions.
    pub(crate) fn carry(
        &mut self,
        outline: &PolytopeOutline,
        map: &SilhouetteMap,
        camera: &Camera,
        transfer: Transfer,
    ) -> &SeenLoops {
        let count = self.carry_regions(outline, map, camera, transfer).len();
        if count == 0 {
            self.regions[0].clear();
        }
        for region in &mut self.regions[..count] {
            if region.may_overlap() {
                self.union.unite(region, HAIR_PX, &mut self.united);
                std::mem::swap(region, &mut self.united);
            }
        }
        if count <= 1 {
            return &self.regions[0];
        }
        self.intersection
            .intersect(self.regions.each_ref(), &mut self.shared);
        &self.shared
    }

    /// Each region as `camera` sees it.
    pub(crate) fn carry_regions(
        &mut self,
        outline: &PolytopeOutline,
        map: &SilhouetteMap,
        camera: &Camera,
        transfer: Transfer,
    ) -> &[SeenLoops] {
        let regions = &outline.regions[..outline.count];
        for (region, seen) in regions.iter().zip(&mut self.regions) {
            let to_camera = outline.projection(region, map, camera, transfer);
            project_loops(&region.loops, &to_camera, seen);
        }
        &self.regions[..outline.count]
    }
}

/// The outlines of captured views, all parts together.
#[derive(Clone, Debug, Default)]
pub(crate) struct CapturedOutlines {
    contours: SeenLoops,
    union: PartUnion,
    outline: SeenLoops,
}

impl CapturedOutlines {
    /// Of how many pieces the outline of each view of `map` is made.
    pub(crate) fn piece_counts(&mut self, map: &SilhouetteMap) -> Vec<PieceCounts> {
        let of_view = |view: &CapturedView| {
            self.contours.clear();
            for contour in &view.contours {
                self.contours.set_part(contour.part);
                (contour.points.iter()).for_each(|p| self.contours.push(p.extend(0.0)));
                self.contours.close();
            }
            if !self.contours.may_overlap() {
                return PieceCounts::of(&self.contours);
            }
            self.union.unite(&self.contours, HAIR_PX, &mut self.outline);
            PieceCounts::of(&self.outline)
        };
        map.views.iter().map(of_view).collect()
    }
}

/// From rays at `from` to rays at `to` that meet them on the plane through `center` with `normal`, up to positive scale
/// (section 5, footnote 2).
fn plane_homography(center: DVec3, normal: DVec3, from: DVec3, to: DVec3) -> DMat3 {
    // A ray d from p_t meets the plane at p_t + d·(n·(c − p_t))/(n·d); times n·d, seen from p_c.
    let towards = if normal.dot(center - from) < 0.0 {
        -normal
    } else {
        normal
    };
    let reach = towards.dot(center - from);
    let shift = from - to;
    let outer = DMat3::from_cols(shift * towards.x, shift * towards.y, shift * towards.z);
    DMat3::from_diagonal(DVec3::splat(reach)) + outer
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    #[test]
    fn the_homography_meets_points_of_the_plane() {
        let (center, normal) = (DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.2, 0.5, 1.0));
        let (from, to) = (DVec3::new(0.5, 0.3, 4.0), DVec3::new(-1.0, 2.0, 7.0));
        let across = normal.any_orthogonal_vector();
        let point = center + across * 0.7;
        let mapped = plane_homography(center, normal, from, to) * (point - from);
        assert!(mapped.cross(point - to).length() < 1e-9 && mapped.dot(point - to) > 0.0);
        let same = plane_homography(center, normal, from, from) * DVec2::new(0.1, 0.2).extend(-1.0);
        assert!(same.cross(DVec3::new(0.1, 0.2, -1.0)).length() < 1e-9);
    }

    fn outline() -> impl Strategy<Value = PolytopeOutline> {
        let number = || -9.0..9.0_f64;
        let point = (number(), number(), number(), number()).prop_map(DVec4::from);
        let loops = prop::collection::vec(prop::collection::vec(point, 3..6), 0..4);
        let region = (loops, any::<bool>(), number()).prop_map(|(loops, is_frame, turn)| {
            let mut region = PolytopeRegion {
                is_frame,
                rays_from_loops: DMat3::from_rotation_x(turn),
                ..PolytopeRegion::default()
            };
            region.loops.assign(loops.iter().map(Vec::as_slice));
            region
        });
        let regions = prop::array::uniform3(region);
        (regions, 0..=3_usize, any::<bool>(), 0..9_usize).prop_map(
            |(regions, count, has_depth, n)| PolytopeOutline {
                point: DVec3::new(1.0e5 / 3.0, -2.0 / 7.0, n as f64),
                normal: DVec3::Y,
                has_depth,
                pieces: PieceCounts::from_array([n, 1]),
                count,
                regions,
            },
        )
    }

    /// What there is to know of an outline, as numbers.
    fn numbers(outline: &PolytopeOutline) -> Vec<f64> {
        let mut all = outline.point.to_array().to_vec();
        all.extend(outline.normal.to_array());
        all.extend(outline.pieces.to_array().map(|n| n as f64));
        all.push(f64::from(u8::from(outline.has_depth)));
        for region in &outline.regions[..outline.count] {
            all.push(f64::from(u8::from(region.is_frame)));
            all.extend(region.rays_from_loops.to_cols_array());
            for points in region.loops.iter() {
                all.push(points.len() as f64);
                all.extend(points.iter().flat_map(|p| p.to_array()));
            }
        }
        all
    }

    proptest! {
        /// What is packed comes back, whatever was there before; of a part of it nothing comes, and nothing breaks.
        #[test]
        fn what_is_packed_comes_back(one in outline(), mut other in outline(), share in 0.0..1.0_f64) {
            let mut rows = Vec::new();
            one.pack(&mut rows);
            other.unpack(&rows);
            let (wanted, found) = (numbers(&one), numbers(&other));
            prop_assert_eq!(wanted.len(), found.len());
            for (w, f) in wanted.iter().zip(&found) {
                prop_assert!((w - f).abs() < 1e-6, "{w} {f}");
            }
            // The place, which may be far from the origin, is as exact as it was.
            prop_assert!(one.point.distance(other.point) < 1e-8);
            let part = (rows.len() as f64 * share) as usize;
            other.unpack(&rows[..part]);
            prop_assert_eq!(other.count, 0);
        }
    }
}
