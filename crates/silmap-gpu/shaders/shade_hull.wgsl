// The hull, opaque. Needs: shared/view, shared/hull.

@fragment
fn fs_main(fragment: HullFragment) -> @location(0) vec4f {
    return vec4f(hull_colour(fragment), 1.0);
}
