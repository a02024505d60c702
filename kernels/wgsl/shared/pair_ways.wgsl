// NUMERICS section 15: where the ways of all particles start [m], then where they end, with a fourth number that is not 0 if the particle is
// marked.

@group(0) @binding(70) var<storage, read_write> pair_ways: array<vec4f>;

fn way_start(particle: u32) -> vec3f {
    return pair_ways[particle].xyz;
}

fn way_end(particle: u32) -> vec3f {
    return pair_ways[pair_task.node_count + particle].xyz;
}

fn is_marked(particle: u32) -> bool {
    return pair_ways[pair_task.node_count + particle].w != 0.0;
}
