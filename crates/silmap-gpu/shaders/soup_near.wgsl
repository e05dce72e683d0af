// The nearest layer of faces: white, or grey for charcoal. Needs: shared/view, shared/soup.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999, section 3 and "Charcoal rendering".

struct NearFragment {
    @builtin(position) @invariant position: vec4f,
    @location(0) grey: f32,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, face: SoupFace) -> NearFragment {
    var out: NearFragment;
    out.position = view.clip_from_object * vec4f(soup_corner(face, vertex_ix), 1.0);
    if !soup_is_near(face) {
        out.position = soup_nowhere;
    }
    out.grey = soup_colour(face, vertex_ix, 1.0);
    return out;
}

@fragment
fn fs_main(fragment: NearFragment) -> @location(0) vec4f {
    return vec4f(vec3f(fragment.grey), 1.0);
}
