// Which particle a ray from the eye meets, in three passes of one entry point, so that all of them compute the same numbers.

struct Pick {
    origin: vec3f,
    // Part of the distance by which the ray may miss a particle.
    reach: f32,
    // Unit vector.
    direction: vec3f,
    // 0: how near; 1: which; 2: the answer.
    pass_number: u32,
    triangle_count: u32,
    particle_count: u32,
    padding_0: u32,
    padding_1: u32,
}

struct Found {
    // Bits of the distance at which the ray meets a triangle first [m]; NOTHING if it meets none.
    distance: atomic<u32>,
    // The first of the triangles there.
    triangle: atomic<u32>,
    // Bits of the smallest distance of a particle from the ray, within reach, and the first particle there.
    aside: atomic<u32>,
    near: atomic<u32>,
    // The answer, NOTHING if there is none, and bits of its distance along the ray [m].
    particle: u32,
    particle_distance: u32,
}

@group(0) @binding(0) var<uniform> pick: Pick;
@group(0) @binding(1) var<storage, read> positions: array<vec4f>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read_write> found: Found;

// Above the bits of all positive numbers.
const NOTHING = 0xffffffffu;

fn corner(triangle: u32, number: u32) -> vec3f {
    return positions[triangles[3u * triangle + number]].xyz;
}

// Bits of the distance at which the ray meets a triangle, from either side (Möller and Trumbore 1997).
fn triangle_distance(triangle: u32) -> u32 {
    let a = corner(triangle, 0u);
    let u_side = corner(triangle, 1u) - a;
    let v_side = corner(triangle, 2u) - a;
    let p = cross(pick.direction, v_side);
    let determinant = dot(u_side, p);
    if determinant == 0.0 {
        return NOTHING;
    }
    let offset = pick.origin - a;
    let u = dot(offset, p) / determinant;
    let q = cross(offset, u_side);
    let v = dot(pick.direction, q) / determinant;
    let distance = dot(v_side, q) / determinant;
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 {
        return bitcast<u32>(distance);
    }
    return NOTHING;
}

// Bits of the distance of a particle from the ray, if it is within reach.
fn particle_aside(particle: u32) -> u32 {
    let offset = positions[particle].xyz - pick.origin;
    let distance = dot(offset, pick.direction);
    let aside = length(offset - distance * pick.direction);
    if distance > 0.0 && aside <= pick.reach * distance {
        return bitcast<u32>(aside);
    }
    return NOTHING;
}

// The corner of the triangle next to where the ray meets it, or the particle next to the ray.
fn answer() {
    found.particle = atomicLoad(&found.near);
    let triangle = atomicLoad(&found.triangle);
    if triangle != NOTHING {
        let distance = bitcast<f32>(atomicLoad(&found.distance));
        let hit = pick.origin + distance * pick.direction;
        var nearest = 0u;
        for (var k = 1u; k < 3u; k += 1u) {
            if length(corner(triangle, k) - hit) < length(corner(triangle, nearest) - hit) {
                nearest = k;
            }
        }
        found.particle = triangles[3u * triangle + nearest];
        found.particle_distance = bitcast<u32>(distance);
    } else if found.particle != NOTHING {
        let offset = positions[found.particle].xyz - pick.origin;
        found.particle_distance = bitcast<u32>(dot(offset, pick.direction));
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let item = (group.y * groups.x + group.x) * 64u + lane;
    if pick.pass_number == 2u {
        if item == 0u {
            answer();
        }
        return;
    }
    if item < pick.triangle_count {
        let distance = triangle_distance(item);
        if pick.pass_number == 0u {
            atomicMin(&found.distance, distance);
        } else if distance != NOTHING && distance == atomicLoad(&found.distance) {
            atomicMin(&found.triangle, item);
        }
    }
    if item < pick.particle_count {
        let aside = particle_aside(item);
        if pick.pass_number == 0u {
            atomicMin(&found.aside, aside);
        } else if aside != NOTHING && aside == atomicLoad(&found.aside) {
            atomicMin(&found.near, item);
        }
    }
}
