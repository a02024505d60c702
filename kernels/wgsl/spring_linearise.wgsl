// NUMERICS section 5: u and e of every spring, by the particle with the smaller number.
//!include model substep status motion links link_kinds spring_factor
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end

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
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let entry = link_entries[at];
        let other = particle + entry.x;
        if other < particle {
            continue;
        }
        let kind = link_kind(at);
        let difference = position_in[other].xyz - position;
        factors[entry.y + particle] = spring_factor(kind, spring_word(kind), difference);
    }
}
