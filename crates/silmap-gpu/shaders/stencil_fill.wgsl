// Loops as triangle fans; only the stencil is touched. Needs: shared/view.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.1.

@vertex
fn vs_main(@location(0) point_px: vec2f) -> @builtin(position) vec4f {
    return view_clip_from_image(point_px);
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(0.0);
}
