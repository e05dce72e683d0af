// The hull where it covers pixels partly, of faces behind each other the nearest alone. Needs: outline, instance, paint, hull_covered, hull_coverage, hull_colour, hull_shown, or those of relief.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    let covered = fragment_coverage(fragment);
    if covered.share <= 0.0 || covered.share >= 1.0 {
        discard;
    }
    return shown_on_hull(fragment, shown(fragment_paint(fragment), covered.share).colour);
}
