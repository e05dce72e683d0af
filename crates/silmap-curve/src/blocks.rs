//! Room for outlines in a texture: blocks whose sizes are powers of two, split and joined again (Knowlton's buddy system).
//!
//! Source: Knuth. The Art of Computer Programming, volume 1, section 2.5, algorithms R and S.

/// Texels of the smallest block.
pub(crate) const SMALLEST: u32 = 64;

const NONE: u32 = u32::MAX;

/// Free blocks. Places and sizes are in units of [`SMALLEST`] inside, in texels outside.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// First free block of each order.
    heads: Vec<u32>,
    /// Of each place where a free block begins: its order, and its neighbours in the list of that order.
    orders: Vec<u8>,
    next: Vec<u32>,
    previous: Vec<u32>,
}

const NOT_FREE: u8 = u8::MAX;

/// The order of the block that holds so many texels.
pub(crate) fn order_for(texels: u32) -> u8 {
    texels
        .div_ceil(SMALLEST)
        .next_power_of_two()
        .trailing_zeros() as u8
}

impl Blocks {
    /// Room for so many texels, all free.
    pub(crate) fn new(texels: u32) -> Self {
        let count = texels / SMALLEST;
        let orders = count.max(1).ilog2() as usize + 1;
        let mut blocks = Self {
            heads: vec![NONE; orders],
            orders: vec![NOT_FREE; count as usize],
            next: vec![NONE; count as usize],
            previous: vec![NONE; count as usize],
        };
        let mut at = 0;
        while at < count {
            let fits = (count - at).ilog2();
            let order = fits.min(at.trailing_zeros());
            blocks.push(at, order as u8);
            at += 1 << order;
        }
        blocks
    }

    /// First texel of a block of an order, which is no longer free; `None` where none is left.
    pub(crate) fn take(&mut self, order: u8) -> Option<u32> {
        let found =
            (order..self.heads.len() as u8).find(|&o| self.heads[usize::from(o)] != NONE)?;
        let at = self.heads[usize::from(found)];
        self.remove(at);
        for smaller in (order..found).rev() {
            self.push(at + (1 << smaller), smaller);
        }
        Some(at * SMALLEST)
    }

    /// Frees a block that was taken.
    pub(crate) fn give_back(&mut self, texel: u32, mut order: u8) {
        let mut at = texel / SMALLEST;
        while usize::from(order) + 1 < self.heads.len() {
            let buddy = at ^ (1 << order);
            if self.orders.get(buddy as usize) != Some(&order) {
                break;
            }
            self.remove(buddy);
            at = at.min(buddy);
            order += 1;
        }
        self.push(at, order);
    }

    fn push(&mut self, at: u32, order: u8) {
        let head = std::mem::replace(&mut self.heads[usize::from(order)], at);
        self.orders[at as usize] = order;
        self.next[at as usize] = head;
        self.previous[at as usize] = NONE;
        if head != NONE {
            self.previous[head as usize] = at;
        }
    }

    fn remove(&mut self, at: u32) {
        let order = std::mem::replace(&mut self.orders[at as usize], NOT_FREE);
        let (before, after) = (self.previous[at as usize], self.next[at as usize]);
        match before {
            NONE => self.heads[usize::from(order)] = after,
            _ => self.next[before as usize] = after,
        }
        if after != NONE {
            self.previous[after as usize] = before;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Blocks never overlap, and when all are given back there is room for the largest again.
        #[test]
        fn blocks_do_not_overlap_and_join_again(
            count in 1..90_u32, steps in prop::collection::vec((0..5_u8, 0..8_usize), 1..120),
        ) {
            let mut blocks = Blocks::new(count * SMALLEST);
            let mut taken: Vec<(u32, u8)> = Vec::new();
            for (order, which) in steps {
                if which < taken.len() {
                    let (at, order) = taken.swap_remove(which);
                    blocks.give_back(at, order);
                } else if let Some(at) = blocks.take(order) {
                    let end = |at: u32, order: u8| at + (SMALLEST << order);
                    prop_assert!(end(at, order) <= count * SMALLEST);
                    prop_assert_eq!(at % (SMALLEST << order), 0);
                    for &(other, of) in &taken {
                        prop_assert!(end(at, order) <= other || end(other, of) <= at);
                    }
                    taken.push((at, order));
                }
            }
            for (at, order) in taken {
                blocks.give_back(at, order);
            }
            prop_assert!(blocks.take(count.ilog2() as u8).is_some());
        }
    }

    #[test]
    fn a_block_is_as_large_as_it_must_be() {
        assert_eq!([1, 64, 65, 128, 129].map(order_for), [0, 0, 1, 1, 2]);
    }
}
