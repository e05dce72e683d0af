// Where the clip mask is wrong: red where it covers too much, blue where it covers too little. Needs: shared/screen.

@group(1) @binding(0) var predicted_image: texture_2d<f32>;
@group(1) @binding(1) var true_image: texture_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32) -> @builtin(position) vec4f {
    return screen_corner(vertex_ix);
}

@fragment
fn fs_main(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let is_predicted = textureLoad(predicted_image, pixel, 0).r > 0.5;
    let is_true = textureLoad(true_image, pixel, 0).r > 0.5;
    if is_predicted == is_true {
        discard;
    }
    return select(vec4f(0.05, 0.15, 1.0, 1.0), vec4f(1.0, 0.03, 0.02, 1.0), is_predicted);
}
