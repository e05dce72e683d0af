// The hull's depth alone, so that the blended draw after it touches each pixel once. Needs: shared/view, shared/hull.

@fragment
fn fs_main(fragment: HullFragment) -> @location(0) vec4f {
    return vec4f(0.0);
}
