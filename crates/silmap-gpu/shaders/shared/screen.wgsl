// One triangle over the whole image.

fn screen_corner(vertex_ix: u32) -> vec4f {
    let x = select(-1.0, 3.0, vertex_ix == 1u);
    let y = select(-1.0, 3.0, vertex_ix == 2u);
    return vec4f(x, y, 0.0, 1.0);
}
