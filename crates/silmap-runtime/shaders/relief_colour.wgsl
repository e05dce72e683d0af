// The colour and the depth of a hull's fragment by relief. Needs: paint, light, relief, relief_plain or relief_covered.

struct Painted {
    colour: vec3f,
    depth: f32,
}

fn fragment_paint(fragment: Fragment) -> Painted {
    var way = -fragment.eye.xyz;
    if fragment.eye.w > 0.5 {
        way = fragment.place - fragment.eye.xyz;
    }
    let reach = length(way);
    let direction = way / reach;
    // Before all branches: neighbours have to take part.
    let across = dpdx(fragment.place);
    let along = dpdy(fragment.place);
    let pixel = max(length(cross(across, direction)), length(cross(along, direction)));
    let views = relief_unpacked(fragment.views.x);
    var rays: ReliefRays;
    rays.a = relief_ray(views.x, fragment.place, direction);
    rays.b = relief_ray(views.y, fragment.place, direction);
    rays.c = relief_ray(views.z, fragment.place, direction);
    rays.d = relief_ray(views.w, fragment.place, direction);
    let found = relief_find(rays, fragment.weights.xyz, fragment.place, direction);

    // Three views, the fourth in the place of the third where it saw more. Where none saw anything, those that see the hull's face, at P(v).
    let is_last = found.shares.w > found.shares.z;
    let third = select(views.z, views.w, is_last);
    var shares = vec4f(found.shares.xy, max(found.shares.z, found.shares.w), 0.0);
    var shown = vec3u(views.xy, third);
    var point = fragment.place + direction * found.t;
    let is_seen = shares.x + shares.y + shares.z > 0.1 * RELIEF_STAND_IN;
    if !is_seen {
        shares = fragment.own_weights;
        shown = relief_unpacked(fragment.views.y).xyz;
        point = fragment.point;
    }
    var sum: ReliefSum;
    relief_add(&sum, fragment, shown.x, point, pixel, shares.x, is_seen);
    relief_add(&sum, fragment, shown.y, point, pixel, shares.y, is_seen);
    relief_add(&sum, fragment, shown.z, point, pixel, shares.z, is_seen);
    if shares.w > 0.0 {
        relief_add_own(&sum, fragment, shares.w);
    }
    var painted: Painted;
    painted.colour = sum.colour.rgb / max(sum.colour.a, 1e-20);
    if light_is_moved(fragment.light) {
        painted.colour = light_relit(painted.colour, sum.normal, fragment.light);
    }
    var t = found.t;
    if !found.is_there {
        t = dot(fragment.point - fragment.place, direction);
    }
    let clip = fragment.clip.xy + fragment.clip.zw * (t / reach);
    painted.depth = clamp(clip.x / clip.y, 0.0, 1.0);
    return painted;
}

fn relief_unpacked(views: u32) -> vec4u {
    return (vec4u(views) >> vec4u(0u, 6u, 12u, 18u)) & vec4u(63u);
}

// Colours times their shares, and those; normals, as far as the light is moved.
struct ReliefSum {
    colour: vec4f,
    normal: vec3f,
}

// Adds what a view shows of a point, and the normal that it has there: where the view saw the point, by how squarely.
fn relief_add(
    sum: ptr<function, ReliefSum>,
    fragment: Fragment,
    view: u32,
    point: vec3f,
    pixel: f32,
    share: f32,
    is_seen: bool,
) {
    if share <= 0.0 {
        return;
    }
    let h = asset.texture_from_object[min(view, 63u)] * vec4f(point, 1.0);
    let uv = h.xy / h.z;
    let texel = asset.eyes[min(view, 63u)].w * h.z;
    let level = log2(max(pixel / texel, 1e-6)) - RELIEF_SHARPER;
    let colour = textureSampleLevel(paint_views, paint_sampler, uv, view, max(level, 0.0));
    let weight = share * select(1.0, colour.a * colour.a + RELIEF_LEAST_SQUARE, is_seen);
    (*sum).colour += vec4f(colour.rgb, 1.0) * weight;
    if light_is_moved(fragment.light) {
        (*sum).normal += weight * light_view_normal(uv, view, fragment.atlas_uv, fragment.normal);
    }
}

// Adds what stands in for views where none sees the face.
fn relief_add_own(sum: ptr<function, ReliefSum>, fragment: Fragment, share: f32) {
    var normal = fragment.normal;
    var colour = asset.albedo.rgb * paint_irradiance(normalize(normal));
    if asset.counts.y != 0u {
        colour = textureSampleLevel(paint_atlas, paint_sampler, fragment.atlas_uv, 0.0).rgb;
        normal = light_atlas_normal(fragment.atlas_uv, normal);
    }
    (*sum).colour += share * vec4f(colour, 1.0);
    (*sum).normal += share * normal;
}
