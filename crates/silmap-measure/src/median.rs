//! The middle one of some times.

/// Of an even number the later of the two in the middle; zero of none. Sorts them.
pub(crate) fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}
