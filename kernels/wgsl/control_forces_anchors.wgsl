// Anchors of springs that begin where their particles are.
//!include motion_out control_forces

@compute @workgroup_size(FORCE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let place = control_force_place(id, groups);
    if place < control_forces.count && control_forces.list[place].is_here != 0u {
        control_forces.list[place].anchor = position_out[control_forces.list[place].particle].xyz;
    }
}
