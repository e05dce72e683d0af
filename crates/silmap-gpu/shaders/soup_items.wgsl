// The number of the nearest face at each pixel, a byte a channel. Needs: shared/view, shared/soup.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999: polygons without a consistent order of vertices.

struct ItemFragment {
    @builtin(position) @invariant position: vec4f,
    @location(0) @interpolate(flat, either) item: u32,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, face: SoupFace) -> ItemFragment {
    var out: ItemFragment;
    out.position = view.clip_from_object * vec4f(soup_corner(face, vertex_ix), 1.0);
    out.item = face.tag;
    return out;
}

@fragment
fn fs_main(fragment: ItemFragment) -> @location(0) vec4f {
    let item = vec4u(fragment.item) >> vec4u(0u, 8u, 16u, 24u);
    return vec4f(item & vec4u(255u)) / 255.0;
}
