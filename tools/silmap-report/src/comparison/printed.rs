//! Figures printed in the papers.

use serde_json::{Value, json};

/// A column of tables 1 and 2 of the 2000 paper, measured at random viewpoints on a Pentium III of 550 MHz and a GeForce 256.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clipping {
    pub(super) model: &'static str,
    pub(super) faces: u32,
    pub(super) edges: u32,
    pub(super) silhouette_edges: u32,
    pub(super) tested_edges: u32,
    pub(super) tested_nodes: u32,
    /// Milliseconds of extraction alone: search tree and brute force.
    pub(super) tree_ms: f64,
    pub(super) brute_ms: f64,
    pub(super) hull_faces: u32,
    /// Milliseconds of a frame: the mesh, and in the clipped hull's: extraction, stencil, hull, all of it, antialiasing on top.
    pub(super) original_ms: f64,
    pub(super) frame_extraction_ms: f64,
    pub(super) stencil_ms: f64,
    pub(super) hull_ms: f64,
    pub(super) total_ms: f64,
    pub(super) antialiasing_ms: f64,
}

impl Clipping {
    /// Faces that the original's rendering would draw in the time of the clipped hull, if its time is proportional to them.
    pub(super) fn faces_in_the_same_time(&self) -> f64 {
        f64::from(self.faces) * self.total_ms / self.original_ms
    }
}

/// Tables 1 and 2. The parasaur has 43,886 faces in the first and 43,866 in the second, which fits its edges.
pub(super) const CLIPPING: [Clipping; 5] = [
    Clipping {
        model: "bunny",
        faces: 69_674,
        edges: 104_511,
        silhouette_edges: 3_461,
        tested_edges: 10_256,
        tested_nodes: 4_282,
        tree_ms: 4.1,
        brute_ms: 20.4,
        hull_faces: 500,
        original_ms: 34.7,
        frame_extraction_ms: 4.5,
        stencil_ms: 2.7,
        hull_ms: 4.8,
        total_ms: 7.8,
        antialiasing_ms: 3.0,
    },
    Clipping {
        model: "dragon",
        faces: 400_000,
        edges: 600_000,
        silhouette_edges: 23_493,
        tested_edges: 67_934,
        tested_nodes: 26_291,
        tree_ms: 28.2,
        brute_ms: 117.3,
        hull_faces: 4_000,
        original_ms: 204.7,
        frame_extraction_ms: 24.2,
        stencil_ms: 21.5,
        hull_ms: 5.2,
        total_ms: 50.3,
        antialiasing_ms: 22.5,
    },
    Clipping {
        model: "parasaur",
        faces: 43_866,
        edges: 65_799,
        silhouette_edges: 3_227,
        tested_edges: 10_938,
        tested_nodes: 3_538,
        tree_ms: 4.3,
        brute_ms: 12.5,
        hull_faces: 1_020,
        original_ms: 20.63,
        frame_extraction_ms: 4.0,
        stencil_ms: 2.0,
        hull_ms: 4.9,
        total_ms: 6.9,
        antialiasing_ms: 2.9,
    },
    Clipping {
        model: "knot",
        faces: 185_856,
        edges: 278_784,
        silhouette_edges: 3_291,
        tested_edges: 13_134,
        tested_nodes: 7_926,
        tree_ms: 6.4,
        brute_ms: 50.6,
        hull_faces: 928,
        original_ms: 81.12,
        frame_extraction_ms: 6.5,
        stencil_ms: 2.8,
        hull_ms: 4.9,
        total_ms: 10.3,
        antialiasing_ms: 3.4,
    },
    Clipping {
        model: "three holes",
        faces: 188_416,
        edges: 282_624,
        silhouette_edges: 1_737,
        tested_edges: 5_976,
        tested_nodes: 4_594,
        tree_ms: 3.3,
        brute_ms: 51.4,
        hull_faces: 500,
        original_ms: 90.3,
        frame_extraction_ms: 4.0,
        stencil_ms: 1.0,
        hull_ms: 4.4,
        total_ms: 5.5,
        antialiasing_ms: 1.5,
    },
];

/// Faces of the bunny, and how many times less Johannsen and Carter's tests the cones take: section 7 of the 2000 paper.
const OVER_JC: [(usize, f64); 5] = [
    (500, 1.1),
    (4_000, 1.3),
    (20_000, 1.5),
    (50_000, 2.0),
    (69_674, 2.1),
];

/// The 2000 paper's factor over Johannsen and Carter for a bunny of about as many faces.
pub(super) fn over_jc(faces: usize) -> Option<f64> {
    const ABOUT: f64 = 0.05;
    let is_near = |of: usize| faces.abs_diff(of) as f64 <= ABOUT * of as f64;
    OVER_JC.iter().find(|row| is_near(row.0)).map(|row| row.1)
}

/// A row of table 2 of the 2001 paper: extractions in a second without drawing, the eye led by hand, on an SGI Octane of 195 MHz.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rates {
    pub(super) model: &'static str,
    pub(super) faces: u32,
    pub(super) dual: f64,
    pub(super) brute: f64,
}

const fn rates(model: &'static str, faces: u32, dual: f64, brute: f64) -> Rates {
    Rates {
        model,
        faces,
        dual,
        brute,
    }
}

/// Table 2 of the 2001 paper, faces from its table 1.
pub(super) const RATES: [Rates; 7] = [
    rates("bishop", 496, 1946.21, 1566.3),
    rates("teapot", 3_752, 941.51, 522.32),
    rates("skyscraper", 3_672, 922.58, 261.22),
    rates("molecule", 24_860, 94.69, 17.11),
    rates("pagoda", 40_098, 83.49, 15.22),
    rates("bunny", 69_451, 196.56, 30.76),
    rates("dragon", 871_414, 12.2, 2.0),
];

/// As JSON, to be laid beside what was measured.
pub(super) fn numbers() -> Value {
    let clipping = CLIPPING.iter().map(|c| {
        json!({
            "model": c.model,
            "faces": c.faces,
            "edges": c.edges,
            "silhouette_edges": c.silhouette_edges,
            "tested_edges": c.tested_edges,
            "visited_nodes": c.tested_nodes,
            "cones_milliseconds": c.tree_ms,
            "brute_milliseconds": c.brute_ms,
            "hull_faces": c.hull_faces,
            "frame_milliseconds": {
                "original": c.original_ms,
                "extraction": c.frame_extraction_ms,
                "stencil": c.stencil_ms,
                "hull": c.hull_ms,
                "total": c.total_ms,
                "antialiasing": c.antialiasing_ms,
            },
            "faces_in_the_same_time": c.faces_in_the_same_time(),
        })
    });
    let rates = RATES.iter().map(|r| {
        json!({
            "model": r.model,
            "faces": r.faces,
            "dual_per_second": r.dual,
            "brute_per_second": r.brute,
        })
    });
    json!({
        "silhouette_clipping_2000": clipping.collect::<Vec<_>>(),
        "jc_tests_over_cones_2000": OVER_JC,
        "dual_space_2001": rates.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_factors_follow_from_printed_times() {
        // Speedup factors as the tables print them, each rounded from times that were rounded before.
        let frames = [4.4, 4.1, 3.0, 7.9, 16.4];
        let extraction = [5.0, 4.2, 2.9, 7.9, 15.6];
        for (c, (frame, extract)) in CLIPPING.iter().zip(frames.into_iter().zip(extraction)) {
            let within = |a: f64, b: f64| (a / b - 1.0).abs() < 0.03;
            assert!(within(c.original_ms / c.total_ms, frame), "{}", c.model);
            assert!(within(c.brute_ms / c.tree_ms, extract), "{}", c.model);
            assert_eq!(c.edges * 2, c.faces * 3, "closed: {}", c.model);
            let parts = c.frame_extraction_ms + c.stencil_ms + c.hull_ms;
            assert!(c.total_ms < parts, "done side by side: {}", c.model);
        }
        let [.., bunny, dragon] = RATES;
        assert!((bunny.dual / bunny.brute - 6.4).abs() < 0.05);
        assert!((dragon.dual / dragon.brute - 6.1).abs() < 0.05);
    }

    #[test]
    fn factors_are_told_for_about_as_many_faces_only() {
        assert_eq!(over_jc(69_666), Some(2.1));
        assert_eq!(over_jc(500), Some(1.1));
        assert_eq!(over_jc(100_000), None);
    }
}
