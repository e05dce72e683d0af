// The hull, opaque. Needs: instance, paint, hull_plain, hull_colour, hull_shown, or those of relief.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    return shown(fragment_paint(fragment), 1.0);
}
