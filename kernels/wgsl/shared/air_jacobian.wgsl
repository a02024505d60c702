// NUMERICS section 5: J, the derivative of the force of the air by the velocity of the triangles.

fn air_jacobian(particle: u32) -> Symmetric {
    var sum = Symmetric(vec3f(0.0), vec3f(0.0));
    let end = triangle_rows[particle + 1u];
    for (var at = triangle_rows[particle]; at < end; at += 1u) {
        let corners = triangles[triangle_rows[model.particle_count + 1u + at]];
        let flow = air_flow(corners);
        let third = flow.area * (1.0 / 3.0);
        let cloth = air_cloths[corners.w];
        let pressure = third * (2.0 * cloth.pressure * abs(flow.across));
        let friction = third * (cloth.friction * flow.speed);
        let direction = flow.along * (1.0 / max(flow.speed, LENGTH_MIN));
        sum.on += vec3f(friction);
        sum = symmetric_add_outer(sum, pressure - friction, flow.normal);
        sum = symmetric_add_outer(sum, friction, direction);
    }
    return sum;
}
