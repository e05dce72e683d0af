// The coarse hull: its vertices, and its paint where a shader asks for it.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2. Points near P(v), not v, are projected into the texture views, in
// homogeneous coordinates, so that a picture lies on the plane through three points without a bend.
// Deviation: the point of the eye's ray through v that is nearest to P(v) is projected. It is P(v) but for what the hull's
// distance from the model moves it aside on the screen, so that an eye where the picture was taken sees the picture.

const HULL_ATLAS: u32 = 64u;

struct HullPaint {
    // Per texture view: (s·q, t·q, q) of a point of object space, (s, t) from the picture's top-left.
    texture_from_object: array<mat4x4f, 64>,
    // Linear colour of an unpainted hull.
    albedo: vec4f,
}

@group(2) @binding(0) var<uniform> hull_paint: HullPaint;
@group(2) @binding(1) var hull_views: texture_2d_array<f32>;
@group(2) @binding(2) var hull_atlas: texture_2d<f32>;
@group(2) @binding(3) var hull_sampler: sampler;

struct HullVertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) surface_point: vec3f,
    @location(3) atlas_uv: vec2f,
    // Three texture views, and HULL_ATLAS or what else stands in for them: lit.
    @location(4) sources: vec4u,
    // Their weights, the same at all corners of a face.
    @location(5) weights: vec4f,
}

struct HullFragment {
    @invariant @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) atlas_uv: vec2f,
    @location(2) point_a: vec3f,
    @location(3) point_b: vec3f,
    @location(4) point_c: vec3f,
    @location(5) @interpolate(flat, either) sources: vec4u,
    @location(6) @interpolate(flat, either) weights: vec4f,
}

// What a texture view shows at the point of a vertex, for an eye that sees the vertex.
fn hull_texture_point(point: vec3f, source: u32) -> vec3f {
    let projected = hull_paint.texture_from_object[min(source, 63u)] * vec4f(point, 1.0);
    return projected.xyz;
}

@vertex
fn vs_main(vertex: HullVertex) -> HullFragment {
    var out: HullFragment;
    out.position = view.clip_from_object * vec4f(vertex.position, 1.0);
    out.normal = vertex.normal;
    out.atlas_uv = vertex.atlas_uv;
    out.sources = vertex.sources;
    out.weights = vertex.weights;
    let ray = vertex.position - view.eye.xyz;
    let along = dot(vertex.surface_point - view.eye.xyz, ray) / max(dot(ray, ray), 1e-30);
    let point = view.eye.xyz + ray * along;
    out.point_a = hull_texture_point(point, vertex.sources.x);
    out.point_b = hull_texture_point(point, vertex.sources.y);
    out.point_c = hull_texture_point(point, vertex.sources.z);
    return out;
}

fn hull_view_colour(texture_point: vec3f, source: u32) -> vec3f {
    let uv = texture_point.xy / texture_point.z;
    return textureSampleLevel(hull_views, hull_sampler, uv, source, 0.0).rgb;
}

fn hull_colour(fragment: HullFragment) -> vec3f {
    let weights = fragment.weights;
    var painted = vec3f(0.0);
    if weights.x > 0.0 {
        painted += weights.x * hull_view_colour(fragment.point_a, fragment.sources.x);
    }
    if weights.y > 0.0 {
        painted += weights.y * hull_view_colour(fragment.point_b, fragment.sources.y);
    }
    if weights.z > 0.0 {
        painted += weights.z * hull_view_colour(fragment.point_c, fragment.sources.z);
    }
    var colour = painted * view.dim;
    if weights.w > 0.0 {
        if fragment.sources.w == HULL_ATLAS {
            let tile = textureSampleLevel(hull_atlas, hull_sampler, fragment.atlas_uv, 0.0).rgb;
            colour += weights.w * tile * view.dim;
        } else {
            colour += weights.w * hull_paint.albedo.rgb * view_irradiance(fragment.normal);
        }
    }
    return colour;
}
