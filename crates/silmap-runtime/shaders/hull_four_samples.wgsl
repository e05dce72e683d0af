// The hull in those of four samples that are inside of the outline. Needs: outline, instance, paint, hull_covered, hull_coverage,
// hull_colour.

struct Sampled {
    @location(0) colour: vec4f,
    @builtin(sample_mask) samples: u32,
}

@fragment
fn fs_main(fragment: Fragment) -> Sampled {
    let samples = fragment_samples(fragment);
    if samples == 0u {
        discard;
    }
    return Sampled(vec4f(fragment_paint(fragment).colour, 1.0), samples);
}
