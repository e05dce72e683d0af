// The same in a pass without colour. Needs: outline, instance, paint, hull_covered.

@fragment
fn fs_main(fragment: Fragment) {
    let covered = fragment_coverage(fragment);
    if !covered.is_inside {
        discard;
    }
}
