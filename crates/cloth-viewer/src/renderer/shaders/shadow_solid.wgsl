// Depth from the light: colliders that are not planes.

@vertex
fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return view.light_from_world * vec4f(position, 1.0);
}
