//! Outlines that outlive a frame, in a texture of a fixed size: what was used longest ago makes room for what is new.

use std::collections::HashMap;

use crate::blocks::{Blocks, order_for};
use crate::cells::{Bearing, CellKey};

const NONE: u32 = u32::MAX;

/// A kept outline, as long as it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OutlineRef {
    slot: u32,
    generation: u32,
}

/// Where an outline lies and what it is of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptOutline {
    key: CellKey,
    /// First texel.
    pub(crate) start: u32,
    /// Its points.
    pub(crate) points: u32,
    /// The eye it was made for.
    pub(crate) middle: Bearing,
    order: u8,
    generation: u32,
    /// The frame in which it was used last.
    used: u64,
    newer: u32,
    older: u32,
}

/// All outlines that are kept.
#[derive(Debug)]
pub(crate) struct OutlineCache {
    slots: Vec<KeptOutline>,
    unused: Vec<u32>,
    by_key: HashMap<CellKey, u32>,
    blocks: Blocks,
    newest: u32,
    oldest: u32,
    frame: u64,
}

impl OutlineCache {
    /// With room for so many texels.
    pub(crate) fn new(texels: u32) -> Self {
        let most = (texels / crate::blocks::SMALLEST) as usize;
        Self {
            slots: Vec::with_capacity(most),
            unused: Vec::with_capacity(most),
            by_key: HashMap::with_capacity(most),
            blocks: Blocks::new(texels),
            newest: NONE,
            oldest: NONE,
            frame: 0,
        }
    }

    /// What is asked for from here on stays for this frame.
    pub(crate) fn begin_frame(&mut self) {
        self.frame += 1;
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.by_key.len()
    }

    /// The outline of a cell.
    pub(crate) fn find(&mut self, key: &CellKey) -> Option<OutlineRef> {
        let slot = *self.by_key.get(key)?;
        Some(self.touch(slot))
    }

    /// An outline of another frame, if it is kept still; it stays for this frame.
    pub(crate) fn revive(&mut self, outline: OutlineRef) -> Option<OutlineRef> {
        let is_kept = self.kept(outline).is_some();
        is_kept.then(|| self.touch(outline.slot))
    }

    /// What is kept by this name.
    pub(crate) fn kept(&self, outline: OutlineRef) -> Option<&KeptOutline> {
        let kept = &self.slots[outline.slot as usize];
        (kept.generation == outline.generation).then_some(kept)
    }

    /// Makes room for an outline of so many texels; `None` where all that is kept is used in this frame.
    pub(crate) fn insert(
        &mut self,
        key: CellKey,
        middle: Bearing,
        texels: u32,
        points: u32,
    ) -> Option<OutlineRef> {
        let order = order_for(texels);
        let start = loop {
            if let Some(start) = self.blocks.take(order) {
                break start;
            }
            self.drop_oldest()?;
        };
        let kept = KeptOutline {
            key,
            start,
            points,
            middle,
            order,
            generation: 0,
            used: 0,
            newer: NONE,
            older: NONE,
        };
        let slot = match self.unused.pop() {
            Some(slot) => {
                let generation = self.slots[slot as usize].generation;
                self.slots[slot as usize] = KeptOutline { generation, ..kept };
                slot
            }
            None => {
                self.slots.push(kept);
                self.slots.len() as u32 - 1
            }
        };
        self.by_key.insert(key, slot);
        self.link(slot);
        Some(self.touch(slot))
    }

    fn touch(&mut self, slot: u32) -> OutlineRef {
        self.unlink(slot);
        self.link(slot);
        let kept = &mut self.slots[slot as usize];
        kept.used = self.frame;
        OutlineRef {
            slot,
            generation: kept.generation,
        }
    }

    /// Makes the outline that was used longest ago go; `None` where that is in this frame.
    fn drop_oldest(&mut self) -> Option<()> {
        let slot = self.oldest;
        let kept = self.slots.get(slot as usize)?;
        if kept.used == self.frame {
            return None;
        }
        let (key, start, order) = (kept.key, kept.start, kept.order);
        self.unlink(slot);
        self.by_key.remove(&key);
        self.blocks.give_back(start, order);
        let kept = &mut self.slots[slot as usize];
        kept.generation = kept.generation.wrapping_add(1);
        self.unused.push(slot);
        Some(())
    }

    /// Puts a slot before all others.
    fn link(&mut self, slot: u32) {
        let second = std::mem::replace(&mut self.newest, slot);
        let kept = &mut self.slots[slot as usize];
        (kept.newer, kept.older) = (NONE, second);
        match second {
            NONE => self.oldest = slot,
            _ => self.slots[second as usize].newer = slot,
        }
    }

    fn unlink(&mut self, slot: u32) {
        let KeptOutline { newer, older, .. } = self.slots[slot as usize];
        match newer {
            NONE => self.newest = older,
            _ => self.slots[newer as usize].older = older,
        }
        match older {
            NONE => self.oldest = newer,
            _ => self.slots[older as usize].newer = newer,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::SMALLEST;
    use glam::DVec3;

    const MIDDLE: Bearing = Bearing {
        direction: DVec3::Z,
        rim_angle: 0.1,
    };

    fn key(k: u64) -> CellKey {
        CellKey {
            asset: 0,
            size: 5,
            place: [k, 0, 0, 0],
        }
    }

    #[test]
    fn what_was_used_longest_ago_goes_first() {
        let mut cache = OutlineCache::new(4 * SMALLEST);
        cache.begin_frame();
        let first = (0..4).map(|k| cache.insert(key(k), MIDDLE, SMALLEST, 9).unwrap());
        let first: Vec<OutlineRef> = first.collect();
        assert!(
            cache.insert(key(9), MIDDLE, 1, 9).is_none(),
            "all are in use"
        );
        cache.begin_frame();
        assert_eq!(cache.find(&key(0)), Some(first[0]));
        let new = cache.insert(key(9), MIDDLE, 1, 9).unwrap();
        assert_eq!(cache.find(&key(1)), None);
        assert!(cache.kept(first[1]).is_none() && cache.revive(first[1]).is_none());
        assert_eq!(cache.find(&key(9)), Some(new));
        assert_eq!(cache.revive(first[2]), Some(first[2]));
        // Two neighbours are needed, and one of them is in use: more goes until there is room, or nothing is left to go.
        assert!(cache.insert(key(10), MIDDLE, 2 * SMALLEST, 9).is_none());
        assert_eq!(cache.len(), 3);
        cache.begin_frame();
        assert!(cache.insert(key(10), MIDDLE, 4 * SMALLEST, 9).is_some());
        assert_eq!(cache.len(), 1);
    }
}
