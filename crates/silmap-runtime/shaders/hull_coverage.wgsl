// How the outline covers a hull's fragment, whatever the hull shows. Needs: outline, hull_covered or relief_covered.

fn fragment_coverage(fragment: Fragment) -> OutlineCoverage {
    let place = fragment.seen.xy / fragment.seen.z;
    let across = dpdx(place);
    let along = dpdy(place);
    if fragment.outline.y == 0u {
        var whole: OutlineCoverage;
        whole.is_inside = true;
        whole.share = 1.0;
        return whole;
    }
    var rows: OutlineRows;
    rows.x = fragment.row_x;
    rows.y = fragment.row_y;
    rows.w = fragment.row_w;
    return outline_coverage(fragment.outline.x, rows, place, across, along);
}

fn fragment_samples(fragment: Fragment) -> u32 {
    let place = fragment.seen.xy / fragment.seen.z;
    let across = dpdx(place);
    let along = dpdy(place);
    if fragment.outline.y == 0u {
        return 15u;
    }
    var rows: OutlineRows;
    rows.x = fragment.row_x;
    rows.y = fragment.row_y;
    rows.w = fragment.row_w;
    return outline_samples(fragment.outline.x, rows, place, across, along);
}
