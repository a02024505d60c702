// NUMERICS section 3: what forces on single particles do to the velocities in a substep, in place.
//!include substep status motion_out control_forces

@compute @workgroup_size(FORCE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = control_force_place(id, groups);
    if place >= control_forces.count || is_stopped() {
        return;
    }
    let control = control_forces.list[place];
    let position = position_out[control.particle];
    let velocity = velocity_out[control.particle];
    control_forces.list[place].before = velocity.xyz;
    // Held particles get none.
    if position.w > 0.0 {
        var d = (control.anchor + substep.anchor_offset) - position.xyz;
        let distance = sqrt(fma(d.z, d.z, fma(d.y, d.y, d.x * d.x)));
        if distance > control.reach {
            d *= control.reach / distance;
        }
        let h = substep.length;
        let v = velocity.xyz;
        let inertia = fma(h * h, control.stiffness, fma(h, control.damping, velocity.w));
        let stretch = fma(vec3f(-h), v, d);
        let pull = fma(vec3f(control.stiffness), stretch, -(control.damping * v));
        velocity_out[control.particle] = vec4f(fma(vec3f(h / inertia), control.force + pull, v), velocity.w);
    }
}
