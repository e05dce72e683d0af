// A mesh, lit, in many places: what an engine draws where there is no silhouette map.

struct Scene {
    lights: array<vec4f, 2>,
    // Linear colour, and the factor on it where no light falls.
    albedo: vec4f,
}

@group(0) @binding(0) var<uniform> scene: Scene;

struct Fragment {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
}

@vertex
fn vs_main(
    @location(0) position: vec3f,
    @location(1) normal: vec4f,
    @location(2) clip_x: vec4f,
    @location(3) clip_y: vec4f,
    @location(4) clip_z: vec4f,
    @location(5) clip_w: vec4f,
) -> Fragment {
    var out: Fragment;
    out.position = mat4x4f(clip_x, clip_y, clip_z, clip_w) * vec4f(position, 1.0);
    out.normal = normal.xyz;
    return out;
}

@fragment
fn fs_main(fragment: Fragment) -> @location(0) vec4f {
    let n = normalize(fragment.normal);
    var light = scene.albedo.w;
    light += scene.lights[0].w * max(dot(n, scene.lights[0].xyz), 0.0);
    light += scene.lights[1].w * max(dot(n, scene.lights[1].xyz), 0.0);
    return vec4f(scene.albedo.rgb * light, 1.0);
}
