// The camera and the light of a frame.
// Lit colours are linear; the target encodes them.

struct View {
    clip_from_object: mat4x4f,
    // Unit directions to the two lights, object space, and their intensities.
    lights: array<vec4f, 2>,
    // Image size in pixels.
    size_px: vec2f,
    // Factor on the albedo where no light falls.
    ambient: f32,
    // Factor on everything: under 1 for a picture that is only a backdrop.
    dim: f32,
}

@group(0) @binding(0) var<uniform> view: View;

// Factor on the albedo of a surface with this normal (any length).
fn view_irradiance(normal: vec3f) -> f32 {
    let n = normal / max(length(normal), 1e-20);
    var sum = view.ambient;
    sum += view.lights[0].w * max(dot(n, view.lights[0].xyz), 0.0);
    sum += view.lights[1].w * max(dot(n, view.lights[1].xyz), 0.0);
    return sum * view.dim;
}

// Clip position of a point of the image, pixels from the top-left corner.
fn view_clip_from_image(point_px: vec2f) -> vec4f {
    let ndc = point_px / view.size_px * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    return vec4f(ndc, 0.0, 1.0);
}
