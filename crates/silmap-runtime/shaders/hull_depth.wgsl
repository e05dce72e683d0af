// The hull in a pass without colour. Needs: instance, paint, hull_plain.

@fragment
fn fs_main(fragment: Fragment) {
}
