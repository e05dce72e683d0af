// The colour of a hull's fragment, whichever vertices it is between. Needs: paint, light, hull_plain or hull_covered.

struct Painted {
    colour: vec3f,
}

fn fragment_paint(fragment: Fragment) -> Painted {
    // Before all branches: neighbours have to take part.
    let place_a = paint_place(fragment.point_a);
    let place_b = paint_place(fragment.point_b);
    let place_c = paint_place(fragment.point_c);
    let views = fragment.views;
    let weights = fragment.weights;
    var colour = vec3f(0.0);
    if weights.x > 0.0 {
        colour += weights.x * hull_view_colour(fragment, place_a, views.x);
    }
    if weights.y > 0.0 {
        colour += weights.y * hull_view_colour(fragment, place_b, views.y);
    }
    if weights.z > 0.0 {
        colour += weights.z * hull_view_colour(fragment, place_c, views.z);
    }
    if weights.w > 0.0 {
        colour += weights.w * hull_own_colour(fragment, views.w);
    }
    return Painted(colour);
}

fn hull_view_colour(fragment: Fragment, place: PaintPlace, view: u32) -> vec3f {
    let colour = paint_view_colour(place, view);
    if !light_is_moved(fragment.light) {
        return colour;
    }
    let normal = light_view_normal(place.uv, view, fragment.atlas_uv, fragment.normal);
    return light_relit(colour, normal, fragment.light);
}

// What stands in for views where none sees the face.
fn hull_own_colour(fragment: Fragment, mode: u32) -> vec3f {
    let has_tiles = asset.counts.y != 0u && mode != PAINT_VIEWS && mode != PAINT_LIT;
    if !has_tiles {
        return light_lit(fragment.normal, fragment.light);
    }
    let colour = textureSampleLevel(paint_atlas, paint_sampler, fragment.atlas_uv, 0.0).rgb;
    if !light_is_moved(fragment.light) {
        return colour;
    }
    return light_relit(colour, light_atlas_normal(fragment.atlas_uv, fragment.normal), fragment.light);
}
