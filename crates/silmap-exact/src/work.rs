//! How much an extraction looked at.

/// What one extraction had to look at; independent of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Edges whose faces were tested, or that were toggled.
    pub tested_edges: usize,
    /// Nodes of a search structure that were tested.
    pub visited_nodes: usize,
}

impl Work {
    pub(crate) fn of_edges(tested_edges: usize) -> Self {
        Self {
            tested_edges,
            visited_nodes: 0,
        }
    }
}
