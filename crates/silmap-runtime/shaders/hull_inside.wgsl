// The hull where the outline winds about the pixel's centre. Needs: outline, instance, paint, hull_covered, hull_colour.

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    let covered = fragment_coverage(fragment);
    if !covered.is_inside {
        discard;
    }
    return vec4f(fragment_colour(fragment), 1.0);
}
