//! The rule of the 1999 paper: cliques of intervals, their ends interpolated linearly (section 5.3).

pub(crate) mod cliques;
pub(crate) mod spans;
