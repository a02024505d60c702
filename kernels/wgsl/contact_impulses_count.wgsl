// NUMERICS section 8, impulses, first pass: how many particles each one is in contact with.
//!include model substep status motion contact_pair contact_partners contact_counts

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
    let row = contact_rows[particle];
    var count = 0u;
    for (var at = row.x; at < row.x + row.y; at += 1u) {
        if is_in_contact(pair_of(position, position_in[contact_entries[at]].xyz)) {
            count += 1u;
        }
    }
    contact_counts[particle] = count;
}
