// The same at the positions that are written.
@group(0) @binding(59) var<storage, read_write> group_positions_out: array<vec4<u32>>;

// Keeps a particle of a group.
fn position_keep(group: u32, lane: u32, particle: u32, position: vec3f) {
    group_positions_out[group * GROUP + lane] = vec4<u32>(bitcast<vec3<u32>>(position), particle);
}
