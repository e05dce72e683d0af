//! What becomes of a picture's border where a lens is taken out, or put in: the box around it, and what lies beyond the lens's domain.

use glam::DVec2;

/// Places along the border that are looked at, a pixel count apart.
const BORDER_STEP_PX: f64 = 8.0;

/// Halvings of an interval.
const HALVINGS: u32 = 40;

/// The box, lowest and highest corner, around where the border of a picture of this size is moved to; `None` where nothing of it is moved
/// anywhere.
pub(crate) fn box_of_border(
    size: DVec2,
    moved: impl Fn(DVec2) -> Option<DVec2>,
) -> Option<(DVec2, DVec2)> {
    let corners = [
        DVec2::ZERO,
        DVec2::new(size.x, 0.0),
        size,
        DVec2::new(0.0, size.y),
    ];
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % 4];
        let pieces = (from.distance(to) / BORDER_STEP_PX).ceil().max(1.0);
        for piece in 0..pieces as u32 {
            if let Some(place) = moved(from.lerp(to, f64::from(piece) / pieces)) {
                (low, high) = (low.min(place), high.max(place));
            }
        }
    }
    low.cmple(high).all().then_some((low, high))
}

/// What is found at the largest share of 1 at which there is something; `None` where nothing is at 0.
pub(crate) fn farthest(find: impl Fn(f64) -> Option<DVec2>) -> Option<DVec2> {
    if let Some(found) = find(1.0) {
        return Some(found);
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut best = find(low)?;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match find(middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Some(best)
}
