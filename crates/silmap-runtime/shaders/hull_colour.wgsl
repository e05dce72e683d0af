// The colour of a hull's fragment, whichever vertices it is between. Needs: paint, hull_plain or hull_covered.

struct Painted {
    colour: vec3f,
}

fn fragment_paint(fragment: Fragment) -> Painted {
    return Painted(paint_colour(
        fragment.point_a,
        fragment.point_b,
        fragment.point_c,
        fragment.views,
        fragment.weights,
        fragment.atlas_uv,
        fragment.normal,
    ));
}
