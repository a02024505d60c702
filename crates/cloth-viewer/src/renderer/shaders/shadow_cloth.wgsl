// Depth from the light: the cloths.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return view.light_from_world * vec4f(positions[index].xyz, 1.0);
}
