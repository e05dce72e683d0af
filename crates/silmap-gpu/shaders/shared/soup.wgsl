// Faces one by one, each an instance with its three corners: no indices, no neighbours. Needs: shared/view.
// Source: Raskar, Cohen. Image Precision Silhouette Edges. I3D 1999.

struct EdgeLines {
    // The eye, in the space of the positions.
    eye_in_object: vec3f,
    // Width of lines, pixels.
    width_px: f32,
    // Factor on the distance from the eye of what is pulled forward.
    depth_scale: f32,
    // Change of depth that a slope of 1 makes in a pixel, times the distance along the viewing direction.
    slope_depth: f32,
    // 1 where faces are shaded in greys and lines drawn at grazing front faces too.
    charcoal: f32,
    // 1 where tags, not orientation, tell the nearest layer.
    by_tag: f32,
}

@group(1) @binding(0) var<uniform> edge_lines: EdgeLines;

struct SoupFace {
    @location(0) a: vec3f,
    @location(1) b: vec3f,
    @location(2) c: vec3f,
    @location(3) normal_a: vec4f,
    @location(4) normal_b: vec4f,
    @location(5) normal_c: vec4f,
    // With by_tag 1 behind the nearest layer, 0 elsewhere; otherwise unused. Where items are drawn, the item's number.
    @location(6) tag: u32,
}

// Outside of what is drawn.
const soup_nowhere = vec4f(0.0, 0.0, 2.0, 1.0);
// Largest cosine between normal and view of front faces that charcoal strokes follow.
const soup_grazing = 0.1;

fn soup_corner(face: SoupFace, corner_ix: u32) -> vec3f {
    return select(select(face.a, face.b, corner_ix == 1u), face.c, corner_ix == 2u);
}

fn soup_normal(face: SoupFace, corner_ix: u32) -> vec3f {
    let n = select(select(face.normal_a, face.normal_b, corner_ix == 1u), face.normal_c, corner_ix == 2u);
    return n.xyz;
}

// Positive for a face that shows its front, six times the volume that it spans with the eye.
fn soup_side(face: SoupFace) -> f32 {
    return dot(edge_lines.eye_in_object - face.a, cross(face.b - face.a, face.c - face.a));
}

fn soup_is_near(face: SoupFace) -> bool {
    return select(soup_side(face) > 0.0, face.tag == 0u, edge_lines.by_tag > 0.5);
}

fn soup_is_far(face: SoupFace) -> bool {
    return select(soup_side(face) <= 0.0, face.tag == 1u, edge_lines.by_tag > 0.5);
}

// Grey of a corner, linear: (1 + V·N)/3 of full white as encoded.
fn soup_grey(face: SoupFace, corner_ix: u32) -> f32 {
    let to_eye = edge_lines.eye_in_object - soup_corner(face, corner_ix);
    let n = soup_normal(face, corner_ix);
    let cosine = dot(to_eye, n) / max(length(to_eye) * length(n), 1e-20);
    return pow(clamp((1.0 + cosine) / 3.0, 0.0, 1.0), 2.2);
}

// Paper, ink, or for charcoal the grey of a corner.
fn soup_colour(face: SoupFace, corner_ix: u32, flat_colour: f32) -> f32 {
    return mix(flat_colour, soup_grey(face, corner_ix), edge_lines.charcoal);
}
