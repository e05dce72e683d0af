//! Loops as triangle fans about their centroids, and cutting long loops so that the triangles are fewer slivers.
//!
//! A fan covers more than its loop where the loop is not star-shaped about the centroid: a winding of one there is made of
//! several windings that cancel, and each costs the pixels it passes over. Cutting a loop in two by a pair of opposite
//! edges between two of its vertices leaves all winding numbers as they are, since the two edges cancel, and brings the
//! centroids nearer to what is filled.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 6 (basic algorithm, loop
//! decomposition).
//! Deviations: the paper leaves open which two vertices are picked. Here a loop is halved between the two vertices half its
//! length apart that lie nearest to each other, down to [`LEAST_VERTICES`], and of all these cuts those are kept that
//! lower the area. Centroids are those of the projected vertices, not of those in space.

use glam::DVec2;
use silmap_geometry::polygon::Loop;

/// Loops of fewer vertices are not cut: two more triangles each would cost what they save.
const LEAST_VERTICES: usize = 24;

/// What cutting loops did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FanReport {
    /// Loops before.
    pub loops_before: usize,
    /// Loops after.
    pub loops_after: usize,
    /// Sum of the areas of all fan triangles before, px².
    pub area_before_px: f64,
    /// Sum of the areas of all fan triangles after, px².
    pub area_after_px: f64,
}

/// The middle of a loop's vertices, about which its fan turns; zero when it has none.
fn centroid(points: &[DVec2]) -> DVec2 {
    points.iter().sum::<DVec2>() / points.len().max(1) as f64
}

/// Sum of the areas of the triangles of a loop's fan, px², each counted as positive.
#[must_use]
pub fn fan_area(points: &[DVec2]) -> f64 {
    let apex = centroid(points);
    let twice: f64 = silmap_geometry::polygon::edges(points)
        .map(|(a, b)| (a - apex).perp_dot(b - apex).abs())
        .sum();
    0.5 * twice
}

/// Cuts loops where that lowers the area of their fans; winding numbers stay as they are.
#[must_use]
pub fn decompose_loops(loops: &[Loop]) -> (Vec<Loop>, FanReport) {
    let mut report = FanReport {
        loops_before: loops.len(),
        ..FanReport::default()
    };
    let mut pieces = Vec::with_capacity(loops.len());
    for points in loops {
        report.area_before_px += fan_area(points);
        let (best, area) = best_pieces(points.clone());
        report.area_after_px += area;
        pieces.extend(best);
    }
    report.loops_after = pieces.len();
    (pieces, report)
}

/// A loop whole or in pieces, whichever has the smaller fans, and their area.
fn best_pieces(points: Loop) -> (Vec<Loop>, f64) {
    let whole = fan_area(&points);
    let Some((from, to)) = nearest_opposite(&points) else {
        return (vec![points], whole);
    };
    // Both pieces hold both vertices: the edge to → from closes the one, from → to the other.
    let first = points[from..=to].to_vec();
    let second = [&points[to..], &points[..=from]].concat();
    let (mut pieces, first_area) = best_pieces(first);
    let (others, second_area) = best_pieces(second);
    if first_area + second_area < whole {
        pieces.extend(others);
        (pieces, first_area + second_area)
    } else {
        (vec![points], whole)
    }
}

/// The two vertices half the loop apart that lie nearest to each other; none when the loop is short.
fn nearest_opposite(points: &[DVec2]) -> Option<(usize, usize)> {
    if points.len() < LEAST_VERTICES {
        return None;
    }
    let half = points.len() / 2;
    (0..half).map(|k| (k, k + half)).min_by(|&(a, b), &(c, d)| {
        let [first, second] = [(a, b), (c, d)].map(|(i, j)| points[i].distance_squared(points[j]));
        first.total_cmp(&second)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::bumpy_torus;
    use crate::{outline_loops, silhouette_edges};
    use glam::DVec3;
    use proptest::prelude::*;
    use silmap_geometry::polygon::{fill_non_zero, signed_area};
    use silmap_geometry::{Camera, Mask};

    fn ring(radius: f64, corners: u32) -> Loop {
        (0..corners)
            .map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(corners);
                DVec2::from_angle(angle) * radius
            })
            .collect()
    }

    /// A thin tube around a circle, open at one place: the worst for a single fan.
    fn thin_arc() -> Loop {
        let arc =
            |radius: f64| (0..200).map(move |k| DVec2::from_angle(f64::from(k) * 0.03) * radius);
        arc(100.0)
            .chain(arc(96.0).collect::<Vec<_>>().into_iter().rev())
            .collect()
    }

    #[test]
    fn a_convex_loop_stays_whole() {
        let circle = ring(50.0, 300);
        let (pieces, report) = decompose_loops(std::slice::from_ref(&circle));
        assert_eq!(pieces.as_slice(), std::slice::from_ref(&circle));
        assert_eq!(report.area_before_px, report.area_after_px);
        assert!((report.area_before_px - signed_area(&circle)).abs() < 1e-6);
    }

    #[test]
    fn a_thin_arc_is_cut_to_a_fraction_of_its_fans() {
        let arc = thin_arc();
        let (pieces, report) = decompose_loops(std::slice::from_ref(&arc));
        assert!(pieces.len() > 4, "{} pieces", pieces.len());
        assert!(
            report.area_after_px < 0.2 * report.area_before_px,
            "{report:?}"
        );
        let area: f64 = pieces.iter().map(|l| signed_area(l)).sum();
        assert!((area - signed_area(&arc)).abs() < 1e-6);
        let measured: f64 = pieces.iter().map(|l| fan_area(l)).sum();
        assert!((measured - report.area_after_px).abs() < 1e-6);
    }

    /// Directed edges that are left when opposite ones have cancelled, in a fixed order.
    fn boundary(loops: &[Loop]) -> Vec<[u64; 4]> {
        let key = |a: DVec2, b: DVec2| [a.x, a.y, b.x, b.y].map(f64::to_bits);
        let mut edges: Vec<_> = (loops.iter())
            .flat_map(|l| silmap_geometry::polygon::edges(l))
            .filter(|(a, b)| a != b)
            .collect();
        edges.sort_by_key(|&(a, b)| key(a, b));
        let mut left: Vec<[u64; 4]> = Vec::new();
        let mut reversed: Vec<[u64; 4]> = edges.iter().map(|&(a, b)| key(b, a)).collect();
        reversed.sort_unstable();
        for &(a, b) in &edges {
            match reversed.binary_search(&key(a, b)) {
                Ok(at) => {
                    reversed.remove(at);
                }
                Err(_) => left.push(key(a, b)),
            }
        }
        left
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn cutting_changes_no_winding_and_never_adds_area(
            mesh in bumpy_torus(),
            direction in prop::array::uniform3(-1.0..1.0),
        ) {
            let direction = DVec3::from(direction) + DVec3::new(0.01, 0.02, 0.03);
            let bounds = mesh.bounds();
            let eye = bounds.center + direction.normalize_or_zero() * bounds.radius * 2.5;
            let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (200, 200))
                .expect("the eye is outside");
            prop_assert!(!silhouette_edges(&mesh, eye).is_empty());
            let loops = outline_loops(&mesh, &camera).expect("all in front");
            let (pieces, report) = decompose_loops(&loops);
            prop_assert_eq!(boundary(&pieces), boundary(&loops));
            prop_assert!(report.area_after_px <= report.area_before_px);
            let [mut before, mut after] = [(); 2].map(|()| Mask::new(200, 200));
            fill_non_zero(&loops, &mut before);
            fill_non_zero(&pieces, &mut after);
            prop_assert_eq!(before.count_different(&after), 0);
            let dropped = &pieces[1..];
            fill_non_zero(dropped, &mut after);
            prop_assert!(pieces.len() > 1 || before.count_different(&after) > 0);
        }
    }
}
