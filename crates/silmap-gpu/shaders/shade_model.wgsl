// The full mesh in its own colours under the studio light. Needs: shared/view.
// Group 2: the material of the piece that is drawn.

struct ModelMaterial {
    // Linear colour factor.
    base_colour: vec4f,
}

@group(2) @binding(0) var<uniform> model_material: ModelMaterial;
@group(2) @binding(1) var model_texture: texture_2d<f32>;
@group(2) @binding(2) var model_sampler: sampler;

struct ModelVertex {
    @location(0) position: vec3f,
    @location(1) normal: vec4f,
    // Linear.
    @location(2) colour: vec4f,
    @location(3) uv: vec2f,
}

struct ModelFragment {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) colour: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_main(vertex: ModelVertex) -> ModelFragment {
    var out: ModelFragment;
    out.position = view.clip_from_object * vec4f(vertex.position, 1.0);
    out.normal = vertex.normal.xyz;
    out.colour = vertex.colour.rgb;
    out.uv = vertex.uv;
    return out;
}

@fragment
fn fs_main(fragment: ModelFragment) -> @location(0) vec4f {
    let texel = textureSample(model_texture, model_sampler, fragment.uv).rgb;
    let albedo = model_material.base_colour.rgb * fragment.colour * texel;
    return vec4f(albedo * view_irradiance(fragment.normal), 1.0);
}
