//! Coordinates about a point near the model, for models far from their file's origin.
//!
//! Map projections put a house 5·10⁶ units away. Single precision then has steps of half a unit, and double precision still
//! loses digits wherever a product of coordinates is formed. From here on coordinates are relative to a point near its middle;
//! [`silmap_geometry::ClosedMesh::origin`] holds it, and code that writes coordinates for people adds it again. The point has few
//! digits: a multiple of a power of two near the radius. Subtracting it loses nothing, and a model moved by such a
//! multiple has the same coordinates about its own.

use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_geometry::camera::in_short;

use super::error::MeshFault;
use crate::warning::MeshWarning;

/// Models whose middle is within this many radii of the origin keep their coordinates: of the 24 binary digits of single
/// precision four are lost there.
const NEAR_RADII: f64 = 16.0;

/// The coarsest steps of coordinates that are taken, in radii: 16 binary digits along the radius are left. With coarser ones
/// small faces turn over, and what is written with them no longer encloses the model.
const COARSEST_STEP_REL: f64 = 1.0 / 65_536.0;

/// From such steps of single precision on there is a warning: those to which an asset rounds depths. Coarser ones show.
const COARSE_SINGLE_STEP_REL: f64 = 1.0 / 4096.0;

/// From steps of this many radii on there is a warning: far below a pixel, but features of the model may be as small.
const COARSE_STEP_REL: f64 = 1e-6;

/// Every decimal number of so many digits has a double of its own.
const DECIMAL_DIGITS: u32 = 15;

/// Whole numbers up to this one are doubles.
const MOST_EXACT: i64 = 1 << 53;

/// Moves the mesh so that it lies about its origin where it is far from it. Returns the point of its old coordinates that
/// is the origin of the new ones.
///
/// # Errors
/// When the numbers of double precision lie too far apart there to represent the model's shape.
pub(super) fn localise(mesh: &mut TriangleMesh) -> Result<(DVec3, Option<MeshWarning>), MeshFault> {
    let bounds = mesh.bounds();
    let radius = bounds.radius;
    let distance = bounds.center.abs().max_element();
    // Coordinates that are not finite are reported elsewhere.
    let is_far = radius > 0.0 && distance > NEAR_RADII * radius;
    if !is_far || !(distance / radius).is_finite() {
        return Ok((DVec3::ZERO, None));
    }
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let step = farthest.next_up() - farthest;
    if step > COARSEST_STEP_REL * radius {
        return Err(MeshFault::TooFar {
            distance,
            radius,
            step,
        });
    }
    let step_single = f64::from((farthest as f32).next_up()) - f64::from(farthest as f32);
    let warning = if step > COARSE_STEP_REL * radius {
        Some(step)
    } else if step_single > COARSE_SINGLE_STEP_REL * radius && lies_on_grid(mesh, step_single) {
        Some(step_single)
    } else {
        None
    };
    let warning = warning.map(|step| MeshWarning::CoarseCoordinates {
        step,
        step_rel: step / radius,
    });
    let unit = radius.log2().floor().exp2();
    let origin = (bounds.center / unit).round() * unit;
    tell_about(mesh, origin);
    Ok((origin, warning))
}

/// Takes `origin` off all coordinates.
///
/// Numbers of a text that have few digits are taken as such: 5400008.83 less 5400000 is 8.83, the number that the text of the
/// same model at the origin has, though their nearest doubles differ by another.
pub(super) fn tell_about(mesh: &mut TriangleMesh, origin: DVec3) {
    if origin == DVec3::ZERO {
        return;
    }
    let as_decimals = (mesh.positions.iter())
        .map(|p| {
            let [x, y, z] = [0, 1, 2].map(|k| decimal_difference(p[k], origin[k]));
            Some(DVec3::new(x?, y?, z?))
        })
        .collect::<Option<Vec<DVec3>>>();
    match as_decimals {
        Some(positions) => mesh.positions = positions,
        None => mesh.positions.iter_mut().for_each(|p| *p -= origin),
    }
}

/// The double nearest to the difference, where `value` stands for a decimal number of at most [`DECIMAL_DIGITS`] digits; `origin`
/// must be whole for that.
fn decimal_difference(value: f64, origin: f64) -> Option<f64> {
    if origin == 0.0 {
        return Some(value);
    }
    // The shortest digits that stand for this double and no other.
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e')?;
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let digits: i64 = format!("{whole}{fraction}").parse().ok()?;
    if digits.unsigned_abs() >= 10_u64.pow(DECIMAL_DIGITS) {
        return None;
    }
    let behind = fraction.len() as i32 - exponent.parse::<i32>().ok()?;
    if behind <= 0 {
        // A whole number.
        return Some(value - origin);
    }
    let scale = 10_i64.checked_pow(behind as u32)?;
    if origin.fract() != 0.0 || origin.abs() > MOST_EXACT as f64 {
        return None;
    }
    let difference = digits.checked_sub((origin as i64).checked_mul(scale)?)?;
    let is_exact = difference.abs() <= MOST_EXACT && scale <= MOST_EXACT;
    // Both are doubles, so that the quotient is the one nearest to the true one.
    is_exact.then(|| difference as f64 / scale as f64)
}

/// Whether all coordinates are single-precision numbers, some of which need steps as small as `step`.
fn lies_on_grid(mesh: &TriangleMesh, step: f64) -> bool {
    let all = || mesh.positions.iter().flat_map(|p| p.to_array());
    all().all(|x| x == f64::from(x as f32)) && all().any(|x| (x / (2.0 * step)).fract() != 0.0)
}

/// Says how far numbers of single precision are from a mesh's coordinates about `origin`, where that is more than its shape can
/// bear.
pub(super) fn rounding(mesh: &TriangleMesh, origin: DVec3) -> Option<MeshWarning> {
    let radius = mesh.bounds().radius;
    let moved = (mesh.positions.iter())
        .map(|&p| p + origin)
        .map(|p| (p.as_vec3().as_dvec3() - p).length())
        .fold(0.0, f64::max);
    (moved > COARSE_STEP_REL * radius).then(|| MeshWarning::Ignored {
        what: format!(
            "this format has single precision alone: its coordinates are up to {} off, {:.1e} of the radius",
            in_short(moved),
            moved / radius
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(radius: f64, center: DVec3) -> TriangleMesh {
        let corner = |x: f64, y: f64| center + DVec3::new(x, y, 0.0) * radius;
        TriangleMesh {
            positions: vec![
                corner(-0.75, 0.0),
                corner(0.75, 0.0),
                corner(0.0, 0.75),
                corner(0.0, -0.75),
            ],
            faces: vec![[0, 1, 2], [0, 3, 1]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn near_models_stay_as_they_are() {
        for center in [DVec3::ZERO, DVec3::splat(10.0), DVec3::NAN, DVec3::INFINITY] {
            let mut mesh = square(1.0, center);
            let before = format!("{:?}", mesh.positions);
            assert_eq!(localise(&mut mesh).unwrap(), (DVec3::ZERO, None));
            assert_eq!(format!("{:?}", mesh.positions), before);
        }
        let mut point = square(0.0, DVec3::X);
        assert_eq!(localise(&mut point).unwrap(), (DVec3::ZERO, None));
    }

    #[test]
    fn far_models_are_what_they_are_at_the_origin() {
        for shift in [DVec3::new(5e5, 5.4e6, 200.0), DVec3::new(-1e9, 0.0, 3.0)] {
            let mut mesh = square(1.0, shift);
            let (origin, warning) = localise(&mut mesh).unwrap();
            assert_eq!((origin, warning), (shift, None));
            assert_eq!(mesh, square(1.0, DVec3::ZERO));
        }
        // Not a multiple, but with few digits and near.
        let mut mesh = square(0.1, DVec3::splat(1234.567));
        let (origin, _) = localise(&mut mesh).unwrap();
        assert!((origin * 32.0).fract() == DVec3::ZERO);
        assert!(mesh.bounds().center.length() < 0.1);
        for (p, q) in mesh
            .positions
            .iter()
            .zip(square(0.1, DVec3::splat(1234.567)).positions)
        {
            assert_eq!(*p + origin, q);
        }
    }

    #[test]
    fn decimals_are_what_they_are_at_the_origin() {
        let near = ["8.829803", "-12.5", "0.000001", "0", "3e-7", "-0.1", "7"];
        let numbers = |add: i64| -> Vec<f64> {
            let add = |text: &str| {
                let steps = (text.parse::<f64>().unwrap() * 1e7).round() as i64;
                let all = steps + add * 10_000_000;
                let sign = if all < 0 { "-" } else { "" };
                let all = all.unsigned_abs();
                format!("{sign}{}.{:07}", all / 10_000_000, all % 10_000_000)
            };
            near.iter().map(|text| add(text).parse().unwrap()).collect()
        };
        let here = numbers(0);
        for origin in [5_400_000, -500_000, 200, 72] {
            for (&far, &wanted) in numbers(origin).iter().zip(&here) {
                assert_eq!(decimal_difference(far, origin as f64), Some(wanted));
            }
        }
        // Subtracting doubles gives another number: what this is for.
        assert_ne!(5_400_008.829803 - 5_400_000.0, 8.829803);
        // All digits of a double are no decimal number, nor is there one less a half.
        assert_eq!(
            decimal_difference(5_400_000.0 + 1.0 / 3.0, 5_400_000.0),
            None
        );
        assert_eq!(decimal_difference(1000.1, 1000.5), None);
    }

    #[test]
    fn too_few_digits_are_said_or_refused() {
        let localised = |distance: f64| localise(&mut square(1.0, DVec3::X * distance));
        assert!(matches!(localised(1e9), Ok((_, None))));
        assert!(matches!(localised(1e10), Ok((_, Some(_)))));
        assert!(matches!(localised(1e12), Err(MeshFault::TooFar { .. })));
        let mut single = square(1.0, DVec3::X * 5e4);
        for p in &mut single.positions {
            *p = (*p + DVec3::splat(0.1)).as_vec3().as_dvec3();
        }
        assert!(matches!(localise(&mut single), Ok((_, Some(_)))));
        // Whole numbers are what they are meant to be.
        let mut whole = square(4.0, DVec3::X * 4e6);
        assert!(matches!(localise(&mut whole), Ok((_, None))));
    }
}
