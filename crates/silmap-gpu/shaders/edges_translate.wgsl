// The layer behind, filled, pulled towards the eye: it comes to lie before the nearest layer next to silhouettes.
// Needs: shared/view, shared/soup.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999, section 4, "Translated back-facing polygons": the
// model scaled about the camera. With a scale of one, the basic method of section 3.

struct InkFragment {
    @builtin(position) @invariant position: vec4f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, face: SoupFace) -> InkFragment {
    let corner = soup_corner(face, vertex_ix);
    let there = view.clip_from_object * vec4f(corner, 1.0);
    let forward = mix(edge_lines.eye_in_object, corner, edge_lines.depth_scale);
    let nearer = view.clip_from_object * vec4f(forward, 1.0);
    var out: InkFragment;
    out.position = there;
    if edge_lines.depth_scale < 1.0 {
        // The same place in the image, to the last digit; what passes the near plane stays on it.
        out.position.z = clamp(nearer.z / nearer.w, 0.0, 1.0) * there.w;
    }
    if !soup_is_far(face) {
        out.position = soup_nowhere;
    }
    return out;
}

@fragment
fn fs_main(fragment: InkFragment) -> @location(0) vec4f {
    return vec4f(0.0, 0.0, 0.0, 1.0);
}
