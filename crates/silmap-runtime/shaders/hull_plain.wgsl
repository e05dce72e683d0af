// The hull's vertices where no function of the outline clips them. Needs: instance, paint.

struct Fragment {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) atlas_uv: vec2f,
    @location(2) point_a: vec3f,
    @location(3) point_b: vec3f,
    @location(4) point_c: vec3f,
    @location(5) @interpolate(flat, either) views: vec4u,
    @location(6) @interpolate(flat, either) weights: vec4f,
    @location(7) @interpolate(flat, either) light: vec4f,
}

@vertex
fn vs_main(corner: Corner, instance: Instance) -> Fragment {
    let shares = paint_shares(corner, instance.eye, instance.outline.z);
    var out: Fragment;
    out.position = instance_clip(instance, corner.position);
    out.normal = corner.normal;
    out.atlas_uv = corner.atlas_uv;
    out.point_a = paint_point(corner, instance.eye, shares.views.x);
    out.point_b = paint_point(corner, instance.eye, shares.views.y);
    out.point_c = paint_point(corner, instance.eye, shares.views.z);
    out.views = vec4u(shares.views, instance.outline.z);
    out.weights = shares.weights;
    out.light = instance.light;
    return out;
}
