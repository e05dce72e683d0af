// The hull's vertices where a function of the outline clips them. Needs: outline, instance, paint, hull_coverage.

struct Fragment {
    @invariant @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) atlas_uv: vec2f,
    @location(2) point_a: vec3f,
    @location(3) point_b: vec3f,
    @location(4) point_c: vec3f,
    @location(5) @interpolate(flat, either) views: vec4u,
    @location(6) @interpolate(flat, either) weights: vec4f,
    // Where the point is seen in the picture of the outline, homogeneous.
    @location(7) seen: vec3f,
    @location(8) @interpolate(flat, either) row_x: vec4f,
    @location(9) @interpolate(flat, either) row_y: vec4f,
    @location(10) @interpolate(flat, either) row_w: vec4f,
    @location(11) @interpolate(flat, either) outline: vec2u,
    @location(12) @interpolate(flat, either) light: vec4f,
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
    fill_outline(&out, corner, instance);
    return out;
}
