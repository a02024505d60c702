// What is behind everything.

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let place = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return Corner(vec4f(place, 0.0, 1.0), place);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let near = view.world_from_clip * vec4f(corner.place, 1.0, 1.0);
    return encode(sky(normalize(near.xyz / near.w - view.eye.xyz)));
}
