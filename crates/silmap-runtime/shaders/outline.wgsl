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

// What the grid says of a place: 0 outside, 1 inside, 2 near the border.
fn outline_cell(start: u32, place: vec2f) -> u32 {
    if max(abs(place.x), abs(place.y)) >= 1.0 {
        return 0u;
    }
    let count = outline_texel(start).z;
    let share = place * 0.5 + 0.5;
    let column = min(u32(share.x * f32(count)), count - 1u);
    let row = min(u32(share.y * f32(count)), count - 1u);
    let cell = row * count + column;
    let cells = outline_texel(start + outline_texel(start + 1u).z + cell / 64u);
    return (cells[(cell % 64u) / 16u] >> (2u * (cell % 16u))) & 3u;
}

// The edges of the band that a place is in, from one number to before another.
fn outline_band(start: u32, place: vec2f) -> vec2u {
    let count = outline_texel(start).y;
    let starts = start + outline_texel(start + 1u).x;
    let band = min(u32((place.y * 0.5 + 0.5) * f32(count)), count - 1u);
    return vec2u(outline_half(starts, band), outline_half(starts, band + 1u));
}

// By how much an edge changes the winding about the origin: edges that cross the half-line to the right.
fn outline_turn(a: vec2f, b: vec2f) -> i32 {
    if (a.y <= 0.0) == (b.y <= 0.0) {
        return 0;
    }
    let is_up = b.y > a.y;
    let is_right = (a.x * b.y - a.y * b.x > 0.0) == is_up;
    return select(0, select(-1, 1, is_up), is_right);
}

// How an outline covers the pixel that is seen at `place` of the rows' picture, whose neighbours to the right and below are seen
// `across` and `along` from it.
fn outline_coverage(start: u32, rows: OutlineRows, place: vec2f, across: vec2f, along: vec2f) -> OutlineCoverage {
    var covered: OutlineCoverage;
    let state = outline_cell(start, place);
    covered.is_inside = state == 1u;
    covered.share = f32(state);
    if state != 2u {
        return covered;
    }
    // To pixels.
    let area = across.x * along.y - across.y * along.x;
    let px_x = vec2f(along.y, -along.x) / area;
    let px_y = vec2f(-across.y, across.x) / area;
    let edges = start + outline_texel(start + 1u).y;
    let band = outline_band(start, place);
    var winding = 0;
    var nearest = 1e30;
    for (var k = band.x; k < band.y; k++) {
        let edge = outline_half(edges, k);
        let a = outline_seen(start, edge, rows) - place;
        let b = outline_seen(start, edge + 1u, rows) - place;
        winding += outline_turn(a, b);
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

// Which of the four samples of a pixel are inside, a bit each. Samples are where every interface has them, in sixteenths of a pixel:
// (−2, −6), (6, −2), (−6, 2), (2, 6) from the middle, y down.
fn outline_samples(start: u32, rows: OutlineRows, place: vec2f, across: vec2f, along: vec2f) -> u32 {
    let state = outline_cell(start, place);
    if state != 2u {
        return select(0u, 15u, state == 1u);
    }
    let a_step = across / 16.0;
    let b_step = along / 16.0;
    let first = place - 2.0 * a_step - 6.0 * b_step;
    let second = place + 6.0 * a_step - 2.0 * b_step;
    let third = place - 6.0 * a_step + 2.0 * b_step;
    let fourth = place + 2.0 * a_step + 6.0 * b_step;
    let edges = start + outline_texel(start + 1u).y;
    let band = outline_band(start, place);
    var windings = vec4i(0);
    for (var k = band.x; k < band.y; k++) {
        let edge = outline_half(edges, k);
        let a = outline_seen(start, edge, rows);
        let b = outline_seen(start, edge + 1u, rows);
        windings += vec4i(
            outline_turn(a - first, b - first),
            outline_turn(a - second, b - second),
            outline_turn(a - third, b - third),
            outline_turn(a - fourth, b - fourth),
        );
    }
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), windings != vec4i(0));
    return bits.x | bits.y | bits.z | bits.w;
}

// Number `index` of those that begin at a texel.
fn outline_half(first: u32, index: u32) -> u32 {
    let texel = outline_texel(first + index / 8u);
    return (texel[(index % 8u) / 2u] >> (16u * (index % 2u))) & 0xffffu;
}

// Where a point is seen in the rows' picture.
fn outline_seen(start: u32, index: u32, rows: OutlineRows) -> vec2f {
    let point = vec4f(bitcast<vec3f>(outline_point(start, index).xyz), 1.0);
    return vec2f(dot(rows.x, point), dot(rows.y, point)) / dot(rows.w, point);
}
