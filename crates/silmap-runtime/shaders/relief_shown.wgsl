// What a hull's fragment leaves in the pass, its depth included. Needs: relief_colour.

struct Shown {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

fn shown(painted: Painted, share: f32) -> Shown {
    return Shown(vec4f(painted.colour, 1.0) * share, painted.depth);
}

// With the depth of the hull, wherever the colour is from.
fn shown_on_hull(fragment: Fragment, colour: vec4f) -> Shown {
    return Shown(colour, fragment.position.z);
}
