//! How deep a point of the model lies within its silhouettes from a viewpoint and those around it.
//!
//! The outlines of parts go on where the part lies behind or before others. What lies so deep that no eye near a view sees it outlined
//! needs no precision there: it may be thinned out, as long as it stays within the silhouettes.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::{Camera, Mask};

/// Side of the cells in which distances are kept, pixels.
const CELL_PX: u32 = 4;

/// Distances are kept in these parts of a cell.
const STEPS: u16 = 3;

/// Steps to a neighbour and to one across, as Borgefors has them (Distance Transformations in Digital Images, 1986).
const CHAMFER: (u16, u16) = (3, 4);

/// The distances of all pixels of a silhouette from its outline.
#[derive(Clone, Debug)]
struct Depths {
    width: usize,
    cells: Vec<u8>,
}

impl Depths {
    fn new(mask: &Mask) -> Self {
        let (width, height) = [mask.width(), mask.height()]
            .map(|px| (px / CELL_PX) as usize)
            .into();
        let mut steps = vec![0_u16; width * height];
        for cell_y in 0..height {
            for cell_x in 0..width {
                let is_inside = (0..CELL_PX).all(|y| {
                    let row = i64::from(cell_y as u32 * CELL_PX + y);
                    (0..CELL_PX).all(|x| mask.get(i64::from(cell_x as u32 * CELL_PX + x), row))
                });
                steps[cell_y * width + cell_x] = if is_inside { u16::MAX / 2 } else { 0 };
            }
        }
        // Nothing is known beyond the picture.
        let at = |steps: &[u16], x: isize, y: isize| {
            let is_there = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
            if is_there {
                steps[y as usize * width + x as usize]
            } else {
                0
            }
        };
        let mut relax = |x: usize, y: usize, sign: isize| {
            let (px, py) = (x as isize, y as isize);
            let straight = at(&steps, px - sign, py).min(at(&steps, px, py - sign));
            let across = at(&steps, px - sign, py - sign).min(at(&steps, px + sign, py - sign));
            let least = (straight + CHAMFER.0).min(across + CHAMFER.1);
            let own = &mut steps[y * width + x];
            *own = (*own).min(least);
        };
        for y in 0..height {
            (0..width).for_each(|x| relax(x, y, 1));
        }
        for y in (0..height).rev() {
            (0..width).rev().for_each(|x| relax(x, y, -1));
        }
        let cells = steps.iter().map(|&s| s.min(u8::MAX.into()) as u8);
        Self {
            width,
            cells: cells.collect(),
        }
    }

    /// The distance at a place, pixels; zero outside.
    fn at(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x / f64::from(CELL_PX), y / f64::from(CELL_PX));
        let height = self.cells.len() / self.width.max(1);
        if !(x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < height as f64) {
            return 0.0;
        }
        let steps = self.cells[y as usize * self.width + x as usize];
        // To the border of the nearest cell outside.
        let cells = (f64::from(steps) / f64::from(STEPS) - 1.0).max(0.0);
        cells * f64::from(CELL_PX)
    }
}

/// The silhouettes of a model from all views.
#[derive(Debug)]
pub(crate) struct Silhouettes<'a> {
    cameras: &'a [Camera],
    center: DVec3,
    depths: Vec<Depths>,
    /// Cosine of the angle about the center within which eyes are near.
    near: f64,
}

/// Views are near that are no farther than this times the spacing of those that will be kept.
const REACH: f64 = 0.7;

/// Silhouettes must be closer to each other than this share of the reach: what is hidden in all of them may show between.
const LEAST_DENSITY: f64 = 0.6;

/// The angle between neighbours of so many evenly spread views.
fn spacing(views: f64) -> f64 {
    (8.0 * std::f64::consts::PI / (3.0_f64.sqrt() * views.max(4.0))).sqrt()
}

impl<'a> Silhouettes<'a> {
    /// From evenly spread views, of which `kept` will be left; `None` where there are too few to tell.
    pub(crate) fn new(
        (cameras, masks): (&'a [Camera], &[Mask]),
        center: DVec3,
        kept: u32,
    ) -> Option<Self> {
        let reach = REACH * spacing(kept.into());
        if spacing(cameras.len() as f64) > LEAST_DENSITY * reach {
            return None;
        }
        Some(Self {
            cameras,
            center,
            depths: masks.par_iter().map(Depths::new).collect(),
            near: reach.cos(),
        })
    }

    /// The silhouettes from the eyes near that of a view, its own first.
    pub(crate) fn near(&self, view: usize) -> Near<'_> {
        let direction = |k: usize| (self.cameras[k].eye - self.center).normalize_or_zero();
        let own = direction(view);
        let others = (0..self.cameras.len()).filter(|&k| k != view);
        let near = others.filter(|&k| direction(k).dot(own) >= self.near);
        Near {
            of: self,
            views: std::iter::once(view).chain(near).collect(),
        }
    }
}

/// Silhouettes from eyes near each other.
#[derive(Debug)]
pub(crate) struct Near<'a> {
    of: &'a Silhouettes<'a>,
    views: Vec<usize>,
}

impl Near<'_> {
    /// How much deeper than `least` a point lies within all of them, pixels; zero where it does not.
    pub(crate) fn beyond(&self, point: DVec3, least: f64) -> f64 {
        let mut depth = f64::INFINITY;
        for &k in &self.views {
            let p = self.of.cameras[k].image_from_object(point);
            depth = depth.min(self.of.depths[k].at(p.x, p.y));
            if depth <= least {
                return 0.0;
            }
        }
        depth - least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Never deeper than it is, and not much less deep.
        #[test]
        fn depths_are_bounds(x in 20.0..44.0_f64, y in 20.0..44.0_f64, radius in 6.0..20.0_f64) {
            let mut mask = Mask::new(64, 64);
            for row in 0..64_u32 {
                for column in 0..64_u32 {
                    let off = (f64::from(column) + 0.5 - x).hypot(f64::from(row) + 0.5 - y);
                    mask.set(column, row, off < radius);
                }
            }
            let depths = Depths::new(&mask);
            for row in 0..64_u32 {
                for column in 0..64_u32 {
                    let p = [column, row].map(|v| f64::from(v) + 0.5);
                    let truth = (radius - (p[0] - x).hypot(p[1] - y)).max(0.0);
                    let found = depths.at(p[0], p[1]);
                    prop_assert!(found <= truth + 1.5, "{found} for {truth}");
                    prop_assert!(found >= truth - 3.0 * f64::from(CELL_PX), "{found} for {truth}");
                }
            }
            prop_assert_eq!(depths.at(-1.0, 5.0), 0.0);
        }
    }

    #[test]
    fn sparse_views_tell_nothing() {
        let camera = Camera::fit_sphere(DVec3::Z * 3.0, DVec3::ZERO, 1.0, None, (8, 8)).unwrap();
        let (cameras, masks) = (vec![camera; 96], vec![Mask::new(8, 8); 96]);
        assert!(Silhouettes::new((&cameras, &masks), DVec3::ZERO, 96).is_none());
        assert!(Silhouettes::new((&cameras, &masks), DVec3::ZERO, 12).is_some());
    }
}
