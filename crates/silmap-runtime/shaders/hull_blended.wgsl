// The hull by its coverage, for a pass without depth. Needs: outline, instance, paint, hull_covered, hull_colour.

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    let covered = fragment_coverage(fragment);
    if covered.share <= 0.0 {
        discard;
    }
    return vec4f(fragment_colour(fragment), 1.0) * covered.share;
}
