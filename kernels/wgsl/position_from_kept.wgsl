// NUMERICS section 5: x = x0 + amount v.
//!include model status call motion motion_out

@group(0) @binding(46) var<storage, read> position_kept: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count {
        return;
    }
    var position = position_in[particle];
    var velocity = velocity_in[particle];
    if !is_stopped() {
        var start = position_kept[particle].xyz;
        if call.amount != 0.0 {
            start = add_scaled(start, call.amount, velocity.xyz);
        }
        position = vec4f(start, position.w);
    }
    position_out[particle] = position;
    velocity_out[particle] = velocity;
}
