// The edges of the layer behind as lines, at the depth of the edges. Needs: shared/view, shared/soup.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999, section 4, "Wireframe rendering".
// Deviation: a line reaches the whole width to either side of its edge, since at a silhouette the half over the nearest
// layer is hidden.

struct LineFragment {
    @builtin(position) position: vec4f,
}

fn pixel_of(clip: vec4f) -> vec2f {
    return (clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * view.size_px;
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, face: SoupFace) -> LineFragment {
    // Six vertices an edge, two triangles over the start and end of both sides: s e S, e S E.
    let edge_ix = vertex_ix / 6u;
    let side_ix = vertex_ix % 6u;
    let is_end = (side_ix & 1u) == 1u;
    let is_left = (side_ix == 2u) || (side_ix >= 4u);
    let start = view.clip_from_object * vec4f(soup_corner(face, edge_ix), 1.0);
    let end = view.clip_from_object * vec4f(soup_corner(face, (edge_ix + 1u) % 3u), 1.0);
    let along = pixel_of(end) - pixel_of(start);
    let n = vec2f(-along.y, along.x) / max(length(along), 1e-6);
    let here = select(start, end, is_end);
    let point_px = pixel_of(here) + n * select(-edge_lines.width_px, edge_lines.width_px, is_left);
    var out: LineFragment;
    out.position = view_clip_from_image(point_px);
    out.position.z = here.z / here.w;
    if !soup_is_far(face) {
        out.position = soup_nowhere;
    }
    return out;
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(0.0, 0.0, 0.0, 1.0);
}
