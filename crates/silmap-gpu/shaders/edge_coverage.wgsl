// Coverage near the outline, from the distance to its nearest segment. Needs: shared/view.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.3: the contour again as an antialiased polyline into alpha.
// Deviation: the ramp is one pixel wide and centred on the outline, ½ + d inside and ½ − d outside; minimum and maximum
// blending make the nearest segment win, so corners have no seams and the order of segments does not matter.

// Coverage on the segment itself.
override at_edge: f32 = 0.5;
// Change of coverage per pixel of distance: +1 inside, −1 outside and for lines.
override slope: f32 = -1.0;

struct EdgeFragment {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) segment: vec4f,
    @location(1) point_px: vec2f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, @location(0) segment: vec4f) -> EdgeFragment {
    let along = segment.zw - segment.xy;
    let t = along / max(length(along), 1e-6);
    let n = vec2f(-t.y, t.x);
    // Past this distance the ramp has ended, and a pixel centre has room to spare.
    let reach = max(at_edge, 1.0 - at_edge) + 0.5;
    // Two triangles over the start and end of both sides: s e S, e S E.
    let is_end = (vertex_ix & 1u) == 1u;
    let is_left = (vertex_ix == 2u) || (vertex_ix >= 4u);
    let base = select(segment.xy - t * reach, segment.zw + t * reach, is_end);
    let point_px = base + n * select(-reach, reach, is_left);
    var out: EdgeFragment;
    out.position = view_clip_from_image(point_px);
    out.segment = segment;
    out.point_px = point_px;
    return out;
}

@fragment
fn fs_main(fragment: EdgeFragment) -> @location(0) vec4f {
    let a = fragment.segment.xy;
    let along = fragment.segment.zw - a;
    let to_point = fragment.point_px - a;
    let s = clamp(dot(to_point, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    let distance_px = length(to_point - along * s);
    return vec4f(clamp(at_edge + slope * distance_px, 0.0, 1.0));
}
