// What a function of the outline needs of a hull's vertex, and how the outline covers a fragment, whatever the hull shows. Needs: outline,
// instance, paint, hull_covered or relief_covered.

fn fill_outline(out: ptr<function, Fragment>, corner: Corner, instance: Instance) {
    let rows = outline_rows(instance.outline.x, instance.eye, instance.sphere.xyz, instance.sphere.w);
    let point = vec4f(corner.position, 1.0);
    (*out).seen = vec3f(dot(rows.x, point), dot(rows.y, point), dot(rows.w, point));
    (*out).row_x = rows.x;
    (*out).row_y = rows.y;
    (*out).row_w = rows.w;
    (*out).outline = instance.outline.xy;
}

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
