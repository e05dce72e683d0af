// One colour by a coverage, premultiplied. Needs: shared/screen.

struct Tint {
    // Linear, with alpha, not premultiplied.
    colour: vec4f,
}

@group(1) @binding(0) var coverage_image: texture_2d<f32>;
@group(1) @binding(1) var<uniform> tint: Tint;

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32) -> @builtin(position) vec4f {
    return screen_corner(vertex_ix);
}

@fragment
fn fs_main(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let coverage = textureLoad(coverage_image, vec2i(position.xy), 0).r;
    return vec4f(tint.colour.rgb, 1.0) * (tint.colour.a * coverage);
}
