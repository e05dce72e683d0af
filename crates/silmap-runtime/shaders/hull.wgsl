// The hull, opaque. Needs: instance, paint, hull_plain, hull_colour.

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    return vec4f(fragment_colour(fragment), 1.0);
}
