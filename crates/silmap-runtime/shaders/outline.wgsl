// Outlines in space, as `curve.rs` lays them out, and how far one covers a pixel.

const OUTLINE_NO_EDGE: u32 = 0xffffffffu;
const OUTLINE_HEADER: u32 = 3u;
const OUTLINE_ROOM: f32 = 1.02;

@group(0) @binding(0) var outline_texels: texture_2d<u32>;

fn outline_texel(index: u32) -> vec4u {
    return textureLoad(outline_texels, vec2i(i32(index & 1023u), i32(index >> 10u)), 0);
}

fn outline_point(start: u32, index: u32) -> vec4u {
    return outline_texel(start + OUTLINE_HEADER + index);
}

// The picture of an eye in which the sphere about `center` fills the square from −1 to 1: (x·w, y·w, w) of a point are the products of
// the rows with it.
struct OutlineRows {
    x: vec4f,
    y: vec4f,
    w: vec4f,
}

fn outline_rows(start: u32, eye: vec4f, center: vec3f, radius: f32) -> OutlineRows {
    let sorted_right = bitcast<vec3f>(outline_texel(start + 2u).xyz);
    var forward = -eye.xyz;
    var scale = 1.0 / (OUTLINE_ROOM * radius);
    var rows: OutlineRows;
    rows.w = vec4f(0.0, 0.0, 0.0, 1.0);
    if eye.w > 0.5 {
        let arm = center - eye.xyz;
        let distance = length(arm);
        forward = arm / distance;
        scale = sqrt(max(distance * distance - radius * radius, 0.0)) / (radius * OUTLINE_ROOM);
        rows.w = vec4f(forward, -dot(forward, eye.xyz));
    }
    let right = normalize(sorted_right - forward * dot(sorted_right, forward));
    let up = cross(right, forward);
    rows.x = vec4f(right, -dot(right, center)) * scale;
    rows.y = vec4f(up, -dot(up, center)) * scale;
    return rows;
}

struct OutlineCoverage {
    // Whether the outline winds about the pixel's centre.
    is_inside: bool,
    // How much of the pixel is covered, by distance.
    share: f32,
}

// How an outline covers the pixel that is seen at `place` of the rows' picture, whose neighbours to the right and below are seen
// `across` and `along` from it.
fn outline_coverage(start: u32, rows: OutlineRows, place: vec2f, across: vec2f, along: vec2f) -> OutlineCoverage {
    var covered: OutlineCoverage;
    covered.is_inside = false;
    covered.share = 0.0;
    if max(abs(place.x), abs(place.y)) >= 1.0 {
        return covered;
    }
    let counts = outline_texel(start);
    let parts = outline_texel(start + 1u);
    let share = place * 0.5 + 0.5;
    let column = min(u32(share.x * f32(counts.z)), counts.z - 1u);
    let row = min(u32(share.y * f32(counts.z)), counts.z - 1u);
    let cell = row * counts.z + column;
    let cells = outline_texel(start + parts.z + cell / 64u);
    let state = (cells[(cell % 64u) / 16u] >> (2u * (cell % 16u))) & 3u;
    if state != 2u {
        covered.is_inside = state == 1u;
        covered.share = f32(state);
        return covered;
    }
    // To pixels.
    let area = across.x * along.y - across.y * along.x;
    let px_x = vec2f(along.y, -along.x) / area;
    let px_y = vec2f(-across.y, across.x) / area;
    let band = min(u32(share.y * f32(counts.y)), counts.y - 1u);
    let first = outline_half(start + parts.x, band);
    let end = outline_half(start + parts.x, band + 1u);
    var winding = 0;
    var nearest = 1e30;
    for (var k = first; k < end; k++) {
        let edge = outline_half(start + parts.y, k);
        let a = outline_seen(start, edge, rows) - place;
        let b = outline_seen(start, edge + 1u, rows) - place;
        if (a.y <= 0.0) != (b.y <= 0.0) {
            // On which side of the edge the pixel is: to the left of its crossing with the row.
            let turn = a.x * b.y - a.y * b.x;
            let is_up = b.y > a.y;
            if (turn > 0.0) == is_up {
                winding += select(-1, 1, is_up);
            }
        }
        let p = vec2f(dot(a, px_x), dot(a, px_y));
        let q = vec2f(dot(b, px_x), dot(b, px_y));
        let edge_px = q - p;
        let s = clamp(-dot(p, edge_px) / max(dot(edge_px, edge_px), 1e-12), 0.0, 1.0);
        let to_edge = p + edge_px * s;
        nearest = min(nearest, dot(to_edge, to_edge));
    }
    covered.is_inside = winding != 0;
    let distance = sqrt(nearest);
    covered.share = clamp(select(0.5 - distance, 0.5 + distance, covered.is_inside), 0.0, 1.0);
    return covered;
}

fn outline_half(start: u32, index: u32) -> u32 {
    let texel = outline_texel(start + index / 8u);
    return (texel[(index % 8u) / 2u] >> (16u * (index % 2u))) & 0xffffu;
}

fn outline_seen(start: u32, index: u32, rows: OutlineRows) -> vec2f {
    let point = vec4f(bitcast<vec3f>(outline_point(start, index).xyz), 1.0);
    return vec2f(dot(rows.x, point), dot(rows.y, point)) / dot(rows.w, point);
}
