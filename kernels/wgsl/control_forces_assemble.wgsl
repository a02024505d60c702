// NUMERICS section 3: what forces on single particles add to the system of an implicit substep, after `implicit_assemble`.
//!include model substep status call motion vectors symmetric matrix matrix_diagonal control_forces

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
    let particle = control.particle;
    let position = position_in[particle];
    // Held particles get none.
    if position.w > 0.0 {
        let d = (control.anchor + substep.anchor_offset) - position.xyz;
        let distance = sqrt(fma(d.z, d.z, fma(d.y, d.y, d.x * d.x)));
        // Beyond its reach a spring is less stiff, so that its force stays what it is there.
        let stiffness = control.stiffness * select(1.0, control.reach / distance, distance > control.reach);
        let h = substep.length;
        let v = velocity_in[particle].xyz;
        let ahead = select(h, 0.0, call_has(CALL_ITERATE));
        let pull = fma(vec3f(stiffness), fma(vec3f(-ahead), v, d), -(control.damping * v));
        let term = vec4f(vec3f(fma(h * h, stiffness, h * control.damping)), 0.0);
        matrix_base[2u * particle] += term;
        matrix_diagonal[2u * particle] += term;
        let right = vector_get(VECTOR_RIGHT_SIDE, particle);
        vector_set(VECTOR_RIGHT_SIDE, particle, fma(vec3f(h), control.force + pull, right));
    }
}
