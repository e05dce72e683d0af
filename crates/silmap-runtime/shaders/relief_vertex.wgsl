// What a hull's vertex says for relief. Needs: instance, paint, relief, relief_plain or relief_covered.

// Of a fragment: its place on the hull; the point where the ray is nearest to P(v), shown where no view saw what the ray meets; the four views
// nearest to the eye and those that see the face, six bits each, with their weights; third and fourth clip coordinate of the place, and of the way
// from the eye to it.
fn fill_relief(out: ptr<function, Fragment>, corner: Corner, instance: Instance) {
    let own = paint_shares(corner, instance.eye, PAINT_BLENDED);
    let nearest = relief_views(corner, instance.eye);
    var way = -instance.eye.xyz;
    if instance.eye.w > 0.5 {
        way = corner.position - instance.eye.xyz;
    }
    let matrix = mat4x4f(instance.clip_x, instance.clip_y, instance.clip_z, instance.clip_w);
    (*out).normal = corner.normal;
    (*out).atlas_uv = corner.atlas_uv;
    (*out).place = corner.position;
    (*out).point = paint_on_ray(corner, instance.eye);
    (*out).clip = vec4f((matrix * vec4f(corner.position, 1.0)).zw, (matrix * vec4f(way, 0.0)).zw);
    (*out).eye = instance.eye;
    (*out).views = vec2u(relief_packed(nearest.views), relief_packed(vec4u(own.views, 0u)));
    (*out).weights = vec4f(nearest.weights, 0.0);
    (*out).own_weights = own.weights;
    (*out).light = instance.light;
}

fn relief_packed(views: vec4u) -> u32 {
    return views.x | (views.y << 6u) | (views.z << 12u) | (views.w << 18u);
}
