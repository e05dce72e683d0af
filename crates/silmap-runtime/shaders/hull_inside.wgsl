// The hull where the outline winds about the pixel's centre. Needs: outline, instance, paint, hull_covered, hull_coverage, hull_colour, hull_shown, or those of relief.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    let covered = fragment_coverage(fragment);
    if !covered.is_inside {
        discard;
    }
    return shown(fragment_paint(fragment), 1.0);
}
