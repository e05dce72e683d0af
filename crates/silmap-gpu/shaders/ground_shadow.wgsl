// A shadow on the ground: black, by the share of a few lookups in a light's depth image that something stands before.
// Nothing is below the ground, so whatever has a depth there casts a shadow.

struct Ground {
    // Where the corners of the light's picture fall on the ground, in clip space: at (−1, −1), (1, −1), (−1, 1), (1, 1).
    corners: array<vec4f, 4>,
    // Alpha of a full shadow.
    strength: f32,
    // A texel of the depth image, in texture coordinates.
    texel: f32,
    // Unused.
    room: vec2f,
}

@group(1) @binding(0) var<uniform> ground: Ground;
@group(1) @binding(1) var ground_depths: texture_depth_2d;
@group(1) @binding(2) var ground_sampler: sampler_comparison;

// Nearer than nothing, farther than anything.
const ground_far = 0.999;

struct GroundFragment {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32) -> GroundFragment {
    let clip = ground.corners[vertex_ix];
    var out: GroundFragment;
    // Neither the near plane nor the far one cuts the ground.
    out.position = vec4f(clip.xy, 0.5 * clip.w, clip.w);
    out.uv = vec2f(f32(vertex_ix & 1u), 1.0 - f32(vertex_ix >> 1u));
    return out;
}

@fragment
fn fs_main(fragment: GroundFragment) -> @location(0) vec4f {
    var lit = 0.0;
    for (var y = 0; y < 4; y++) {
        for (var x = 0; x < 4; x++) {
            let aside = (vec2f(f32(x), f32(y)) - 1.5) * ground.texel;
            lit += textureSampleCompareLevel(ground_depths, ground_sampler, fragment.uv + aside, ground_far);
        }
    }
    return vec4f(0.0, 0.0, 0.0, ground.strength * (1.0 - lit / 16.0));
}
