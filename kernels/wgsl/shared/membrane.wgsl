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

// The same of threads that jam.
fn locking_at(lock: vec4f, strain: f32) -> vec3f {
    let y = max(strain - lock.y, 0.0);
    let x = min(y, lock.z);
    let beyond = y - x;
    let steep = lock.w * x;
    return vec3f(
        steep * fma(1.0 / 3.0, x * x, beyond * (x + beyond)),
        steep * (x + (beyond + beyond)),
        steep + steep,
    );
}

struct FabricResponse {
    // [N/m]
    stress: vec3f,
    // dS11/dE11, dS22/dE22, dS12/(2 dE12) [N/m]
    slopes: vec3f,
    // [J/m^2]
    energy: f32,
    // c [N/m], damping [s]
    coupling: f32,
    damping: f32,
}

fn fabric_response(fabric: u32, strain: vec3f) -> FabricResponse {
    let warp = fabric_laws[3u * fabric];
    let weft = fabric_laws[3u * fabric + 1u];
    let u = curve_at(warp, strain.x);
    let v = curve_at(weft, strain.y);
    let across = 2.0 * weft.w * strain.z;
    let damping_lock = fabric_laws[3u * fabric + 2u];
    let lock_u = locking_at(damping_lock, strain.x);
    let lock_v = locking_at(damping_lock, strain.y);
    let lock_w = locking_at(damping_lock, abs(strain.z));
    let locked = vec3f(lock_u.y, lock_v.y, select(lock_w.y, -lock_w.y, strain.z < 0.0));
    return FabricResponse(
        vec3f(fma(warp.w, strain.y, u.y), fma(warp.w, strain.x, v.y), across) + locked,
        vec3f(u.z + lock_u.z, v.z + lock_v.z, fma(0.5, lock_w.z, weft.w)),
        fma(across, strain.z, fma(warp.w * strain.x, strain.y, u.x + v.x)) + fma(2.0, lock_w.x, lock_u.x + lock_v.x),
        warp.w,
        damping_lock.x,
    );
}

// C times a rate of strain.
fn viscous_stress(response: FabricResponse, rate: vec3f) -> vec3f {
    return vec3f(
        fma(response.coupling, rate.y, response.slopes.x * rate.x),
        fma(response.coupling, rate.x, response.slopes.y * rate.y),
        2.0 * response.slopes.z * rate.z,
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
