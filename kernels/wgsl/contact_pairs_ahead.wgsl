// NUMERICS section 15, contact_pairs: ways from where particles are to where their velocities take them.
//!include model motion pair_task pair_ways

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    let position = position_in[particle].xyz;
    let ahead = add_scaled(position, pair_task.length, velocity_in[particle].xyz);
    pair_ways[particle] = vec4f(position, 0.0);
    pair_ways[pair_task.node_count + particle] = vec4f(ahead, 0.0);
}
