// Brings two drawn pictures of the same size into the window: the left one up to a column, the right one from there on, in the same place or
// beside the left one.

struct Placement {
    // The picture's top left pixel in the window.
    origin_px: vec2<f32>,
    // The column of the picture at which the right one begins.
    split_px: f32,
    // How far to the right of the left picture the right one lies.
    shift_px: f32,
    // 1 where the window takes encoded colours, 0 where it encodes by itself; four times, for WebGL2 takes whole sixteen bytes.
    encodes: vec4<f32>,
}

@group(0) @binding(0) var<uniform> placement: Placement;
@group(0) @binding(1) var left: texture_2d<f32>;
@group(0) @binding(2) var right: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0);
}

fn encoded(linear: vec3<f32>) -> vec3<f32> {
    let low = linear * 12.92;
    let high = 1.055 * pow(linear, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3<f32>(0.0031308));
}

@fragment
fn place(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(floor(position.xy - placement.origin_px));
    let last = vec2<i32>(textureDimensions(left)) - 1;
    var colour = textureLoad(left, clamp(at, vec2<i32>(0), last), 0);
    if f32(at.x) + 0.5 > placement.split_px {
        let beside = at - vec2<i32>(i32(placement.shift_px), 0);
        colour = textureLoad(right, clamp(beside, vec2<i32>(0), last), 0);
    }
    return vec4<f32>(select(colour.rgb, encoded(colour.rgb), placement.encodes.x > 0.5), 1.0);
}
