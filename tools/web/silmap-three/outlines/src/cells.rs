//! Which outlines there are, which eyes they serve, and which are wanted.

use std::collections::{HashMap, HashSet};

use glam::{DVec3, DVec4};
use silmap_curve::block_cache::{BlockCache, KeptRef};
use silmap_curve::cells::{Bearing, Cell, CellKey, ReuseError};
use wasm_bindgen::prelude::*;

use crate::maker::REQUEST;

/// Numbers of an eye: its place with a 1 or the unit direction to it with a 0, and the radius of the model's sphere in pixels.
const EYE: usize = 5;

/// Numbers of a record, which shaders read: the eye in single precision; the outline's first texel, its points, and two zeros.
const RECORD: usize = 8;

/// Points of the outline of an instance that is drawn whole, and of one whose outline is not there yet.
const WHOLE: f32 = 0.0;
const NOT_YET: f32 = -1.0;

/// What is known of an outline that is kept.
#[derive(Clone, Copy, Debug)]
struct KeptOutline {
    points: u32,
    /// The eye that it was made for.
    middle: Bearing,
}

/// The outlines of one asset.
#[wasm_bindgen]
#[derive(Debug)]
pub struct OutlineCells {
    center: DVec3,
    radius: f64,
    error: ReuseError,
    kept: BlockCache<CellKey, KeptOutline>,
    /// Cells without an outline that eyes were in since the last were taken, and how far off what they use instead is.
    wanted: HashMap<CellKey, (Cell, f64)>,
    /// Cells whose outlines are being made.
    pending: HashSet<CellKey>,
    /// The same by the names of their requests.
    pending_cells: HashMap<u32, Cell>,
    next_request: u32,
}

#[wasm_bindgen]
impl OutlineCells {
    /// For a model in a sphere, with room for so many texels; `allowed_px` as for `OutlineMaker`.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new(sphere: &[f64], allowed_px: f64, texels: u32) -> Self {
        let &[x, y, z, radius] = sphere.first_chunk().unwrap_or(&[0.0, 0.0, 0.0, 1.0]);
        Self {
            center: DVec3::new(x, y, z),
            radius,
            error: ReuseError { allowed_px },
            kept: BlockCache::new(texels),
            wanted: HashMap::new(),
            pending: HashSet::new(),
            pending_cells: HashMap::new(),
            next_request: 0,
        }
    }

    /// What was found until now may make room for what is new.
    pub fn begin_frame(&mut self) {
        self.kept.begin_frame();
    }

    /// Outlines that are kept.
    #[must_use]
    pub fn count(&self) -> usize {
        self.kept.len()
    }

    /// Finds the outlines of eyes and writes their records. `before` holds what each eye used last, or zero. Returns for how many
    /// nothing serves.
    pub fn find(&mut self, eyes: &[f64], before: &mut [u64], records: &mut [f32]) -> u32 {
        let eyes = eyes.as_chunks::<EYE>().0;
        let records = records.as_chunks_mut::<RECORD>().0;
        let mut missing = 0;
        for ((eye, before), record) in eyes.iter().zip(before).zip(records) {
            let &[x, y, z, w, radius_px] = eye;
            let eye = DVec4::new(x, y, z, w);
            let (start, points) = self.outline_of(eye, radius_px, before);
            missing += u32::from(points == NOT_YET);
            let [x, y, z, w] = eye.as_vec4().to_array();
            *record = [x, y, z, w, start as f32, points, 0.0, 0.0];
        }
        missing
    }

    /// Takes at most so many of the requests for outlines, those that are needed most; `OutlineMaker::make` takes one each. The numbers
    /// of each are followed by its name, for [`OutlineCells::keep`].
    pub fn take_wanted(&mut self, most: usize) -> Vec<f64> {
        let mut wanted: Vec<(Cell, f64)> = self.wanted.drain().map(|(_, w)| w).collect();
        wanted.sort_unstable_by(|(a, off_a), (b, off_b)| {
            let by_key = (a.key.size, a.key.place).cmp(&(b.key.size, b.key.place));
            off_b.total_cmp(off_a).then(by_key)
        });
        wanted.truncate(most);
        let mut requests = Vec::with_capacity(wanted.len() * (REQUEST + 1));
        for (cell, _) in wanted {
            let name = self.next_request;
            self.next_request = self.next_request.wrapping_add(1);
            self.pending.insert(cell.key);
            self.pending_cells.insert(name, cell);
            let Bearing {
                direction: d,
                rim_angle,
            } = cell.middle;
            requests.extend([d.x, d.y, d.z, rim_angle, cell.radius_px, name.into()]);
        }
        requests
    }

    /// How many outlines are being made.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Makes room for an outline that was asked for: its first texel, or −1 where there is no room, or nobody asked.
    pub fn keep(&mut self, name: u32, texels: u32, points: u32) -> i32 {
        let Some(cell) = self.pending_cells.remove(&name) else {
            return -1;
        };
        self.pending.remove(&cell.key);
        let middle = cell.middle;
        let kept = KeptOutline { points, middle };
        let kept = self.kept.insert(cell.key, texels.max(1), kept);
        let start = kept.and_then(|kept| self.kept.kept(kept)).map(|k| k.start);
        start.map_or(-1, |start| start as i32)
    }
}

impl OutlineCells {
    /// First texel and points of the outline that serves an eye.
    fn outline_of(&mut self, eye: DVec4, radius_px: f64, before: &mut u64) -> (u32, f32) {
        let is_eye = eye.is_finite() && radius_px.is_finite();
        let bearing = is_eye.then(|| Bearing::new(eye, self.center, self.radius));
        let Some(bearing) = bearing.flatten() else {
            return (0, WHOLE);
        };
        let cell = Cell::of(0, bearing, radius_px, &self.error);
        let found = self.kept.find(&cell.key);
        if let Some(kept) = found {
            *before = kept.to_bits();
            return self.place_of(kept);
        }
        // What it had may serve until its turn comes.
        let last = KeptRef::from_bits(*before);
        let last = last.and_then(|l| Some((l, self.kept.kept(l)?.value.middle)));
        let off_px = last.map_or(f64::INFINITY, |(_, middle)| {
            self.error
                .bound_px(middle.angle_to(&bearing), cell.radius_px)
        });
        if !self.pending.contains(&cell.key) {
            let wanted = self.wanted.entry(cell.key).or_insert((cell, off_px));
            wanted.1 = wanted.1.max(off_px);
        }
        match last {
            Some((last, _)) if off_px <= 2.0 * self.error.allowed_px => {
                let last = self.kept.revive(last);
                last.map_or((0, NOT_YET), |last| self.place_of(last))
            }
            _ => (0, NOT_YET),
        }
    }

    fn place_of(&self, kept: KeptRef) -> (u32, f32) {
        let kept = self.kept.kept(kept);
        kept.map_or((0, NOT_YET), |k| (k.start, k.value.points as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    fn points_of(cells: &mut OutlineCells, eye: [f64; EYE], before: &mut [u64]) -> f32 {
        let mut record = [0.0; RECORD];
        cells.find(&eye, before, &mut record);
        record[5]
    }

    #[test]
    fn an_outline_serves_the_eyes_of_its_cell_and_for_a_while_those_beside_it() {
        let mut cells = OutlineCells::new(&SPHERE, 0.5, 1 << 16);
        let before = &mut [0];
        let eye = |angle: f64| [4.0 * angle.sin(), 0.3, 4.0 * angle.cos(), 1.0, 100.0];
        assert_eq!(points_of(&mut cells, eye(0.2), before), NOT_YET);
        let wanted = cells.take_wanted(9);
        assert_eq!((wanted.len(), cells.pending()), (REQUEST + 1, 1));
        // It is asked for once.
        assert_eq!(points_of(&mut cells, eye(0.2), before), NOT_YET);
        assert!(cells.take_wanted(9).is_empty());
        assert!(cells.keep(wanted[REQUEST] as u32, 80, 33) >= 0);
        assert_eq!(points_of(&mut cells, eye(0.2), before), 33.0);
        // A cell beside it uses it until its own is there; a far one does not.
        let aside = (0..100).map(|k| 0.2 + 0.001 * f64::from(k));
        let found: Vec<f32> = aside
            .map(|angle| points_of(&mut cells, eye(angle), &mut before.clone()))
            .collect();
        assert!(found[0] == 33.0 && found[99] == NOT_YET, "{found:?}");
        assert!(!cells.take_wanted(9).is_empty());
        assert_eq!(points_of(&mut cells, eye(2.0), before), NOT_YET);
    }

    #[test]
    fn within_the_sphere_and_without_an_outline_all_is_shown() {
        let mut cells = OutlineCells::new(&SPHERE, 0.5, 1 << 16);
        let inside = [0.1, 0.2, 0.0, 1.0, 100.0];
        assert_eq!(points_of(&mut cells, inside, &mut [0]), WHOLE);
        let far = [0.0, 0.0, 1.0, 0.0, 100.0];
        assert_eq!(points_of(&mut cells, far, &mut [0]), NOT_YET);
        let name = cells.take_wanted(1)[REQUEST] as u32;
        assert!(cells.keep(name, 0, 0) >= 0);
        assert_eq!(points_of(&mut cells, far, &mut [0]), WHOLE);
        assert_eq!(cells.keep(name, 0, 0), -1, "nobody asked again");
    }

    #[test]
    fn what_cannot_be_is_no_fault() {
        let mut cells = OutlineCells::new(&[], 0.5, 0);
        assert_eq!(cells.find(&[f64::NAN; 7], &mut [9, 9], &mut [0.0; 3]), 0);
        let broken = [f64::NAN, 0.0, 0.0, 1.0, f64::INFINITY];
        assert_eq!(points_of(&mut cells, broken, &mut [u64::MAX]), WHOLE);
        let eye = [0.0, 0.0, 9.0, 1.0, 50.0];
        assert_eq!(points_of(&mut cells, eye, &mut [u64::MAX]), NOT_YET);
        let name = cells.take_wanted(1)[REQUEST] as u32;
        assert_eq!(cells.keep(name, 100, 5), -1, "there is no room");
    }
}
