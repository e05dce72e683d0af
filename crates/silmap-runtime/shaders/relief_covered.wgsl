// The hull's vertices for relief, where a function of the outline clips them. Needs: outline, instance, paint, relief, relief_vertex,
// hull_coverage.

struct Fragment {
    @invariant @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) atlas_uv: vec2f,
    @location(2) place: vec3f,
    @location(3) point: vec3f,
    @location(4) clip: vec4f,
    @location(5) @interpolate(flat, either) eye: vec4f,
    @location(6) @interpolate(flat, either) views: vec2u,
    @location(7) @interpolate(flat, either) weights: vec4f,
    @location(8) @interpolate(flat, either) own_weights: vec4f,
    // Where the point is seen in the picture of the outline, homogeneous.
    @location(9) seen: vec3f,
    @location(10) @interpolate(flat, either) row_x: vec4f,
    @location(11) @interpolate(flat, either) row_y: vec4f,
    @location(12) @interpolate(flat, either) row_w: vec4f,
    @location(13) @interpolate(flat, either) outline: vec2u,
    @location(14) @interpolate(flat, either) light: vec4f,
}

@vertex
fn vs_main(corner: Corner, instance: Instance) -> Fragment {
    var out: Fragment;
    out.position = instance_clip(instance, corner.position);
    fill_relief(&out, corner, instance);
    fill_outline(&out, corner, instance);
    return out;
}
