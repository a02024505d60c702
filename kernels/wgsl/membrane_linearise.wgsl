// NUMERICS section 11: tangents and impulses of stretched triangles of fabric.
//!include model substep status call motion fabric membrane membrane_motion fabric_vectors membrane_store fabric_tangents

// The stress without its negative principal stress.
fn tensile_part(stress: vec3f) -> vec3f {
    let mean = 0.5 * (stress.x + stress.y);
    let apart = 0.5 * (stress.x - stress.y);
    let radius = sqrt(fma(stress.z, stress.z, apart * apart));
    if mean - radius >= 0.0 {
        return stress;
    }
    if mean + radius <= 0.0 {
        return vec3f(0.0);
    }
    let share = (mean + radius) / (radius + radius);
    return share * vec3f(apart + radius, radius - apart, stress.z);
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = particle_index(id, groups);
    if number >= model.element_count || is_stopped() {
        return;
    }
    let triangle = membrane_of(number);
    let f = positions_deformation(triangle);
    let rates = velocities_deformation(triangle);
    let response = fabric_response(triangle.fabric, green_strain(f));
    let length = substep.length;
    let square = length * length;
    let damped = length * response.damping;
    let weight = square + damped;
    let along = select(weight, damped, call_has(CALL_ITERATE));
    let viscous = viscous_stress(response, green_strain_rate(f, rates));
    let stress = fma(vec3f(along), viscous, length * response.stress);
    let tensile = triangle.area * tensile_part(response.stress);
    var pull = membrane_pull(f, stress, triangle.inverse, triangle.area);
    if !call_has(CALL_ITERATE) {
        let turning = membrane_pull(rates, tensile, triangle.inverse, square);
        pull = Pull(pull.second + turning.second, pull.third + turning.third);
    }
    membrane_store(number, pull);
    let scale = weight * triangle.area;
    fabric_tangents[4u * number] = vec4f(f.u, scale * response.slopes.z);
    fabric_tangents[4u * number + 1u] = vec4f(f.v, 0.0);
    fabric_tangents[4u * number + 2u] = vec4f(scale * vec3f(response.slopes.x, response.coupling, response.slopes.y), 0.0);
    fabric_tangents[4u * number + 3u] = vec4f(square * tensile, 0.0);
}
