// NUMERICS section 5: u and e of every spring, by the particle with the smaller number.
//!include model substep status motion links link_kinds
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
        let numbers = bitcast<vec4f>(spring_word(kind));
        let difference = position_in[other].xyz - position;
        let length = sqrt(dot_product(difference, difference));
        let inverse_length = 1.0 / max(length, LENGTH_MIN);
        let stretch = length - numbers.y;
        let square = substep.length * substep.length;
        let e = square * elastic_tension(kind, numbers.z, stretch) * inverse_length;
        let slope = elastic_slope(kind, numbers.z, stretch);
        let along = fma(square, slope, substep.length * numbers.w);
        let root = sqrt(max(along - max(e, 0.0), 0.0)) * inverse_length;
        let u = root * difference;
        // Without a direction all of the stiffness is across; e has nothing to pull along.
        let across = select(e, along - dot_product(u, u), length <= LENGTH_MIN);
        factors[entry.y + particle] = vec4f(u, across);
    }
}
