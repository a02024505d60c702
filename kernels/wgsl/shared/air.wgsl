// NUMERICS section 3: pressure and friction of the air, pressure of gas within a cloth.

struct AirCloth {
    // rho/2 times the coefficients of pressure and of friction [kg/m^3].
    pressure: f32,
    friction: f32,
    // A sixth of the pressure of the gas within [Pa], when it begins to rise and when it is there [s].
    gas: f32,
    gas_start: f32,
    gas_end: f32,
    padding: f32,
}

// For each cloth.
@group(0) @binding(12) var<storage, read> air_cloths: array<AirCloth>;

// The air relative to a triangle.
struct Flow {
    // Twice the area along the normal [m^2].
    doubled: vec3f,
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
    return Flow(doubled, length * 0.5, normal, across, along, sqrt(dot_product(along, along)));
}

// A third of the force on a triangle [N], that of the air and that of the gas within the cloth.
fn air_share(corners: vec4<u32>) -> vec3f {
    let flow = air_flow(corners);
    let cloth = air_cloths[corners.w];
    let pressure = cloth.pressure * abs(flow.across) * flow.across;
    let friction = cloth.friction * flow.speed;
    let share = (flow.area * fma(vec3f(pressure), flow.normal, friction * flow.along)) * (1.0 / 3.0);
    if cloth.gas == 0.0 {
        return share;
    }
    var risen = 1.0;
    if substep.clock <= cloth.gas_start {
        risen = 0.0;
    } else if substep.clock < cloth.gas_end {
        risen = (substep.clock - cloth.gas_start) / (cloth.gas_end - cloth.gas_start);
    }
    return fma(vec3f(cloth.gas * risen), flow.doubled, share);
}

// The force of air and gas on a particle [N], its triangles in ascending order.
fn air_force(particle: u32) -> vec3f {
    var sum = vec3f(0.0);
    let end = triangle_rows[particle + 1u];
    for (var at = triangle_rows[particle]; at < end; at += 1u) {
        sum += air_share(triangles[triangle_rows[model.particle_count + 1u + at]]);
    }
    return sum;
}
