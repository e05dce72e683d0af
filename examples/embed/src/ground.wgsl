// A ground of chequered tiles that takes the sun's shadow.

struct Ground {
    clip_from_world: mat4x4f,
    light_from_world: mat4x4f,
}

@group(0) @binding(0) var<uniform> ground: Ground;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

const REACH: f32 = 400.0;
const SHADE: f32 = 0.3;

struct Fragment {
    @builtin(position) position: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Fragment {
    var corners = array(
        vec2f(-1.0, -1.0), vec2f(-1.0, 1.0), vec2f(1.0, -1.0), vec2f(1.0, -1.0), vec2f(-1.0, 1.0), vec2f(1.0, 1.0),
    );
    var out: Fragment;
    out.place = corners[vertex] * REACH;
    out.position = ground.clip_from_world * vec4f(out.place.x, 0.0, out.place.y, 1.0);
    return out;
}

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    let tile = vec2i(floor(fragment.place / 2.0));
    // Tiles fade where they are small on the screen.
    let sharp = 1.0 - smoothstep(0.1, 0.7, length(fwidth(fragment.place)));
    let colour = mix(0.27, select(0.22, 0.32, ((tile.x + tile.y) & 1) == 0), sharp);
    let light = ground.light_from_world * vec4f(fragment.place.x, 0.0, fragment.place.y, 1.0);
    let uv = vec2f(0.5, -0.5) * light.xy + 0.5;
    let texel = 1.0 / vec2f(textureDimensions(shadow_map));
    var lit = 0.0;
    for (var i = 0; i < 9; i++) {
        let off = vec2f(f32(i % 3 - 1), f32(i / 3 - 1)) * texel;
        lit += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + off, light.z) / 9.0;
    }
    let is_known = all(uv > vec2f(0.0)) && all(uv < vec2f(1.0)) && light.z < 1.0;
    return vec4f(vec3f(0.95, 1.0, 0.9) * colour * mix(SHADE, 1.0, select(1.0, lit, is_known)), 1.0);
}
