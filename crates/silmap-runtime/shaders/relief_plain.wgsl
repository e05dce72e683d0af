// The hull's vertices for relief, where no function of the outline clips them. Needs: instance, paint, relief, relief_vertex.

struct Fragment {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) atlas_uv: vec2f,
    @location(2) place: vec3f,
    @location(3) point: vec3f,
    @location(4) clip: vec4f,
    @location(5) @interpolate(flat, either) eye: vec4f,
    @location(6) @interpolate(flat, either) views: vec2u,
    @location(7) @interpolate(flat, either) weights: vec4f,
    @location(8) @interpolate(flat, either) own_weights: vec4f,
    @location(9) @interpolate(flat, either) light: vec4f,
}

@vertex
fn vs_main(corner: Corner, instance: Instance) -> Fragment {
    var out: Fragment;
    out.position = instance_clip(instance, corner.position);
    fill_relief(&out, corner, instance);
    return out;
}
