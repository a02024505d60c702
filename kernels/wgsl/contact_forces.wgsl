// NUMERICS section 8: adds the penalty force of all pairs in contact.
//!include model substep status motion force contact_pair contact_partners contact_counts contact_penalty

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    let position = position_in[particle].xyz;
    let velocity = velocity_in[particle].xyz;
    let row = contact_rows[particle];
    var sum = vec3f(0.0);
    for (var at = row.x; at < row.x + row.y; at += 1u) {
        sum = penalty_add(sum, push_of(position, velocity, contact_entries[at]));
    }
    if (substep.flags & FLAG_COUNT_CONTACTS) != 0u {
        contact_counts[particle] = row.y;
    }
    force[particle] = vec4f(force[particle].xyz + sum, 0.0);
}
