// NUMERICS section 6: the right-hand side of the constant system, which the kernels of the conjugate gradient
// method then solve.
//!include model substep status motion force links link_kinds vectors
//!if buckling
//!include spring_buckling
//!end
//!if not buckling
//!include spring_linear
//!end
//!if fabric
//!include element_pull
//!end
//!if not fabric
//!include element_pull_none
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
    let velocity = velocity_in[particle].xyz;
    var sum = vec3f(0.0);
    let row = link_row(particle);
    for (var at = row.first; at < row.end; at += row.stride) {
        let stiffness = bitcast<f32>(spring_word(link_kind(at)).z);
        let other = particle + link_entries[at].x;
        sum = add_scaled(sum, stiffness, velocity_in[other].xyz - velocity);
    }
    sum = element_pull(sum, particle, velocity);
    let length = substep.length;
    var right_side = fma(vec3f(length), force[particle].xyz, length * length * sum);
    if !(position_in[particle].w > 0.0) {
        right_side = vec3f(0.0);
    }
    vector_set(VECTOR_RIGHT_SIDE, particle, right_side);
}
