// NUMERICS section 8, building the candidate list, third pass: puts the particles in the order of
// their cells.
//!include model substep status contact_list

@group(0) @binding(24) var<storage, read> cell_of_particle: array<vec2<u32>>;
@group(0) @binding(26) var<storage, read> cell_ranges: array<vec2<u32>>;
// Bits of the reference position in the order of cells, and the particle.
@group(0) @binding(27) var<storage, read_write> sorted_positions: array<vec4<u32>>;
// Their expected velocity.
@group(0) @binding(28) var<storage, read_write> sorted_velocities: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || !contact_list_is_being_built() {
        return;
    }
    if particle == 0u {
        status.contact_built = substep.contact_tick;
        status.contact_built_time = substep.time;
        status.contact_rebuilds += 1u;
        atomicStore(&status.contact_entries, 0u);
        atomicStore(&status.contact_spilled, 0u);
    }
    let cell = cell_of_particle[particle];
    let place = cell_ranges[cell.x].x + cell.y;
    let reference = contact_reference[particle];
    sorted_positions[place] = vec4<u32>(reference.xyz, particle);
    sorted_velocities[place] = reference.w;
}
