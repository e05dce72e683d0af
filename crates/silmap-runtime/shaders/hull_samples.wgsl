// The hull by its coverage, which the device turns into samples. Needs: outline, instance, paint, hull_covered, hull_coverage, hull_colour, hull_shown, or those of relief.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    let covered = fragment_coverage(fragment);
    if covered.share <= 0.0 {
        discard;
    }
    var out = shown(fragment_paint(fragment), 1.0);
    out.colour.w = covered.share;
    return out;
}
