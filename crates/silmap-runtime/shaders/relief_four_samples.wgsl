// The same by relief, with its depth. Needs: outline, instance, paint, relief_covered, hull_coverage, relief_colour.

struct Sampled {
    @location(0) colour: vec4f,
    @builtin(sample_mask) samples: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(fragment: Fragment) -> Sampled {
    let samples = fragment_samples(fragment);
    if samples == 0u {
        discard;
    }
    let painted = fragment_paint(fragment);
    return Sampled(vec4f(painted.colour, 1.0), samples, painted.depth);
}
