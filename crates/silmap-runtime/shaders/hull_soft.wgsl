// The hull where it covers pixels wholly, and its depth where it covers them partly. Needs: outline, instance, paint, hull_covered, hull_colour.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.3: an antialiased outline.
// Deviation: the ramp is one pixel wide and centred on the outline, ½ + d inside and ½ − d outside.

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    let covered = fragment_coverage(fragment);
    // Before all branches, as its gradients need neighbours.
    let colour = fragment_colour(fragment);
    if covered.share <= 0.0 {
        discard;
    }
    if covered.share < 1.0 {
        return vec4f(0.0);
    }
    return vec4f(colour, 1.0);
}
