// Marks the pixels whose centre a mesh covers. Needs: shared/view.

@vertex
fn vs_main(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return view.clip_from_object * vec4f(position, 1.0);
}

@fragment
fn fs_main() -> @location(0) vec4f {
    return vec4f(1.0);
}
