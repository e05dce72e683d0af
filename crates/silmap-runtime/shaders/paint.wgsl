// What the hull shows: up to three texture views that share a face, and tiles of the atlas or light where none sees it.
//
// The weights of views are as in `view_weights.rs` of `silmap-tests`, which they are tested against: 1/a − 1/t, a the distance
// between the directions from the face to a view and to the eye, t that of the fourth nearest.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.2, for the visibility bits and the nearest view; Buehler, Bosse, McMillan,
// Gortler, Cohen. Unstructured Lumigraph Rendering. SIGGRAPH 2001, section 4, for weights that fall to zero.
// Points near P(v), not v, are projected into the texture views, in homogeneous coordinates, so that a picture lies on the plane through
// three points without a bend.
// Deviation: the point of the eye's ray through v that is nearest to P(v) is projected. It is P(v) but for what the hull's distance from
// the model moves it aside on the screen, so that an eye where the picture was taken sees the picture.

const PAINT_BLENDED: u32 = 0u;
const PAINT_NEAREST: u32 = 1u;
const PAINT_VIEWS: u32 = 2u;
const PAINT_TILES: u32 = 3u;
const PAINT_LIT: u32 = 4u;

// The least distance between directions that is told from none.
const PAINT_LEAST: f32 = 1e-4;

struct Asset {
    // Per texture view: (s·q, t·q, q, d) of a point of the object, (s, t) from the picture's top-left, d the depth from the hull's middle
    // in its radii.
    texture_from_object: array<mat4x4f, 64>,
    // Eyes of the texture views, and the width of a pixel of their pictures at depth 1.
    eyes: array<vec4f, 64>,
    // Unit directions to the two lights, and their intensities.
    lights: array<vec4f, 2>,
    // Linear colour of an unpainted hull, and the factor on it where no light falls.
    albedo: vec4f,
    // Texture views; 1 where there is an atlas, where views have normals, and where the atlas has.
    counts: vec4u,
    // Radius of the hull.
    depth: vec4f,
}

@group(1) @binding(0) var<uniform> asset: Asset;
@group(1) @binding(1) var paint_views: texture_2d_array<f32>;
@group(1) @binding(2) var paint_atlas: texture_2d<f32>;
@group(1) @binding(3) var paint_sampler: sampler;

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) surface_point: vec3f,
    @location(3) atlas_uv: vec2f,
    // Bit i: texture view i sees the whole face.
    @location(4) visible: vec2u,
    // The face's middle on the model's surface.
    @location(5) middle: vec3f,
}

// Up to three views with their weights, and the weight of what stands in for them.
struct Shares {
    views: vec3u,
    weights: vec4f,
}

// The four views nearest to the eye, nearest first, with the cosines of the angles between their directions and the eye's.
struct Nearest {
    views: vec4u,
    cosines: vec4f,
}

// Farther than any view can be.
const PAINT_NONE_NEAR = Nearest(vec4u(0u), vec4f(-1.0001));

// Takes a view in where it is nearer than one of those.
fn paint_take(nearest: ptr<function, Nearest>, view: u32, cosine: f32) {
    let cosines = (*nearest).cosines;
    let views = (*nearest).views;
    if cosine > cosines.x {
        (*nearest).cosines = vec4f(cosine, cosines.xyz);
        (*nearest).views = vec4u(view, views.xyz);
    } else if cosine > cosines.y {
        (*nearest).cosines = vec4f(cosines.x, cosine, cosines.yz);
        (*nearest).views = vec4u(views.x, view, views.yz);
    } else if cosine > cosines.z {
        (*nearest).cosines = vec4f(cosines.xy, cosine, cosines.z);
        (*nearest).views = vec4u(views.xy, view, views.z);
    } else if cosine > cosines.w {
        (*nearest).cosines.w = cosine;
        (*nearest).views.w = view;
    }
}

// Weights of the first three of four views, up to scale: by inverse chords between the directions, less that of the fourth.
fn paint_weights(cosines: vec4f) -> vec3f {
    let distances = sqrt(max(2.0 - 2.0 * cosines, vec4f(0.0)));
    let inverse = 1.0 / max(distances, vec4f(PAINT_LEAST));
    return inverse.xyz - inverse.w;
}


fn paint_shares(corner: Corner, eye: vec4f, mode: u32) -> Shares {
    var shares: Shares;
    shares.views = vec3u(0u);
    shares.weights = vec4f(0.0, 0.0, 0.0, 1.0);
    if mode >= PAINT_TILES {
        return shares;
    }
    var to_eye = eye.xyz;
    if eye.w > 0.5 {
        to_eye = eye.xyz - corner.middle;
    }
    let direction = normalize(to_eye);
    var nearest = PAINT_NONE_NEAR;
    var least = 1e30;
    var is_seen = false;
    var low = corner.visible.x;
    var high = corner.visible.y;
    while (low | high) != 0u {
        // The lowest bit that is set; OpenGL's shaders have no function for it.
        var word = low;
        var first = 0u;
        if low == 0u {
            word = high;
            first = 32u;
        }
        let view = first + u32(log2(f32(word & (~word + 1u))) + 0.5);
        if low == 0u {
            high &= high - 1u;
        } else {
            low &= low - 1u;
        }
        let to_view = asset.eyes[view].xyz - corner.middle;
        let cosine = dot(to_view, direction) * inverseSqrt(dot(to_view, to_view));
        if mode == PAINT_NEAREST {
            var off = to_view - to_eye;
            if eye.w < 0.5 {
                off = vec3f(1.0 - cosine, 0.0, 0.0);
            }
            if dot(off, off) < least {
                least = dot(off, off);
                nearest.views.x = view;
            }
        } else {
            paint_take(&nearest, view, cosine);
        }
        is_seen = true;
    }
    if !is_seen {
        return shares;
    }
    shares.views = nearest.views.xyz;
    shares.weights = vec4f(1.0, 0.0, 0.0, 0.0);
    if mode == PAINT_NEAREST {
        return shares;
    }
    let weights = paint_weights(nearest.cosines);
    if weights.x > 0.0 {
        shares.weights = vec4f(weights / (weights.x + weights.y + weights.z), 0.0);
    }
    return shares;
}

// The point of the eye's ray through a corner that is nearest to P(v).
fn paint_on_ray(corner: Corner, eye: vec4f) -> vec3f {
    var ray = -eye.xyz;
    if eye.w > 0.5 {
        ray = corner.position - eye.xyz;
    }
    let along = dot(corner.surface_point - corner.position, ray) / max(dot(ray, ray), 1e-30);
    return corner.position + ray * along;
}

// What a texture view shows at the point of a corner, for an eye that sees the corner.
fn paint_point(corner: Corner, eye: vec4f, view: u32) -> vec3f {
    let projected = asset.texture_from_object[min(view, 63u)] * vec4f(paint_on_ray(corner, eye), 1.0);
    return projected.xyz;
}

// A place in a texture view, and how far it moves from one pixel to the next: by half of it, as a picture is seen aslant and averages over
// the longer way are too wide. At 96 pixels colours of two assets are half as far from those of a picture of 1536 pixels that way as
// without smaller versions, and a third nearer than by the whole.
struct PaintPlace {
    uv: vec2f,
    across: vec2f,
    along: vec2f,
}

fn paint_place(texture_point: vec3f) -> PaintPlace {
    let uv = texture_point.xy / texture_point.z;
    return PaintPlace(uv, 0.5 * dpdx(uv), 0.5 * dpdy(uv));
}

fn paint_view_colour(place: PaintPlace, view: u32) -> vec3f {
    return textureSampleGrad(paint_views, paint_sampler, place.uv, view, place.across, place.along).rgb;
}

// Factor on the albedo of a surface with this unit normal, by the studio light.
fn paint_irradiance(n: vec3f) -> f32 {
    var sum = asset.albedo.w;
    sum += asset.lights[0].w * max(dot(n, asset.lights[0].xyz), 0.0);
    sum += asset.lights[1].w * max(dot(n, asset.lights[1].xyz), 0.0);
    return sum;
}
