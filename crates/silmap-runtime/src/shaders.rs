//! The shaders: which parts make up which program.

use silmap_gpu::shaders::Shader;

const OUTLINE: &str = include_str!("../shaders/outline.wgsl");
const INSTANCE: &str = include_str!("../shaders/instance.wgsl");
const PAINT: &str = include_str!("../shaders/paint.wgsl");
const LIGHT: &str = include_str!("../shaders/light.wgsl");
const PLAIN: &str = include_str!("../shaders/hull_plain.wgsl");
const COVERED: &str = include_str!("../shaders/hull_covered.wgsl");
const COVERAGE: &str = include_str!("../shaders/hull_coverage.wgsl");
const COLOUR: &str = include_str!("../shaders/hull_colour.wgsl");
const SHOWN: &str = include_str!("../shaders/hull_shown.wgsl");
const RELIEF: &str = include_str!("../shaders/relief.wgsl");
const RELIEF_VERTEX: &str = include_str!("../shaders/relief_vertex.wgsl");
const RELIEF_PLAIN: &str = include_str!("../shaders/relief_plain.wgsl");
const RELIEF_COVERED: &str = include_str!("../shaders/relief_covered.wgsl");
const RELIEF_COLOUR: &str = include_str!("../shaders/relief_colour.wgsl");
const RELIEF_SHOWN: &str = include_str!("../shaders/relief_shown.wgsl");

macro_rules! shaders {
    ($($(#[$doc:meta])* $constant:ident = $name:literal from $file:literal, web: $web:literal, after [$($part:ident),*];)*) => {
        $(
            $(#[$doc])*
            pub const $constant: Shader = Shader {
                name: $name,
                parts: &[$($part,)* include_str!(concat!("../shaders/", $file, ".wgsl"))],
                web: $web,
            };
        )*
        /// All shaders.
        pub const ALL: &[Shader] = &[$($constant),*];
    };
}

shaders! {
    /// Outlines as triangles, into the stencil.
    WINDINGS = "windings" from "windings", web: true, after [OUTLINE, INSTANCE];
    /// The hull.
    HULL = "hull" from "hull", web: true, after [INSTANCE, PAINT, LIGHT, PLAIN, COLOUR, SHOWN];
    /// Its depth.
    HULL_DEPTH = "hull_depth" from "hull_depth", web: true, after [INSTANCE, PAINT, LIGHT, PLAIN];
    /// The depth of the hull inside of the outline.
    HULL_INSIDE_DEPTH = "hull_inside_depth" from "hull_inside_depth", web: true, after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE];
    /// The hull inside of the outline.
    HULL_INSIDE = "hull_inside" from "hull_inside", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR, SHOWN];
    /// The hull with its coverage in alpha.
    HULL_SAMPLES = "hull_samples" from "hull_samples", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR, SHOWN];
    /// The hull in those of four samples that are inside.
    HULL_FOUR_SAMPLES = "hull_four_samples" from "hull_four_samples", web: false,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR];
    /// The hull where it covers all of a pixel, and the depth of the rest.
    HULL_SOFT = "hull_soft" from "hull_soft", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR, SHOWN];
    /// That rest.
    HULL_SOFT_BORDER = "hull_soft_border" from "hull_soft_border", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR, SHOWN];
    /// The hull by coverage, in a pass without depth.
    HULL_BLENDED = "hull_blended" from "hull_blended", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, COVERED, COVERAGE, COLOUR, SHOWN];
    /// As [`HULL`], by relief.
    RELIEF_HULL = "relief_hull" from "hull", web: true,
        after [INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_PLAIN, RELIEF_COLOUR, RELIEF_SHOWN];
    /// As [`HULL_INSIDE`], by relief.
    RELIEF_INSIDE = "relief_inside" from "hull_inside", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_COVERED, COVERAGE, RELIEF_COLOUR, RELIEF_SHOWN];
    /// As [`HULL_SAMPLES`], by relief.
    RELIEF_SAMPLES = "relief_samples" from "hull_samples", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_COVERED, COVERAGE, RELIEF_COLOUR, RELIEF_SHOWN];
    /// As [`HULL_FOUR_SAMPLES`], by relief.
    RELIEF_FOUR_SAMPLES = "relief_four_samples" from "relief_four_samples", web: false,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_COVERED, COVERAGE, RELIEF_COLOUR];
    /// As [`HULL_SOFT`], by relief.
    RELIEF_SOFT = "relief_soft" from "hull_soft", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_COVERED, COVERAGE, RELIEF_COLOUR, RELIEF_SHOWN];
    /// As [`HULL_SOFT_BORDER`], by relief.
    RELIEF_SOFT_BORDER = "relief_soft_border" from "hull_soft_border", web: true,
        after [OUTLINE, INSTANCE, PAINT, LIGHT, RELIEF, RELIEF_VERTEX, RELIEF_COVERED, COVERAGE, RELIEF_COLOUR, RELIEF_SHOWN];
}
