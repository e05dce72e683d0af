// The layer behind, each face fattened by the same width in the image; for charcoal the grazing faces of the nearest
// layer too. Needs: shared/view, shared/soup.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999, section 4, "View-dependent modification" and
// "Charcoal rendering".
// Deviations: the paper moves an edge in the face's plane by z·sin α/(V·N), taken at one point of the face; here it is moved
// in the image, which is the same width at every point, and takes the depth that the plane has there. How steeply that
// depth may change is limited, since a face seen edge-on has none. A corner is rounded by two triangles, where one, as in
// the paper, leaves lines thinner around it.

struct FatFragment {
    @builtin(position) position: vec4f,
    @location(0) grey: f32,
}

// Slope of a fattened face, as depth over width, that is the most.
const steepest = 16.0;

// A point in the image, pixels, with its depth.
fn image_of(corner: vec3f) -> vec3f {
    let clip = view.clip_from_object * vec4f(corner, 1.0);
    let ndc = clip.xyz / clip.w;
    return vec3f((ndc.xy * vec2f(0.5, -0.5) + 0.5) * view.size_px, ndc.z);
}

// Unit vector across the edge from p to q, away from r.
fn outwards(p: vec2f, q: vec2f, r: vec2f) -> vec2f {
    let u = q - p;
    let n = vec2f(u.y, -u.x) / max(length(u), 1e-6);
    return select(n, -n, dot(n, r - p) > 0.0);
}

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32, face: SoupFace) -> FatFragment {
    // Triangle t joins the middle with rim points t and t + 1. Of edge e, rim points 3e and 3e + 1 are its ends moved out,
    // and 3e + 2 is its end moved out half way to the next edge's direction.
    let rim_ix = (vertex_ix / 3u + (vertex_ix % 3u) / 2u) % 9u;
    let edge_ix = rim_ix / 3u;
    let corner_ix = select((edge_ix + 1u) % 3u, edge_ix, rim_ix % 3u == 0u);
    let start = image_of(soup_corner(face, edge_ix));
    let end = image_of(soup_corner(face, (edge_ix + 1u) % 3u));
    let other = image_of(soup_corner(face, (edge_ix + 2u) % 3u));
    let here = select(end, start, rim_ix % 3u == 0u);
    let middle = (start + end + other) / 3.0;

    var out_px = outwards(start.xy, end.xy, other.xy);
    if rim_ix % 3u == 2u {
        let both = out_px + outwards(end.xy, other.xy, start.xy);
        // In a corner that is no more than a line the two directions cancel.
        let along = select(both, here.xy - middle.xy, length(both) < 0.1);
        out_px = along / max(length(along), 1e-6);
    }
    // Change of depth per pixel along the plane, in the direction moved to.
    let u = end - start;
    let v = other - start;
    let double_area = u.x * v.y - u.y * v.x;
    let gradient = vec2f(u.z * v.y - v.z * u.y, v.z * u.x - u.z * v.x) / select(double_area, 1e-9, abs(double_area) < 1e-9);
    let here_w = (view.clip_from_object * vec4f(soup_corner(face, corner_ix), 1.0)).w;
    let most = steepest * edge_lines.slope_depth / here_w;
    let slope = clamp(dot(gradient, out_px), -most, most);

    var point = here + vec3f(out_px, slope) * edge_lines.width_px;
    var grey = soup_colour(face, corner_ix, 0.0);
    if vertex_ix % 3u == 0u {
        point = middle;
        grey = (soup_colour(face, 0u, 0.0) + soup_colour(face, 1u, 0.0) + soup_colour(face, 2u, 0.0)) / 3.0;
    }
    var out: FatFragment;
    out.position = view_clip_from_image(point.xy);
    out.position.z = clamp(point.z, 0.0, 1.0);
    out.grey = grey;

    let cross_face = cross(face.b - face.a, face.c - face.a);
    let to_eye = edge_lines.eye_in_object - face.a;
    let cosine = abs(soup_side(face)) / max(length(cross_face) * length(to_eye), 1e-30);
    let is_stroke = edge_lines.charcoal > 0.5 && cosine < soup_grazing && soup_is_near(face);
    if !(soup_is_far(face) || is_stroke) {
        out.position = soup_nowhere;
    }
    return out;
}

@fragment
fn fs_main(fragment: FatFragment) -> @location(0) vec4f {
    return vec4f(vec3f(fragment.grey), 1.0);
}
