// Full coverage where the stencil says inside. Needs: shared/screen.

@vertex
fn vs_main(@builtin(vertex_index) vertex_ix: u32) -> @builtin(position) vec4f {
    return screen_corner(vertex_ix);
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(1.0);
}
