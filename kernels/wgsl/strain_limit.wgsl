// NUMERICS section 4: shortens the over-long springs of one colour, in place. They share no
// particle.
//!include model status substep motion_out colour

// Two particles and the largest length [m] of each spring, by colour.
@group(0) @binding(21) var<storage, read> limited_springs: array<vec4<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = particle_index(id, groups);
    if place >= colour.count || is_stopped() {
        return;
    }
    let spring = limited_springs[colour.first + place];
    let a = position_out[spring.x];
    let b = position_out[spring.y];
    let longest = bitcast<f32>(spring.z);
    let difference = b.xyz - a.xyz;
    let length = sqrt(dot_product(difference, difference));
    let total = a.w + b.w;
    if length <= longest || total == 0.0 {
        return;
    }
    let shift = ((length - longest) / total / length) * difference;
    let shift_a = a.w * shift;
    let shift_b = -b.w * shift;
    position_out[spring.x] = vec4f(a.xyz + shift_a, a.w);
    position_out[spring.y] = vec4f(b.xyz + shift_b, b.w);
    let velocity_a = velocity_out[spring.x];
    let velocity_b = velocity_out[spring.y];
    velocity_out[spring.x] = vec4f(velocity_a.xyz + shift_a / substep.length, velocity_a.w);
    velocity_out[spring.y] = vec4f(velocity_b.xyz + shift_b / substep.length, velocity_b.w);
}
