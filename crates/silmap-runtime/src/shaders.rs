//! The shaders: which parts make up which program.

use silmap_gpu::shaders::Shader;

const OUTLINE: &str = include_str!("../shaders/outline.wgsl");
const INSTANCE: &str = include_str!("../shaders/instance.wgsl");
const PAINT: &str = include_str!("../shaders/paint.wgsl");
const PLAIN: &str = include_str!("../shaders/hull_plain.wgsl");
const COVERED: &str = include_str!("../shaders/hull_covered.wgsl");
const COLOUR: &str = include_str!("../shaders/hull_colour.wgsl");

macro_rules! shaders {
    ($($(#[$doc:meta])* $constant:ident = $name:literal, web: $web:literal, after [$($part:ident),*];)*) => {
        $(
            $(#[$doc])*
            pub const $constant: Shader = Shader {
                name: $name,
                parts: &[$($part,)* include_str!(concat!("../shaders/", $name, ".wgsl"))],
                web: $web,
            };
        )*
        /// All shaders.
        pub const ALL: &[Shader] = &[$($constant),*];
    };
}

shaders! {
    /// Outlines as triangles, into the stencil.
    WINDINGS = "windings", web: true, after [OUTLINE, INSTANCE];
    /// The hull.
    HULL = "hull", web: true, after [INSTANCE, PAINT, PLAIN, COLOUR];
    /// Its depth.
    HULL_DEPTH = "hull_depth", web: true, after [INSTANCE, PAINT, PLAIN];
    /// The hull inside of the outline.
    HULL_INSIDE = "hull_inside", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
    /// The depth of that.
    HULL_INSIDE_DEPTH = "hull_inside_depth", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED];
    /// The hull with its coverage in alpha.
    HULL_SAMPLES = "hull_samples", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
    /// The hull in those of four samples that are inside.
    HULL_FOUR_SAMPLES = "hull_four_samples", web: false, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
    /// The hull where it covers all of a pixel, and the depth of the rest.
    HULL_SOFT = "hull_soft", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
    /// That rest.
    HULL_SOFT_BORDER = "hull_soft_border", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
    /// The hull by coverage, in a pass without depth.
    HULL_BLENDED = "hull_blended", web: true, after [OUTLINE, INSTANCE, PAINT, COVERED, COLOUR];
}
