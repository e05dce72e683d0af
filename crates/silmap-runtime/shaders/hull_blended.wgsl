// The hull by its coverage, for a pass without depth. Needs: outline, instance, paint, hull_covered, hull_coverage, hull_colour, hull_shown, or those of relief.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    let covered = fragment_coverage(fragment);
    if covered.share <= 0.0 {
        discard;
    }
    return shown(fragment_paint(fragment), covered.share);
}
