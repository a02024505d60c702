// Takes back what `control_forces` did last.
//!include motion_out control_forces

@compute @workgroup_size(FORCE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = control_force_place(id, groups);
    if place < control_forces.count {
        let particle = control_forces.list[place].particle;
        let mass = velocity_out[particle].w;
        velocity_out[particle] = vec4f(control_forces.list[place].before, mass);
    }
}
