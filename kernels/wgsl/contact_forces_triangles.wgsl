// NUMERICS section 15, contact_forces: adds the forces of all contacts of triangles.
//!include model status force contact_table

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let particle = particle_index(id, groups);
    if particle >= model.particle_count || is_stopped() {
        return;
    }
    var sum = vec3f(0.0);
    let places = contact_places(particle);
    for (var k = places.x; k < places.y; k += 1u) {
        let place = contact_table[k];
        let at = contact_of(place);
        sum = add_scaled(sum, contact_weight(at, place), contact_three(at + 14u));
    }
    force[particle] = vec4f(force[particle].xyz + sum, 0.0);
}
