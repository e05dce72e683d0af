// What a hull's vertex says for relief. Needs: instance, paint, relief.

struct ReliefVertex {
    // On the hull, and where the ray is nearest to P(v): what is shown where no view saw what the ray meets.
    place: vec3f,
    point: vec3f,
    // The four views nearest to the eye, and those that see the face, six bits each.
    views: vec2u,
    weights: vec4f,
    own_weights: vec4f,
    // Third and fourth clip coordinate of the place, and of the way from the eye to it.
    clip: vec4f,
}

fn relief_vertex(corner: Corner, instance: Instance) -> ReliefVertex {
    let own = paint_shares(corner, instance.eye, PAINT_BLENDED);
    let nearest = relief_views(corner, instance.eye);
    var way = -instance.eye.xyz;
    if instance.eye.w > 0.5 {
        way = corner.position - instance.eye.xyz;
    }
    let matrix = mat4x4f(instance.clip_x, instance.clip_y, instance.clip_z, instance.clip_w);
    var out: ReliefVertex;
    out.place = corner.position;
    out.point = paint_on_ray(corner, instance.eye);
    out.views = vec2u(relief_packed(nearest.views), relief_packed(vec4u(own.views, 0u)));
    out.weights = vec4f(nearest.weights, 0.0);
    out.own_weights = own.weights;
    out.clip = vec4f((matrix * vec4f(corner.position, 1.0)).zw, (matrix * vec4f(way, 0.0)).zw);
    return out;
}

fn relief_packed(views: vec4u) -> u32 {
    return views.x | views.y << 6u | views.z << 12u | views.w << 18u;
}
