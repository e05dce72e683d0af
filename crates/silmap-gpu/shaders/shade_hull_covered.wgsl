// The hull as far as the outline covers each pixel, premultiplied. Needs: shared/view, shared/hull.
// Source: Gu et al., Silhouette Mapping, TR-1-99, section 8.3: the mesh drawn by the recorded alphas.

@group(1) @binding(0) var coverage_image: texture_2d<f32>;

@fragment
fn fs_main(fragment: HullFragment) -> @location(0) vec4f {
    let coverage = textureLoad(coverage_image, vec2i(fragment.position.xy), 0).r;
    return vec4f(hull_colour(fragment), 1.0) * coverage;
}
