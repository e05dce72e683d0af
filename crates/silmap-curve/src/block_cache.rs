//! What outlives a frame, in blocks of a memory of a fixed size: what was used longest ago makes room for what is new.

use std::collections::HashMap;
use std::hash::Hash;

use crate::blocks::{Blocks, order_for};

const NONE: u32 = u32::MAX;

/// Names what is kept, as long as it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptRef {
    slot: u32,
    generation: u32,
}

impl KeptRef {
    /// The name as a number, which is not zero.
    #[must_use]
    pub fn to_bits(self) -> u64 {
        u64::from(self.generation) << 32 | (u64::from(self.slot) + 1)
    }

    /// The name that a number was made from; `None` for zero. Of any other number something that is kept or is not.
    #[must_use]
    pub fn from_bits(bits: u64) -> Option<Self> {
        let slot = (bits & u64::from(u32::MAX)).checked_sub(1)?;
        Some(Self {
            slot: slot as u32,
            generation: (bits >> 32) as u32,
        })
    }
}

/// Where something lies and what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Kept<K, V> {
    key: K,
    /// What is known of it.
    pub value: V,
    /// Where it begins.
    pub start: u32,
    order: u8,
    generation: u32,
    /// The frame in which it was used last.
    used: u64,
    newer: u32,
    older: u32,
}

/// All that is kept. Places and lengths are in elements of the memory.
#[derive(Debug)]
pub struct BlockCache<K, V> {
    slots: Vec<Kept<K, V>>,
    unused: Vec<u32>,
    by_key: HashMap<K, u32>,
    blocks: Blocks,
    newest: u32,
    oldest: u32,
    frame: u64,
}

impl<K: Copy + Eq + Hash, V: Copy> BlockCache<K, V> {
    /// With room for so many elements.
    #[must_use]
    pub fn new(room: u32) -> Self {
        let most = (room / crate::blocks::SMALLEST) as usize;
        Self {
            slots: Vec::with_capacity(most),
            unused: Vec::with_capacity(most),
            by_key: HashMap::with_capacity(most),
            blocks: Blocks::new(room),
            newest: NONE,
            oldest: NONE,
            frame: 0,
        }
    }

    /// What is asked for from here on stays for this frame.
    pub fn begin_frame(&mut self) {
        self.frame += 1;
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.by_key.len()
    }

    /// Whether there is nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.by_key.is_empty()
    }

    /// What has a key; it stays for this frame.
    pub fn find(&mut self, key: &K) -> Option<KeptRef> {
        let slot = *self.by_key.get(key)?;
        Some(self.touch(slot))
    }

    /// What has a key.
    #[must_use]
    pub fn peek(&self, key: &K) -> Option<&Kept<K, V>> {
        let slot = *self.by_key.get(key)?;
        self.slots.get(slot as usize)
    }

    /// What another frame used, if it is kept still; it stays for this frame.
    pub fn revive(&mut self, kept: KeptRef) -> Option<KeptRef> {
        let is_kept = self.kept(kept).is_some();
        is_kept.then(|| self.touch(kept.slot))
    }

    /// What is kept by this name.
    #[must_use]
    pub fn kept(&self, name: KeptRef) -> Option<&Kept<K, V>> {
        let kept = self.slots.get(name.slot as usize)?;
        (kept.generation == name.generation).then_some(kept)
    }

    /// Makes room for so many elements; `None` where all that is kept is used in this frame.
    pub fn insert(&mut self, key: K, length: u32, value: V) -> Option<KeptRef> {
        let order = order_for(length);
        let start = loop {
            if let Some(start) = self.blocks.take(order) {
                break start;
            }
            self.drop_oldest()?;
        };
        let kept = Kept {
            key,
            value,
            start,
            order,
            generation: 0,
            used: 0,
            newer: NONE,
            older: NONE,
        };
        let slot = match self.unused.pop() {
            Some(slot) => {
                let generation = self.slots[slot as usize].generation;
                self.slots[slot as usize] = Kept { generation, ..kept };
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

    fn touch(&mut self, slot: u32) -> KeptRef {
        self.unlink(slot);
        self.link(slot);
        let kept = &mut self.slots[slot as usize];
        kept.used = self.frame;
        KeptRef {
            slot,
            generation: kept.generation,
        }
    }

    /// Makes what was used longest ago go; `None` where that is in this frame.
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
        let Kept { newer, older, .. } = self.slots[slot as usize];
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

    #[test]
    fn what_was_used_longest_ago_goes_first() {
        let mut cache = BlockCache::new(4 * SMALLEST);
        cache.begin_frame();
        let first = (0..4).map(|k| cache.insert(k, SMALLEST, ()).unwrap());
        let first: Vec<KeptRef> = first.collect();
        assert!(cache.insert(9, 1, ()).is_none(), "all are in use");
        cache.begin_frame();
        assert_eq!(cache.find(&0), Some(first[0]));
        let new = cache.insert(9, 1, ()).unwrap();
        assert_eq!(cache.find(&1), None);
        assert!(cache.kept(first[1]).is_none() && cache.revive(first[1]).is_none());
        assert_eq!(cache.find(&9), Some(new));
        assert_eq!(cache.revive(first[2]), Some(first[2]));
        // Two neighbours are needed, and one of them is in use: more goes until there is room, or nothing is left to go.
        assert!(cache.insert(10, 2 * SMALLEST, ()).is_none());
        assert_eq!(cache.len(), 3);
        cache.begin_frame();
        assert!(cache.insert(10, 4 * SMALLEST, ()).is_some());
        assert_eq!(cache.len(), 1);
    }
}
