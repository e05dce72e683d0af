// Where an eye's ray meets the model, by the depths of the texture views nearest to the eye, and its colour there. Needs: paint.
//
// A view says of every point whether it is in front of what the view saw, and then it is outside of the model, or not. The ray is followed
// inwards until none of the views says outside. What it meets there was seen by the views whose depth is that of the point.
// Source: Policarpo, Oliveira, Comba. Real-Time Relief Mapping on Arbitrary Polygonal Surfaces. I3D 2005, for the search in steps and its
// refinement; Debevec, Yu, Borshukov. Efficient View-Dependent Image-Based Rendering with Projective Texture-Mapping. EGWR 1998, for views
// that stand for one another.
// Deviation: views are asked together, so that what one does not see is decided by those that do, and steps are as long as the gap that is
// left, as its slope foretells.

@group(1) @binding(4) var relief_depths: texture_2d_array<f32>;
@group(1) @binding(5) var relief_sampler: sampler;

// The quality: of how many views, two to four, and in how many steps at most.
override RELIEF_VIEWS: u32 = 3u;
override RELIEF_STEPS: u32 = 48u;

// In bounding radii of the hull: how near to a surface is on it, how far a step goes at most, and how far behind what a view saw a point
// is no longer what it saw.
const RELIEF_NEAR: f32 = 0.001;
const RELIEF_STEP: f32 = 0.03;
const RELIEF_LEAST_RATE: f32 = 0.7;
const RELIEF_LEAST_STEP: f32 = 0.015;
const RELIEF_SEEN: f32 = 0.012;
// Depths from here on say that nothing is seen, and how far nothing is seen around, in widths of the picture; what is below all depths.
const RELIEF_NOTHING: f32 = 2.0;
const RELIEF_ALWAYS: f32 = -9.0;
// A view sees a ray move at other speeds than at its start.
const RELIEF_CAREFUL: f32 = 0.8;
// Weight of a view that is not of the nearest three, where those saw nothing.
const RELIEF_STAND_IN: f32 = 1e-3;
// Least weight of a view that saw a place, however aslant.
const RELIEF_LEAST_SQUARE: f32 = 1e-3;
// By how many smaller versions of a picture a fragment's is larger than its footprint asks for, which is that of a view head on.
const RELIEF_SHARPER: f32 = 0.5;

// The four views nearest to the eye, nearest first, and the weights of the first three.
struct ReliefViews {
    views: vec4u,
    weights: vec3f,
}

fn relief_views(corner: Corner, eye: vec4f) -> ReliefViews {
    var to_eye = eye.xyz;
    if eye.w > 0.5 {
        to_eye = eye.xyz - corner.middle;
    }
    let direction = normalize(to_eye);
    var nearest = PAINT_NONE_NEAR;
    for (var view = 0u; view < asset.counts.x; view++) {
        let to_view = asset.eyes[view].xyz - corner.middle;
        paint_take(&nearest, view, dot(to_view, direction) * inverseSqrt(dot(to_view, to_view)));
    }
    let weights = paint_weights(nearest.cosines);
    return ReliefViews(nearest.views, weights / max(weights.x + weights.y + weights.z, 1e-20));
}

// A ray in the homogeneous texture coordinates of a view; the fourth is the depth from the hull's middle, in its radii.
struct ReliefRay {
    view: u32,
    start: vec4f,
    along: vec4f,
}

fn relief_ray(view: u32, start: vec3f, direction: vec3f) -> ReliefRay {
    let matrix = asset.texture_from_object[min(view, 63u)];
    return ReliefRay(view, matrix * vec4f(start, 1.0), matrix * vec4f(direction, 0.0));
}

// The depth that a ray's view saw where it sees the ray's point.
fn relief_depth(ray: ReliefRay, t: f32) -> f32 {
    let h = ray.start.xyz + ray.along.xyz * t;
    return textureSampleLevel(relief_depths, relief_sampler, h.xy / h.z, ray.view, 0.0).x;
}

// How far along the ray its view sees the width of its picture, about its start.
fn relief_crossing(ray: ReliefRay) -> f32 {
    let z = ray.start.z;
    let speed = length(ray.along.xy * z - ray.start.xy * ray.along.z);
    return RELIEF_CAREFUL * z * z / max(speed, 1e-6 * z * z);
}

// The rays of the four views nearest to the eye.
struct ReliefRays {
    a: ReliefRay,
    b: ReliefRay,
    c: ReliefRay,
    d: ReliefRay,
}

fn relief_depths_at(rays: ReliefRays, t: f32) -> vec4f {
    var depths = vec4f(RELIEF_ALWAYS);
    depths.x = relief_depth(rays.a, t);
    depths.y = relief_depth(rays.b, t);
    if RELIEF_VIEWS > 2u {
        depths.z = relief_depth(rays.c, t);
    }
    if RELIEF_VIEWS > 3u {
        depths.w = relief_depth(rays.d, t);
    }
    return depths;
}

fn relief_most(v: vec4f) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// What a ray meets: how far along it, whether anything is there, and what each view's share of it is, by how much of it the view saw and
// how near the view is to the eye; all zero where none saw it.
struct ReliefFound {
    t: f32,
    is_there: bool,
    shares: vec4f,
}

fn relief_find(rays: ReliefRays, weights: vec3f, start: vec3f, direction: vec3f) -> ReliefFound {
    let first = vec4f(rays.a.start.w, rays.b.start.w, rays.c.start.w, rays.d.start.w);
    let rates = vec4f(rays.a.along.w, rays.b.along.w, rays.c.along.w, rays.d.along.w);
    let crossings = vec4f(relief_crossing(rays.a), relief_crossing(rays.b), relief_crossing(rays.c), relief_crossing(rays.d));
    let radius = asset.depth.x;
    // How far a gap takes to close where the surface is across the view.
    let reaches = 1.0 / max(rates, vec4f(RELIEF_LEAST_RATE / radius));
    // Where the ray leaves the sphere about the hull.
    let middle = -dot(start, direction);
    let leaves = middle + sqrt(max(middle * middle - dot(start, start) + radius * radius, 0.0));
    var t = 0.0;
    var gaps = vec4f(-1.0);
    var gap = -1.0;
    // The last place outside, and the first within once there is one.
    var low = 0.0;
    var gap_low = 1.0;
    var high = -1.0;
    var gap_high = -1.0;
    for (var k = 0u; k < RELIEF_STEPS; k++) {
        let depths = relief_depths_at(rays, t);
        gaps = depths - first - rates * t;
        gap = relief_most(gaps);
        if abs(gap) <= RELIEF_NEAR || t >= leaves || (gap < 0.0 && t <= 0.0) {
            break;
        }
        // A view that sees nothing there says how far it sees nothing. Of those that see something behind, as far as the nearest.
        let sees_nothing = depths > vec4f(RELIEF_NOTHING);
        let free = relief_most(select(vec4f(0.0), (depths - RELIEF_NOTHING) * crossings, sees_nothing));
        let is_behind = (gaps > vec4f(RELIEF_NEAR)) & !sees_nothing;
        let far = select(vec4f(-1e30), -gaps * reaches, is_behind);
        let step = max(clamp(-relief_most(far), RELIEF_LEAST_STEP * radius, RELIEF_STEP * radius), free);
        let is_outside = gap > 0.0;
        low = select(low, t, is_outside);
        gap_low = select(gap_low, min(gap, 1.0), is_outside);
        high = select(t, high, is_outside);
        gap_high = select(gap, gap_high, is_outside);
        let share = clamp(gap_low / (gap_low - gap_high), 0.2, 0.8);
        t = select(low + step, mix(low, high, share), high > 0.0);
        if high > 0.0 && high - low < 3.0 * RELIEF_NEAR * radius {
            break;
        }
    }
    var found: ReliefFound;
    found.t = t;
    found.is_there = high > 0.0 || gap <= 4.0 * RELIEF_NEAR;
    // Views that are aligned need not give way to the nearest as early as those on the hull: their mean has less noise.
    let seen = 1.0 - smoothstep(vec4f(RELIEF_SEEN), vec4f(2.0 * RELIEF_SEEN), abs(gaps));
    found.shares = select(vec4f(0.0), vec4f(sqrt(max(weights, vec3f(0.0))) + RELIEF_STAND_IN, RELIEF_STAND_IN) * seen, found.is_there);
    if RELIEF_VIEWS < 4u {
        found.shares.w = 0.0;
    }
    if RELIEF_VIEWS < 3u {
        found.shares.z = 0.0;
    }
    return found;
}
