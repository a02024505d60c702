// NUMERICS section 3: pressure and friction of the air.

// For each cloth rho/2 times the coefficients of pressure and of friction [kg/m^3].
@group(0) @binding(12) var<storage, read> air_coefficients: array<vec2f>;

// The air relative to a triangle.
struct Flow {
    area: f32,
    normal: vec3f,
    // Component along the normal, component along the surface, and its length [m/s].
    across: f32,
    along: vec3f,
    speed: f32,
}

fn air_flow(corners: vec4<u32>) -> Flow {
    let origin = position_in[corners.x].xyz;
    let doubled = cross_product(
        position_in[corners.y].xyz - origin,
        position_in[corners.z].xyz - origin,
    );
    let length = sqrt(dot_product(doubled, doubled));
    let normal = doubled * (1.0 / max(length, LENGTH_MIN));
    let sum = (velocity_in[corners.x].xyz + velocity_in[corners.y].xyz)
        + velocity_in[corners.z].xyz;
    let relative = fma(vec3f(-1.0 / 3.0), sum, substep.wind);
    let across = dot_product(relative, normal);
    let along = fma(vec3f(-across), normal, relative);
    return Flow(length * 0.5, normal, across, along, sqrt(dot_product(along, along)));
}

// A third of the force on a triangle [N].
fn air_share(corners: vec4<u32>) -> vec3f {
    let flow = air_flow(corners);
    let coefficients = air_coefficients[corners.w];
    let pressure = coefficients.x * abs(flow.across) * flow.across;
    let friction = coefficients.y * flow.speed;
    return (flow.area * fma(vec3f(pressure), flow.normal, friction * flow.along)) * (1.0 / 3.0);
}

// The force of the air on a particle [N], its triangles in ascending order.
fn air_force(particle: u32) -> vec3f {
    var sum = vec3f(0.0);
    let end = triangle_rows[particle + 1u];
    for (var at = triangle_rows[particle]; at < end; at += 1u) {
        sum += air_share(triangles[triangle_rows[model.particle_count + 1u + at]]);
    }
    return sum;
}
