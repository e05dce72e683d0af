//! A queue out of which what costs least comes first.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A queue of items with costs. The one of least cost comes first; of equal costs, the least item, so that the order depends on
/// nothing but what is in the queue. Costs are compared by [`f64::total_cmp`]: minus zero is less than zero, NaN more than all.
///
/// ```
/// use silmap_geometry::CostQueue;
///
/// let mut queue: CostQueue<&str> = [(2.0, "late"), (1.0, "soon")].into_iter().collect();
/// queue.push(1.0, "at once");
/// assert_eq!(queue.pop(), Some((1.0, "at once")));
/// assert_eq!(queue.pop(), Some((1.0, "soon")));
/// ```
#[derive(Clone, Debug)]
pub struct CostQueue<T> {
    heap: BinaryHeap<Reverse<Entry<T>>>,
}

#[derive(Clone, Copy, Debug)]
struct Entry<T> {
    cost: f64,
    item: T,
}

impl<T: Ord> Ord for Entry<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cost
            .total_cmp(&other.cost)
            .then_with(|| self.item.cmp(&other.item))
    }
}

impl<T: Ord> PartialOrd for Entry<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T: Ord> PartialEq for Entry<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T: Ord> Eq for Entry<T> {}

impl<T: Ord> CostQueue<T> {
    /// An empty queue with capacity for so many items.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            heap: BinaryHeap::with_capacity(capacity),
        }
    }

    /// Puts an item into the queue.
    pub fn push(&mut self, cost: f64, item: T) {
        self.heap.push(Reverse(Entry { cost, item }));
    }

    /// Takes the item of least cost out.
    pub fn pop(&mut self) -> Option<(f64, T)> {
        self.heap
            .pop()
            .map(|Reverse(Entry { cost, item })| (cost, item))
    }

    /// The item of least cost, which stays.
    #[must_use]
    pub fn peek(&self) -> Option<(f64, &T)> {
        let Reverse(entry) = self.heap.peek()?;
        Some((entry.cost, &entry.item))
    }

    /// Throws everything away.
    pub fn clear(&mut self) {
        self.heap.clear();
    }
}

impl<T: Ord> Default for CostQueue<T> {
    fn default() -> Self {
        Self::with_capacity(0)
    }
}

impl<T: Ord> Extend<(f64, T)> for CostQueue<T> {
    fn extend<I: IntoIterator<Item = (f64, T)>>(&mut self, items: I) {
        let entry = |(cost, item)| Reverse(Entry { cost, item });
        self.heap.extend(items.into_iter().map(entry));
    }
}

/// Takes time in proportion to the items, where pushing one after the other may take a factor of their logarithm.
impl<T: Ord> FromIterator<(f64, T)> for CostQueue<T> {
    fn from_iter<I: IntoIterator<Item = (f64, T)>>(items: I) -> Self {
        let entry = |(cost, item)| Reverse(Entry { cost, item });
        Self {
            heap: items.into_iter().map(entry).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn what_comes_out_is_sorted(
            items in proptest::collection::vec((proptest::num::f64::ANY, 0_u8..4), 0..60),
            at_once in 0_usize..60,
        ) {
            let at_once = at_once.min(items.len());
            let mut queue: CostQueue<u8> = items[..at_once].iter().copied().collect();
            for &(cost, item) in &items[at_once..] {
                queue.push(cost, item);
            }
            let out: Vec<(f64, u8)> = std::iter::from_fn(|| queue.pop()).collect();
            let mut sorted = items;
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let bits = |all: &[(f64, u8)]| all.iter().map(|e| (e.0.to_bits(), e.1)).collect::<Vec<_>>();
            proptest::prop_assert_eq!(bits(&out), bits(&sorted));
        }
    }
}
