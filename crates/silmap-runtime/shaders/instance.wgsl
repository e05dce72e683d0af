// One instance of an asset: where it is, from where it is seen, and which outline clips it.

struct Instance {
    // From the object, relative to its hull's middle, to clip space.
    @location(6) clip_x: vec4f,
    @location(7) clip_y: vec4f,
    @location(8) clip_z: vec4f,
    @location(9) clip_w: vec4f,
    // The eye, with a 1; or the direction towards it, with a 0.
    @location(10) eye: vec4f,
    // First texel of the outline, its points or 0 where the hull is not clipped, what the hull shows, 0.
    @location(11) outline: vec4u,
    // Middle of the sphere about the model, relative to its hull's middle, and its radius.
    @location(12) sphere: vec4f,
    // Unit direction to a moved light, with a 1; or 0 where it has its own.
    @location(13) light: vec4f,
}

fn instance_clip(instance: Instance, point: vec3f) -> vec4f {
    return mat4x4f(instance.clip_x, instance.clip_y, instance.clip_z, instance.clip_w) * vec4f(point, 1.0);
}
