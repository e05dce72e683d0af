// The hull where it covers pixels wholly, and its depth where it covers them partly. Those have the hull's own depth, by which
// hull_soft_border finds them. Needs: outline, instance, paint, hull_covered, hull_coverage, hull_colour, hull_shown, or those of relief.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.3: an antialiased outline.
// Deviation: the ramp is one pixel wide and centred on the outline, ½ + d inside and ½ − d outside.

@fragment
fn fs_main(fragment: Fragment) -> Shown {
    let covered = fragment_coverage(fragment);
    if covered.share <= 0.0 {
        discard;
    }
    // Before all branches, as its gradients need neighbours.
    let painted = fragment_paint(fragment);
    if covered.share < 1.0 {
        return shown_on_hull(fragment, vec4f(0.0));
    }
    return shown(painted, 1.0);
}
