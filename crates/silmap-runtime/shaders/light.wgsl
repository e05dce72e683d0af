// A moved light: what is painted has the studio light in it, which is divided out where the surface's normal is known. Needs: paint.
//
// Source: Debevec, Hawkins, Tchou, Duiker, Sarokin, Sagar. Acquiring the Reflectance Field of a Human Face. SIGGRAPH 2000, for pictures
// that are lit anew by what is known of the surface. Deviation: the surface is matt, and its light is known.

// Unit normals in the object, from −1 to 1 as bytes from 1 to 255; next to zero where none is known.
@group(1) @binding(6) var light_normals: texture_2d_array<f32>;
@group(1) @binding(7) var light_atlas_normals: texture_2d<f32>;

// A normal shorter than this is none.
const LIGHT_LEAST: f32 = 0.05;

fn light_unpacked(texel: vec4f) -> vec3f {
    return texel.xyz * (255.0 / 127.0) - 128.0 / 127.0;
}

fn light_is_moved(light: vec4f) -> bool {
    return light.w > 0.5 && (asset.counts.z | asset.counts.w) != 0u;
}

// The normal of what a texture view shows at a place of its picture; where views have none, that of the atlas.
fn light_view_normal(uv: vec2f, view: u32, atlas_uv: vec2f, face: vec3f) -> vec3f {
    if asset.counts.z == 0u {
        return light_atlas_normal(atlas_uv, face);
    }
    let normal = light_unpacked(textureSampleLevel(light_normals, paint_sampler, uv, view, 0.0));
    return light_known(normal, face);
}

fn light_atlas_normal(atlas_uv: vec2f, face: vec3f) -> vec3f {
    if asset.counts.w == 0u {
        return face;
    }
    let normal = light_unpacked(textureSampleLevel(light_atlas_normals, paint_sampler, atlas_uv, 0.0));
    return light_known(normal, face);
}

fn light_known(normal: vec3f, face: vec3f) -> vec3f {
    let size = length(normal);
    if size < LIGHT_LEAST {
        return face;
    }
    return normal / size;
}

// Factor on the albedo by a light of that direction.
fn light_moved(normal: vec3f, light: vec4f) -> f32 {
    return asset.albedo.w + (1.0 - asset.albedo.w) * max(dot(normal, light.xyz), 0.0);
}

// A colour by the studio light as one by a moved light.
fn light_relit(colour: vec3f, normal: vec3f, light: vec4f) -> vec3f {
    let n = normal / max(length(normal), 1e-20);
    return colour * (light_moved(n, light) / paint_irradiance(n));
}

// The colour of an unpainted hull, by its own light or a moved one.
fn light_lit(normal: vec3f, light: vec4f) -> vec3f {
    let n = normal / max(length(normal), 1e-20);
    return asset.albedo.rgb * select(paint_irradiance(n), light_moved(n, light), light.w > 0.5);
}
