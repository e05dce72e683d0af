// Outlines as triangle fans, for their effect on the stencil. Needs: outline, instance.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.1.
// Deviation: the loops are in space and are projected here, so that an outline that is kept costs nothing.

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, instance: Instance) -> @builtin(position) vec4f {
    let start = instance.outline.x;
    let edge = vertex / 3u;
    let corner = vertex % 3u;
    let nowhere = vec4f(0.0, 0.0, 0.5, 1.0);
    if edge >= instance.outline.y {
        return nowhere;
    }
    let first = outline_point(start, edge);
    if first.w == OUTLINE_NO_EDGE {
        return nowhere;
    }
    let index = select(select(edge, edge + 1u, corner == 2u), first.w, corner == 0u);
    let point = bitcast<vec3f>(outline_point(start, index).xyz);
    let clip = instance_clip(instance, point);
    // Neither the near plane nor the far one cuts a fan.
    return vec4f(clip.xy, 0.5 * clip.w, clip.w);
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(0.0);
}
