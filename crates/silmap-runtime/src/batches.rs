//! Which instances can be drawn together with one stencil: those whose rectangles on the screen do not overlap.
//!
//! The screen is divided into tiles. An instance belongs to the batch after the last one that touched any of its tiles; in whatever
//! order instances come, batches are in that order too.

use glam::DVec2;

use crate::view::Rect;

/// Pixels of a tile's side, more where there would be too many tiles.
const TILE_PX: f64 = 16.0;
const MOST_TILES: f64 = 256.0;

/// Tiles of a picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batches {
    columns: usize,
    rows: usize,
    /// The batch that the next instance on a tile can be in.
    next: Vec<u32>,
}

impl Batches {
    /// Begins a picture.
    pub(crate) fn begin(&mut self, size_px: DVec2) {
        let count = |px: f64| (px / TILE_PX).ceil().clamp(1.0, MOST_TILES) as usize;
        (self.columns, self.rows) = (count(size_px.x), count(size_px.y));
        self.next.clear();
        self.next.resize(self.columns * self.rows, 0);
    }

    /// The batch of the next instance.
    pub(crate) fn add(&mut self, rect: &Rect) -> u32 {
        let range = |least: f64, most: f64, count: usize| {
            let place = |x: f64| {
                let at = ((x * 0.5 + 0.5) * count as f64).floor();
                at.clamp(0.0, (count - 1) as f64) as usize
            };
            place(least)..place(most) + 1
        };
        let across = range(rect.least.x, rect.most.x, self.columns);
        let along = range(rect.least.y, rect.most.y, self.rows);
        let tiles = |row: usize| row * self.columns + across.start..row * self.columns + across.end;
        let batch = along
            .clone()
            .flat_map(|row| &self.next[tiles(row)])
            .fold(0, |batch, &next| batch.max(next));
        for row in along {
            let tiles = row * self.columns + across.start..row * self.columns + across.end;
            self.next[tiles].fill(batch + 1);
        }
        batch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rect() -> impl Strategy<Value = Rect> {
        let place = (-1.3..1.3_f64, -1.3..1.3_f64, 0.0..0.8_f64, 0.0..0.8_f64);
        place.prop_map(|(x, y, width, height)| Rect {
            least: DVec2::new(x, y),
            most: DVec2::new(x + width, y + height),
        })
    }

    proptest! {
        /// Of two instances that overlap in the picture the later is in a later batch.
        #[test]
        fn what_overlaps_is_drawn_later(rects in prop::collection::vec(rect(), 1..40), px in 1.0..9000.0_f64) {
            let mut batches = Batches::default();
            batches.begin(DVec2::new(px, 0.4 * px));
            let order: Vec<u32> = rects.iter().map(|r| batches.add(r)).collect();
            for (k, one) in rects.iter().enumerate() {
                for (l, two) in rects.iter().enumerate().skip(k + 1) {
                    let least = one.least.max(two.least).max(DVec2::NEG_ONE);
                    let most = one.most.min(two.most).min(DVec2::ONE);
                    if least.cmple(most).all() {
                        prop_assert!(order[k] < order[l]);
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_apart_is_drawn_together() {
        let mut batches = Batches::default();
        batches.begin(DVec2::new(160.0, 160.0));
        let at = |x: f64| Rect {
            least: DVec2::new(x, -0.05),
            most: DVec2::new(x + 0.1, 0.05),
        };
        let order = [-0.9, 0.0, 0.6, 0.05].map(|x| batches.add(&at(x)));
        assert_eq!(order, [0, 0, 0, 1]);
        let all = Rect {
            least: DVec2::NEG_INFINITY,
            most: DVec2::INFINITY,
        };
        assert_eq!(batches.add(&all), 2);
    }
}
