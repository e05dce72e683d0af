//! Conclusions from measured times, and their place on the page.

use silmap_measure::ContourResult;

use super::*;

fn result(method: &str, edges: f64, seconds: f64) -> ExtractionResult {
    let extracted = Extracted {
        viewpoints: 9,
        silhouette_edges: edges,
        tested_edges: 1e6 * seconds,
        visited_nodes: 0.0,
        seconds_median: seconds,
    };
    ExtractionResult {
        method: method.to_owned(),
        walk: extracted,
        scattered: Extracted {
            seconds_median: 2.0 * seconds,
            ..extracted
        },
        frame_seconds: Some(1e-3 + seconds),
        ..ExtractionResult::default()
    }
}

/// Cones grow in proportion to the silhouette and brute force as its square, as the 2000 paper has it.
fn comparison() -> Comparison {
    let level = |faces: usize, edges: f64| ComparisonLevel {
        faces,
        methods: vec![
            result("brute", edges, 1e-9 * edges * edges),
            result("brute-parallel", edges, 2e-6 + 0.4e-9 * edges * edges),
            result("cones", edges, 100e-9 * edges),
        ],
    };
    Comparison {
        levels: vec![
            level(500, 50.0),
            level(4_000, 170.0),
            level(20_000, 500.0),
            level(69_666, 1_500.0),
        ],
        contours: vec![ContourResult {
            method: "tight".to_owned(),
            seconds_median: 1e-4,
            error_px: 0.25,
            data_bytes: 99,
        }],
        walk_viewpoints: 120,
        scattered_viewpoints: 60,
        threads: 2,
        frames: Some(FrameResults {
            adapter: "a slow one".to_owned(),
            size_px: 512,
            hull_faces: 500,
            full: vec![
                (500, 0.5e-3),
                (4_000, 1e-3),
                (20_000, 4e-3),
                (69_666, 16e-3),
            ],
            interpolated: Some(("tight".to_owned(), 1.2e-3)),
            hull_seconds: 0.9e-3,
        }),
    }
}

#[test]
fn a_crossover_holds_for_all_that_is_finer() {
    let comparison = comparison();
    let crossover = |a, b| comparison.crossover(a, b, Motion::Walk);
    assert_eq!(crossover("cones", "brute"), Some(4_000));
    assert_eq!(crossover("cones", "brute-parallel"), Some(20_000));
    assert_eq!(crossover("brute", "cones"), None);
    assert_eq!(crossover("dual", "brute"), None);
    assert_eq!(
        comparison.levels_won("brute-parallel", Motion::Walk),
        [4_000]
    );
    assert_eq!(comparison.levels_won("brute", Motion::Walk), [500]);
}

#[test]
fn the_slope_is_the_power_that_times_grow_by() {
    let mut comparison = comparison();
    let slope = |c: &Comparison, method| c.growth(method).unwrap();
    assert!((slope(&comparison, "brute") - 2.0).abs() < 1e-9);
    assert!((slope(&comparison, "cones") - 1.0).abs() < 1e-9);
    assert_eq!(comparison.growth("dual"), None);
    comparison.levels.truncate(2);
    assert_eq!(comparison.growth("brute"), None, "two points fit any line");
}

#[test]
fn faces_in_the_same_time_lie_between_those_that_were_drawn() {
    let comparison = comparison();
    let frames = comparison.frames.as_ref().unwrap();
    for (faces, seconds) in &frames.full[..3] {
        let drawn = frames.faces_drawn_in(*seconds).unwrap();
        assert!((drawn / *faces as f64 - 1.0).abs() < 1e-9, "{drawn}");
    }
    // Twice the time of 4,000 faces is half-way to four times it, which 20,000 take.
    let between = frames.faces_drawn_in(2e-3).unwrap();
    assert!(
        (between - (4_000.0_f64 * 20_000.0).sqrt()).abs() < 1e-6,
        "{between}"
    );
    assert_eq!(frames.faces_drawn_in(0.4e-3), None, "less than any");
    assert_eq!(frames.faces_drawn_in(17e-3), None, "more than any");
    let pairs = comparison.same_time("cones");
    assert_eq!(pairs.len(), 4);
    assert!(
        pairs[3].1.unwrap() < 69_666.0,
        "clipping draws more: {pairs:?}"
    );
    assert!(
        pairs[0].1.unwrap() > 500.0,
        "and costs more than it shows: {pairs:?}"
    );
    assert_eq!(comparison.clipping_pays_from("cones"), Some(20_000));
    assert_eq!(comparison.clipping_pays_from("dual"), None, "not measured");
    // Times that fall where faces grow are noise.
    let noisy = FrameResults {
        full: vec![(500, 2e-3), (4_000, 1e-3), (20_000, 4e-3)],
        ..frames.clone()
    };
    assert!(noisy.faces_drawn_in(3e-3).unwrap() > 4_000.0);
}

#[test]
fn the_section_has_what_was_measured_and_what_was_printed() {
    let comparison = comparison();
    let html = section(&comparison).into_string();
    for part in [
        "69,666",
        "from 20,000 faces on",
        "is the fastest of all at 4,000 faces",
        "0.250",
        "10,256",
        "196.6",
        "150.0",
        "as its power: <code>brute</code> 2.0",
        "a slow one",
        "parasaur",
        "silhouette edges",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
    assert_eq!(html.matches("<svg").count(), 4);
    let numbers = numbers(&comparison);
    for (path, value) in [
        ("/levels/3/methods/cones/walk/seconds_median", 1.5e-4),
        ("/time_grows_by_power_of_silhouette_edges/brute", 2.0),
        (
            "/printed/silhouette_clipping_2000/0/cones_milliseconds",
            4.1,
        ),
    ] {
        let found = numbers.pointer(path).and_then(Value::as_f64).unwrap();
        assert!((found - value).abs() < 1e-9, "{path}: {found}");
    }
    assert_eq!(numbers["levels"][0]["fastest"]["walk"], "brute");
    assert_eq!(
        numbers["levels"][3]["fastest_on_one_thread"]["scattered"],
        "cones"
    );
    assert_eq!(section(&Comparison::default()).into_string(), "");
}

#[test]
fn without_frames_there_is_a_page_too() {
    let mut comparison = comparison();
    if let Some(frames) = &mut comparison.frames {
        frames.hull_seconds = 0.1e-3;
    }
    assert!(section(&comparison).into_string().contains("under 500"));
    comparison.frames = None;
    let html = section(&comparison).into_string();
    assert!(!html.contains("As frames") && html.contains("parasaur"));
    assert_eq!(numbers(&comparison)["frames"], Value::Null);
}
