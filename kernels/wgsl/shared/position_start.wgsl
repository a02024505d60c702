// Where particles were at the start of the substep.

@group(0) @binding(60) var<storage, read> position_start: array<vec4f>;

fn start_of(particle: u32, now: vec3f) -> vec3f {
    return position_start[particle].xyz;
}
