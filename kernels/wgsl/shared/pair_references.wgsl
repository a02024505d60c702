// NUMERICS section 15: both sets of positions that the list of pairs was made for [m].

@group(0) @binding(71) var<storage, read_write> pair_references: array<vec4f>;

fn reference_first(particle: u32) -> vec3f {
    return pair_references[particle].xyz;
}

fn reference_second(particle: u32) -> vec3f {
    return pair_references[pair_task.node_count + particle].xyz;
}
