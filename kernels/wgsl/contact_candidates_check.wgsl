// NUMERICS section 8: marks the candidate list as stale if it is not complete for the present
// positions.
//!include model substep status motion contact_list

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    if !contact_list_holds(contact_progress(particle, position_in[particle].xyz)) {
        atomicMax(&status.contact_stale, substep.contact_tick);
    }
}
