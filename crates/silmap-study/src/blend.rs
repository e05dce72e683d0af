//! Blend weights of texture views on each face of the hull.
//!
//! The paper takes the nearest view that sees the face; when another becomes the nearest, the face pops. Here up to three views
//! share a face. Their distance a_i is that between the directions from the face to the view and to the eye, and their weights are
//! 1/a_i − 1/t, where t is the distance of the fourth: a view's weight is zero when it drops out for another, and a view that the
//! eye coincides with takes all.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2, for the visibility bits and the nearest view; Buehler, Bosse,
//! McMillan, Gortler, Cohen. Unstructured Lumigraph Rendering. SIGGRAPH 2001, section 4, for weights that fall to zero.
//! Deviations: distances are chords between directions at each face's middle, not distances of camera centers, so that going
//! nearer or farther changes nothing; faces that no view sees take the atlas, which the first paper does not have, or are lit.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::Paint;

/// Views that share a face.
const SHARERS: usize = 3;

/// What a face shows where no texture view does; `HULL_…` of `shaders/shared/hull.wgsl`.
const ATLAS: u8 = 64;
const LIT: u8 = 65;

/// The largest distance between directions; what fewer than four views are weighed against.
const FARTHEST: f64 = 2.0;

/// A view nearer than this is where the eye is.
const NEAREST: f64 = 1e-9;

/// What a face shows: the same at its three corners, as `shared/hull.wgsl` reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct FacePaint {
    /// Three texture views, and what stands in where they do not reach.
    sources: [u8; 4],
    /// Their weights, in 65,535ths; with sum one.
    weights: [u16; 4],
}

impl FacePaint {
    fn only(stand_in: u8) -> Self {
        Self {
            sources: [0, 0, 0, stand_in],
            weights: [0, 0, 0, u16::MAX],
        }
    }

    /// The views with these weights, at least one of which is not zero.
    fn shared(views: [u8; SHARERS], weights: [f64; SHARERS]) -> Self {
        let sum: f64 = weights.iter().sum();
        let mut paint = Self {
            sources: [views[0], views[1], views[2], ATLAS],
            weights: [0; 4],
        };
        // The first gets what the others leave, so that the sum is exact.
        let mut rest = u16::MAX;
        for (share, weight) in paint.weights.iter_mut().zip(weights).skip(1) {
            *share = (weight / sum * f64::from(u16::MAX)).round() as u16;
            rest -= *share;
        }
        paint.weights[0] = rest;
        paint
    }
}

/// A texture view that sees a face.
#[derive(Clone, Copy, Debug)]
struct Witness {
    view: u8,
    /// Unit direction from the face's middle.
    direction: DVec3,
    /// Distance of the view's eye from the face's middle.
    distance: f64,
}

/// What the choice needs, face by face.
#[derive(Debug, Default)]
pub(crate) struct ViewBlender {
    middles: Vec<DVec3>,
    /// Per face the end of its witnesses.
    ends: Vec<usize>,
    witnesses: Vec<Witness>,
    has_atlas: bool,
}

impl ViewBlender {
    /// `middles` are the faces' middles on the original's surface, `eyes` the texture views' eyes, bit i of `visible_views` says
    /// whether view i sees the face; a face without bits is seen by none.
    pub(crate) fn new(
        middles: Vec<DVec3>,
        eyes: &[DVec3],
        visible_views: &[u64],
        has_atlas: bool,
    ) -> Self {
        let mut witnesses = Vec::new();
        let mut ends = Vec::with_capacity(middles.len());
        for (f, &middle) in middles.iter().enumerate() {
            let bits = visible_views.get(f).copied().unwrap_or(0);
            let seen = (0..).zip(eyes).filter(|(view, _)| bits >> view & 1 == 1);
            witnesses.extend(seen.map(|(view, &eye)| Witness {
                view,
                direction: (eye - middle).normalize_or_zero(),
                distance: eye.distance(middle),
            }));
            ends.push(witnesses.len());
        }
        Self {
            middles,
            ends,
            witnesses,
            has_atlas,
        }
    }

    /// What each face shows to an eye; without `paint` it is lit.
    pub(crate) fn choose(&self, eye: DVec3, paint: Option<Paint>, mut each: impl FnMut(FacePaint)) {
        let stand_in = match paint {
            Some(Paint::Blended | Paint::Nearest | Paint::Tiles) if self.has_atlas => ATLAS,
            _ => LIT,
        };
        let mut start = 0;
        for (&middle, &end) in self.middles.iter().zip(&self.ends) {
            let witnesses = &self.witnesses[start..end];
            start = end;
            let shown = match paint {
                Some(Paint::Blended | Paint::Views) => blended(witnesses, eye - middle),
                Some(Paint::Nearest) => nearest(witnesses, eye - middle),
                Some(Paint::Tiles) | None => None,
            };
            each(shown.unwrap_or(FacePaint::only(stand_in)));
        }
    }
}

/// The paper's choice: the view whose eye is nearest, of equals the first.
fn nearest(witnesses: &[Witness], to_eye: DVec3) -> Option<FacePaint> {
    let distance = |w: &Witness| (w.direction * w.distance).distance_squared(to_eye);
    let least = |a, b| if distance(b) < distance(a) { b } else { a };
    let witness = witnesses.iter().reduce(least)?;
    Some(FacePaint::shared([witness.view, 0, 0], [1.0, 0.0, 0.0]))
}

fn blended(witnesses: &[Witness], to_eye: DVec3) -> Option<FacePaint> {
    let direction = to_eye.normalize_or_zero();
    // The nearest views, nearest first; what lies behind them only sets their weights.
    let mut order = [(FARTHEST, 0_u8); SHARERS + 1];
    for witness in witnesses {
        let mut new = (
            witness.direction.distance(direction).min(FARTHEST),
            witness.view,
        );
        for slot in &mut order {
            if new.0 < slot.0 {
                std::mem::swap(slot, &mut new);
            }
        }
    }
    let limit = order[SHARERS].0;
    let weights: [f64; SHARERS] =
        std::array::from_fn(|k| order[k].0.max(NEAREST).recip() - limit.max(NEAREST).recip());
    let views = std::array::from_fn(|k| order[k].1);
    match weights[0] > 0.0 {
        true => Some(FacePaint::shared(views, weights)),
        // As far as the fourth, all of them: any is as good.
        false => witnesses
            .first()
            .map(|w| FacePaint::shared([w.view, 0, 0], [1.0, 0.0, 0.0])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(blender: &ViewBlender, eye: DVec3, paint: Option<Paint>) -> Vec<FacePaint> {
        let mut all = Vec::new();
        blender.choose(eye, paint, |paint| all.push(paint));
        all
    }

    /// Weight of each of 64 views in what a face shows.
    fn weights(paint: FacePaint) -> Vec<f64> {
        let mut of_view = vec![0.0; 66];
        for (source, weight) in paint.sources.into_iter().zip(paint.weights) {
            of_view[usize::from(source)] += f64::from(weight) / f64::from(u16::MAX);
        }
        of_view
    }

    /// Eyes on a sphere of radius three, all of which see the one face at the origin.
    fn many_views(count: u32) -> ViewBlender {
        let eyes: Vec<DVec3> = (0..count)
            .map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
                let (sin, cos) = (2.4 * f64::from(k)).sin_cos();
                3.0 * ((1.0 - z * z).sqrt() * DVec3::new(cos, sin, 0.0) + z * DVec3::Z)
            })
            .collect();
        ViewBlender::new(vec![DVec3::ZERO], &eyes, &[(1 << count) - 1], true)
    }

    #[test]
    fn the_paper_shows_the_nearest_view_that_sees_a_face() {
        let eyes = [DVec3::X, DVec3::Y, DVec3::Z];
        let bits = [0b111, 0b110, 0b100, 0];
        let mut blender = ViewBlender::new(vec![DVec3::ZERO; 4], &eyes, &bits, true);
        let eye = DVec3::new(3.0, 2.0, 1.0);
        let first = |paint: FacePaint| {
            let of_view = weights(paint);
            of_view.iter().position(|&w| w == 1.0)
        };
        let shown: Vec<_> = chosen(&blender, eye, Some(Paint::Nearest));
        let shown: Vec<_> = shown.into_iter().map(first).collect();
        assert_eq!(shown, [Some(0), Some(1), Some(2), Some(64)]);
        for paint in chosen(&blender, eye, Some(Paint::Tiles)) {
            assert_eq!(first(paint), Some(64));
        }
        assert_eq!(
            first(chosen(&blender, eye, Some(Paint::Views))[3]),
            Some(65)
        );
        blender.has_atlas = false;
        for paint in [Some(Paint::Tiles), None] {
            assert_eq!(chosen(&blender, eye, paint), [FacePaint::only(LIT); 4]);
        }
    }

    #[test]
    fn at_a_views_own_place_it_is_shown_alone() {
        let blender = many_views(20);
        for k in 0..20 {
            let eye = blender.witnesses[k].direction;
            for distance in [1.5, 3.0, 10.0] {
                let shown = chosen(&blender, eye * distance, Some(Paint::Blended));
                assert!(weights(shown[0])[k] > 0.9999, "{shown:?}");
            }
        }
    }

    #[test]
    fn weights_sum_to_one_and_do_not_jump() {
        let blender = many_views(20);
        let at = |turn: f64, paint| {
            let eye = DVec3::new(turn.cos(), 0.9 * (2.3 * turn).sin(), turn.sin()) * 3.0;
            weights(chosen(&blender, eye, Some(paint))[0])
        };
        // The largest change of a weight in a step along a walk around the face.
        let largest_change = |paint, steps: u32| {
            let mut largest = 0.0_f64;
            let mut before = at(0.0, paint);
            for k in 1..=steps {
                let after = at(6.0 * f64::from(k) / f64::from(steps), paint);
                assert!((after.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
                largest = largest.max(change.fold(0.0, f64::max));
                before = after;
            }
            largest
        };
        // In a tenth of a step nothing changes by much more than a tenth.
        let (large, small) = (
            largest_change(Paint::Blended, 30_000),
            largest_change(Paint::Blended, 300_000),
        );
        assert!(small < 0.2 * large, "{small} after {large}");
        // The nearest view alone jumps, however small the step.
        assert_eq!(largest_change(Paint::Nearest, 300_000), 1.0);
    }

    #[test]
    fn views_as_far_as_each_other_share_and_many_of_them_do_no_harm() {
        let around: Vec<DVec3> = (0..6)
            .map(|k| {
                let (sin, cos) = f64::from(k).sin_cos();
                DVec3::new(cos, sin, 1.0)
            })
            .collect();
        for count in 1..=6_usize {
            let bits = [(1_u64 << count) - 1];
            let blender = ViewBlender::new(vec![DVec3::ZERO], &around, &bits, false);
            let of_view = weights(chosen(&blender, DVec3::Z, Some(Paint::Blended))[0]);
            assert!((of_view.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert!(of_view[..count].iter().sum::<f64>() > 0.999, "{of_view:?}");
            if count <= 3 {
                assert!((of_view[0] - 1.0 / count as f64).abs() < 1e-3);
            }
        }
    }
}
