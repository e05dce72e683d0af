//! Exact silhouettes from the full mesh: the comparison mode
