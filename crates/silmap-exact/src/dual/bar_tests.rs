//! Regions stay fat and trees balanced for all point distributions.

use proptest::prelude::*;

use super::*;

fn points_at(places: impl IntoIterator<Item = DVec3>) -> Vec<Point> {
    let points = places.into_iter().enumerate().map(|(k, p)| Point {
        face: k as u32,
        chart: 6,
        at: [p.x, p.y, p.z, 1.0],
    });
    points.collect()
}

/// Builds the tree and returns its depth, after looking at what must hold.
fn check(mut points: Vec<Point>) -> usize {
    let before = points.len();
    let mut drafts = Vec::new();
    let mut regions = Vec::new();
    divide_watched(&mut points, 0, &mut drafts, &mut |region, count| {
        assert!(region.aspect() <= MOST_ASPECT, "{}", region.aspect());
        regions.push((region.clone(), count));
    });
    let mut faces: Vec<u32> = points.iter().map(|p| p.face).collect();
    faces.sort_unstable();
    assert!(faces.into_iter().eq(0..before as u32));
    // Parts share their parent's points, and every point lies in the regions that hold it.
    let mut deepest = 0;
    let mut open: Vec<(usize, u32)> = Vec::new();
    for (k, draft) in drafts.iter().enumerate() {
        while open.last().is_some_and(|&(_, left)| left == 0) {
            open.pop();
        }
        if let Some((parent, left)) = open.last_mut() {
            *left -= 1;
            let whole = &drafts[*parent].points;
            assert!(whole.start <= draft.points.start && draft.points.end <= whole.end);
        }
        assert_eq!(draft.points.len(), regions[k].1);
        for point in &points[draft.points.clone()] {
            for direction in DIRECTIONS {
                let [low, high] = regions[k].0.extent(direction);
                let value = place_of(point).dot(direction);
                assert!(low - 1e-9 <= value && value <= high + 1e-9);
            }
        }
        open.push((k, draft.child_count));
        deepest = deepest.max(open.len());
    }
    deepest
}

/// Levels that a balanced tree of so many points may have, with a few cuts that only shrink between two that share.
fn most_levels(count: usize) -> usize {
    let halvings = (count as f64 / LEAF_POINTS as f64).max(1.0).log2();
    (5.0 * halvings) as usize + 6
}

/// Numbers from 0 to 1 that look random.
fn noise(count: usize) -> Vec<DVec3> {
    let mut state = 1_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / (1_u64 << 24) as f64
    };
    (0..count)
        .map(|_| DVec3::new(next(), next(), next()))
        .collect()
}

#[test]
fn spread_points_make_a_balanced_tree() {
    let count = 8000;
    let depth = check(points_at(noise(count).into_iter().map(|p| p * 2.0 - 1.0)));
    assert!((8..=12).contains(&depth), "{depth}");
    let sphere = noise(count)
        .into_iter()
        .map(|p| (p - 0.5).normalize_or_zero());
    assert!(check(points_at(sphere)) <= most_levels(count));
}

#[test]
fn crowds_on_all_scales_make_a_balanced_tree() {
    // Half of the points in a quarter of the cube around some place, half of these in a quarter of that, and so on: an octree
    // goes down once for every scale.
    let count = 4000;
    for center in [DVec3::ZERO, DVec3::splat(1.0), DVec3::new(0.3, -0.7, 0.1)] {
        let crowd = noise(count).into_iter().enumerate().map(|(k, p)| {
            let scale = 0.5_f64.powf(30.0 * k as f64 / count as f64);
            (center + (p * 2.0 - 1.0) * scale).clamp(-DVec3::ONE, DVec3::ONE)
        });
        let depth = check(points_at(crowd));
        assert!(depth <= most_levels(count), "{depth} around {center}");
    }
}

#[test]
fn points_at_one_place_stay_together() {
    let place = DVec3::new(0.25, -0.5, 0.125);
    let depth = check(points_at(vec![place; 500]));
    assert!(depth <= MOST_UNBALANCED as usize + 2, "{depth}");
    let two = (0..500).map(|k| if k % 2 == 0 { place } else { -place });
    assert!(check(points_at(two)) <= 2 * MOST_UNBALANCED as usize);
}

#[test]
fn a_thin_part_is_noticed() {
    let cube = Region::cube();
    assert!((cube.aspect() - 3.0_f64.sqrt()).abs() < 1e-12);
    assert!(cube.cut(DVec3::X, -0.9).is_none());
    assert!(cube.cut(DVec3::X, 0.0).is_some());
    // However small a corner is, what is left is fat.
    let corner = cube.cut(DVec3::ONE, -3.0 + 1e-6).expect("a corner is fat");
    assert!(corner.parts[1].aspect() < 2.0);
    assert!(cube.clipped(DVec3::X, -0.9).aspect() > MOST_ASPECT);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn whatever_the_points_regions_are_fat(
        places in prop::collection::vec(prop::array::uniform3(-4_i32..=4), 1..300),
        scale in prop_oneof![Just(0.25), Just(1e-3), Just(1e-12)],
    ) {
        let places = places.iter().map(|p| DVec3::from(p.map(f64::from)) * scale);
        check(points_at(places));
    }
}
