// Outlines as triangles whose windings add up in the stencil. Needs: outline, instance.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.1.
// Deviation: the loops are in space and are projected here, so that an outline that is kept costs nothing; their triangles are those of
// `winding_triangles.rs`, not fans.

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, instance: Instance) -> @builtin(position) vec4f {
    let start = instance.outline.x;
    let middle = vertex / 3u;
    let corner = vertex % 3u;
    let nowhere = vec4f(0.0, 0.0, 0.5, 1.0);
    if middle >= instance.outline.y {
        return nowhere;
    }
    var texel = outline_point(start, middle);
    let after = texel.w & 0x7ffffffu;
    if texel.w == OUTLINE_NO_EDGE || after == 0u {
        return nowhere;
    }
    if corner == 0u {
        texel = outline_point(start, middle - (1u << (texel.w >> 27u)));
    } else if corner == 2u {
        texel = outline_point(start, middle + after);
    }
    let clip = instance_clip(instance, bitcast<vec3f>(texel.xyz));
    // Neither the near plane nor the far one cuts a triangle.
    return vec4f(clip.xy, 0.5 * clip.w, clip.w);
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(0.0);
}
