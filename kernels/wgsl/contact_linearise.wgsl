// NUMERICS section 5: u of every pair in contact, kept with each candidate of both particles.
//!include model substep status motion contact_pair contact_partners

@group(0) @binding(45) var<storage, read_write> contact_factors: array<vec4f>;

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
    let stiffness = substep.length * model.contact_stiffness;
    let root = sqrt(substep.length * (stiffness + model.contact_damping));
    let row = contact_rows[particle];
    for (var at = row.x; at < row.x + row.y; at += 1u) {
        let pair = pair_of(position, position_in[contact_entries[at]].xyz);
        var factor = vec4f(0.0);
        if is_in_contact(pair) && pair.length_squared > LENGTH_SQUARED_MIN {
            let normal = pair.difference * (1.0 / sqrt(pair.length_squared));
            factor = vec4f(root * normal, 1.0);
        }
        contact_factors[at] = factor;
    }
}
