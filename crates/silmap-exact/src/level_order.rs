//! Trees in level order: siblings are adjacent, and a search runs over lists of ranges.

/// Trees as they are laid out for a search that goes down level by level.
#[derive(Clone, Debug)]
pub(crate) struct LevelOrder {
    /// Of each place the node there, by its number in depth-first order; roots first.
    pub(crate) nodes: Vec<usize>,
    /// Of each place where its first child is.
    pub(crate) first_children: Vec<u32>,
    pub(crate) root_count: usize,
}

/// Lays out trees that are given by how many nodes hang directly below each, in depth-first order. Siblings are sorted by
/// `key` and then by their number.
pub(crate) fn level_order(child_counts: &[u32], key: impl Fn(usize) -> u32) -> LevelOrder {
    // Behind each node its subtree, so that a node's first child follows it, and a sibling is where the last ended.
    let mut ends = vec![0; child_counts.len()];
    let mut roots: Vec<usize> = Vec::new();
    for (k, &child_count) in child_counts.iter().enumerate().rev() {
        let kept = roots.len() - child_count as usize;
        ends[k] = roots.get(kept).map_or(k + 1, |&last| ends[last]);
        roots.truncate(kept);
        roots.push(k);
    }
    let by_key = |nodes: &mut [usize]| nodes.sort_unstable_by_key(|&k| (key(k), k));
    by_key(&mut roots);
    let root_count = roots.len();
    let (mut nodes, mut first_children) = (roots, Vec::with_capacity(child_counts.len()));
    let mut at = 0;
    while let Some(&k) = nodes.get(at) {
        let first_child = nodes.len();
        let mut child = k + 1;
        for _ in 0..child_counts[k] {
            nodes.push(child);
            child = ends[child];
        }
        by_key(&mut nodes[first_child..]);
        first_children.push(first_child as u32);
        at += 1;
    }
    LevelOrder {
        nodes,
        first_children,
        root_count,
    }
}

/// Numbers that [`write_range`] writes at once; lists of them have space for as many more.
pub(crate) const SPARE: usize = 8;

/// Writes `count` numbers from `first` on to the place `at` of a list, and moves the place behind them.
#[inline(always)]
pub(crate) fn write_range(list: &mut [u32], at: &mut usize, first: u32, count: u32) {
    // Without a guess how many there are.
    if let Some(room) = list[*at..].first_chunk_mut::<SPARE>() {
        *room = std::array::from_fn(|k| first.wrapping_add(k as u32));
    }
    if count as usize > SPARE {
        write_long_range(&mut list[*at..], first, count);
    }
    *at += count as usize;
}

#[inline(never)]
fn write_long_range(list: &mut [u32], first: u32, count: u32) {
    for (place, number) in list.iter_mut().zip(first..first + count) {
        *place = number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn siblings_lie_side_by_side() {
        // 0 (1 (2) 3) 4 (5 6 (7)).
        let counts = [2, 1, 0, 0, 2, 0, 1, 0];
        let order = level_order(&counts, |k| u32::from(k != 6));
        assert_eq!(order.root_count, 2);
        assert_eq!(order.nodes, [0, 4, 1, 3, 6, 5, 2, 7]);
        assert_eq!(order.first_children, [2, 4, 6, 7, 7, 8, 8, 8]);
    }

    #[test]
    fn ranges_are_written_one_behind_the_other() {
        let mut list = [0; 24];
        let mut at = 0;
        write_range(&mut list, &mut at, 5, 2);
        write_range(&mut list, &mut at, 40, 0);
        write_range(&mut list, &mut at, 20, 11);
        assert_eq!(
            list[..at],
            [5, 6, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30]
        );
    }
}
