// The coarse hull: its vertices, and its paint where a shader asks for it.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2. P(v), not v, is projected into the texture view, in
// homogeneous coordinates, so that the picture lies on the plane through the three surface points without a bend.

const HULL_ATLAS: u32 = 64u;
const HULL_LIT: u32 = 65u;

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
    // Texture view of the face, HULL_ATLAS or HULL_LIT.
    @location(4) layer: u32,
}

struct HullFragment {
    @invariant @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) texture_point: vec3f,
    @location(2) @interpolate(flat, either) layer: u32,
}

@vertex
fn vs_main(vertex: HullVertex) -> HullFragment {
    var out: HullFragment;
    out.position = view.clip_from_object * vec4f(vertex.position, 1.0);
    out.normal = vertex.normal;
    out.layer = vertex.layer;
    out.texture_point = vec3f(vertex.atlas_uv, 1.0);
    if vertex.layer < HULL_ATLAS {
        let projected = hull_paint.texture_from_object[vertex.layer] * vec4f(vertex.surface_point, 1.0);
        out.texture_point = projected.xyz;
    }
    return out;
}

fn hull_colour(fragment: HullFragment) -> vec3f {
    let uv = fragment.texture_point.xy / fragment.texture_point.z;
    let from_view = textureSampleLevel(hull_views, hull_sampler, uv, min(fragment.layer, 63u), 0.0).rgb;
    let from_atlas = textureSampleLevel(hull_atlas, hull_sampler, uv, 0.0).rgb;
    let lit = hull_paint.albedo.rgb * view_irradiance(fragment.normal);
    let painted = select(from_atlas, from_view, fragment.layer < HULL_ATLAS) * view.dim;
    return select(painted, lit, fragment.layer == HULL_LIT);
}
