// NUMERICS section 11: a triangle that stretches and shears. Tensors of the plane are (11, 22, 12).

// F: f_u and f_v, or their rates.
struct Gradient {
    u: vec3f,
    v: vec3f,
}

// a s + b t
fn combination(a: vec3f, s: f32, b: vec3f, t: f32) -> vec3f {
    return fma(vec3f(t), b, s * a);
}

fn deformation(a: vec3f, b: vec3f, c: vec3f, inverse: vec4f) -> Gradient {
    return Gradient(
        combination(b - a, inverse.x, c - a, inverse.z),
        combination(b - a, inverse.y, c - a, inverse.w),
    );
}

fn positions_deformation(triangle: Membrane) -> Gradient {
    let at = triangle.particles;
    return deformation(position_in[at.x].xyz, position_in[at.y].xyz, position_in[at.z].xyz, triangle.inverse);
}

fn velocities_deformation(triangle: Membrane) -> Gradient {
    let at = triangle.particles;
    return deformation(velocity_in[at.x].xyz, velocity_in[at.y].xyz, velocity_in[at.z].xyz, triangle.inverse);
}

fn green_strain(f: Gradient) -> vec3f {
    return 0.5 * vec3f(dot_product(f.u, f.u) - 1.0, dot_product(f.v, f.v) - 1.0, dot_product(f.u, f.v));
}

fn green_strain_rate(f: Gradient, rate: Gradient) -> vec3f {
    let across = dot_product(f.u, rate.v) + dot_product(f.v, rate.u);
    return vec3f(dot_product(f.u, rate.u), dot_product(f.v, rate.v), 0.5 * across);
}

// Energy, stress and slope of a tensile curve (slope at rest, coefficient of E^3, end) at a strain.
fn curve_at(curve: vec4f, strain: f32) -> vec3f {
    let x = min(max(strain, 0.0), curve.z);
    let beyond = max(strain - curve.z, 0.0);
    let x2 = x * x;
    let steep = curve.y * x2;
    let bent = fma(beyond, fma(1.5, beyond, x), 0.25 * x2);
    return vec3f(
        fma(steep, bent, 0.5 * curve.x * strain * strain),
        fma(steep, fma(3.0, beyond, x), curve.x * strain),
        fma(3.0, steep, curve.x),
    );
}

struct FabricResponse {
    // [N/m]
    stress: vec3f,
    // psi'' of warp and weft [N/m]
    slopes: vec2f,
    // [J/m^2]
    energy: f32,
    // c and G [N/m], damping [s]
    coupling: f32,
    shear: f32,
    damping: f32,
}

fn fabric_response(fabric: u32, strain: vec3f) -> FabricResponse {
    let warp = fabric_laws[3u * fabric];
    let weft = fabric_laws[3u * fabric + 1u];
    let u = curve_at(warp, strain.x);
    let v = curve_at(weft, strain.y);
    let across = 2.0 * weft.w * strain.z;
    return FabricResponse(
        vec3f(fma(warp.w, strain.y, u.y), fma(warp.w, strain.x, v.y), across),
        vec2f(u.z, v.z),
        fma(across, strain.z, fma(warp.w * strain.x, strain.y, u.x + v.x)),
        warp.w,
        weft.w,
        fabric_laws[3u * fabric + 2u].x,
    );
}

// C times a rate of strain.
fn viscous_stress(response: FabricResponse, rate: vec3f) -> vec3f {
    return vec3f(
        fma(response.coupling, rate.y, response.slopes.x * rate.x),
        fma(response.coupling, rate.x, response.slopes.y * rate.y),
        2.0 * response.shear * rate.z,
    );
}

// Forces on the second and third corner for a stress; that on the first is minus their sum.
struct Pull {
    second: vec3f,
    third: vec3f,
}

fn membrane_pull(f: Gradient, stress: vec3f, inverse: vec4f, area: f32) -> Pull {
    let u = -area * combination(f.u, stress.x, f.v, stress.z);
    let v = -area * combination(f.u, stress.z, f.v, stress.y);
    return Pull(combination(u, inverse.x, v, inverse.y), combination(u, inverse.z, v, inverse.w));
}
