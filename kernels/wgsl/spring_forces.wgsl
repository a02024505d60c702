// NUMERICS section 2: adds the forces of springs and their dampers.
//!include model status motion force spring spring_batch
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
    let velocity = velocity_in[particle].xyz;
    let sum = spring_force(force[particle].xyz, particle, position, velocity);
    force[particle] = vec4f(sum, 0.0);
}
