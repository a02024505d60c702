// NUMERICS section 8, building the candidate list, first pass: counts the particles of each cell and
// notes from where and how each particle is expected to move.
//!include model substep status motion contact_list cells

// The cell of each particle, and its number among those in it.
@group(0) @binding(24) var<storage, read_write> cell_of_particle: array<vec2<u32>>;
// Particles in each cell; all zero between two builds.
@group(0) @binding(25) var<storage, read_write> cell_counts: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || !contact_list_is_wanted() {
        return;
    }
    if particle == 0u {
        atomicStore(&status.cell_particles, 0u);
    }
    let position = position_in[particle].xyz;
    let relative = velocity_in[particle].xyz - contact.drift;
    let packed = pack4x8snorm(vec4f(relative / contact.velocity_max, 0.0));
    contact_reference[particle] = vec4<u32>(bitcast<vec3<u32>>(position), packed);
    let cell = cell_place(cell_of(position));
    // The order within a cell depends on scheduling; the lists made of it are sorted.
    cell_of_particle[particle] = vec2<u32>(cell, atomicAdd(&cell_counts[cell], 1u));
}
