//! Where a model is cut: again and again the piece is halved whose halves are the most convex beside it.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use silmap_geometry::watch::{Interrupted, Watch};
use silmap_geometry::{ClosedMesh, TriangleMesh};
use silmap_map::SilhouetteMap;

use super::HalfSpace;
use super::clip::clip;
use super::concavity::{Hulls, Sample, samples};

/// How a model is cut into parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PartParams {
    /// Parts at most; with 1 the model is interpolated as a whole.
    pub most: u32,
    /// How far parts reach into each other on either side of a cut, in radii of the bounding sphere.
    pub overlap_rel: f64,
}

impl PartParams {
    /// One part.
    pub(crate) fn whole() -> Self {
        Self {
            most: 1,
            ..Self::default()
        }
    }
}

impl Default for PartParams {
    fn default() -> Self {
        Self {
            most: 12,
            overlap_rel: 0.02,
        }
    }
}

/// Points of the surface at which concavity is measured.
const SAMPLES: usize = 3000;

/// Planes of each direction that are tried.
const PLANES: usize = 24;

/// A cut must lower the mean square of all concavities, in radii, by this.
const LEAST_GAIN: f64 = 2e-5;

/// A piece of the model.
struct Piece {
    solid: TriangleMesh,
    samples: Vec<Sample>,
    best: Option<Cut>,
}

/// A way to halve a piece, and by how much that lowers the cost.
#[derive(Clone, Copy, Debug)]
struct Cut {
    at: HalfSpace,
    gain: f64,
}

/// The pieces of a model, in the order of their cuts.
///
/// # Errors
/// When interrupted.
pub(super) fn pieces(
    model: &ClosedMesh,
    params: &PartParams,
    watch: &Watch<'_>,
) -> Result<Vec<TriangleMesh>, Interrupted> {
    let radius = model.bounds().radius;
    let solid = TriangleMesh {
        positions: model.mesh().positions.clone(),
        faces: model.mesh().faces.clone(),
        ..TriangleMesh::default()
    };
    let most = params.most.min(SilhouetteMap::MOST_PARTS.into()) as usize;
    if most <= 1 {
        return Ok(vec![solid]);
    }
    let mut samples = samples(&solid, SAMPLES);
    let hulls = Hulls::new(&mut samples, radius);
    let mut pieces = vec![Piece {
        best: best_cut(&samples, &hulls),
        solid,
        samples,
    }];
    while pieces.len() < most {
        watch.check()?;
        let gain = |k: &usize| pieces[*k].best.map_or(0.0, |cut| cut.gain);
        // Of equal ones the first.
        let widest = (0..pieces.len())
            .rev()
            .max_by(|a, b| gain(a).total_cmp(&gain(b)));
        let Some((k, cut)) = widest.and_then(|k| Some((k, pieces[k].best?))) else {
            break;
        };
        if cut.gain < LEAST_GAIN * SAMPLES as f64 {
            break;
        }
        match halves(&pieces[k], &cut.at, params.overlap_rel * radius, &hulls) {
            Some(halves) => {
                pieces.splice(k..=k, halves);
            }
            None => pieces[k].best = None,
        }
    }
    Ok(pieces.into_iter().map(|piece| piece.solid).collect())
}

/// The two sides of a cut, which reach into each other; `None` where they cannot be closed.
fn halves(piece: &Piece, at: &HalfSpace, overlap: f64, hulls: &Hulls) -> Option<[Piece; 2]> {
    let (kept, rest): (Vec<Sample>, Vec<Sample>) =
        (piece.samples.iter()).partition(|s| at.beyond(s.place) <= 0.0);
    let half = |side: HalfSpace, samples: Vec<Sample>| {
        Some(Piece {
            solid: clip(&piece.solid, &side.widened(overlap))?,
            best: best_cut(&samples, hulls),
            samples,
        })
    };
    Some([half(*at, kept)?, half(at.opposite(), rest)?])
}

/// Directions across which pieces are cut: of the axes, and between them.
fn normals() -> Vec<DVec3> {
    let mut normals = Vec::new();
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                if (x, y, z) > (0, 0, 0) {
                    normals.push(DVec3::from([x, y, z].map(f64::from)).normalize_or_zero());
                }
            }
        }
    }
    normals
}

/// The plane that lowers a piece's cost the most.
fn best_cut(samples: &[Sample], hulls: &Hulls) -> Option<Cut> {
    let mut extents = Vec::new();
    let whole = hulls.cost(samples, &mut extents);
    let candidates: Vec<HalfSpace> = normals()
        .into_iter()
        .flat_map(|normal| {
            let along = samples.iter().map(|s| normal.dot(s.place));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            (1..=PLANES).map(move |k| HalfSpace {
                normal,
                offset: low + (high - low) * k as f64 / (PLANES + 1) as f64,
            })
        })
        .collect();
    let costs: Vec<f64> = candidates
        .par_iter()
        .map_init(
            || (Vec::new(), Vec::new(), Vec::new()),
            |(kept, rest, extents), at| {
                kept.clear();
                rest.clear();
                for &s in samples {
                    if at.beyond(s.place) <= 0.0 {
                        kept.push(s);
                    } else {
                        rest.push(s);
                    }
                }
                if kept.is_empty() || rest.is_empty() {
                    return f64::INFINITY;
                }
                hulls.cost(kept, extents) + hulls.cost(rest, extents)
            },
        )
        .collect();
    let best = (0..candidates.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]))?;
    let gain = whole - costs[best];
    (gain > 0.0).then_some(Cut {
        at: candidates[best],
        gain,
    })
}
