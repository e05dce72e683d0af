//! How large pictures must be for the detail that the model has.

use rayon::prelude::*;
use silmap_geometry::lighting::srgb_from_linear;
use silmap_geometry::watch::{Interrupted, Watch};

use super::params::MAX_SIDE_PX;
use super::surface::Surface;
use super::{Chosen, TextureParams, take_picture};

/// So many views are looked at.
const VIEWS: usize = 4;

/// Mean loss of colour, of 255, from which larger pictures are worth their bytes: what JPEG loses anyway.
const WORTH: f64 = 1.0;

/// How much longer than asked for sides may be, tried in order.
const LONGER: [f64; 2] = [1.5, 2.0];

/// The side that pictures are to have: that of the params, or where they allow it, the longest of which each step is worth its bytes.
pub(super) fn side_px(
    surface: &Surface<'_>,
    chosen: &[Chosen<'_>],
    params: &TextureParams,
    watch: &Watch<'_>,
) -> Result<u32, Interrupted> {
    let mut side = params.size_px;
    // A photograph has its own size.
    let drawn: Vec<&Chosen<'_>> = chosen.iter().filter(|c| c.photograph.is_none()).collect();
    if !params.detailed || drawn.is_empty() {
        return Ok(side);
    }
    let step = drawn.len().div_ceil(VIEWS);
    let looked: Vec<&Chosen<'_>> = drawn.into_iter().step_by(step).collect();
    for longer in LONGER {
        let larger = ((f64::from(params.size_px) * longer) as u32).min(MAX_SIDE_PX);
        if larger <= side || loss(surface, &looked, (side, larger), watch)? <= WORTH {
            break;
        }
        side = larger;
    }
    Ok(side)
}

/// By how much pictures of one side differ from those of a larger one where they are magnified to it: the mean of the largest channel,
/// of 255.
fn loss(
    surface: &Surface<'_>,
    views: &[&Chosen<'_>],
    (least, most): (u32, u32),
    watch: &Watch<'_>,
) -> Result<f64, Interrupted> {
    let losses = views.par_iter().map(|view| {
        watch.check()?;
        let take = |side| take_picture(surface, &view.camera.resized((side, side)));
        let (fine, mut coarse) = (take(most), take(least));
        coarse.fill();
        let (mut lost, mut pixels) = (0.0, 0.0);
        let scale = least as f32 / most as f32;
        for (pixel, _) in fine.pixels.iter().enumerate().filter(|(_, p)| p[3] > 0.0) {
            let place = [pixel % fine.width, pixel / fine.width].map(|v| (v as f32 + 0.5) * scale);
            let [there, here] = [fine.colour(pixel), coarse.sample(place[0], place[1])];
            let off =
                (0..3).map(|c| (srgb_from_linear(there[c]) - srgb_from_linear(here[c])).abs());
            lost += f64::from(255.0 * off.fold(0.0, f32::max));
            pixels += 1.0;
        }
        Ok((lost, pixels))
    });
    let losses = losses.collect::<Result<Vec<(f64, f64)>, Interrupted>>()?;
    let lost: f64 = losses.iter().map(|l| l.0).sum();
    let pixels: f64 = losses.iter().map(|l| l.1).sum();
    Ok(lost / pixels.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use silmap_geometry::{Camera, TriangleMesh};

    /// A square of stripes, so many from side to side.
    fn stripes(count: u32) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for k in 0..count {
            let base = mesh.positions.len() as u32;
            for (i, j) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let x = f64::from(k + i) / f64::from(count) - 0.5;
                mesh.positions.push(DVec3::new(x, f64::from(j) - 0.5, 0.0));
            }
            mesh.faces
                .extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
            let colour = [[f32::from(u8::from(k % 2 == 0)); 3]; 3];
            mesh.appearance.corner_colours.extend([colour; 2]);
        }
        mesh
    }

    #[test]
    fn finer_stripes_get_larger_pictures() {
        let camera = Camera::fit_sphere(DVec3::Z * 3.0, DVec3::ZERO, 1.0, None, (64, 64)).unwrap();
        let chosen = [Chosen {
            camera,
            photograph: None,
            paintable: Vec::new(),
        }];
        let side = |count, detailed| {
            let mesh = stripes(count);
            let params = TextureParams {
                size_px: 64,
                detailed,
                ..TextureParams::default()
            };
            side_px(&Surface::new(&mesh), &chosen, &params, &Watch::silent()).unwrap()
        };
        assert_eq!(side(1, true), 64, "one colour");
        assert_eq!(side(16, true), 128);
        assert_eq!(side(16, false), 64, "not asked for");
    }
}
